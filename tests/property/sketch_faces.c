/* What draft sketches of meshes is as near to the model as is proven of balls: on meshes of any
 * size, with smooth normals and without, from anywhere; and it is of those triangles that shots
 * meet. */
#include "plan/faces.h"
#include "property/sketch_model.h"
#include "shade/sketch.h"
#include "sight/faces.h"
#include "unit/see.h"

/* A ball of triangles around the origin, turned and stretched, that fills much of the picture; or
 * the eye is in it. */
static char *scene(uint64_t seed, const char *tier) {
    uint64_t random = seed * 104729 + 5;
    const bool inside = seed % 5 == 0, ortho = below(&random, 3) == 0 && !inside;
    const double size = pow(10, uniform(&random, -3, 3)),
                 far = inside ? 0.1 : 1.5 + pow(10, uniform(&random, -1, 3)),
                 part = pow(10, uniform(&random, -1.5, 0.1)); /* of the size that is seen */
    const shd_affine turn = random_rotation(&random),
                     stretch = scaling(size, size * uniform(&random, 0.3, 1),
                                       -size * uniform(&random, 0.3, 1)),
                     map = shd_compose(&turn, &stretch);
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 64, \"height\": 64, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"%s\"}, \"camera\": {\"position\": [0, 0, %.17g], \"target\": [%.17g, 0, 0], ",
            tier, far * size, seed % 2 ? size : 0);
    if (ortho)
        fprintf(w.out, "\"type\": \"orthographic\", \"height\": %.17g}", 2 * part * size);
    else
        fprintf(w.out, "\"fov\": %.17g}",
                inside ? 50 : 2 * atan(part / (far - 0.99)) * 180 / SHD_PI);
    fputs(", \"ambient\": 0.1, \"lights\": [", w.out);
    for (int i = 0, count = 1 + below(&random, 4); i < count; i++) {
        fputs(i ? ", " : "", w.out);
        write_light(w.out, &random, size);
    }
    fputs("], \"objects\": [{\"type\": \"mesh\", ", w.out);
    write_ball(w.out, 4 + below(&random, 6), 3 + below(&random, 4), seed % 3);
    fputs(", ", w.out);
    write_transform(w.out, &map);
    fprintf(w.out,
            ", \"material\": {\"diffuse\": [0.7, 0.4, 0.3], \"specular\": %.17g, \"shininess\": "
            "%.17g, \"side\": \"%s\", \"lobes\": [{\"specular\": 0.2, \"shininess\": %.17g}]}}]}",
            below(&random, 4) ? 0.5 : 0.0, pow(10, uniform(&random, 0, 5)),
            below(&random, 3) ? "both" : "front", pow(10, uniform(&random, 0, 5)));
    return finish(&w);
}

typedef struct tally {
    size_t blocks, drawn, part;
    real worst;
} tally;

/* Holds a block against what shots hit, by pixel: an index of hits, or -1. */
static void check_block(const shd_plan *plan, const shd_block_faces *faces, float *const rgb[3],
                        const shd_hits *hits, const int *hit_of, int left, int top,
                        const char *json, tally *t) {
    for (int i = 0; i < SHD_BLOCK_RAYS; i++) {
        const int hit = hit_of[(top + i / 8) * SIDE + left + i % 8];
        real wanted[3], room[3];
        if ((hit >= 0) != (faces->hit >> i & 1)) fail_msg("ray %d of a block: %s", i, json);
        if (hit < 0) continue;
        spot at;
        for (int c = 0; c < 3; c++) {
            (&at.point.x)[c] = hits->position[c][hit];
            (&at.normal.x)[c] = hits->normal[c][hit];
            (&at.view.x)[c] = hits->view[c][hit];
        }
        shade(plan, false, &at, wanted, room);
        for (int c = 0; c < 3; c++) {
            const double got = (double)rgb[c][i];
            const real off = fabsl((real)got - wanted[c]);
            if (!(off <= room[c]))
                fail_msg("(%d, %d): %g, not %Lg, is off by %Lg, not %Lg: %s", left + i % 8,
                         top + i / 8, got, wanted[c], off, room[c], json);
            t->worst = fmaxl(t->worst, off / room[c]);
        }
    }
}

static void check_blocks(const shd_plan *plan, const shd_sight *sight, shd_arena *arena,
                         const shd_hits *hits, const int *hit_of, const char *json, tally *t) {
    const shd_lighting *lighting = shd_lighting_new(plan, NULL, arena);
    static float rows[3][SHD_BLOCK_RAYS];
    float *const rgb[3] = {rows[0], rows[1], rows[2]};
    shd_survey survey;
    shd_scratch memory = {.arena = arena};
    shd_survey_lay_out(1, 32, 32, &memory, &survey);
    for (int tile = 0; tile < 4; tile++) {
        const int x = tile % 2 * 32, y = tile / 2 * 32;
        shd_sight_survey(sight, (shd_tile){x, y, 32, 32}, &survey);
        for (size_t block = 0; survey.candidate_count && block < 16; block++) {
            shd_block_faces faces;
            t->blocks++;
            if (!shd_sight_faces(sight, &survey, block, 0, &faces) || !faces.count ||
                !shd_sketch_faces(lighting, &faces, 8, rgb))
                continue;
            t->drawn++;
            t->part += faces.hit != ~(uint64_t)0;
            check_block(plan, &faces, rgb, hits, hit_of, x + (int)(block % 4) * 8,
                        y + (int)(block / 4) * 8, json, t);
        }
    }
}

static void sketches_of_meshes_are_as_near_as_proven(void **state) {
    tally t = {0};
    for (uint64_t seed = 1; seed <= 60; seed++) {
        char *json = scene(seed, "draft"), *exactly = scene(seed, "exact");
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
            static int hit_of[ALL];
            if (!shd_cpu_has(isa)) continue;
            seen exact = see(*state, exactly, isa);
            shd_request *request = read_scene(*state, json);
            shd_arena *arena = request->rendering.arena;
            const shd_plan *plan;
            shd_sight *sight;
            shd_error error;
            for (int i = 0; i < ALL; i++) hit_of[i] = -1;
            for (size_t i = 0; i < exact.hits.count; i++) hit_of[exact.hits.shot[i]] = (int)i;
            assert_int_equal(shd_plan_make(request->scene, isa, NULL, NULL, arena, &plan, &error),
                             SHD_OK);
            assert_int_equal(shd_sight_new(plan, NULL, arena, &sight, &error), SHD_OK);
            if (plan->sketched) check_blocks(plan, sight, arena, &exact.hits, hit_of, json, &t);
            shd_request_drop(request);
            shd_request_drop(exact.request);
        }
        free(json);
        free(exactly);
    }
    print_message("%zu of %zu blocks are sketched, %zu beside a silhouette; at most %.2Lf of what "
                  "is proven\n",
                  t.drawn, t.blocks, t.part, t.worst);
    assert_true(t.drawn > t.blocks / 4 && t.part > 0);
}

static char *picture(const char *tier, int samples, bool smooth) {
    writing w;
    start(&w);
    fprintf(
        w.out,
        "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": %d}, \"accuracy\": {\"tier\": "
        "\"%s\"}, \"background\": [0.1, 0.3, 0.2], \"lights\": [{\"type\": \"point\", "
        "\"position\": "
        "[3, 4, 5], \"attenuation\": [0.5, 0.1, 0]}], \"objects\": [{\"type\": \"mesh\", ",
        samples, tier);
    write_ball(w.out, 8, 5, smooth);
    fputs(", \"material\": {\"diffuse\": [0.7, 0.4, 0.3], \"specular\": 0.4, \"shininess\": 20}}]}",
          w.out);
    return finish(&w);
}

/* Whatever the number of samples, silhouettes and background, too; and parts of a picture are what
 * they are of the whole. */
static void drafts_of_meshes_are_within_their_bounds(void **state) {
    shd_engine *other = new_engine_of(3, "portable");
    for (int k = 0; k < 6; k++) {
        const int samples = (int[]){1, 4, 5}[k / 2];
        char *draft = picture("draft", samples, k % 2), *exact = picture("exact", samples, k % 2);
        drawn a = film_of(*state, draft), b = film_of(*state, exact);
        assert_true(a.request->rendering.plan->sketched);
        check_bound(&a, &b, 1e-4);
        check_region(other, other, draft);
        drop_drawn(&a);
        drop_drawn(&b);
        free(draft);
        free(exact);
    }
    shd_engine_drop(other);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sketches_of_meshes_are_as_near_as_proven),
        cmocka_unit_test(drafts_of_meshes_are_within_their_bounds),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
