/* Environments on models whose lobes are not symmetric, against sums over all texels of the same
 * map, cut into smaller and smaller ones. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "plan/around.h"
#include "plan/tier.h"
#include "shade/around_quick.h"
#include "shade/brdf.h"
#include "shade/surrounded.h"
#include "shade/ways.h"

enum { HIGH = 64, WIDE = 2 * HIGH, ROWS = 6 };

static double uniform(void) {
    static uint64_t random = 7;
    random = random * 6364136223846793005u + 1442695040888963407u;
    return (double)(random >> 11) * 0x1p-53;
}

static shd_vec3 direction(double down, double turn) {
    return (shd_vec3){-sin(down) * sin(turn), cos(down), sin(down) * cos(turn)};
}

/* ---- A point, and what is summed there. ---- */

typedef struct place {
    shd_material from;
    shd_plan_lobe lobe;
    shd_plan_material material;
    shd_packed_energy energy;
    shd_surface at;
    shd_way_point ways;
    size_t term, rows;
} place;

/* Seen with N.V = `viewing` from the side `turn`. */
static void stand(place *p, shd_model model, double sharpness, shd_vec3 normal, double viewing,
                  double turn) {
    *p = (place){.from = {.fresnel = {.n = {1.5, 0.2, 2}, .k = {0, 3, 4}}, .sigma = sharpness},
                 .lobe = {.shininess = sharpness}};
    p->material = (shd_plan_material){.model = model,
                                      .from = &p->from,
                                      .lobes = &p->lobe,
                                      .lobe_count = model != SHD_MODEL_OREN_NAYAR};
    p->term = p->material.lobe_count;
    p->rows = 3 + 3 * p->term;
    shd_vec3 a = {1, 0, 0};
    shd_normalize(
        shd_cross(fabs(normal.x) < 0.5 ? (shd_vec3){1, 0, 0} : (shd_vec3){0, 1, 0}, normal), &a);
    const shd_vec3 b = shd_cross(normal, a);
    const double aside = sqrt((1 - viewing) * (1 + viewing));
    shd_vec3 v = shd_scale(normal, viewing);
    v = shd_madd(shd_madd(v, a, aside * cos(turn)), b, aside * sin(turn));
    p->at = (shd_surface){.normal = normal, .view = v, .material = &p->material};
    p->at.mirror = shd_sub(shd_scale(normal, 2 * shd_dot(normal, v)), v);
    if (model == SHD_MODEL_PHONG_NORMALIZED) shd_fit_phong_energy(sharpness, &p->energy);
    p->ways = (shd_way_point){.at = &p->at,
                              .energies = model == SHD_MODEL_PHONG_NORMALIZED ? &p->energy : NULL};
}

/* ---- Maps. ---- */

static float texels[3 * WIDE * HIGH];

static shd_surroundings finish_map(void) {
    shd_surroundings map = {.name = "made", .width = WIDE, .height = HIGH, .texels = texels};
    assert_true(shd_surroundings_measure(&map, true, NULL));
    return map;
}

/* The texel that a direction is in, of 10,000, and nothing else. */
static shd_surroundings map_of_one(shd_vec3 d) {
    const double turn = atan2(-d.x, d.z);
    const int row = (int)fmin(acos(fmax(fmin(d.y, 1), -1)) / SHD_PI * HIGH, HIGH - 1),
              column = (int)((turn < 0 ? turn + 2 * SHD_PI : turn) / (2 * SHD_PI) * WIDE) % WIDE;
    memset(texels, 0, sizeof texels);
    for (int c = 0; c < 3; c++) texels[3 * (row * WIDE + column) + c] = c == 1 ? 5e3F : 1e4F;
    return finish_map();
}

static shd_surroundings map_of_noise(void) {
    for (int i = 0; i < 3 * WIDE * HIGH; i++)
        texels[i] = uniform() < 0.02 ? (float)(1e4 * uniform()) : 0.2F;
    return finish_map();
}

/* ---- Brute force. ---- */

/* One cell between the middles of texels, cut both ways. */
static void add_cell(const shd_surroundings *map, const place *p, int i, int j, int cut,
                     double out[ROWS][3]) {
    const double wide = 2 * SHD_PI / map->width / cut, left = shd_cell_turn(map->width, i),
                 top = shd_cell_down(map->height, j),
                 high = (shd_cell_down(map->height, j + 1) - top) / cut;
    for (int y = 0; y < cut; y++)
        for (int x = 0; x < cut; x++) {
            const double down = top + high * (y + 0.5), turn = left + wide * (x + 0.5);
            const shd_vec3 l = direction(down, turn);
            double row[SHD_BRDF_ROWS], v[3];
            if (!shd_brdf_weigh(&p->at, l, row)) continue;
            shd_surroundings_at(map, l, v);
            const double by = wide * high * sin(down) / SHD_PI;
            for (size_t r = 0; r < p->rows; r++)
                for (int k = 0; k < 3; k++) out[r][k] += by * v[k] * row[r];
        }
}

static bool is_dark(const shd_surroundings *map, int i, int j) {
    for (int y = j - 1; y <= j; y++)
        for (int x = i; x <= i + 1; x++) {
            const int row = y < 0 ? 0 : y < map->height ? y : map->height - 1;
            if (map->texels[3 * (row * map->width + x % map->width)] > 0) return false;
        }
    return true;
}

/* Around W, and nothing beside it. */
static bool is_narrow(const place *p) {
    return p->lobe.shininess > 1e3 && p->material.model != SHD_MODEL_BLINN_PHONG;
}

static bool is_beside(const shd_surroundings *map, const place *p, int i, int j) {
    const shd_vec3 middle = direction(shd_cell_down(map->height, j), shd_cell_turn(map->width, i));
    return is_narrow(p) && shd_dot(middle, p->at.mirror) < cos(0.25);
}

static void brute_force(const shd_surroundings *map, const place *p, int cut, double out[ROWS][3]) {
    memset(out, 0, sizeof(double[ROWS][3]));
    for (int j = 0; j <= map->height; j++)
        for (int i = 0; i < map->width; i++)
            if (!is_dark(map, i, j) && !is_beside(map, p, i, j)) add_cell(map, p, i, j, cut, out);
}

static double differ(const place *p, double a[ROWS][3], double b[ROWS][3]) {
    double most = 0;
    for (size_t r = 3 * p->term; r < p->rows; r++)
        for (int k = 0; k < 3; k++) most = fmax(most, fabs(a[r][k] - b[r][k]));
    return most;
}

static void walk(const shd_surroundings *map, const shd_moments *moments, const place *p,
                 double out[ROWS][3]) {
    const shd_around_function f = {shd_sum_ways_portable, &p->ways, p->rows, SHD_PORTABLE, NULL};
    const shd_around_lobe lobe = {p->material.model, p->lobe.shininess, p->at.normal, p->at.view,
                                  p->at.mirror};
    memset(out, 0, sizeof(double[ROWS][3]));
    shd_around_sum(map, moments, &lobe, &f, out);
}

static shd_light light_of(const shd_surroundings *map) {
    return (shd_light){.of_map = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .map = map};
}

/* The most that the map adds by a lobe that is seen like this. */
static double most_of(const shd_surroundings *map, const place *p) {
    const double v = shd_dot(p->at.normal, p->at.view);
    const shd_light light = light_of(map);
    return shd_around_most_of(&light, &p->material, p->term,
                              p->material.model == SHD_MODEL_COOK_TORRANCE
                                  ? shd_facets_most(p->lobe.shininess) / fabs(v) / 4
                                  : INFINITY);
}

static void walk_quickly(const shd_surroundings *map, const shd_moments *moments, const place *p,
                         double floor, double out[ROWS][3]) {
    const shd_around_function f = {shd_sum_ways_portable, &p->ways, p->rows, SHD_PORTABLE,
                                   &p->ways};
    const shd_around_lobe lobe = {p->material.model, p->lobe.shininess, p->at.normal, p->at.view,
                                  p->at.mirror};
    assert_true(shd_ways32_hold(&p->ways, map->most));
    memset(out, 0, sizeof(double[ROWS][3]));
    shd_around_sum_quickly(map, moments, &lobe, &f, SHD_QUICK_SHARE, floor, out);
}

/* Holds the quick walk, as pictures have it, against `fine`, which may itself be off by twice what
 * `coarse` is off it. Returns how far off it is, of what it may be. */
static double check_quick(const shd_surroundings *map, const shd_moments *moments, const place *p,
                          double fine[ROWS][3], double coarse[ROWS][3], const char *name) {
    const shd_light light = light_of(map);
    const double floor = SHD_QUICK_FLOOR * most_of(map, p);
    double found[ROWS][3], worst = 0;
    walk_quickly(map, moments, p, shd_walk_floor(&light, &p->material, p->term > 0, &p->at), found);
    for (size_t r = 3 * p->term; r < p->rows; r++)
        for (int k = 0; k < 3; k++) {
            const double may =
                SHD_QUICK_SHARE * fine[r][k] + floor + 2 * fabs(coarse[r][k] - fine[r][k]);
            worst = fmax(worst, fabs(found[r][k] - fine[r][k]) / may);
        }
    print_message("%s, model %d, sharpness %g, N.V %.3g: quickly %.2f of what is allowed\n", name,
                  p->material.model, p->lobe.shininess, shd_dot(p->at.normal, p->at.view), worst);
    assert_true(worst <= 1);
    return worst;
}

/* Holds the walk against sums by `cut` and twice as many; returns how far off it is, of the
 * most. */
static double check(const shd_surroundings *map, const place *p, int cut, const char *name) {
    shd_moments *moments = aligned_alloc(64, shd_moments_size(map));
    double found[ROWS][3], coarse[ROWS][3], fine[ROWS][3];
    assert_true(shd_moments_make(map, NULL, moments));
    walk(map, moments, p, found);
    brute_force(map, p, cut, coarse);
    brute_force(map, p, 2 * cut, fine);
    check_quick(map, moments, p, fine, coarse, name);
    free(moments);
    const double most = most_of(map, p), off = differ(p, found, fine) / most,
                 itself = differ(p, coarse, fine) / most;
    print_message("%s, model %d, sharpness %g, N.V %.3g: off %.1e of %.3g, brute force itself "
                  "%.1e\n",
                  name, p->material.model, p->lobe.shininess, shd_dot(p->at.normal, p->at.view),
                  off, most, itself);
    assert_true(off <= SHD_AROUND_TOLERANCE / 2 + 2 * itself);
    return off;
}

/* ---- Claims. ---- */

static const struct {
    shd_model model;
    double sharpness;
} lobes[] = {{SHD_MODEL_BLINN_PHONG, 1},
             {SHD_MODEL_BLINN_PHONG, 40},
             {SHD_MODEL_BLINN_PHONG, 1e4},
             {SHD_MODEL_PHONG_NORMALIZED, 1},
             {SHD_MODEL_PHONG_NORMALIZED, 60},
             {SHD_MODEL_PHONG_NORMALIZED, 1e4},
             {SHD_MODEL_COOK_TORRANCE, 0.6},
             {SHD_MODEL_COOK_TORRANCE, 0.15},
             {SHD_MODEL_COOK_TORRANCE, 0.02},
             {SHD_MODEL_OREN_NAYAR, 0.6},
             {SHD_MODEL_PHONG, 1},
             {SHD_MODEL_PHONG, 19.3},
             {SHD_MODEL_PHONG, 8e3}};
enum { LOBES = sizeof lobes / sizeof *lobes };

/* One texel: at the mirrored view, at a pole, across the horizon, and where the view itself is. */
static void one_texel_is_as_its_parts(void **state) {
    (void)state;
    static const double views[] = {0.9, 0.25, 0.02};
    for (int k = 0; k < LOBES; k++)
        for (int way = 0; way < 4; way++) {
            place p;
            const double viewing = views[(k + way) % 3];
            const double down = 0.4 + 2 * uniform(), pole = k % 2 ? SHD_PI : 0;
            const shd_vec3 normal =
                direction(way == 1 ? fabs(pole - acos(viewing)) : down, 6 * uniform());
            stand(&p, lobes[k].model, lobes[k].sharpness, normal, viewing, 6 * uniform());
            if (way == 1) {
                p.at.mirror = direction(pole, 0);
                p.at.view =
                    shd_sub(shd_scale(normal, 2 * shd_dot(normal, p.at.mirror)), p.at.mirror);
            }
            shd_vec3 to = way == 3 ? p.at.view : p.at.mirror;
            if (way == 2) shd_normalize(shd_madd(to, normal, -shd_dot(to, normal)), &to);
            const shd_surroundings map = map_of_one(to);
            check(&map, &p, lobes[k].sharpness > 1e3 || lobes[k].sharpness < 0.1 ? 100 : 40,
                  way == 0   ? "mirrored"
                  : way == 1 ? "pole"
                  : way == 2 ? "horizon"
                             : "view");
        }
}

static void noise_is_as_all_texels(void **state) {
    (void)state;
    static const int which[] = {0, 1, 4, 6, 7, 9, 10, 11};
    for (size_t k = 0; k < sizeof which / sizeof *which; k++) {
        place p;
        const shd_surroundings map = map_of_noise();
        stand(&p, lobes[which[k]].model, lobes[which[k]].sharpness,
              direction(3 * uniform(), 6 * uniform()), k % 2 ? 0.7 : 0.2, 6 * uniform());
        check(&map, &p, 2, "noise");
    }
}

/* Blocks are no other model than their cells. */
static void blocks_are_as_their_cells(void **state) {
    (void)state;
    const shd_surroundings map = map_of_noise();
    shd_moments *moments = aligned_alloc(64, shd_moments_size(&map));
    assert_true(shd_moments_make(&map, NULL, moments));
    for (int k = 0; k < LOBES; k++) {
        place p;
        double all[ROWS][3], cells[ROWS][3];
        stand(&p, lobes[k].model, lobes[k].sharpness, direction(3 * uniform(), 6 * uniform()), 0.6,
              6 * uniform());
        walk(&map, moments, &p, all);
        walk(&map, NULL, &p, cells);
        assert_true(differ(&p, all, cells) <= SHD_AROUND_TOLERANCE / 2 * most_of(&map, &p));
    }
    free(moments);
}

/* Weights of a block sum to the light of its cells, whose nodes see a constant as it is. */
static void blocks_hold_all_light(void **state) {
    (void)state;
    for (int i = 0; i < 3 * WIDE * HIGH; i++) texels[i] = 1;
    const shd_surroundings map = finish_map();
    shd_moments *moments = aligned_alloc(64, shd_moments_size(&map));
    assert_true(shd_moments_make(&map, NULL, moments));
    for (int level = 0; level < moments->level_count; level++) {
        const shd_moment_level *l = &moments->levels[level];
        const shd_moment_block *b = shd_moment_blocks_of(moments, level);
        double sums[SHD_MOMENT_ORDERS] = {0};
        for (int k = 0; k < l->rows * l->columns; k++)
            for (int o = 0; o < SHD_MOMENT_ORDERS; o++)
                for (int n = shd_moment_nodes_at(o); n < shd_moment_nodes_at(o + 1); n++)
                    sums[o] += (double)b[k].weights[2][n];
        for (int o = 0; o < SHD_MOMENT_ORDERS; o++)
            assert_true(fabs(sums[o] / (4 * SHD_PI) - 1) < 1e-6);
    }
    free(moments);
    assert_true(shd_surroundings_brightest(&map, 1) >= 1);
    assert_true(shd_surroundings_brightest(&map, 100) < 2 * SHD_PI * (1 + 1e-9));
}

/* Quick walks are within their share of long ones, on the maps that are built in and on sparks. */
static void quick_walks_are_as_long_ones(void **state) {
    (void)state;
    const shd_surroundings *maps[] = {shd_surroundings_find("studio"), shd_surroundings_find("sky"),
                                      NULL};
    const shd_surroundings sparks = map_of_noise();
    maps[2] = &sparks;
    for (int m = 0; m < 3; m++) {
        shd_moments *moments = aligned_alloc(64, shd_moments_size(maps[m]));
        assert_true(shd_moments_make(maps[m], NULL, moments));
        for (int k = 0; k < LOBES; k++)
            for (int way = 0; way < 3; way++) {
                static const double views[] = {0.95, 0.4, 0.03};
                place p;
                double all[ROWS][3], less[ROWS][3];
                stand(&p, lobes[k].model, lobes[k].sharpness,
                      direction(acos(2 * uniform() - 1), 6.3 * uniform()), views[way],
                      6.3 * uniform());
                walk(maps[m], moments, &p, all);
                if (m == 2 && is_narrow(&p)) { /* of sparks, by what long walks are off */
                    brute_force(maps[m], &p, 16, less);
                    brute_force(maps[m], &p, 32, all);
                }
                check_quick(maps[m], moments, &p, all, m == 2 && is_narrow(&p) ? less : all,
                            maps[m]->name);
            }
        free(moments);
    }
}

/* In maps as fine as they may be, hundreds of blocks along the horizon are off together, and
 * thousands hold little each. */
static void fine_maps_are_no_worse(void **state) {
    (void)state;
    enum { FINE_HIGH = 256, FINE_WIDE = 2 * FINE_HIGH, ROUGH = 4, PLACES = 24 };
    float *all = malloc(sizeof(float[FINE_HIGH][FINE_WIDE][3]));
    for (int i = 0; i < 3 * FINE_HIGH * FINE_WIDE; i++) {
        const int row = i / 3 / FINE_WIDE;
        all[i] = row < 60 || row >= FINE_HIGH - 60;
    }
    shd_surroundings map = {.name = "caps", .width = FINE_WIDE, .height = FINE_HIGH, .texels = all};
    assert_true(shd_surroundings_measure(&map, true, NULL));
    shd_moments *moments = aligned_alloc(64, shd_moments_size(&map));
    assert_true(shd_moments_make(&map, NULL, moments));
    static const struct {
        shd_model model;
        double sharpness;
    } rough[] = {{SHD_MODEL_BLINN_PHONG, 1},
                 {SHD_MODEL_PHONG, 1},
                 {SHD_MODEL_COOK_TORRANCE, 1},
                 {SHD_MODEL_OREN_NAYAR, SHD_PI / 3}};
    double worst = 0;
    for (int k = 0; k < ROUGH * PLACES; k++) {
        place p;
        double found[ROWS][3];
        stand(&p, rough[k % ROUGH].model, rough[k % ROUGH].sharpness,
              direction(acos(2 * uniform() - 1), 6.3 * uniform()), 0.05 + 0.95 * uniform(),
              6.3 * uniform());
        walk(&map, moments, &p, found);
        worst = fmax(worst, check_quick(&map, moments, &p, found, found, map.name));
    }
    assert_true(worst < 0.8);
    free(moments);
    free(all);
}

/* A sun of one texel in a black sky as fine as it may be: little beside its own radiance. */
static void small_suns_count(void **state) {
    (void)state;
    enum { FINE_HIGH = 256, FINE_WIDE = 2 * FINE_HIGH, PLACES = 16 };
    static const struct {
        shd_model model;
        double sharpness;
    } broad[] = {{SHD_MODEL_COOK_TORRANCE, 0.75},
                 {SHD_MODEL_COOK_TORRANCE, 0.5},
                 {SHD_MODEL_BLINN_PHONG, 300},
                 {SHD_MODEL_PHONG_NORMALIZED, 100}};
    float *all = calloc(3 * FINE_HIGH * FINE_WIDE, sizeof *all);
    const int row = 70, column = 200;
    for (int c = 0; c < 3; c++) all[3 * (row * FINE_WIDE + column) + c] = 1e4F;
    const shd_vec3 sun =
        direction(SHD_PI * (row + 0.5) / FINE_HIGH, 2 * SHD_PI * (column + 0.5) / FINE_WIDE);
    shd_surroundings map = {.name = "sun", .width = FINE_WIDE, .height = FINE_HIGH, .texels = all};
    assert_true(shd_surroundings_measure(&map, true, NULL));
    shd_moments *moments = aligned_alloc(64, shd_moments_size(&map));
    assert_true(shd_moments_make(&map, NULL, moments));
    for (int k = 0; k < 4 * PLACES; k++) {
        place p;
        double fine[ROWS][3] = {{0}}, coarse[ROWS][3] = {{0}};
        shd_vec3 normal = direction(acos(2 * uniform() - 1), 6.3 * uniform());
        if (shd_dot(normal, sun) < 0) normal = shd_scale(normal, -1);
        stand(&p, broad[k / PLACES].model, broad[k / PLACES].sharpness, normal,
              0.3 + 0.7 * uniform(), 6.3 * uniform());
        for (int j = row; j <= row + 1; j++)
            for (int i = column - 1; i <= column; i++) {
                add_cell(&map, &p, i, j, 32, fine);
                add_cell(&map, &p, i, j, 16, coarse);
            }
        check_quick(&map, moments, &p, fine, coarse, map.name);
    }
    free(moments);
    free(all);
}

/* The row of a fine map that is beside a pole, whose narrow cells are off alike. */
static void poles_are_no_worse(void **state) {
    (void)state;
    enum { FINE_HIGH = 256, FINE_WIDE = 2 * FINE_HIGH, PLACES = 60 };
    float *all = calloc(3 * FINE_HIGH * FINE_WIDE, sizeof *all);
    for (int i = 0; i < 3 * FINE_WIDE; i++) all[i] = 1e4F;
    shd_surroundings map = {.name = "pole", .width = FINE_WIDE, .height = FINE_HIGH, .texels = all};
    assert_true(shd_surroundings_measure(&map, true, NULL));
    shd_moments *moments = aligned_alloc(64, shd_moments_size(&map));
    assert_true(shd_moments_make(&map, NULL, moments));
    for (int k = 0; k < PLACES; k++) {
        place p;
        double fine[ROWS][3] = {{0}}, coarse[ROWS][3] = {{0}};
        const double viewing = 0.1 + 0.9 * uniform(), exponent = pow(10, 3 + uniform()),
                     off = (k % 2 ? 2 : 1) * (1 + 3 * uniform()) / sqrt(exponent);
        stand(&p, k % 2 ? SHD_MODEL_BLINN_PHONG : SHD_MODEL_PHONG_NORMALIZED, exponent,
              direction(acos(viewing), 6.3 * uniform()), viewing, 0);
        p.at.mirror = direction(off, 6.3 * uniform());
        p.at.view =
            shd_sub(shd_scale(p.at.normal, 2 * shd_dot(p.at.normal, p.at.mirror)), p.at.mirror);
        for (int j = 0; j < 2; j++)
            for (int i = 0; i < FINE_WIDE; i++) {
                add_cell(&map, &p, i, j, 12, fine);
                add_cell(&map, &p, i, j, 6, coarse);
            }
        check_quick(&map, moments, &p, fine, coarse, map.name);
    }
    free(moments);
    free(all);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_texel_is_as_its_parts),
        cmocka_unit_test(noise_is_as_all_texels),
        cmocka_unit_test(blocks_are_as_their_cells),
        cmocka_unit_test(blocks_hold_all_light),
        cmocka_unit_test(quick_walks_are_as_long_ones),
        cmocka_unit_test(fine_maps_are_no_worse),
        cmocka_unit_test(small_suns_count),
        cmocka_unit_test(poles_are_no_worse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
