/* Sample patterns on what they are for: needles, dust and glints, things of about a pixel, against
 * 4,096 samples a pixel and beside patterns that others use. SHADED_MEASURE=1 prints all figures.
 */
#include "property/pieces.h"
#include "sight/item.h"

enum { SIDE = 64, FINE = 64 };

typedef struct pattern {
    int count;
    double x[64], y[64];
} pattern;

static pattern own_pattern(int count) {
    pattern p = {.count = count};
    for (int i = 0; i < count; i++) shd_sample_offset(i, count, &p.x[i], &p.y[i]);
    return p;
}

/* Direct3D 11's standard multisample patterns, in sixteenths of a pixel from its centre. */
static pattern standard_pattern(int count) {
    static const signed char four[] = {-2, -6, 6, -2, -6, 2, 2, 6},
                             eight[] = {1, -3, -1, 3, 5, 1, -3, -5, -5, 5, -7, -1, 3, 7, 7, -7},
                             sixteen[] = {1,  1, -1, -3, -3, 2,  4, -1, -5, -2, 2,
                                          5,  5, 3,  3,  -5, -2, 6, 0,  -7, -4, -6,
                                          -6, 4, -8, 0,  7,  -4, 6, 7,  -7, -8};
    const signed char *at = count == 4 ? four : count == 8 ? eight : sixteen;
    pattern p = {.count = count};
    for (int i = 0; i < count; i++) {
        p.x[i] = 0.5 + at[2 * i] / 16.0;
        p.y[i] = 0.5 + at[2 * i + 1] / 16.0;
    }
    return p;
}

/* 64 of a regular grid of side x side, from its point (column, row) on. */
static pattern grid_pattern(int side, int column, int row) {
    pattern p = {.count = 64};
    for (int i = 0; i < 64; i++) {
        p.x[i] = (column + i % 8 + 0.5) / side;
        p.y[i] = (row + i / 8 + 0.5) / side;
    }
    return p;
}

/* ---- Scenes: a unit is a pixel. ---- */

static void write_needles(FILE *out, uint64_t *random) {
    for (int i = 0; i < 300; i++) {
        fprintf(out, "%s{\"type\": \"cylinder\", \"radius\": %.17g, \"height\": %.17g, ",
                i ? ", " : "", exp(uniform(random, -4, -1)), uniform(random, 2, 12));
        shd_affine turn = random_rotation(random);
        turn.origin = (shd_vec3){uniform(random, -32, 32), uniform(random, -32, 32), 0};
        write_transform(out, &turn);
        fputs(", \"material\": {\"diffuse\": 0, \"emissive\": 1}}", out);
    }
}

static void write_balls(FILE *out, int count, double least, double most, const char *material,
                        uint64_t *random) {
    for (int i = 0; i < count; i++)
        fprintf(out,
                "%s{\"type\": \"sphere\", \"radius\": %.17g, \"transform\": {\"translate\": "
                "[%.17g, %.17g, %.17g]}, \"material\": {%s}}",
                i ? ", " : "", exp(uniform(random, log(least), log(most))),
                uniform(random, -32, 32), uniform(random, -32, 32), uniform(random, -9, 9),
                material);
}

static void write_dust(FILE *out, uint64_t *random) {
    write_balls(out, 400, 0.1, 0.8, "\"diffuse\": 0, \"emissive\": 1", random);
}

static void write_glints(FILE *out, uint64_t *random) {
    write_balls(out, 150, 2, 6, "\"diffuse\": 0, \"specular\": 1, \"shininess\": 300", random);
}

static void (*const kinds[])(FILE *, uint64_t *) = {write_needles, write_dust, write_glints};
static const char *const names[] = {"needles", "dust", "glints"};
enum { KINDS = 3 };

static char *write_scene(int kind, int samples) {
    uint64_t random = 3 + (uint64_t)kind;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"background\": 0, "
            "\"camera\": {\"type\": \"orthographic\", \"height\": %d, \"position\": [0, 0, 90]}, "
            "\"lights\": [{\"type\": \"directional\", \"direction\": [-0.4, -0.6, -1]}, {\"type\": "
            "\"directional\", \"direction\": [0.7, 0.1, -1]}], \"objects\": [",
            SIDE, SIDE, samples, SIDE);
    kinds[kind](w.out, &random);
    fputs("]}", w.out);
    return finish(&w);
}

/* ---- Pictures. ---- */

/* Adds the picture's first channel as the pattern sees it. */
static void add_picture(shd_engine *engine, int kind, const pattern *p, double *sum) {
    char *json = write_scene(kind, p->count);
    shd_request *request = read_scene(engine, json);
    shd_sight *sight = plan_and_see(request);
    memcpy(sight->offset_x, p->x, sizeof p->x);
    memcpy(sight->offset_y, p->y, sizeof p->y);
    shd_film film = {0};
    shd_error error = {.status = SHD_OK};
    assert_int_equal(shd_film_render(&request->rendering, sight, NULL, NULL, &film, &error),
                     SHD_OK);
    for (size_t i = 0; i < SIDE * SIDE; i++) sum[i] += (double)film.rgba[4 * i];
    shd_request_drop(request);
    free(json);
}

static double error_of(shd_engine *engine, int kind, const pattern *p, const double *truth) {
    double *seen = calloc(SIDE * SIDE, sizeof *seen), sum = 0;
    assert_non_null(seen);
    add_picture(engine, kind, p, seen);
    for (size_t i = 0; i < SIDE * SIDE; i++) sum += (seen[i] - truth[i]) * (seen[i] - truth[i]);
    free(seen);
    return sqrt(sum / (SIDE * SIDE));
}

/* 4,096 samples: a regular grid of 64 x 64, in 64 parts. */
static double *find_truth(shd_engine *engine, int kind) {
    double *sum = calloc(SIDE * SIDE, sizeof *sum);
    assert_non_null(sum);
    for (int part = 0; part < FINE; part++) {
        const pattern p = grid_pattern(FINE, part % 8 * 8, part / 8 * 8);
        add_picture(engine, kind, &p, sum);
    }
    for (size_t i = 0; i < SIDE * SIDE; i++) sum[i] /= FINE;
    return sum;
}

static void patterns_are_as_good_as_others(void **state) {
    int missed = 0;
    for (int kind = 0; kind < KINDS; kind++) {
        double *truth = find_truth(*state, kind);
        for (int count = 4; count <= 64; count = count == 16 ? 64 : 2 * count) {
            const pattern own = own_pattern(count),
                          other = count == 64 ? grid_pattern(8, 0, 0) : standard_pattern(count);
            const double got = error_of(*state, kind, &own, truth),
                         theirs = error_of(*state, kind, &other, truth);
            if (getenv("SHADED_MEASURE"))
                printf("%s, %d samples: RMS error %.5f, %s's %.5f\n", names[kind], count, got,
                       count == 64 ? "a regular grid" : "Direct3D", theirs);
            missed += got > theirs * (count < 64 ? 1 : 1.2);
        }
        free(truth);
    }
    assert_int_equal(missed, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(patterns_are_as_good_as_others),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
