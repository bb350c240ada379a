/* Bounds of the tiers' errors hold, and are not far above what is measured. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "bound/light/error.h"
#include "unit/shade_support.h"

static points at;
static pair wanted[MOST_POINTS];
static double distances[MOST_POINTS], attenuations[MOST_POINTS];
static double diffuse[MOST_POINTS], specular[MOST_POINTS];

typedef struct shares {
    double diffuse, specular; /* largest error over its bound */
} shares;

/* Points within a unit ball: of any facing from 1e-5 on, viewers anywhere about the lobe. */
static void scatter(const shd_plan_light *light, double shininess) {
    for (at.count = 0; at.count < MOST_POINTS;) {
        shd_vec3 p = shd_scale(random_unit(), uniform()), n = random_unit(), toward = light->toward;
        double distance = 1;
        if (!light->directional) {
            shd_vec3 path = shd_sub(light->position, p);
            distance = shd_length(path);
            shd_normalize(path, &toward);
        }
        /* every fourth point sees the light at grazing incidence */
        if (at.count % 4 == 0) {
            shd_normalize(shd_cross(toward, random_unit()), &n);
            shd_normalize(shd_madd(n, toward, pow(10, -4 * uniform())), &n);
        }
        if (shd_dot(n, toward) < 1e-5) continue;
        shd_vec3 v = n, m = shd_sub(shd_scale(n, 2 * shd_dot(n, toward)), toward);
        shd_normalize(shd_madd(m, random_unit(), 8 / sqrt(shininess + 1) * pow(uniform(), 3)), &v);
        distances[at.count] = distance;
        attenuations[at.count] =
            light->directional ? 1 : 1 / (light->a + distance * (light->b + distance * light->c));
        wanted[at.count] = exact_weights(light, shininess, p, n, v);
        set_point(&at, at.count++, p, n, v);
    }
}

static shd_path path_of(const shd_plan_light *light) {
    return light->directional  ? SHD_PATH_DIRECTIONAL
           : light->attenuated ? SHD_PATH_ATTENUATED
                               : SHD_PATH_POINT;
}

/* What half an ulp of f32 in three coordinates of a point of the unit ball and of the light moves
 * the direction by. */
static double moved_by(const shd_plan_light *light, double distance) {
    return 0.87 * 0x1p-23 * (1 + shd_max_abs(light->position)) / distance;
}

static void compare(const kernel *k, const shd_plan_light *light, double shininess, bool split,
                    shares *most) {
    const shd_rounding rounding = shd_rounding_of(k->tier, k->isa);
    const shd_path_error *e = shd_path_error_of(rounding, path_of(light));
    const shd_lobe_error lobe = shd_lobe_error_of(rounding, shininess, 1);
    weigh_points(k, 1, light, shininess, &at, split, diffuse, specular);
    for (size_t i = 0; i < at.count; i++) {
        const bool moves = !split && !light->directional && k->tier != SHD_EXACT;
        const double moved = moves ? moved_by(light, distances[i]) : 0, f = attenuations[i];
        const double distance = e->relative + (light->attenuated ? 2 * moved : 0);
        double bound = f * (e->facing + moved) + distance * wanted[i].diffuse;
        most->diffuse = fmax(most->diffuse, fabs(diffuse[i] - wanted[i].diffuse) / bound);
        /* As if no point were brighter, */
        const double power = wanted[i].specular / f, shine = pow(power, 1 / shininess);
        bound = f * (shd_lobe_faint(&lobe, power) +
                     shd_lobe_sum(shd_lobe_turned(&lobe, shine, power, e->direction + moved),
                                  shd_lobe_functions(&lobe, power))) +
                distance * wanted[i].specular;
        const double error = fabs(specular[i] - wanted[i].specular);
        if (error > 0 && !(error <= bound))
            fail_msg("%s, ns %g: %g of %g is off by %g, not %g", k->name, shininess,
                     wanted[i].specular, f, error, bound);
        /* in proportion to it but for the lobe's foot, */
        const double direction = e->direction + moved;
        bound = f * (shd_lobe_faint(&lobe, 1) + shd_lobe_foot(&lobe, 1, 1, direction)) +
                (shd_lobe_ratio(&lobe, direction) + distance) * wanted[i].specular;
        if (error > 0 && !(error <= bound))
            fail_msg("%s, ns %g: %g of %g is off by %g, not %g in proportion", k->name, shininess,
                     wanted[i].specular, f, error, bound);
        /* and as if some were as bright as can be. */
        bound = f * (shd_lobe_faint(&lobe, 1) +
                     shd_lobe_sum(shd_lobe_turned(&lobe, 1, 1, e->direction + moved),
                                  shd_lobe_functions(&lobe, 1))) +
                distance * wanted[i].specular;
        most->specular = fmax(most->specular, error / bound);
    }
}

static void weights_are_within_their_bounds(void **state) {
    (void)state;
    static const double shininess[] = {1, 3, 10, 33, 36, 100, 299, 301, 1e3, 1e4, 1e5, 1e6};
    enum { COUNT = sizeof shininess / sizeof shininess[0] };
    kernel kernels[MOST_KERNELS];
    const size_t count = find_kernels(kernels);
    srand(1);
    for (size_t s = 0; s < COUNT; s++) {
        shares most[MOST_KERNELS] = {{0, 0}};
        for (int round = 0; round < 6; round++) {
            shd_plan_light light = point_light(shd_scale(random_unit(), 1.1 + 4 * uniform()));
            light.directional = round % 3 == 2;
            shd_normalize(light.position, &light.toward);
            light.attenuated = round % 3 == 1;
            if (light.attenuated) light.a = 0.2, light.b = uniform(), light.c = 1;
            scatter(&light, shininess[s]);
            for (size_t k = 0; k < count; k++) {
                compare(&kernels[k], &light, shininess[s], false, &most[k]);
                if (kernels[k].tier != SHD_EXACT)
                    compare(&kernels[k], &light, shininess[s], true, &most[k]);
            }
        }
        for (size_t k = 0; k < count; k++) {
            /* 1e6 times the last of 64 bits is near f64's errors. */
            if (WIDE_BITS < 113 && kernels[k].tier == SHD_EXACT && shininess[s] > 1e5) continue;
            if (kernels[k].reference || kernels[k].isa == shd_cpu_best() ||
                kernels[k].isa == SHD_PORTABLE)
                print_message("ns %-6g %-16s of the bounds: diffuse %.2f, specular %.2f\n",
                              shininess[s], kernels[k].name, most[k].diffuse, most[k].specular);
            assert_true(most[k].diffuse <= 1 && most[k].specular <= 1);
            assert_true(most[k].diffuse > 0.1 && most[k].specular > 0.1);
        }
    }
}

/* The factor s at points under a spot, from cosines in wide floats. */
static double spot_of(const shd_plan_light *light, shd_vec3 p) {
    wide l[3] = {(wide)light->position.x - (wide)p.x, (wide)light->position.y - (wide)p.y,
                 (wide)light->position.z - (wide)p.z};
    const wide axis[3] = {(wide)light->axis.x, (wide)light->axis.y, (wide)light->axis.z};
    wide d = wide_sqrt(l[0] * l[0] + l[1] * l[1] + l[2] * l[2]), q = 0;
    for (int c = 0; c < 3; c++) q += (axis[c] + l[c] / d) * (axis[c] + l[c] / d) / 2;
    if (q > (wide)light->outer) return 0;
    wide s = 1;
    if (q > (wide)light->inner) {
        wide x = ((wide)light->outer - q) / ((wide)light->outer - (wide)light->inner);
        s = x * x * (3 - 2 * x);
    }
    if (light->exponent > 0) s *= q < 1 ? wide_exp((wide)light->exponent * wide_log1p(-q)) : 0;
    return (double)s;
}

static void spots_are_within_their_bounds(void **state) {
    (void)state;
    kernel kernels[MOST_KERNELS];
    const size_t count = find_kernels(kernels);
    srand(2);
    double most[MOST_KERNELS] = {0};
    for (int round = 0; round < 24; round++) {
        shd_plan_light light = point_light((shd_vec3){0, 2, 0});
        light.spot = true;
        light.axis = (shd_vec3){0, -1, 0};
        double outer = 0.15 + uniform(), inner = outer - 0.09 - (outer - 0.09) * uniform();
        light.outer = 1 - cos(outer);
        light.inner = 1 - cos(inner);
        light.exponent = round % 3 ? 40 * uniform() * uniform() + 1 : 0;
        at.count = MOST_POINTS;
        for (size_t i = 0; i < at.count; i++) {
            double angle = outer * uniform() * 1.02, around = 2 * SHD_PI * uniform();
            shd_vec3 p = {2 * tan(angle) * cos(around), 0, 2 * tan(angle) * sin(around)},
                     up = {0, 1, 0};
            set_point(&at, i, p, up, up);
        }
        for (size_t k = 0; k < count; k++) {
            const shd_rounding rounding = shd_rounding_of(kernels[k].tier, kernels[k].isa);
            const shd_path_error *e = shd_path_error_of(rounding, SHD_PATH_ATTENUATED);
            weigh_points(&kernels[k], 0.25, &light, 1, &at, true, diffuse, specular);
            for (size_t i = 0; i < at.count; i++) {
                const shd_vec3 p = lane_of(at.position, i);
                const double facing = 2 / sqrt(4 + shd_dot(p, p));
                const double error = fabs(diffuse[i] - spot_of(&light, p) * facing);
                const double bound =
                    shd_spot_error(rounding, &light, -1, 1, 0) + e->relative + e->facing;
                most[k] = fmax(most[k], error / bound);
            }
        }
    }
    for (size_t k = 0; k < count; k++) {
        if (kernels[k].reference || kernels[k].isa == shd_cpu_best() ||
            kernels[k].isa == SHD_PORTABLE)
            print_message("%-16s of the bound of spots: %.2f\n", kernels[k].name, most[k]);
        assert_true(most[k] <= 1);
        assert_true(most[k] > 0.05);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weights_are_within_their_bounds),
        cmocka_unit_test(spots_are_within_their_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
