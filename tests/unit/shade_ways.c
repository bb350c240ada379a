/* Models under lights with a shape: weights of many directions at once against shade/brdf.h and
 * Westin tables one by one, cells against their definition, and sums by kernels against those of
 * the reference, which integrates the same cells one direction at a time. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "shade/extended.h"
#include "shade/gauss.h"
#include "shade/ways.h"
#include "shade/westin.h"
#include "unit/shade_support.h"

enum { LOBES = 4, ROWS = 3 + 3 * LOBES, POINTS = 24, LIT = 11, SHAPES = 3 };

typedef struct world {
    shd_scene scene;
    shd_material from;
    shd_plan_lobe lobes[LOBES];
    shd_plan_material material;
    shd_light shape;
    shd_plan_light light;
    shd_object object;
    const shd_westin *westin[1];
    shd_plan plan;
} world;

static const char *const names[] = {"phong",      "blinn-phong",   "phong-normalized",
                                    "oren-nayar", "cook-torrance", "westin",
                                    "isotropic"};
enum { CASES = SHD_MODEL_COUNT + 1 };

#ifdef __x86_64__
#define VARIANTS(name)                                                                             \
    { name##_portable, name##_avx2, name##_avx512 }
#else
#define VARIANTS(name)                                                                             \
    { name##_portable }
#endif
static shd_area_sum_function *const sums[SHD_ISA_COUNT] = VARIANTS(shd_sum_ways);
static shd_fan_ways_function *const fan_ways[SHD_ISA_COUNT] = VARIANTS(shd_fan_ways);

static const shd_westin *make_westin(bool isotropic) {
    static shd_westin table;
    table.isotropic = isotropic;
    table.tail = 0.3;
    for (size_t v = 0; v < SHD_WESTIN_QUARTER; v++)
        for (size_t l = 0; l < SHD_WESTIN_WAYS; l++)
            for (size_t n = 0; n < SHD_WESTIN_BOUNCES; n++)
                table.rho[v][l][n] = 0.1F + 0.01F * (float)((v * 7 + l * 3 + n) % 11);
    return &table;
}

static void set_world(world *w, int which, shd_isa isa) {
    static const double exponents[LOBES] = {0, 2.5, 30, 700}, slopes[LOBES] = {0.03, 0.1, 0.4, 2};
    const shd_model model = which < SHD_MODEL_COUNT ? (shd_model)which : SHD_MODEL_WESTIN;
    const bool facets = model == SHD_MODEL_COOK_TORRANCE, westin = model == SHD_MODEL_WESTIN;
    memset(w, 0, sizeof *w);
    for (int k = 0; k < LOBES; k++)
        w->lobes[k] = (shd_plan_lobe){{1, 1, 1}, facets ? slopes[k] : exponents[k]};
    w->from = (shd_material){.model = model,
                             .sigma = 0.6,
                             .diffuse = {0.3, 0.5, 0.7},
                             .fresnel = {.n = {0.14, 1.5, 1.5}, .k = {3.98, 0, 0}}};
    w->material =
        (shd_plan_material){.lobes = w->lobes,
                            .lobe_count = westin || model == SHD_MODEL_OREN_NAYAR ? 0 : LOBES,
                            .model = model,
                            .has_diffuse = true,
                            .from = &w->from};
    w->object = (shd_object){.shape = SHD_SPHERE,
                             .radius = 1,
                             .transform = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.1, 0.2, 0}}};
    w->scene = (shd_scene){
        .light_count = 1, .material_count = 1, .objects = &w->object, .object_count = 1};
    w->light = point_light((shd_vec3){0, 0, 3});
    for (int c = 0; c < 3; c++) w->light.color[c] = 1 + c;
    w->westin[0] = westin ? make_westin(which == SHD_MODEL_COUNT) : NULL;
    w->plan = (shd_plan){.scene = &w->scene,
                         .tier = SHD_EXACT,
                         .isa = isa,
                         .lights = &w->light,
                         .light_count = 1,
                         .materials = &w->material,
                         .westin = westin ? w->westin : NULL,
                         .scale = 0.5,
                         .extended = true};
}

static shd_surface random_surface(const world *w, int i) {
    shd_surface at = {.position = random_unit(), .material = &w->material};
    at.normal = i % 3 ? at.position : random_unit();
    at.view = random_unit();
    if (i % 5) shd_normalize(shd_madd(at.view, at.normal, 1.1), &at.view);
    at.mirror = shd_sub(shd_scale(at.normal, 2 * shd_dot(at.normal, at.view)), at.view);
    return at;
}

/* ---- Weights ---- */

static void weigh_one(const world *w, const shd_surface *at, shd_vec3 toward,
                      double row[SHD_BRDF_ROWS]) {
    memset(row, 0, SHD_BRDF_ROWS * sizeof *row);
    if (w->plan.westin)
        shd_westin_weigh(w->westin[0], &w->object, at, toward, row);
    else
        shd_brdf_weigh(at, toward, row);
}

static shd_way_point way_point(const world *w, const shd_lighting *lighting,
                               const shd_surface *at) {
    static shd_westin_seen seen;
    shd_way_point p = {.at = at, .energies = lighting->energies[0]};
    if (!w->plan.westin) return p;
    const shd_tangents tangents = shd_westin_tangents(w->westin[0], &w->object);
    p.westin = &lighting->westin[0];
    p.seen = &seen;
    seen.made = false;
    p.tangent = shd_tangent_at(&tangents, at->position, at->normal);
    return p;
}

/* Around the mirror direction, the normal and everywhere, some behind the surface. */
static void set_ways(const shd_surface *at, size_t count, shd_ways *out) {
    memset(out, 0, sizeof *out);
    out->points = count;
    out->count = (count + SHD_WAYS_STEP - 1) / SHD_WAYS_STEP * SHD_WAYS_STEP;
    out->sums = SHD_WAY_SUMS;
    for (size_t i = 0; i < out->count; i++) {
        shd_vec3 l = random_unit();
        const shd_vec3 axes[3] = {at->mirror, at->normal, at->view};
        if (i % 4) shd_normalize(shd_madd(axes[i % 4 - 1], l, 0.3 * uniform()), &l);
        if (i == 5) l = shd_scale(at->view, -1);
        if (i == 6) l = at->mirror;
        if (i >= count)
            l = (shd_vec3){out->toward[0][count - 1], out->toward[1][count - 1],
                           out->toward[2][count - 1]};
        const double v[3] = {l.x, l.y, l.z};
        for (int c = 0; c < 3; c++) {
            out->toward[c][i] = v[c];
            out->weight[c][i] = i < count ? uniform() : 0;
        }
    }
}

static void compare_weights(int which, shd_isa isa, double (*first)[ROWS][SHD_WAY_SUMS]) {
    static world w;
    set_world(&w, which, isa);
    srand(5);
    shd_arena *arena = shd_arena_new((size_t)1 << 24);
    const shd_lighting *lighting = shd_lighting_new(&w.plan, NULL, arena);
    assert_non_null(lighting);
    for (int i = 0; i < POINTS; i++) {
        const shd_surface at = random_surface(&w, i);
        shd_ways ways;
        set_ways(&at, 1 + (size_t)(i * 13) % SHD_WAYS_MOST, &ways);
        double out[ROWS][SHD_WAY_SUMS], expected[ROWS][SHD_WAY_SUMS], row[SHD_BRDF_ROWS];
        memset(out, 0, sizeof out);
        memset(expected, 0, sizeof expected);
        const shd_way_point p = way_point(&w, lighting, &at);
        sums[isa](&p, &ways, out);
        for (size_t k = 0; k < ways.points; k++) {
            weigh_one(&w, &at, (shd_vec3){ways.toward[0][k], ways.toward[1][k], ways.toward[2][k]},
                      row);
            for (size_t r = 0; r < ROWS; r++)
                for (size_t j = 0; j < SHD_WAY_SUMS; j++)
                    expected[r][j] += ways.weight[j][k] * row[r];
        }
        for (size_t r = 0; r < 3 + 3 * w.material.lobe_count; r++)
            for (size_t j = 0; j < SHD_WAY_SUMS; j++) {
                const double a = out[r][j], b = expected[r][j];
                if (!(fabs(a - b) <= 2e-11 * fmax(fabs(b), 1)))
                    fail_msg("%s %s, row %zu: %.17g instead of %.17g", names[which],
                             shd_isa_name(isa), r, a, b);
            }
        if (isa == SHD_PORTABLE) memcpy(first[i], out, sizeof out);
        assert_memory_equal(first[i], out, sizeof out);
    }
    shd_arena_drop(arena);
}

static void weights_are_those_of_models(void **state) {
    (void)state;
    static double first[POINTS][ROWS][SHD_WAY_SUMS];
    for (int which = SHD_MODEL_BLINN_PHONG; which < CASES; which++)
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++)
            if (shd_cpu_has(isa)) compare_weights(which, isa, first);
}

/* ---- Cells ---- */

static shd_light random_shape(int i) {
    const double size = 0.02 * pow(100, uniform());
    shd_light l = {.type = (shd_light_type)(SHD_LIGHT_RECT + i % 3),
                   .radius = size / 2,
                   .position = shd_scale(random_unit(), 1.5 + uniform()),
                   .size = {size, size * (0.2 + uniform())}};
    shd_normalize(shd_scale(shd_madd(l.position, random_unit(), uniform()), -1), &l.direction);
    shd_perpendicular(l.direction, &l.across, &l.up);
    return l;
}

/* Unit directions, whose weights add up to the solid angle of the fan. */
static void cells_cover_what_is_seen(void **state) {
    (void)state;
    srand(6);
    for (int i = 0; i < 24; i++) {
        const shd_light l = random_shape(i);
        shd_seen seen;
        const shd_vec3 from = shd_scale(random_unit(), 0.5);
        if (!shd_see_area(&l, from, &seen)) continue;
        shd_ways ways, other;
        double whole = 0, expected = 0;
        const shd_vec3 apex = seen.toward;
        for (int k = 0; k < seen.count; k++) {
            const shd_fan fan = {&seen, &seen.pieces[k], apex, 0.5, 1, -0.5, 0.5};
            const double to = asinh(0.5);
            shd_fan f = fan;
            f.from = -to, f.to = to;
            for (int part = 0; part < 16; part++) {
                const double s[2] = {part / 16.0, (part + 1) / 16.0}, h[2] = {0, 1};
                fan_ways[SHD_PORTABLE](&f, s, h, false, &ways);
                for (size_t n = 0; n < ways.count; n++) {
                    const shd_vec3 t = {ways.toward[0][n], ways.toward[1][n], ways.toward[2][n]};
                    assert_true(fabs(shd_dot(t, t) - 1) < 1e-14);
                    whole += ways.weight[0][n];
                }
                for (shd_isa isa = SHD_AVX2; isa < SHD_ISA_COUNT; isa++) {
                    if (!shd_cpu_has(isa)) continue;
                    fan_ways[isa](&f, s, h, false, &other);
                    for (int c = 0; c < 3; c++) {
                        assert_memory_equal(ways.toward[c], other.toward[c],
                                            ways.count * sizeof(double));
                        assert_memory_equal(ways.weight[c], other.weight[c],
                                            ways.count * sizeof(double));
                    }
                }
            }
        }
        /* By another rule: what is like 1 / distance^3 over the plane. */
        enum { STEPS = 150 };
        for (int a = 0; a < STEPS; a++)
            for (int b = 0; b < STEPS; b++) {
                const double u = (a + 0.5) / STEPS, v = (b + 0.5) / STEPS;
                const bool round = seen.count == 1;
                const double x = round ? seen.radius * sqrt(u) * cos(2 * SHD_PI * v)
                                       : seen.pieces[0].x[0] * (1 - 2 * u),
                             y = round ? seen.radius * sqrt(u) * sin(2 * SHD_PI * v)
                                       : seen.pieces[0].y[0] * (1 - 2 * v);
                const double area = round ? SHD_PI * seen.radius * seen.radius
                                          : 4 * fabs(seen.pieces[0].x[0] * seen.pieces[0].y[0]);
                const shd_vec3 p = shd_seen_at(&seen, x, y);
                expected += area / STEPS / STEPS * seen.height / pow(shd_dot(p, p), 1.5);
            }
        assert_true(fabs(whole / expected - 1) < 1e-4);
    }
}

/* ---- Lights ---- */

static void compare_lights(int which, shd_isa isa, double *worst) {
    static world w;
    static points at;
    static double by_kernel[ROWS][LIT], by_reference[ROWS][LIT];
    const uint32_t light = 0;
    int32_t objects[LIT] = {0};
    double *fast[ROWS], *slow[ROWS];
    for (int k = 0; k < ROWS; k++) fast[k] = by_kernel[k], slow[k] = by_reference[k];
    srand(17);
    for (int shape = 0; shape < SHAPES; shape++) {
        set_world(&w, which, isa);
        w.shape = random_shape(shape);
        w.light.shape = &w.shape;
        w.light.position = w.shape.position;
        at.count = LIT;
        for (int i = 0; i < LIT; i++) {
            shd_surface s = random_surface(&w, i);
            s.position = shd_scale(s.position, 0.5);
            if (i % 4) shd_normalize(shd_madd(w.shape.position, random_unit(), 0.7), &s.normal);
            set_point(&at, (size_t)i, s.position, s.normal, s.view);
        }
        shd_arena *arena = shd_arena_new((size_t)1 << 24);
        const shd_lighting *lighting = shd_lighting_new(&w.plan, NULL, arena);
        assert_non_null(lighting);
        shd_points64 p = world_points(&at);
        p.object = objects;
        shd_light_sums64(lighting, &w.material, &light, 1, &p, fast, fast + 3);
        shd_extended_sums(lighting, &w.material, &light, 1, &p, slow, slow + 3);
        for (size_t k = 0; k < 3 + 3 * w.material.lobe_count; k++)
            for (int i = 0; i < LIT; i++) {
                const double a = by_kernel[k][i], b = by_reference[k][i];
                assert_true(isfinite(a) && a >= 0);
                *worst = fmax(*worst, fabs(a - b) / fmax(fabs(b), 1));
            }
        shd_arena_drop(arena);
    }
}

static void sums_are_those_of_the_reference(void **state) {
    (void)state;
    double worst = 0;
    for (int which = SHD_MODEL_BLINN_PHONG; which < CASES; which++)
        compare_lights(which, shd_cpu_best(), &worst);
    /* Rounding, but for cells that are halved by the one and not by the other: within 1e-5. */
    print_message("%.2e\n", worst);
    assert_true(worst < 1e-9);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weights_are_those_of_models),
        cmocka_unit_test(cells_cover_what_is_seen),
        cmocka_unit_test(sums_are_those_of_the_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
