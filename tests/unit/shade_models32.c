/* The kernels in f32 of models beside Phong's: against the reference in f64, within the bound of
 * their weights, and against each other. Points that they leave to f64 are not counted, and few. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "bound/light/error.h"
#include "bound/light/weights.h"
#include "shade/brdf.h"
#include "unit/shade_support.h"

enum { POINTS = 4000, LOBES = 9 };

typedef struct world {
    stage stage;
    shd_plan_light light;
    shd_plan_lobe lobes[LOBES];
    shd_material from;
} world;

static const double exponents[LOBES] = {1, 1.5, 3, 10, 40, 100, 400, 2e3, 1e4};

static void set_world(world *w, shd_model model, shd_isa isa, int kind) {
    const kernel k = {.tier = SHD_STANDARD, .isa = isa};
    memset(w, 0, sizeof *w);
    w->light = point_light(shd_scale(random_unit(), 1.2 + 3 * uniform()));
    w->light.directional = kind == 0;
    shd_normalize(w->light.position, &w->light.toward);
    w->light.attenuated = kind == 2;
    if (kind == 2) w->light.a = 0.2, w->light.b = uniform(), w->light.c = 1;
    set_stage(&w->stage, &k, 1, &w->light, 1, 1);
    for (int j = 0; j < LOBES; j++) w->lobes[j] = (shd_plan_lobe){{1, 1, 1}, exponents[j]};
    w->from = (shd_material){.model = model, .sigma = 0.2 + uniform()};
    w->stage.material.model = model;
    w->stage.material.from = &w->from;
    w->stage.material.lobes = w->lobes;
    w->stage.material.lobe_count = model == SHD_MODEL_OREN_NAYAR ? 0 : LOBES;
    w->stage.plan.grey_lights = false;
    w->stage.plan.extended = w->stage.plan.models32 = true;
}

/* Of any facing, every third with light or view along the surface, and views around the mirror. */
static void scatter(const shd_plan_light *light, points *at) {
    for (at->count = 0; at->count < POINTS;) {
        const shd_vec3 p = shd_scale(random_unit(), uniform());
        shd_vec3 n = random_unit(), v = random_unit(), toward = light->toward;
        if (!light->directional) shd_normalize(shd_sub(light->position, p), &toward);
        if (at->count % 3 == 0) {
            shd_normalize(shd_cross(toward, random_unit()), &n);
            shd_normalize(shd_madd(n, toward, pow(10, -4 * uniform())), &n);
        }
        const shd_vec3 mirrored = shd_sub(shd_scale(n, 2 * shd_dot(n, toward)), toward);
        if (at->count % 2)
            shd_normalize(shd_madd(mirrored, random_unit(), 2 * pow(uniform(), 4)), &v);
        if (at->count % 7 == 3)
            shd_normalize(shd_madd(toward, random_unit(), pow(10, -8 * uniform())), &v);
        if (at->count % 7 == 4)
            shd_normalize(shd_madd(shd_scale(toward, -1), random_unit(), uniform()), &v);
        if (!(shd_dot(n, toward) > 0) || shd_dot(n, v) < (at->count % 11 ? 0 : -0.1)) continue;
        set_point(at, at->count++, p, n, v);
    }
}

static float rows[3 + 3 * LOBES][MOST_POINTS];
static uint8_t edges[MOST_POINTS];

static void sum_rows(const world *w, const points *at, bool split) {
    shd_arena *arena = shd_arena_new((size_t)1 << 22);
    const shd_lighting *lighting = shd_lighting_new(&w->stage.plan, NULL, arena);
    float *out[3 + 3 * LOBES];
    const uint32_t which = 0;
    assert_non_null(lighting);
    for (size_t k = 0; k < 3 + 3 * LOBES; k++) out[k] = rows[k];
    shd_points32 narrow = {.count = at->count};
    for (int c = 0; c < 3; c++) {
        narrow.position[c] = at->position32[c];
        narrow.low[c] = split ? at->low[c] : NULL;
        narrow.normal[c] = at->normal32[c];
        narrow.mirror[c] = at->mirror32[c];
    }
    memset(edges, 0, sizeof edges);
    shd_light_sums32(lighting, &w->stage.material, &which, 1, &narrow, out, out + 3, edges);
    shd_arena_drop(arena);
}

/* What the bounds take for a piece is here a point. */
static shd_glance look(const world *w, const shd_surface *at, shd_vec3 toward, double distance,
                       bool split) {
    const shd_plan_light *light = &w->light;
    const shd_path path = light->directional  ? SHD_PATH_DIRECTIONAL
                          : light->attenuated ? SHD_PATH_ATTENUATED
                                              : SHD_PATH_POINT;
    const bool moves = !split && !light->directional;
    const double place = moves ? 0.87 * 0x1p-23 * (1 + shd_max_abs(light->position)) / distance : 0;
    return (shd_glance){.lit = {.facing_high = shd_dot(at->normal, toward),
                                .shine_high = fmax(shd_dot(at->mirror, toward), 0)},
                        .narrow = true,
                        .place = place,
                        .direction = SHD_WEIGHT_DIRECTION32 + place,
                        .relative = shd_path_error_of(SHD_ROUNDS_FUSED, path)->relative +
                                    (light->attenuated ? 2 * place : 0),
                        .view = fmax(shd_dot(at->normal, at->view), 1e-4),
                        .half = shd_length(shd_add(toward, at->view)) / 2};
}

typedef struct shares {
    double term[1 + LOBES]; /* the largest error over its bound */
    size_t marked;
} shares;

static void compare(const world *w, points *at, bool split, shares *out) {
    const shd_plan_material *m = &w->stage.material;
    sum_rows(w, at, split);
    for (size_t i = 0; i < at->count; i++) {
        shd_surface s = {.position = lane_of(at->position, i),
                         .normal = lane_of(at->normal, i),
                         .view = lane_of(at->view, i),
                         .material = m};
        s.mirror = shd_sub(shd_scale(s.normal, 2 * shd_dot(s.normal, s.view)), s.view);
        const shd_vec3 path = shd_sub(w->light.position, s.position);
        shd_vec3 toward = w->light.toward;
        const double distance = w->light.directional ? 1 : shd_length(path);
        if (!w->light.directional) toward = shd_scale(path, 1 / distance);
        out->marked += edges[i];
        double row[SHD_BRDF_ROWS];
        if (edges[i] || !shd_brdf_weigh(&s, toward, row)) continue;
        const double factor = shd_attenuation(&w->light, distance);
        const shd_glance g = look(w, &s, toward, distance, split);
        for (size_t t = 0; t < 1 + m->lobe_count; t++) {
            const shd_weight bound = shd_weight_of(m, t, &g, 1);
            const double wanted = factor * row[3 * t],
                         most = factor * (bound.error + bound.most * g.relative) + 0x1p-23 * wanted,
                         error = fabs((double)rows[3 * t][i] - wanted);
            if (!(error <= most))
                fail_msg("model %d, term %zu: %g is off by %g, not %g; N.L %g, N.V %g, V.H %g",
                         (int)m->model, t, wanted, error, most, g.lit.facing_high, g.view, g.half);
            out->term[t] = fmax(out->term[t], error / most);
        }
    }
}

static void weights_are_within_their_bounds(void **state) {
    (void)state;
    static const shd_model models[] = {SHD_MODEL_BLINN_PHONG, SHD_MODEL_PHONG_NORMALIZED,
                                       SHD_MODEL_OREN_NAYAR};
    static world w;
    static points at;
    if (!shd_isa_fuses(shd_cpu_best())) skip();
    srand(3);
    for (size_t m = 0; m < sizeof models / sizeof models[0]; m++) {
        shares most = {.marked = 0};
        enum { ROUNDS = 9 };
        for (int round = 0; round < ROUNDS; round++) {
            set_world(&w, models[m], shd_cpu_best(), round % 3);
            scatter(&w.light, &at);
            narrow_points(&at, &w.stage.plan);
            compare(&w, &at, round % 2, &most);
        }
        print_message("model %d: %.3f of points again; of the bounds:", (int)models[m],
                      (double)most.marked / (ROUNDS * POINTS));
        for (size_t t = 0; t < 1 + w.stage.material.lobe_count; t++) {
            print_message(" %.2f", most.term[t]);
            assert_true(most.term[t] > 0.1);
        }
        print_message("\n");
        assert_true(most.marked < ROUNDS * POINTS * 0.4);
    }
}

/* Sums and marks are the same on every machine whose kernels fuse. */
static void kernels_have_the_same_bits(void **state) {
    (void)state;
    static world w;
    static points at;
    static float first[3 + 3 * LOBES][MOST_POINTS];
    static uint8_t first_edges[MOST_POINTS];
    for (int model = SHD_MODEL_BLINN_PHONG; model <= SHD_MODEL_OREN_NAYAR; model++) {
        bool begun = false;
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
            if (!shd_cpu_has(isa) || !shd_isa_fuses(isa)) continue;
            srand(5);
            set_world(&w, (shd_model)model, isa, 2);
            scatter(&w.light, &at);
            narrow_points(&at, &w.stage.plan);
            memset(rows, 0, sizeof rows);
            sum_rows(&w, &at, false);
            if (!begun) {
                memcpy(first, rows, sizeof first);
                memcpy(first_edges, edges, sizeof first_edges);
            }
            begun = true;
            assert_memory_equal(first, rows, sizeof first);
            assert_memory_equal(first_edges, edges, sizeof first_edges);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weights_are_within_their_bounds),
        cmocka_unit_test(kernels_have_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
