/* The kernels of the models beside Phong's: against the scalar reference, and against each other.
 *
 * Both compute in f64, with other functions: each of some dozen operations errs by 2^-53. What a
 * lobe makes of that is its exponent times as much, or 1/m^2: tolerance_of says how much is allowed
 * of a weight, and of 1 at least. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "plan/parts.h"
#include "shade/brdf.h"
#include "shade/extended.h"
#include "shade/westin.h"
#include "unit/shade_support.h"

enum { POINTS = 2048, LIGHTS = 5, LOBES = 11, ROWS = 3 + 3 * LOBES, BINS = 17 };

typedef struct world {
    shd_scene scene;
    shd_material from;
    shd_plan_lobe lobes[LOBES];
    shd_plan_material material;
    shd_plan_light lights[LIGHTS];
    shd_object objects[2];
    const shd_westin *westin[1];
    size_t first; /* point: others follow it */
    shd_bins bins;
    double light_bins[LIGHTS][BINS][3], material_bins[(1 + LOBES) * BINS];
    shd_fresnel indices[(BINS + 2) / 3];
    shd_plan plan;
} world;

static const char *const names[] = {"phong",           "blinn-phong",   "phong-normalized",
                                    "oren-nayar",      "cook-torrance", "westin",
                                    "isotropic westin"};
enum { CASES = SHD_MODEL_COUNT + 1 };

/* In RGB, in a spectrum, and with an index that changes with the wavelength. */
typedef enum channels { RGB, SPECTRAL, DISPERSIVE, CHANNELS } channels;

static void set_lights(world *w) {
    for (int j = 0; j < LIGHTS; j++) {
        shd_plan_light *l = &w->lights[j];
        *l = point_light(shd_scale(random_unit(), 3));
        l->index = (size_t)j;
        for (int c = 0; c < 3; c++) l->color[c] = 0.2 + uniform();
    }
    w->lights[1].directional = w->lights[4].directional = true;
    w->lights[1].toward = random_unit();
    w->lights[4].toward = (shd_vec3){0, 0, 1};
    w->lights[2].attenuated = true;
    w->lights[2].c = 0.3;
    w->lights[3].spot = true;
    w->lights[3].axis = shd_scale(w->lights[3].position, -1.0 / 3);
    w->lights[3].outer = 0.4;
    w->lights[3].inner = 0.1;
    w->lights[3].exponent = 3;
}

/* No microgeometry's, but every entry differs. */
static const shd_westin *make_westin(bool isotropic) {
    static shd_westin table;
    table.isotropic = isotropic;
    table.tail = 0.3;
    for (size_t v = 0; v < SHD_WESTIN_QUARTER; v++)
        for (size_t l = 0; l < SHD_WESTIN_WAYS; l++)
            for (size_t n = 0; n < SHD_WESTIN_BOUNCES; n++) table.rho[v][l][n] = (float)uniform();
    return &table;
}

/* Around the frame of a sphere that is turned, and along a box that is stretched. */
static void set_microgeometry(world *w, bool isotropic) {
    const double c = cos(0.7), s = sin(0.7);
    w->objects[0] = (shd_object){.shape = SHD_SPHERE,
                                 .radius = 1,
                                 .transform = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}, {0.1, 0.2, 0}}};
    w->objects[1] = (shd_object){.shape = SHD_BOX,
                                 .size = {1, 1, 1},
                                 .transform = {{{2, 0, s}, {0, 1, 0}, {0, 0, c}}, {0, 0, 0}}};
    w->scene.objects = w->objects;
    w->scene.object_count = 2;
    w->westin[0] = make_westin(isotropic);
    w->plan.westin = w->westin;
    for (int k = 0; k < 3; k++) w->from.diffuse[k] = isotropic ? 0.7 : 0.2 + 0.3 * k;
}

static bool has_lobes(shd_model model) {
    return model != SHD_MODEL_OREN_NAYAR && model != SHD_MODEL_WESTIN;
}

/* More lobes than a kernel sums at once. */
static void set_world(world *w, int which, shd_isa isa) {
    const shd_model model = which < SHD_MODEL_COUNT ? (shd_model)which : SHD_MODEL_WESTIN;
    static const double exponents[LOBES] = {0, 0.3, 1, 5, 12.3, 40, 100, 500, 2e3, 1e4, 1e6};
    static const double slopes[LOBES] = {1e-4, 1e-3, 0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 1, 3, 10};
    memset(w, 0, sizeof *w);
    srand(7);
    set_lights(w);
    const bool facets = model == SHD_MODEL_COOK_TORRANCE;
    for (int k = 0; k < LOBES; k++)
        w->lobes[k] = (shd_plan_lobe){{1, 1, 1}, facets ? slopes[k] : exponents[k]};
    w->from = (shd_material){.model = model,
                             .sigma = 0.6,
                             .fresnel = {.n = {0.14, 1.5, (double)INFINITY}, .k = {3.98, 0, 0}}};
    w->material = (shd_plan_material){.lobes = w->lobes,
                                      .lobe_count = has_lobes(model) ? LOBES : 0,
                                      .model = model,
                                      .has_diffuse = true,
                                      .from = &w->from};
    w->scene.light_count = LIGHTS;
    w->scene.material_count = 1;
    w->plan = (shd_plan){.scene = &w->scene,
                         .tier = SHD_EXACT,
                         .isa = isa,
                         .lights = w->lights,
                         .light_count = LIGHTS,
                         .materials = &w->material,
                         .scale = 0.25,
                         .extended = true};
    if (model == SHD_MODEL_WESTIN) set_microgeometry(w, which == SHD_MODEL_COUNT);
}

/* No light's colors and no material's, but all of them differ. */
static void set_spectrum(world *w, channels how, shd_arena *arena) {
    static const shd_affine SAME = {.linear = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (how == RGB) return;
    assert_true(shd_bins_make(BINS, 380, 730, &SAME, arena, &w->bins));
    w->plan.bins = &w->bins;
    for (size_t j = 0; j < LIGHTS; j++) {
        for (size_t b = 0; b < BINS; b++)
            for (size_t c = 0; c < 3; c++) w->light_bins[j][b][c] = uniform() / BINS;
        w->lights[j].bins = (const double(*)[3])w->light_bins[j];
    }
    for (size_t i = 0; i < sizeof w->material_bins / sizeof(double); i++)
        w->material_bins[i] = uniform();
    for (size_t b = 0; b < BINS; b++) {
        w->indices[b / 3].n[b % 3] = 0.2 + 2 * uniform();
        w->indices[b / 3].k[b % 3] = b % 4 ? 4 * uniform() : 0;
    }
    w->material.bins = w->material_bins;
    if (how == DISPERSIVE) w->material.indices = w->indices;
    w->plan.max_lobes = LOBES;
    assert_true(shd_plan_term_colors(&w->plan, arena));
    assert_non_null(w->plan.term_colors);
}

static bool is_case(int which, channels how) {
    return how != DISPERSIVE || which == SHD_MODEL_COOK_TORRANCE;
}

/* Points that see all that is hard: grazing, L = V, opposite, N.V below 0, on the light. */
static void set_points(const world *w, points *at, size_t count) {
    at->count = count;
    for (size_t i = 0; i < count; i++) {
        const shd_vec3 p = random_unit();
        shd_vec3 n = i % 3 ? p : random_unit(), v = random_unit();
        if (i % 5 == 1) shd_normalize(shd_madd(v, n, 1.2), &v);
        if (i % 7 == 2) v = w->lights[1].toward;
        if (i % 7 == 3) n = w->lights[1].toward;
        if (i % 7 == 4)
            v = shd_sub(shd_scale(n, 2 * shd_dot(n, w->lights[1].toward)), w->lights[1].toward);
        if (i % 31 == 5) v = shd_scale(w->lights[4].toward, -1);
        if (i % 31 == 6) shd_normalize(shd_madd(random_unit(), n, -shd_dot(n, v)), &v);
        set_point(at, i, i % 97 == 8 ? w->lights[0].position : p, n, v);
    }
}

static double rows_by_kernel[ROWS][POINTS], rows_by_reference[ROWS][POINTS];

static void sum_rows(const shd_lighting *lighting, const world *w, const points *at, bool reference,
                     double rows[ROWS][POINTS]) {
    static const uint32_t which[LIGHTS] = {0, 1, 2, 3, 4};
    const shd_points64 p = world_points(at);
    int32_t objects[POINTS];
    for (size_t i = 0; i < POINTS; i++) objects[i] = (i + w->first) % 3 == 1;
    double *pointers[ROWS];
    for (size_t k = 0; k < ROWS; k++) pointers[k] = rows[k];
    shd_points64 with = p;
    with.object = objects;
    memset(rows, 0, ROWS * sizeof *rows);
    (reference ? shd_extended_sums : shd_light_sums64)(lighting, &w->material, which, LIGHTS, &with,
                                                       pointers, pointers + 3);
}

/* What errors of directions of some 2^-53 do to a lobe, and how well its energy is fitted. */
static double tolerance_of(const world *w, size_t row) {
    /* Angles around the normal are off by 2^-53 over their sine, times some 5 nodes a radian and
     * the table's values, of which entries differ by up to 3. */
    if (w->material.model == SHD_MODEL_WESTIN) return 1e-11;
    if (row < 3) return 1e-13;
    const double sharp = w->lobes[(row - 3) / 3].shininess;
    if (w->material.model == SHD_MODEL_COOK_TORRANCE) return 1e-13 + 1e-14 / (sharp * sharp);
    return 1e-13 + (w->material.model == SHD_MODEL_PHONG_NORMALIZED ? 2e-12 : 0) + 1e-15 * sharp;
}

/* The kernels' rows are those of the reference. */
static void assert_rows(const world *w, size_t count, const char *name, shd_isa isa) {
    for (size_t k = 0; k < 3 + 3 * w->material.lobe_count; k++) {
        double most = 0, worst = 0;
        for (size_t i = 0; i < count; i++) {
            const double a = rows_by_kernel[k][i], b = rows_by_reference[k][i];
            assert_true(isfinite(a) && isfinite(b));
            worst = fmax(worst, fabs(a - b) / fmax(fabs(b), 1));
            most = fmax(most, b);
        }
        /* Every row shows something, but for lobes that no point is in. */
        if (k < 9) assert_true(most > 0);
        if (!(worst <= tolerance_of(w, k)))
            fail_msg("%s %s: row %zu is off by %g", name, shd_isa_name(isa), k, worst);
    }
}

static void compare_kernels(int model, channels how) {
    static world w;
    static points at;
    static double first[ROWS][POINTS];
    bool begun = false;
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        set_world(&w, model, isa);
        set_points(&w, &at, POINTS - 3);
        shd_arena *arena = shd_arena_new((size_t)1 << 24);
        set_spectrum(&w, how, arena);
        const shd_lighting *lighting = shd_lighting_new(&w.plan, NULL, arena);
        assert_non_null(lighting);
        assert_true(shd_has_kernel(lighting, &w.material));
        sum_rows(lighting, &w, &at, false, rows_by_kernel);
        sum_rows(lighting, &w, &at, true, rows_by_reference);
        assert_rows(&w, at.count, names[model], isa);
        if (!begun) memcpy(first, rows_by_kernel, sizeof first);
        begun = true;
        assert_memory_equal(first, rows_by_kernel, sizeof first);
        shd_arena_drop(arena);
    }
}

static void kernels_are_as_the_reference(void **state) {
    (void)state;
    for (channels how = RGB; how < CHANNELS; how++)
        for (int model = SHD_MODEL_PHONG; model < CASES; model++)
            if (is_case(model, how)) compare_kernels(model, how);
}

/* Sums of one point do not depend on what is beside it, nor on how many there are. */
static void look_alone(int model, channels how) {
    static world w;
    static points at, one;
    set_world(&w, model, shd_cpu_best());
    set_points(&w, &at, 61);
    shd_arena *arena = shd_arena_new((size_t)1 << 24);
    set_spectrum(&w, how, arena);
    const shd_lighting *lighting = shd_lighting_new(&w.plan, NULL, arena);
    assert_non_null(lighting);
    w.first = 0;
    sum_rows(lighting, &w, &at, false, rows_by_kernel);
    for (size_t i = 0; i < at.count; i++) {
        one.count = 1;
        w.first = i;
        set_point(&one, 0, lane_of(at.position, i), lane_of(at.normal, i), lane_of(at.view, i));
        sum_rows(lighting, &w, &one, false, rows_by_reference);
        for (size_t k = 0; k < 3 + 3 * w.material.lobe_count; k++)
            assert_true(rows_by_reference[k][0] == rows_by_kernel[k][i]);
    }
    shd_arena_drop(arena);
}

static void points_do_not_see_each_other(void **state) {
    (void)state;
    for (channels how = RGB; how < CHANNELS; how++)
        for (int model = SHD_MODEL_BLINN_PHONG; model < CASES; model++)
            if (is_case(model, how)) look_alone(model, how);
}

static void fits_of_energy_are_close(void **state) {
    (void)state;
    for (double n = 0; n <= 1e6; n = 1.3 * n + 0.07) {
        shd_packed_energy e;
        shd_fit_phong_energy(n, &e);
        for (int i = 0; i <= 500; i++) {
            const double c = i % 2 ? pow(10, -9.0 * i / 500) : i / 500.0, h = n / 2;
            const double x = ((e.kappa - c) / (e.kappa + c) - e.middle) * e.twice;
            double b1 = 0, b2 = 0;
            for (int k = SHD_ENERGY_TERMS - 1; k > 0; k--) {
                const double b = e.terms[k] + x * b1 - b2;
                b2 = b1;
                b1 = b;
            }
            const double psi = e.terms[0] + x * b1 / 2 - b2,
                         fall = c < 1 ? exp((h + 1) * log1p(-c * c)) : 0,
                         fit = (2 * SHD_PI * c + e.beta * fall * psi) / (n + 2),
                         energy = shd_phong_energy(c, n);
            if (!(fabs(fit - energy) <= 1e-11 * energy))
                fail_msg("n %g, N.L %g: %.17g instead of %.17g", n, c, fit, energy);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_are_as_the_reference),
        cmocka_unit_test(points_do_not_see_each_other),
        cmocka_unit_test(fits_of_energy_are_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
