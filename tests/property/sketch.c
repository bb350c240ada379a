/* What draft sketches is as near to the model as is proven: on balls, ellipsoids and planes of any
 * size, from anywhere, under lights of the kinds that are sketched, for any exponent; against an
 * evaluation in longer floats that shares nothing with it. */
#include "shade/sketch.h"
#include "property/sketch_model.h"
#include "sight/bend.h"
#include "sight/item.h"

/* ---- Scenes. ---- */

/* A ball or a plane around the origin, which fills much of 64 x 64 pixels. */
static char *scene(uint64_t seed) {
    uint64_t random = seed * 7919 + 11;
    const bool ball = below(&random, 4), ortho = below(&random, 4) == 0;
    const double size = pow(10, uniform(&random, -3, 3)),
                 far = 1 + pow(10, uniform(&random, -2, below(&random, 4) ? 1 : 4.9)),
                 part = pow(10, uniform(&random, -2, 0.2)), /* of the size that is seen */
        edge = seed % 4 ? 0
               : ortho  ? size
                        : far * size * tan(asin(1 / far)); /* the silhouette */
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 64, \"height\": 64, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"draft\"}, \"camera\": {\"position\": [%.17g, 0, %.17g], \"target\": [%.17g, 0, 0], ",
            ortho ? edge : 0, far * size, edge);
    if (ortho)
        fprintf(w.out, "\"type\": \"orthographic\", \"height\": %.17g}", 2 * part * size);
    else
        fprintf(w.out, "\"fov\": %.17g}", 2 * atan(part / (far - 0.99)) * 180 / SHD_PI);
    fputs(", \"ambient\": 0.1, \"lights\": [", w.out);
    for (int i = 0, count = 1 + below(&random, 4); i < count; i++) {
        fputs(i ? ", " : "", w.out);
        write_light(w.out, &random, ball ? size : 0.1 * size);
    }
    fprintf(w.out, "], \"objects\": [{\"type\": \"%s\", \"transform\": {",
            ball ? "sphere" : "plane");
    if (ball && seed % 2)
        fprintf(w.out, "\"scale\": [%.17g, %.17g, %.17g], \"rotate\": [%.17g, %.17g, 0]}",
                size * uniform(&random, 0.5, 1), size * uniform(&random, 0.5, 1),
                size * uniform(&random, 0.5, 1), uniform(&random, 0, 360),
                uniform(&random, 0, 360));
    else if (ball)
        fprintf(w.out, "\"scale\": %.17g}", size);
    else
        fprintf(w.out, "\"rotate\": [%.17g, %.17g, 0]}", uniform(&random, 5, 90),
                uniform(&random, -40, 40));
    fprintf(w.out,
            ", \"material\": {\"diffuse\": [0.7, 0.4, 0.3], \"specular\": %.17g, \"shininess\": "
            "%.17g, \"lobes\": [{\"specular\": 0.2, \"shininess\": %.17g}]}}]}",
            below(&random, 4) ? 0.5 : 0.0, pow(10, uniform(&random, 0, 5)),
            pow(10, uniform(&random, 0, 5)));
    return finish(&w);
}

/* ---- The model. ---- */

static vec apply(const shd_affine *m, vec v) {
    const double(*a)[3] = m->linear;
    return (vec){a[0][0] * v.x + a[0][1] * v.y + a[0][2] * v.z,
                 a[1][0] * v.x + a[1][1] * v.y + a[1][2] * v.z,
                 a[2][0] * v.x + a[2][1] * v.y + a[2][2] * v.z};
}

static vec apply_transposed(const shd_affine *m, vec v) {
    const double(*a)[3] = m->linear;
    return (vec){a[0][0] * v.x + a[1][0] * v.y + a[2][0] * v.z,
                 a[0][1] * v.x + a[1][1] * v.y + a[2][1] * v.z,
                 a[0][2] * v.x + a[1][2] * v.y + a[2][2] * v.z};
}

/* False: missed, or met from behind. */
static bool meet(const shd_sight *sight, double x, double y, spot *out) {
    const shd_lens *lens = &sight->lens;
    const shd_camera *camera = lens->camera;
    const shd_object *object = sight->plan->scene->objects;
    const real p = (x - lens->middle_x) * (real)lens->step_x,
               q = (lens->middle_y - y) * (real)lens->step_y;
    const vec aside = madd(madd((vec){0, 0, 0}, of(camera->right), p), of(camera->up), q);
    const bool ortho = camera->projection == SHD_ORTHOGRAPHIC;
    const vec eye = ortho ? madd(of(camera->position), aside, 1) : of(camera->position),
              way = unit(madd(ortho ? (vec){0, 0, 0} : aside, of(camera->back), -1));
    out->view = madd((vec){0, 0, 0}, way, -1);
    if (object->shape == SHD_PLANE) {
        const double(*m)[3] = object->transform.linear;
        out->normal = unit((vec){m[0][1], m[1][1], m[2][1]});
        if (dot(out->normal, way) > 0) out->normal = madd((vec){0, 0, 0}, out->normal, -1);
        const real t = -dot(eye, out->normal) / dot(way, out->normal);
        out->point = madd(eye, way, t);
        return t > 0;
    }
    /* In the frame in which it is a ball of radius 1: one in the world only scales. */
    shd_item ball;
    const shd_affine *map = &shd_item_of(sight, 0, &ball)->from_world;
    const vec from = apply(map, eye), toward = apply(map, way);
    const real square = dot(toward, toward), along = dot(from, toward) / square;
    const vec foot = madd(from, toward, -along);
    const real inside = 1 - dot(foot, foot);
    if (!(inside > 0)) return false;
    const real back = sqrtl(inside / square);
    out->point = madd(eye, way, -along - back);
    out->normal = unit(apply_transposed(map, madd(foot, toward, -back)));
    return true;
}

/* ---- Blocks. ---- */

typedef struct tally {
    size_t blocks, sketched, many, missed, rims;
    real worst;
} tally;

/* Checks a pixel that sees the surface `at`. */
static void check_pixel(const shd_sight *sight, const spot *at, float *const rgb[3], size_t i,
                        const char *json, tally *t) {
    const bool ellipsoid = sight->items[0] && sight->items[0]->shape == SHD_SPHERE;
    real wanted[3], room[3];
    shade(sight->plan, ellipsoid, at, wanted, room);
    for (int c = 0; c < 3; c++) {
        const double got = (double)rgb[c][i];
        const real off = fabsl((real)got - wanted[c]);
        if (!(off <= room[c]))
            fail_msg("%zu: %g, not %Lg, is off by %Lg, not %Lg: %s", i, got, wanted[c], off,
                     room[c], json);
        t->worst = fmaxl(t->worst, off / room[c]);
    }
}

/* `rgb`: the block's first pixel, in rows of `stride`. */
static void check_block(const shd_sight *sight, const shd_survey *survey, size_t block,
                        float *const rgb[3], int stride, const char *json, tally *t) {
    for (int i = (int)(t->sketched % 3); i < SHD_SKETCH_PIXELS; i += 3) {
        const double x = survey->rect.x + (double)(block % 4) * 8 + i % 8 + 0.5,
                     y = survey->rect.y + (double)(block / 4) * 8 + i / 8 + 0.5;
        spot at = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
        if (!meet(sight, x, y, &at)) fail_msg("a ray misses: %s", json);
        check_pixel(sight, &at, rgb, (size_t)(i / 8 * stride + i % 8), json, t);
    }
}

static void check_missed(const shd_sight *sight, const shd_survey *survey, size_t block,
                         const char *json, tally *t) {
    for (int i = 0; i < SHD_SKETCH_PIXELS; i++) {
        spot at;
        const double x = survey->rect.x + (double)(block % 4) * 8 + i % 8 + 0.5,
                     y = survey->rect.y + (double)(block / 4) * 8 + i / 8 + 0.5;
        if (meet(sight, x, y, &at)) fail_msg("(%g, %g) is missed: %s", x, y, json);
    }
    t->missed++;
}

/* Sketches a block as one past a rim, and checks all of its pixels. */
static void check_rim(const shd_sight *sight, const shd_lighting *lighting,
                      const shd_survey *survey, size_t block, const char *json, tally *t) {
    static const float beyond[3] = {-1, -2, -3};
    static float rgb[3][SHD_SKETCH_PIXELS];
    float *const rows[3] = {rgb[0], rgb[1], rgb[2]};
    shd_rim rim;
    shd_block_rays rays;
    if (!shd_sight_rim(sight, survey, block, &rim, &rays) ||
        !shd_sketch_rim(lighting, &rim, &rays, beyond, 8, rows))
        return;
    size_t hits = 0;
    for (size_t i = 0; i < SHD_SKETCH_PIXELS; i++) {
        spot at;
        const double x = survey->rect.x + (double)(block % 4) * 8 + (double)(i % 8) + 0.5,
                     y = survey->rect.y + (double)(block / 4) * 8 + (double)(i / 8) + 0.5;
        if (!meet(sight, x, y, &at)) {
            if (rgb[0][i] != -1 || rgb[1][i] != -2 || rgb[2][i] != -3)
                fail_msg("(%g, %g) is missed: %s", x, y, json);
            continue;
        }
        check_pixel(sight, &at, rows, i, json, t);
        hits++;
    }
    t->rims += hits && hits < SHD_SKETCH_PIXELS;
}

/* Sketches blocks, so many each way, and checks each that is drawn. */
static void check_blocks(const shd_sight *sight, const shd_lighting *lighting,
                         const shd_survey *survey, size_t block, int blocks, const char *json,
                         tally *t) {
    static float rgb[3][16 * SHD_SKETCH_PIXELS];
    float *rows[3] = {rgb[0], rgb[1], rgb[2]};
    shd_bend bend;
    shd_block_rays rays;
    bool done[16];
    if (!shd_sight_bend(sight, survey, block, blocks, &bend, &rays) ||
        !shd_sketch_blocks(lighting, &bend, &rays, 32, rows, done))
        return;
    for (int k = 0; k < blocks * blocks; k++) {
        if (!done[k]) continue;
        const int x = k % blocks, y = k / blocks;
        float *at[3];
        for (int c = 0; c < 3; c++) at[c] = rgb[c] + (y * 32 + x) * 8;
        t->sketched += blocks == 1;
        t->many += blocks > 1;
        check_block(sight, survey, block + (size_t)(4 * y + x), at, 32, json, t);
    }
}

/* Sketches all blocks of a scene. */
static void check_scene(void *state, const char *json, shd_isa isa, tally *t) {
    shd_request *request = read_scene(state, json);
    shd_arena *arena = request->rendering.arena;
    const shd_plan *plan;
    shd_sight *sight;
    shd_error error;
    assert_int_equal(shd_plan_make(request->scene, isa, NULL, NULL, arena, &plan, &error), SHD_OK);
    assert_int_equal(shd_sight_new(plan, NULL, arena, &sight, &error), SHD_OK);
    const shd_lighting *lighting = shd_lighting_new(plan, NULL, arena);
    shd_survey survey;
    shd_scratch memory = {.arena = arena};
    shd_survey_lay_out(1, 32, 32, &memory, &survey);
    for (int tile = 0; plan->sketched && tile < 4; tile++) {
        shd_sight_survey(sight, (shd_tile){tile % 2 * 32, tile / 2 * 32, 32, 32}, &survey);
        for (size_t block = 0; survey.candidate_count && block < 16; block++) {
            t->blocks++;
            if (shd_sight_misses(sight, &survey, block))
                check_missed(sight, &survey, block, json, t);
            check_rim(sight, lighting, &survey, block, json, t);
            for (int blocks = 1; blocks <= 4; blocks++)
                if (block % 4 + (size_t)blocks <= 4 && block / 4 + (size_t)blocks <= 4)
                    check_blocks(sight, lighting, &survey, block, blocks, json, t);
        }
    }
    shd_request_drop(request);
}

static void sketches_are_as_near_as_proven(void **state) {
    tally t = {0};
    for (uint64_t seed = 1; seed <= 80; seed++) {
        char *json = scene(seed);
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++)
            if (shd_cpu_has(isa)) check_scene(*state, json, isa, &t);
        free(json);
    }
    print_message("%zu of %zu blocks are sketched, %zu beside others, %zu missed, %zu past rims; "
                  "at most %.2Lf of what is proven\n",
                  t.sketched, t.blocks, t.many, t.missed, t.rims, t.worst);
    assert_true(t.sketched > t.blocks / 4 && t.many > t.sketched / 2 && t.missed > 0 && t.rims > 0);
}

/* Where the rounding of rays is not small beside a pixel. */
static void rims_under_a_lens_from_afar_are_as_near_as_proven(void **state) {
    tally t = {0};
    for (int k = 0; k < 60; k++) {
        const double far = 1000 * pow(1.08, k), turn = k, side[2] = {cos(turn), sin(turn)},
                     high = pow(10, -5 - k % 6);
        char json[1000];
        /* At right angles to each other and to the way of the eye. */
        double edge[3];
        for (int c = 0; c < 3; c++)
            edge[c] = side[0] * (const double[]){3, -2, 0}[c] / sqrt(13) +
                      side[1] * (const double[]){12, 18, -13}[c] / sqrt(637);
        snprintf(
            json, sizeof json,
            "{\"image\": {\"width\": 64, \"height\": 64, \"samples\": 1}, \"accuracy\": "
            "{\"tier\": \"draft\"}, \"camera\": {\"type\": \"orthographic\", \"height\": %.17g, "
            "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g]}, "
            "\"lights\": [{\"type\": \"directional\", \"direction\": [1, 2, -2]}], "
            "\"objects\": [{\"type\": \"sphere\", \"material\": {\"diffuse\": 0.7}}]}",
            high, edge[0] + far * 2 / 7, edge[1] + far * 3 / 7, edge[2] + far * 6 / 7, edge[0],
            edge[1], edge[2]);
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++)
            if (shd_cpu_has(isa)) check_scene(*state, json, isa, &t);
    }
    print_message("%zu past rims; at most %.2Lf of what is proven\n", t.rims, t.worst);
    assert_true(t.rims > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sketches_are_as_near_as_proven),
        cmocka_unit_test(rims_under_a_lens_from_afar_are_as_near_as_proven),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
