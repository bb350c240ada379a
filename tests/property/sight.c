/* Hits depend on their shots alone; surveys leave out nothing that is seen. Random scenes of all
 * shapes, both cameras, by brute force. */
#include "property/pieces.h"

static const char *const shapes[] = {"sphere", "box",   "cylinder", "cone", "torus",
                                     "disc",   "plane", "mesh",     "flat"};
enum { SHAPES = sizeof shapes / sizeof shapes[0], OUTSIDE = 3 };

typedef struct setting {
    uint64_t seed;
    const char *tier;
    bool layers;
    int objects; /* 0: some */
    bool balls;  /* spheres alone, which tiers in f32 show without a stage of all lanes */
} setting;

/* Shapes of any kind, many of them cut by others, seen from near, far or inside. */
static char *scene(const setting *s) {
    uint64_t random = s->seed * 77 + 5;
    bool ortho = below(&random, 3) == 0;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"accuracy\": "
            "{\"tier\": \"%s\"}, \"camera\": {\"type\": \"%s\", \"%s\": %.17g, ",
            40 + below(&random, 40), 30 + below(&random, 40), 1 + below(&random, 8), s->tier,
            ortho ? "orthographic" : "perspective", ortho ? "height" : "fov",
            ortho ? uniform(&random, 0.5, 6) : uniform(&random, 5, 150));
    double far = below(&random, 3) ? 4 : 40;
    write_vector(w.out, "position",
                 shd_scale(random_direction(&random), uniform(&random, 0.1, far)));
    fputs("}, \"objects\": [", w.out);
    int count = s->objects ? s->objects : 1 + below(&random, 6);
    for (int i = 0; i < count; i++) {
        const char *shape = shapes[s->balls ? 0 : below(&random, SHAPES)];
        bool alike = s->balls || below(&random, 2);
        double size = uniform(&random, 0.05, 1.2) * (count > 9 ? 0.3 : 1);
        shd_affine turn = random_rotation(&random);
        shd_affine scale = scaling(size, size * (alike ? 1 : uniform(&random, 0.1, 1)),
                                   size * (alike ? 1 : uniform(&random, 0.1, 1)));
        shd_affine map = shd_compose(&turn, &scale);
        map.origin = shd_scale(random_direction(&random), uniform(&random, 0, 1.5));
        fprintf(w.out, "%s{\"type\": \"%s\", ", i ? ", " : "",
                strcmp(shape, "flat") ? shape : "cone");
        if (!strcmp(shape, "mesh")) write_ball(w.out, 12, 6, i % 2), fputs(", ", w.out);
        if (!strcmp(shape, "flat")) fputs("\"interpolation\": \"flat\", ", w.out);
        write_transform(w.out, &map);
        fprintf(w.out, ", \"material\": {\"side\": \"%s\"}}", below(&random, 4) ? "both" : "front");
    }
    /* A light on a surface makes positions split. */
    fprintf(w.out, "], \"lights\": [{\"type\": \"point\", \"position\": [0, %d, 0]}]",
            !s->balls && below(&random, 2) ? 0 : 50);
    if (s->layers)
        fputs(", \"output\": {\"format\": \"exr\", \"layers\": [\"position\", \"depth\"]}", w.out);
    fputs("}", w.out);
    return finish(&w);
}

/* A request with its plan for an instruction set, and its sight. */
typedef struct looked {
    shd_request *request;
    shd_sight *sight;
    const shd_raster *raster;
} looked;

static looked look(shd_engine *engine, const setting *s, shd_isa isa) {
    char *json = scene(s);
    looked l = {.request = read_scene(engine, json)};
    shd_error error = {.status = SHD_OK};
    shd_arena *arena = l.request->rendering.arena;
    if (shd_plan_make(l.request->scene, isa, NULL, NULL, arena, &l.request->rendering.plan,
                      &error) ||
        shd_sight_new(l.request->rendering.plan, NULL, arena, &l.sight, &error))
        fail_msg("%s: %s", error.path, error.text);
    l.raster = &l.request->scene->raster;
    free(json);
    return l;
}

static void drop_looked(looked *l) {
    shd_request_drop(l->request);
}

/* ---- Shots and hits. ---- */

enum { MOST_SHOTS = 4096 };

typedef struct list {
    int32_t x[MOST_SHOTS], y[MOST_SHOTS];
    uint8_t sample[MOST_SHOTS];
    size_t count;
} list;

/* Runs along rows, runs of a pixel's samples, and scattered ones, some outside of the picture. */
static void make_shots(const shd_raster *raster, uint64_t *random, list *out) {
    out->count = 0;
    while (out->count < 1000) {
        int kind = below(random, 4), length = 1 + below(random, kind < 3 ? 100 : 3);
        int x = below(random, raster->width + 2 * OUTSIDE) - OUTSIDE,
            y = below(random, raster->height + 2 * OUTSIDE) - OUTSIDE;
        for (int i = 0; i < length; i++) {
            size_t k = out->count++;
            int sample = below(random, 2) ? i % raster->samples : below(random, raster->samples);
            out->x[k] = kind == 0 ? x + i / raster->samples : x + i % 8;
            out->y[k] = kind == 0 ? y : y + i / 8;
            out->sample[k] = (uint8_t)(kind == 1 ? 0 : kind == 0 ? i % raster->samples : sample);
        }
    }
}

static shd_hits hits_of(const looked *l, size_t capacity) {
    return new_hits(l->request->rendering.plan, capacity, l->request->rendering.arena);
}

static shd_survey new_survey(const looked *l, int side) {
    shd_scratch memory = {.arena = l->request->rendering.arena};
    shd_survey survey;
    shd_survey_lay_out(l->request->scene->object_count, side, side, &memory, &survey);
    assert_false(memory.full);
    return survey;
}

static uint32_t *all_objects(const looked *l, size_t *count) {
    *count = l->request->scene->object_count;
    uint32_t *all = shd_arena_alloc(l->request->rendering.arena, *count, sizeof *all);
    assert_non_null(all);
    for (size_t i = 0; i < *count; i++) all[i] = (uint32_t)i;
    return all;
}

#define SAME(array)                                                                                \
    (!a->array == !b->array && (!a->array || !memcmp(&a->array[i], &b->array[k], sizeof *a->array)))

/* Hit i of one list and hit k of another, every bit but the shot's index. */
static bool same_hit(const shd_hits *a, size_t i, const shd_hits *b, size_t k, bool faceted) {
    bool same = SAME(object) && SAME(depth);
    for (int c = 0; c < 3; c++)
        same = same && SAME(position32[c]) && SAME(normal32[c]) && SAME(mirror32[c]) &&
               SAME(low32[c]) && SAME(world32[c]) && SAME(position[c]) && SAME(normal[c]) &&
               SAME(view[c]);
    if (faceted && a->triangle) same = same && SAME(triangle) && SAME(u) && SAME(v);
    return same;
}

static bool is_mesh(const looked *l, int32_t object) {
    const shd_object *o = &l->request->scene->objects[object];
    return o->shape == SHD_MESH || o->interpolation != SHD_PHONG;
}

static const setting settings[] = {{0, "standard", false, 0, false},
                                   {0, "standard", true, 0, false},
                                   {0, "exact", false, 0, false},
                                   {0, "exact", true, 0, false},
                                   {0, "standard", false, 40, false}};

/* In every variant: the whole list at once, against each shot alone, with the candidates in the
 * other order, and against the portable variant. */
static void a_hit_depends_on_its_shot_alone(void **state) {
    static list shots;
    for (uint64_t seed = 1; seed <= 50; seed++) {
        setting s = settings[seed % 5];
        s.seed = seed;
        uint64_t random = seed;
        looked first = look(*state, &s, SHD_PORTABLE);
        make_shots(first.raster, &random, &shots);
        const shd_shots whole = {shots.count, shots.x, shots.y, shots.sample};
        size_t objects;
        uint32_t *all = all_objects(&first, &objects);
        shd_hits wanted = hits_of(&first, whole.count), alone = hits_of(&first, whole.count);
        shd_sight_shoot(first.sight, all, objects, &whole, &wanted);
        for (size_t i = 0; i < objects / 2; i++) {
            uint32_t object = all[i];
            all[i] = all[objects - 1 - i];
            all[objects - 1 - i] = object;
        }
        for (size_t i = 0; i < whole.count; i++) {
            const shd_shots one = {1, shots.x + i, shots.y + i, shots.sample + i};
            size_t hits = shd_sight_shoot(first.sight, all, objects, &one, &alone);
            for (size_t k = alone.count - hits; k < alone.count; k++) {
                assert_int_equal(alone.shot[k], 0);
                assert_int_equal(wanted.shot[k], i);
                assert_true(same_hit(&wanted, k, &alone, k, is_mesh(&first, wanted.object[k])));
            }
        }
        assert_int_equal(wanted.count, alone.count);
        for (shd_isa isa = SHD_PORTABLE + 1; isa < SHD_ISA_COUNT; isa++) {
            if (!shd_cpu_has(isa)) continue;
            looked other = look(*state, &s, isa);
            shd_hits hits = hits_of(&other, whole.count);
            shd_sight_shoot(other.sight, all, objects, &whole, &hits);
            assert_int_equal(wanted.count, hits.count);
            for (size_t k = 0; k < hits.count; k++) {
                assert_int_equal(wanted.shot[k], hits.shot[k]);
                assert_true(same_hit(&wanted, k, &hits, k, is_mesh(&first, wanted.object[k])));
            }
            drop_looked(&other);
        }
        drop_looked(&first);
    }
}

/* f32 hits against those of the exact tier. */
static void hits_in_f32_are_the_exact_ones_rounded(void **state) {
    static list shots;
    for (uint64_t seed = 1; seed <= 30; seed++) {
        setting s = settings[seed % 2];
        s.seed = seed;
        uint64_t random = seed;
        looked fast = look(*state, &s, shd_cpu_best());
        s.tier = "exact";
        looked exact = look(*state, &s, shd_cpu_best());
        make_shots(fast.raster, &random, &shots);
        const shd_shots whole = {shots.count, shots.x, shots.y, shots.sample};
        size_t objects;
        uint32_t *all = all_objects(&fast, &objects);
        shd_hits a = hits_of(&fast, whole.count), b = hits_of(&exact, whole.count);
        shd_sight_shoot(fast.sight, all, objects, &whole, &a);
        shd_sight_shoot(exact.sight, all, objects, &whole, &b);
        assert_int_equal(a.count, b.count);
        const shd_plan *plan = fast.request->rendering.plan;
        const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
        for (size_t i = 0; i < a.count; i++) {
            assert_int_equal(a.object[i], b.object[i]);
            double facing = 0, size = 1;
            for (int c = 0; c < 3; c++) {
                facing += b.normal[c][i] * b.view[c][i];
                size = fmax(size, fabs((b.position[c][i] - origin[c]) * plan->scale));
            }
            for (int c = 0; c < 3; c++) {
                double p = (b.position[c][i] - origin[c]) * plan->scale;
                double mirror = 2 * facing * b.normal[c][i] - b.view[c][i];
                assert_true(fabs((double)a.position32[c][i] - p) <= 0x1p-24 * size * 1.0001);
                assert_true(fabs((double)a.normal32[c][i] - b.normal[c][i]) <= 0x1p-25 * 1.0001);
                assert_true(fabs((double)a.mirror32[c][i] - mirror) <= 0x1p-24 * 1.0001);
                if (!a.low32[c]) continue;
                double sum = (double)a.position32[c][i] + (double)a.low32[c][i];
                assert_true(fabs(sum - p) <= 1e-13 * size);
            }
            if (a.depth) assert_true(a.depth[i] == b.depth[i]);
            if (!a.world32[0]) continue;
            for (int c = 0; c < 3; c++) assert_true(a.world32[c][i] == (float)b.position[c][i]);
        }
        drop_looked(&fast);
        drop_looked(&exact);
    }
}

/* Of many balls at once, in a list that has no room beyond its hits: every hit against the same
 * shot at its ball alone, which is shown in another way. */
static void balls_of_a_crowd_are_seen_as_each_alone(void **state) {
    static list shots;
    size_t balls = 0, full = 0;
    for (uint64_t seed = 1; seed <= 24; seed++)
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
            if (!shd_cpu_has(isa)) continue;
            const setting s = {seed, "standard", false, seed % 3 ? 20 : 300, true};
            uint64_t random = seed;
            looked l = look(*state, &s, isa);
            make_shots(l.raster, &random, &shots);
            /* An odd number, so that vectors do not end where the list does. */
            const shd_shots whole = {(shots.count - 1) | 1, shots.x, shots.y, shots.sample};
            size_t objects;
            const uint32_t *all = all_objects(&l, &objects);
            shd_hits hits = hits_of(&l, whole.count), alone = hits_of(&l, 1);
            const size_t before = hits.count = hits.capacity - whole.count;
            for (size_t k = 0; k < before; k++) hits.object[k] = SHD_NOTHING;
            shd_sight_shoot(l.sight, all, objects, &whole, &hits);
            for (size_t k = 0; k < before; k++) assert_int_equal(hits.object[k], SHD_NOTHING);
            for (size_t k = before; k < hits.count; k++) {
                const size_t i = hits.shot[k];
                const uint32_t object = (uint32_t)hits.object[k];
                const shd_shots one = {1, shots.x + i, shots.y + i, shots.sample + i};
                alone.count = 0;
                assert_int_equal(shd_sight_shoot(l.sight, &object, 1, &one, &alone), 1);
                assert_true(same_hit(&hits, k, &alone, 0, false));
                balls += k > before && hits.object[k] != hits.object[k - 1];
            }
            full += hits.count == hits.capacity;
            drop_looked(&l);
        }
    assert_true(balls > 1000);
    assert_true(full > 0);
}

static void padding_repeats_the_last_hit(void **state) {
    setting s = {3, "standard", true, 0, false};
    looked l = look(*state, &s, shd_cpu_best());
    shd_hits hits = hits_of(&l, 1000);
    assert_int_equal(hits.capacity, 1008);
    shd_hits_pad(&hits);
    for (size_t i = 0; i < 1000; i++) hits.object[i] = (int32_t)i, hits.normal32[2][i] = (float)i;
    hits.count = 983;
    shd_hits_pad(&hits);
    assert_int_equal(hits.count, 983);
    for (size_t i = 983; i < 998; i++) {
        assert_int_equal(hits.object[i], 982);
        assert_true(hits.normal32[2][i] == 982);
    }
    assert_int_equal(hits.object[998], 998);
    drop_looked(&l);
}

/* ---- Surveys. ---- */

static bool names(const shd_survey *survey, const shd_block *block, int32_t object) {
    for (uint32_t k = 0; k < block->count; k++)
        if (survey->candidates[block->first + k] == (uint32_t)object) return true;
    return false;
}

/* Rows of shots are cast block by block, at the candidates that are listed for these. */
static void check_blocks(const looked *l, shd_survey *survey, size_t block, const shd_shots *row,
                         const shd_hits *wanted, shd_hits *hits) {
    const size_t step = 8 * (size_t)l->raster->samples;
    size_t seen = 0;
    for (size_t first = 0; first < row->count; first += step, block++) {
        const size_t left = row->count - first;
        const shd_shots part = {left < step ? left : step, row->x + first, row->y + first,
                                row->sample + first};
        hits->count = 0;
        shd_sight_shoot_block(l->sight, survey, block, &part, hits);
        for (size_t k = 0; k < hits->count; k++, seen++) {
            assert_true(seen < wanted->count);
            assert_int_equal(hits->shot[k] + first, wanted->shot[seen]);
            assert_int_equal(hits->object[k], wanted->object[seen]);
            for (int c = 0; c < 3; c++)
                assert_true(hits->position32[c][k] == wanted->position32[c][seen]);
        }
    }
    assert_int_equal(seen, wanted->count);
}

/* What all of the samples see in a rectangle, by brute force, against its survey. */
static void check_survey(const looked *l, shd_tile rect, shd_survey *survey, list *shots) {
    const int n = l->raster->samples;
    size_t objects;
    uint32_t *all = all_objects(l, &objects);
    shd_hits hits = hits_of(l, MOST_SHOTS), again = hits_of(l, MOST_SHOTS);
    shd_sight_survey(l->sight, rect, survey);
    assert_int_equal(survey->across, (rect.w + 7) / 8);
    assert_int_equal(survey->down, (rect.h + 7) / 8);
    for (int y = 0; y < rect.h; y++) {
        shots->count = 0;
        for (int x = 0; x < rect.w; x++)
            for (int i = 0; i < n; i++) {
                shots->x[shots->count] = rect.x + x;
                shots->y[shots->count] = rect.y + y;
                shots->sample[shots->count++] = (uint8_t)i;
            }
        const shd_shots row = {shots->count, shots->x, shots->y, shots->sample};
        hits.count = 0;
        shd_sight_shoot(l->sight, all, objects, &row, &hits);
        check_blocks(l, survey, (size_t)(y / 8 * survey->across), &row, &hits, &again);
        for (size_t k = 0; k < hits.count; k++) {
            const size_t x = hits.shot[k] / (size_t)n;
            const shd_block *block = &survey->blocks[(size_t)(y / 8 * survey->across) + x / 8];
            assert_true(names(survey, block, hits.object[k]));
        }
    }
}

static void surveys_name_all_that_is_seen(void **state) {
    static list shots;
    size_t empty = 0, blocks = 0;
    for (uint64_t seed = 100; seed < 300; seed++) {
        setting s = {seed, "standard", false, seed % 10 ? 0 : 40, false};
        if (seed % 40 == 0) s.objects = 300, s.balls = true; /* enough for cells */
        looked l = look(*state, &s, shd_cpu_best());
        const shd_raster *raster = l.raster;
        uint64_t random = seed;
        shd_survey survey = new_survey(&l, 40);
        for (int k = 0; k < 12; k++) {
            shd_tile rect = {below(&random, raster->width) - 8, below(&random, raster->height) - 8,
                             1 + below(&random, 40), 1 + below(&random, 40)};
            check_survey(&l, rect, &survey, &shots);
            blocks += (size_t)survey.across * (size_t)survey.down;
            for (int i = 0; i < survey.across * survey.down; i++)
                empty += survey.blocks[i].count == 0;
        }
        drop_looked(&l);
    }
    assert_true(empty > blocks / 20);
}

/* A survey that names everything is right as well, but of no use. */
static void surveys_of_a_sphere_follow_its_outline(void **state) {
    shd_request *request = read_scene(*state, "{\"objects\": [{\"type\": \"sphere\"}], \"image\": "
                                              "{\"width\": 512, \"height\": 512}}");
    looked l = {.request = request, .raster = &request->scene->raster};
    l.sight = plan_and_see(request);
    shd_survey survey = new_survey(&l, 512);
    shd_sight_survey(l.sight, (shd_tile){0, 0, 512, 512}, &survey);
    size_t seen = 0;
    for (int i = 0; i < 64 * 64; i++) seen += survey.blocks[i].count;
    /* From distance 4 with a field of 40 degrees the circle's radius is tan(asin(1/4)) / tan 20
     * of half the picture, in blocks 22.7; its rim may take in blocks that it does not touch.
     */
    double area = SHD_PI * 22.7 * 22.7, rim = 2 * SHD_PI * 22.7;
    assert_true((double)seen > area && (double)seen < area + rim);
    drop_looked(&l);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hit_depends_on_its_shot_alone),
        cmocka_unit_test(hits_in_f32_are_the_exact_ones_rounded),
        cmocka_unit_test(balls_of_a_crowd_are_seen_as_each_alone),
        cmocka_unit_test(padding_repeats_the_last_hit),
        cmocka_unit_test(surveys_name_all_that_is_seen),
        cmocka_unit_test(surveys_of_a_sphere_follow_its_outline),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
