/* Which of two objects is seen where rays meet them at nearly the same distance. */
#include "unit/see.h"

/* Pixels where the object is seen. */
static size_t count_of(const seen *s, int32_t object) {
    size_t count = 0;
    for (size_t i = 0; i < s->hits.count; i++) count += s->hits.object[i] == object;
    return count;
}

static shd_affine turned_by(const shd_affine *turn, shd_vec3 at) {
    shd_affine m = *turn;
    m.origin = at;
    return m;
}

/* ---- Apart. ---- */

/* Two discs before an eye at the origin, the second one nearer by `gap`. */
static char *discs_apart(double distance, double gap, bool ortho) {
    return text_of("{" PICTURE ", \"camera\": {\"type\": \"%s\", \"%s\": %.17g, \"position\": "
                   "[0, 0, 0], \"target\": [0, 0, -1]}, \"objects\": [{\"type\": \"disc\", "
                   "\"radius\": %.17g, \"transform\": {\"rotate\": [90, 0, 0], \"translate\": "
                   "[0, 0, %.17g]}}, {\"type\": \"disc\", \"radius\": %.17g, \"transform\": "
                   "{\"rotate\": [90, 0, 0], \"translate\": [0, 0, %.17g]}}]}",
                   ortho ? "orthographic" : "perspective", ortho ? "height" : "fov",
                   ortho ? distance : 50.0, 0.3 * distance, -distance, 0.2 * distance,
                   -distance + gap);
}

static void a_disc_in_front_is_seen_at_any_distance(void **state) {
    static const double distances[] = {1e13, 1, 1e-20, 1e60};
    for (shd_isa isa = 0; every_variant(&isa); isa++)
        for (int k = 0; k < 8; k++) {
            const double distance = distances[k / 2];
            char *json = discs_apart(distance, 3e-14 * distance, k & 1);
            seen s = see(*state, json, isa);
            free(json);
            assert_true(count_of(&s, 0) > 100);
            /* Of the nearer one's pixels each: the picture's share that is within its rim. */
            const double half = k & 1 ? 0.5 : tan(25 * SHD_PI / 180);
            size_t within = 0;
            for (uint32_t i = 0; i < ALL; i++) {
                const double x = (double)(2 * (i % SIDE) + 1) / SIDE - 1,
                             y = (double)(2 * (i / SIDE) + 1) / SIDE - 1;
                within += hypot(x, y) * half < 0.2;
            }
            assert_int_equal(count_of(&s, 1), within);
            drop_seen(&s);
        }
}

/* Parallel discs in any direction, the farther one first in the scene: 2e-14 of their distance is
 * more than f64's rounding up to 45 degrees, and is seen. */
static void of_parallel_discs_the_nearer_is_seen(void **state) {
    uint64_t random = 9;
    for (int round = 0; round < 300; round++) {
        const shd_isa isa = (shd_isa)(round % SHD_ISA_COUNT);
        if (!shd_cpu_has(isa)) continue;
        const shd_affine turn = random_rotation(&random);
        const shd_vec3 normal = shd_linear(&turn, (shd_vec3){0, 1, 0});
        shd_vec3 toward = shd_madd(normal, random_direction(&random), uniform(&random, 0, 0.6));
        assert_true(shd_normalize(toward, &toward));
        const double distance = pow(10, uniform(&random, -10, 13));
        const shd_vec3 at = shd_scale(toward, distance),
                       near = shd_madd(at, normal, -2e-14 * distance);
        writing w;
        start(&w);
        fputs("{" PICTURE ", \"camera\": {\"position\": [0, 0, 0], \"fov\": 3, ", w.out);
        write_vector(w.out, "target", at);
        fprintf(w.out, "}, \"objects\": [{\"type\": \"disc\", \"radius\": %.17g, ", distance);
        shd_affine place = turned_by(&turn, at);
        write_transform(w.out, &place);
        fprintf(w.out, "}, {\"type\": \"disc\", \"radius\": %.17g, ", distance);
        place = turned_by(&turn, near);
        write_transform(w.out, &place);
        fputs("}]}", w.out);
        char *json = finish(&w);
        seen s = see(*state, json, isa);
        free(json);
        assert_int_equal(count_of(&s, 1), ALL);
        drop_seen(&s);
    }
}

/* ---- In each other. ---- */

/* Objects with a face in their frame's plane y = `level`, and the rest of them below. */
typedef struct solid {
    const char *text;
    double level;
} solid;

static const solid solids[] = {
    {"\"type\": \"plane\"", 0},
    {"\"type\": \"disc\", \"radius\": 3", 0},
    {"\"type\": \"box\", \"size\": [3, 1, 2]", 0.5},
    {"\"type\": \"cylinder\", \"radius\": 2, \"height\": 3", 1.5},
    {"\"type\": \"disc\", \"radius\": 2, \"interpolation\": \"flat\", \"segments\": 7", 0},
    {"\"type\": \"box\", \"size\": [3, 1, 2], \"interpolation\": \"flat\"", 0.5},
    {"\"type\": \"mesh\", \"positions\": [-2, 0.25, -2, -2, 0.25, 2, 2, 0.25, 2, 3, 0.25, -2], "
     "\"indices\": [0, 1, 2, 0, 2, 3], \"normals\": [0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 1, 0]",
     0.25},
};
enum { SOLIDS = sizeof solids / sizeof solids[0] };

typedef struct setup {
    shd_affine plane; /* its y axis is at right angles to the common plane, its origin within */
    char camera[400];
    solid pair[2];
    shd_affine places[2];
} setup;

/* An eye above the plane by down to 1e-5 of its distance. */
static setup make_setup(uint64_t *random) {
    setup s = {.plane = random_rotation(random)};
    s.plane.origin = shd_scale(random_direction(random), uniform(random, 0, 2));
    const double angle = uniform(random, -SHD_PI, SHD_PI), away = uniform(random, 2, 40),
                 up = away * pow(10, uniform(random, -5, 0));
    const shd_vec3 eye = shd_transform(&s.plane,
                                       (shd_vec3){away * cos(angle), up, away * sin(angle)}),
                   target = s.plane.origin;
    const bool ortho = below(random, 3) == 0;
    const double field = pow(10, uniform(random, -1, 0.5));
    snprintf(s.camera, sizeof s.camera,
             "\"type\": \"%s\", \"%s\": %.17g, \"position\": [%.17g, %.17g, %.17g], \"target\": "
             "[%.17g, %.17g, %.17g]",
             ortho ? "orthographic" : "perspective", ortho ? "height" : "fov",
             ortho ? field : 10 * field, eye.x, eye.y, eye.z, target.x, target.y, target.z);
    for (int k = 0; k < 2; k++) {
        s.pair[k] = solids[below(random, SOLIDS)];
        const double turn = uniform(random, -SHD_PI, SHD_PI);
        const shd_affine spin = {
            {{cos(turn), 0, -sin(turn)}, {0, 1, 0}, {sin(turn), 0, cos(turn)}},
            {uniform(random, -0.5, 0.5), -s.pair[k].level, uniform(random, -0.5, 0.5)}};
        s.places[k] = shd_compose(&s.plane, &spin);
    }
    return s;
}

static seen see_objects(shd_engine *engine, const setup *s, unsigned which, shd_isa isa) {
    writing w;
    start(&w);
    fprintf(w.out, "{" PICTURE EXACT ", \"camera\": {%s}, \"objects\": [", s->camera);
    for (int k = 0; k < 2; k++) {
        if (!(which >> k & 1)) continue;
        fprintf(w.out, "%s{%s, ", which == 3 && k ? ", " : "", s->pair[k].text);
        write_transform(w.out, &s->places[k]);
        fputs("}", w.out);
    }
    fputs("]}", w.out);
    char *json = finish(&w);
    seen out = see(engine, json, isa);
    free(json);
    return out;
}

/* Whether each pixel shows a point of the common plane; returns how many. */
static size_t mark_plane(const setup *s, const seen *from, bool *marks) {
    const shd_vec3 up = shd_linear(&s->plane, (shd_vec3){0, 1, 0});
    size_t count = 0;
    memset(marks, 0, ALL * sizeof *marks);
    for (size_t i = 0; i < from->hits.count; i++) {
        const shd_vec3 p = {from->hits.position[0][i], from->hits.position[1][i],
                            from->hits.position[2][i]};
        const bool in = fabs(shd_dot(up, shd_sub(p, s->plane.origin))) < 1e-11;
        marks[from->hits.shot[i]] = in;
        count += in;
    }
    return count;
}

/* However flat the rays, and however each face is described, the first object's is seen wherever
 * rays meet both. */
static void surfaces_in_each_other_do_not_speckle(void **state) {
    static bool marks[2][ALL];
    uint64_t random = 5;
    size_t both_met = 0;
    for (int round = 0; round < 600; round++) {
        const shd_isa isa = (shd_isa)(round % SHD_ISA_COUNT);
        if (!shd_cpu_has(isa)) continue;
        const setup s = make_setup(&random);
        for (int k = 0; k < 2; k++) {
            seen alone = see_objects(*state, &s, 1u << k, isa);
            mark_plane(&s, &alone, marks[k]);
            drop_seen(&alone);
        }
        seen both = see_objects(*state, &s, 3, isa);
        for (size_t i = 0; i < both.hits.count; i++) {
            const uint32_t shot = both.hits.shot[i];
            if (!marks[0][shot] || !marks[1][shot]) continue;
            both_met++;
            if (both.hits.object[i] != 0)
                fail_msg("round %d, pixel %u: %s on %s", round, (unsigned)shot, s.pair[1].text,
                         s.pair[0].text);
        }
        drop_seen(&both);
    }
    assert_true(both_met > 100000);
}

/* Solids of revolution, turned about their own axes: from the front to the silhouette. */
static void curved_surfaces_in_each_other_do_not_speckle(void **state) {
    static const solid round_ones[] = {
        {"\"type\": \"sphere\", \"radius\": 1.3", 0},
        {"\"type\": \"cylinder\", \"radius\": 0.7, \"height\": 2", 0},
        {"\"type\": \"cone\", \"radius\": 0.8, \"height\": 1.7", 0},
        {"\"type\": \"torus\", \"radius\": 1, \"tube\": 0.3", 0},
    };
    uint64_t random = 3;
    size_t both_met = 0;
    for (int round = 0; round < 300; round++) {
        const shd_isa isa = (shd_isa)(round % SHD_ISA_COUNT);
        if (!shd_cpu_has(isa)) continue;
        setup s = make_setup(&random);
        for (int k = 0; k < 2; k++) {
            const double turn = uniform(&random, -SHD_PI, SHD_PI);
            const shd_affine spin = {
                {{cos(turn), 0, -sin(turn)}, {0, 1, 0}, {sin(turn), 0, cos(turn)}}, {0, 0, 0}};
            s.pair[k] = round_ones[round % 4];
            s.places[k] = shd_compose(&s.plane, &spin);
        }
        seen alone[2] = {see_objects(*state, &s, 1, isa), see_objects(*state, &s, 2, isa)},
             both = see_objects(*state, &s, 3, isa);
        for (size_t i = 0, j = 0, k = 0; i < both.hits.count; i++) {
            const uint32_t shot = both.hits.shot[i];
            const shd_hits *a = &alone[0].hits, *b = &alone[1].hits;
            while (j < a->count && a->shot[j] < shot) j++;
            while (k < b->count && b->shot[k] < shot) k++;
            if (j >= a->count || k >= b->count || a->shot[j] != shot || b->shot[k] != shot)
                continue;
            double apart = 0;
            for (int c = 0; c < 3; c++)
                apart = fmax(apart, fabs(a->position[c][j] - b->position[c][k]));
            if (apart > 1e-6) continue; /* one was missed beside a silhouette */
            both_met++;
            if (both.hits.object[i] != 0)
                fail_msg("round %d, pixel %u: %s", round, (unsigned)shot, s.pair[0].text);
        }
        for (int k = 0; k < 2; k++) drop_seen(&alone[k]);
        drop_seen(&both);
    }
    assert_true(both_met > 100000);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_disc_in_front_is_seen_at_any_distance),
        cmocka_unit_test(of_parallel_discs_the_nearer_is_seen),
        cmocka_unit_test(surfaces_in_each_other_do_not_speckle),
        cmocka_unit_test(curved_surfaces_in_each_other_do_not_speckle),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
