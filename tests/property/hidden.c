/* What is told of a block's part holds for each of its rays: one object is hit before all others,
 * or nothing is. Of scenes of spheres and planes that touch, cut and hide each other, and a box and
 * a torus among them. */
#include "property/pieces.h"
#include "sight/bend.h"
#include "sight/item.h"

enum { SIDE = 64, SAMPLES = 16, MOST_OBJECTS = 6 };

/* A sphere, or one that touches the one before, from outside or inside; or what cuts them all. */
static void write_body(FILE *out, uint64_t *random, shd_vec3 *center, double *radius) {
    static const char *const others[] = {"plane", "plane", "box", "torus"};
    const int kind = below(random, 8);
    const shd_vec3 way = random_direction(random);
    if (kind < 4) {
        shd_affine turn = random_rotation(random);
        turn.origin = shd_madd(*center, way, below(random, 2) ? *radius : uniform(random, 0, 2));
        fprintf(out, "{\"type\": \"%s\", ", others[kind]);
        write_transform(out, &turn);
    } else {
        const double more = uniform(random, 0.05, 0.8), apart = kind == 4   ? *radius + more
                                                                : kind == 5 ? fabs(*radius - more)
                                                                            : uniform(random, 0, 2);
        *center = shd_madd(*center, way, apart);
        *radius = more;
        shd_affine map = scaling(more, more, more);
        map.origin = *center;
        fputs("{\"type\": \"sphere\", ", out);
        write_transform(out, &map);
    }
    fprintf(out, "%s}", below(random, 6) ? "" : ", \"material\": {\"side\": \"front\"}");
}

static char *scene(uint64_t seed) {
    uint64_t random = seed * 7919 + 29;
    shd_vec3 center = {0, 0, 0};
    double radius = 0.5;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"lights\": [], "
            "\"camera\": {%s, ",
            SIDE, SIDE, SAMPLES,
            below(&random, 3) ? "\"fov\": 40" : "\"type\": \"orthographic\", \"height\": 3");
    write_vector(w.out, "position", shd_scale(random_direction(&random), uniform(&random, 1, 5)));
    fputs("}, \"objects\": [", w.out);
    for (int i = 0, count = 2 + below(&random, MOST_OBJECTS - 1); i < count; i++) {
        if (i) fputs(", ", w.out);
        write_body(w.out, &random, &center, &radius);
    }
    fputs("]}", w.out);
    return finish(&w);
}

/* All rays through a part of a block, at all objects. */
static void shoot_part(const shd_sight *sight, const shd_survey *survey, size_t block, int part,
                       shd_hits *hits) {
    enum { MOST = SHD_BLOCK_SIDE * SHD_BLOCK_SIDE * SAMPLES };
    static const uint32_t all[MOST_OBJECTS] = {0, 1, 2, 3, 4, 5};
    const int side = part == SHD_WHOLE ? SHD_BLOCK_SIDE : SHD_BLOCK_SIDE / 2,
              left =
                  survey->rect.x + (int)block % survey->across * SHD_BLOCK_SIDE + (part & 1) * side,
              top = survey->rect.y + (int)block / survey->across * SHD_BLOCK_SIDE +
                    (part >> 1 & 1) * side;
    int32_t x[MOST], y[MOST];
    uint8_t sample[MOST];
    size_t count = 0;
    for (int i = 0; i < side * side * SAMPLES; i++, count++) {
        x[count] = left + i / SAMPLES % side;
        y[count] = top + i / SAMPLES / side;
        sample[count] = (uint8_t)(i % SAMPLES);
    }
    const shd_shots shots = {count, x, y, sample};
    hits->count = 0;
    shd_sight_shoot(sight, all, sight->count, &shots, hits);
}

typedef struct tally {
    size_t parts, before_others, empty,
        beside; /* `beside`: pixels, of blocks that show something */
} tally;

static void check_part(const shd_sight *sight, const shd_survey *survey, size_t block, int part,
                       shd_hits *hits, const char *json, tally *t) {
    const int side = part == SHD_WHOLE ? SHD_BLOCK_SIDE : SHD_BLOCK_SIDE / 2;
    const size_t rays = (size_t)(side * side * SAMPLES);
    shd_seen seen[SHD_SEEN_MOST];
    shd_analytic a;
    const size_t count = shd_sight_seen(sight, survey, block, part, seen);
    const bool one = shd_sight_expand(sight, survey, block, part, &a);
    t->parts++;
    if (count && !one) return;
    shoot_part(sight, survey, block, part, hits);
    t->empty += !count;
    t->before_others += one && count > 1;
    if (hits->count != (count ? rays : 0))
        fail_msg("%zu of %zu rays hit: %s", hits->count, rays, json);
    for (size_t i = 0; i < hits->count; i++)
        if ((size_t)hits->object[i] != a.object)
            fail_msg("object %d is before %zu: %s", hits->object[i], a.object, json);
}

/* Pixels through which nothing may be seen show nothing. */
static void check_pixels(const shd_sight *sight, const shd_survey *survey, size_t block,
                         shd_hits *hits, const char *json, tally *t) {
    const uint64_t pixels = shd_sight_pixels(sight, survey, block);
    shoot_part(sight, survey, block, SHD_WHOLE, hits);
    for (size_t i = 0; i < hits->count; i++)
        if (!(pixels >> hits->shot[i] / SAMPLES & 1))
            fail_msg("pixel %u of block %zu shows something: %s", hits->shot[i] / SAMPLES, block,
                     json);
    if (pixels) t->beside += (size_t)__builtin_popcountll(~pixels);
}

static void one_object_is_before_all_others(void **state) {
    tally t = {0};
    for (uint64_t seed = 1; seed <= 150; seed++) {
        char *json = scene(seed);
        shd_request *request = read_scene(*state, json);
        shd_arena *arena = request->rendering.arena;
        const shd_plan *plan;
        shd_sight *sight;
        shd_error error;
        assert_int_equal(
            shd_plan_make(request->scene, SHD_PORTABLE, NULL, NULL, arena, &plan, &error), SHD_OK);
        assert_int_equal(shd_sight_new(plan, NULL, arena, &sight, &error), SHD_OK);
        shd_survey survey;
        shd_hits hits;
        shd_scratch memory = {.arena = arena};
        shd_survey_lay_out(sight->count, 32, 32, &memory, &survey);
        shd_hits_lay_out(plan, SHD_BLOCK_SIDE * SHD_BLOCK_SIDE * SAMPLES + SHD_LANES, &memory,
                         &hits);
        for (int tile = 0; tile < 4; tile++) {
            shd_sight_survey(sight, (shd_tile){tile % 2 * 32, tile / 2 * 32, 32, 32}, &survey);
            for (size_t block = 0; survey.candidate_count && block < 16; block++) {
                for (int part = 0; part <= SHD_WHOLE; part++)
                    check_part(sight, &survey, block, part, &hits, json, &t);
                check_pixels(sight, &survey, block, &hits, json, &t);
            }
        }
        shd_request_drop(request);
        free(json);
    }
    print_message("of %zu parts, %zu show one object before others, and %zu nothing\n", t.parts,
                  t.before_others, t.empty);
    assert_true(t.before_others > t.parts / 50 && t.empty > t.parts / 100);
    print_message("%zu pixels are beside what is seen\n", t.beside);
    assert_true(t.beside > t.parts / 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_object_is_before_all_others),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
