/* CIEDE2000's bound of a picture's own colors, against pairs of colors that are as far apart as
 * errors may put them: mixtures of any terms, black, saturated or beyond what a screen holds. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "bound/shown/picture.h"
#include "color/delta_e.h"
#include "plan/plan.h"

static double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

static int below(uint64_t *random, int count) {
    return (int)uniform(random, 0, count);
}

static double power(uint64_t *random, double low, double high) {
    return pow(10, uniform(random, low, high));
}

/* ---- A scene that is no more than its terms. ---- */

enum { CLASSES = 3, TERMS = 4 };

typedef struct made {
    shd_excess_list list;
    shd_term terms[CLASSES][TERMS];
    size_t classes;
    shd_scene scene;
    shd_plan plan;
    shd_shown shown;
} made;

static const double SRGB_XYZ[3][3] = {{0.4123908, 0.3575843, 0.1804808},
                                      {0.2126390, 0.7151687, 0.0721923},
                                      {0.0193308, 0.1191948, 0.9505322}};

static void make_shown(shd_shown *shown, uint64_t *random) {
    *shown = (shd_shown){.coded = true, .seen = true};
    const bool wide = below(random, 3) == 0;
    static const double narrow[3][3] = {
        {1.7, -0.6, -0.1}, {-0.13, 1.14, -0.01}, {-0.02, -0.13, 1.15}};
    for (int r = 0; r < 3; r++) {
        const double white = SRGB_XYZ[r][0] + SRGB_XYZ[r][1] + SRGB_XYZ[r][2];
        for (int c = 0; c < 3; c++) {
            shown->to_xyz[r][c] = SRGB_XYZ[r][c] / white;
            shown->screen[r][c] = wide ? narrow[r][c] : r == c;
        }
    }
}

/* Some channels are empty, some terms alike, and some classes have no constant term to tell how
 * much there is of them. */
static void make_scene(made *m, uint64_t *random) {
    memset(m, 0, sizeof *m);
    make_shown(&m->shown, random);
    m->classes = 1 + (size_t)below(random, CLASSES);
    m->scene.raster.samples = 1;
    m->plan.scene = &m->scene;
    const double bright = power(random, below(random, 8) ? -3 : -18, 1),
                 wild = below(random, 2) ? -3.5 : -0.5; /* errors */
    for (int c = 0; c < 3; c++)
        m->scene.background[c] = below(random, 2) ? bright * uniform(random, 0, 1) : 0;
    shd_excess_list *list = &m->list;
    *list = (shd_excess_list){.nonnegative = true, .mixed = true, .count = m->classes};
    list->color = list->rounding = below(random, 2) ? power(random, -8, -3) : 0;
    list->more = below(random, 3) ? 0 : power(random, -8, -4);
    for (size_t k = 0; k < m->classes; k++) {
        shd_excess *e = &list->excess[k];
        *e = (shd_excess){.terms = m->terms[k],
                          .term_count = TERMS,
                          .lobe_count = TERMS - 2,
                          .ratio = power(random, -7, wild),
                          .distance = power(random, -8, wild)};
        for (size_t t = 0; t < TERMS; t++) {
            shd_term *term = &m->terms[k][t];
            const bool dark = t == 0 && below(random, 2), pale = below(random, 4) == 0;
            for (int c = 0; c < 3 && !dark; c++)
                term->color[c] = pale               ? bright * uniform(random, 0.8, 0.9)
                                 : below(random, 4) ? bright * power(random, -4, 0)
                                                    : 0;
            if (t == 3 && below(random, 3) == 0)
                memcpy(term->color, m->terms[k][1].color, sizeof term->color);
            if (t == 0) continue;
            list->much[k][t].absolute = below(random, 3) ? power(random, -9, wild) : 0;
            list->much[k][t].limited = below(random, 3) ? power(random, -8, wild) : 0;
        }
    }
}

/* ---- Two colors. ---- */

/* Nearly always as large as it may be. */
static double some_of(double most, uint64_t *random) {
    const double part = below(random, 4) ? 1 : uniform(random, 0, 1);
    return below(random, 2) ? most * part : -most * part;
}

/* A pixel, and the same with errors. */
static void make_pair(const made *m, uint64_t *random, double exact[3], double other[3]) {
    const shd_excess_list *list = &m->list;
    double share[CLASSES + 1], sum = 0;
    for (size_t k = 0; k <= m->classes; k++)
        sum += share[k] = below(random, 3) ? power(random, -4, 0) : 0;
    if (!(sum > 0)) sum = share[0] = 1;
    for (int c = 0; c < 3; c++) exact[c] = share[m->classes] / sum * m->scene.background[c];
    memcpy(other, exact, 3 * sizeof *other);
    for (size_t k = 0; k < m->classes; k++) {
        const shd_excess *e = &list->excess[k];
        for (size_t t = 0; t < TERMS; t++) {
            const shd_much *much = &list->much[k][t];
            const double w = t == 0             ? 1
                             : below(random, 3) ? power(random, -5, 0.5)
                                                : 0,
                         rate = e->distance + (t > 1 ? e->ratio : 0),
                         most = much->absolute + fmin(much->limited, rate * w),
                         error = t == 0 ? 0 : some_of(most, random);
            for (int c = 0; c < 3; c++) {
                const double color = share[k] / sum * m->terms[k][t].color[c];
                exact[c] += w * color;
                other[c] += fmax(w + error, 0) * color;
            }
        }
    }
    for (int c = 0; c < 3; c++)
        other[c] = fmax(
            other[c] + some_of(list->color * exact[c], random) + some_of(list->more, random), 0);
}

static void to_lab(const shd_shown *shown, const double rgb[3], double lab[3]) {
    double f[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        double light = 0;
        for (int c = 0; c < 3; c++) light += shown->screen[k][c] * rgb[c];
        light = fmin(fmax(light, 0), 1);
        for (int r = 0; r < 3; r++) f[r] += shown->to_xyz[r][k] * light;
    }
    for (int r = 0; r < 3; r++)
        f[r] = f[r] > 216.0 / 24389 ? cbrt(f[r]) : (24389.0 / 27 * f[r] + 16) / 116;
    lab[0] = 116 * f[1] - 16;
    lab[1] = 500 * (f[0] - f[1]);
    lab[2] = 200 * (f[1] - f[2]);
}

static void colors_are_no_farther_apart_than_the_bound(void **state) {
    (void)state;
    enum { SCENES = 4000, PAIRS = 100 };
    static made m;
    uint64_t random = 3;
    double most = 0;
    shd_arena *arena = shd_arena_new((size_t)1 << 26);
    assert_non_null(arena);
    for (int i = 0; i < SCENES; i++) {
        make_scene(&m, &random);
        double pairs[PAIRS][2][3];
        for (int k = 0; k < PAIRS; k++) {
            make_pair(&m, &random, pairs[k][0], pairs[k][1]);
            for (int c = 0; c < 3; c++)
                m.list.worst = fmax(m.list.worst, fabs(pairs[k][0][c] - pairs[k][1][c]));
        }
        const shd_picture_errors *errors;
        assert_true(shd_picture_errors_new(&m.plan, &m.list, &m.shown, arena, &errors));
        assert_non_null(errors);
        for (int k = 0; k < PAIRS; k++) {
            double lab[2][3];
            for (int s = 0; s < 2; s++) to_lab(&m.shown, pairs[k][s], lab[s]);
            const double apart = shd_delta_e_2000(lab[0], lab[1]);
            /* Either of both may be the picture. */
            for (int s = 0; s < 2; s++) {
                const double bound = shd_picture_delta_e(errors, pairs[k][s]);
                if (!(apart <= bound))
                    fail_msg("scene %d: %g apart, bound %g, of [%g, %g, %g] and [%g, %g, %g]", i,
                             apart, bound, pairs[k][0][0], pairs[k][0][1], pairs[k][0][2],
                             pairs[k][1][0], pairs[k][1][1], pairs[k][1][2]);
                if (bound > 0) most = fmax(most, apart / bound);
            }
        }
    }
    shd_arena_drop(arena);
    assert_true(most > 0.9); /* and much less would not do */
}

/* Nothing is told of what is not known. */
static void unknown_terms_tell_nothing(void **state) {
    (void)state;
    static made m;
    uint64_t random = 8;
    shd_arena *arena = shd_arena_new((size_t)1 << 20);
    const shd_picture_errors *errors;
    for (int how = 0; how < 4; how++) {
        make_scene(&m, &random);
        if (how == 0) m.list.excess[0].terms = NULL;
        if (how == 1) m.list.nonnegative = false;
        if (how == 2) m.shown.seen = false;
        if (how == 3) m.list.worst = INFINITY;
        assert_true(shd_picture_errors_new(&m.plan, &m.list, &m.shown, arena, &errors));
        assert_null(errors);
    }
    shd_arena_drop(arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colors_are_no_farther_apart_than_the_bound),
        cmocka_unit_test(unknown_terms_tell_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
