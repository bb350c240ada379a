/* What a pixel's samples are: all of them in every tier, but where draft is proven to see the same,
 * so that no edge of light, however thin or however well another light hides it, is missed by a
 * bound or a budget. */
#include "property/pieces.h"
#include "render/tell/measure.h"

/* ---- Pictures and how far they are from the exact tier's. ---- */

typedef struct figures {
    double linear, code, delta_e;
    double seen; /* the bound of CIEDE2000 by the picture's own colors */
} figures;

/* `members` is a document without its braces and its accuracy. */
static figures measure(shd_engine *engine, const char *members, const char *accuracy,
                       figures *bound) {
    char *json = text_of("{%s, \"accuracy\": {%s}}", members, accuracy),
         *reference = text_of("{%s, \"accuracy\": {\"tier\": \"exact\"}}", members);
    drawn exact = shown_film_of(engine, reference), other = shown_film_of(engine, json);
    const shd_bound *told = &other.request->rendering.plan->bound;
    *bound = (figures){told->linear, told->code, told->delta_e, 0};
    const shd_difference got = measured(&exact, &other);
    drop_drawn(&exact);
    drop_drawn(&other);
    free(json);
    free(reference);
    bound->seen = got.most;
    return (figures){got.linear.max, got.code.max, got.delta_e.max, 0};
}

/* ---- Edges of light. ---- */

enum { SIDE = 96 };

/* A plane from above, a pixel a hundredth wide, and nothing but the lights. */
static void begin_floor(FILE *out, int samples) {
    fprintf(out,
            "\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"camera\": {\"type\": "
            "\"orthographic\", \"height\": %g, \"position\": [0, 5, 0], \"up\": [0, 0, -1]}, "
            "\"objects\": [{\"type\": \"plane\", \"material\": {\"diffuse\": 0.3}}], \"lights\": [",
            SIDE, SIDE, samples, SIDE / 100.0);
}

static void write_spot(FILE *out, shd_vec3 position, shd_vec3 direction, double degrees) {
    fputs("{\"type\": \"spot\", \"penumbra\": 0, ", out);
    write_vector(out, "position", position);
    fputs(", ", out);
    write_vector(out, "direction", direction);
    fprintf(out, ", \"angle\": %.17g}", degrees);
}

/* Two equal spots whose rims overlap by less than a pixel: light without a second difference, but
 * for a lens that is twice as bright. */
static void write_abutting(FILE *out, int samples, uint64_t *random) {
    begin_floor(out, samples);
    const double degrees = uniform(random, 4, 10), radius = 3 * tan(degrees * SHD_PI / 180),
                 turn = uniform(random, 0, SHD_PI),
                 apart = radius - uniform(random, 0.1, 0.9) / 200;
    for (int k = 0; k < 2; k++) {
        const double side = k ? apart : -apart;
        if (k) fputs(", ", out);
        write_spot(out, (shd_vec3){side * cos(turn), 3, side * sin(turn)}, (shd_vec3){0, -1, 0},
                   degrees);
    }
}

/* Spots along the floor: light much thinner than a pixel; or wedges between many rims. */
static void write_slivers(FILE *out, int samples, uint64_t *random) {
    begin_floor(out, samples);
    const bool thin = below(random, 2);
    const int count = thin ? 3 : 6;
    for (int k = 0; k < count; k++) {
        const double x = uniform(random, -0.4, 0.4), z = uniform(random, -0.4, 0.4);
        if (k) fputs(", ", out);
        if (thin)
            write_spot(out, (shd_vec3){x, uniform(random, 0.01, 0.05), z},
                       (shd_vec3){uniform(random, -2, 2), -0.02, uniform(random, -2, 2)},
                       uniform(random, 0.05, 2));
        else
            write_spot(out, (shd_vec3){x, 3, z}, (shd_vec3){0, -1, 0}, uniform(random, 2, 9));
    }
}

/* Few pixels, and a highlight with a cliff at R.V = 0. */
static void write_coarse(FILE *out, int samples, uint64_t *random) {
    const int side = 12 + below(random, 24);
    fprintf(out,
            "\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"objects\": [{\"type\": "
            "\"sphere\", \"material\": {\"diffuse\": 0.2, \"specular\": 0.7, \"shininess\": %g}}], "
            "\"lights\": [{\"type\": \"directional\", ",
            side, side, samples, uniform(random, 0.55, 2));
    write_vector(out, "direction", random_direction(random));
    fputs("}", out);
}

static void budgets_hold_on_edges_of_light(void **state) {
    static void (*const kinds[])(FILE *, int, uint64_t *) = {write_abutting, write_slivers,
                                                             write_coarse};
    static const char *const budgets[] = {"\"maxError\": 1, \"metric\": \"code\"",
                                          "\"maxError\": 0.5, \"metric\": \"deltaE2000\"",
                                          "\"maxError\": 0.01, \"metric\": \"linear\"",
                                          "\"tier\": \"standard\"", "\"tier\": \"draft\""};
    static const int patterns[] = {1, 2, 4, 8, 9, 16};
    uint64_t random = 5;
    for (int i = 0; i < 60; i++) {
        writing w;
        start(&w);
        kinds[i % 3](w.out, patterns[i / 3 % 6], &random);
        fputs("]", w.out);
        char *members = finish(&w);
        for (int k = 0; k < 5; k++) {
            figures bound, got = measure(*state, members, budgets[k], &bound);
            if (!(got.linear <= bound.linear && got.code <= bound.code &&
                  got.delta_e <= bound.seen && bound.seen <= bound.delta_e))
                fail_msg("%s: off by %g, %g codes, %g deltaE2000, not %g, %g, %g: %s", budgets[k],
                         got.linear, got.code, got.delta_e, bound.linear, bound.code, bound.seen,
                         members);
            if ((k == 0 && got.code > 1) || (k == 1 && got.delta_e > 0.5) ||
                (k == 2 && got.linear > 0.01))
                fail_msg("%s is missed: %s", budgets[k], members);
        }
        free(members);
    }
}

/* ---- Bounds of pictures with four samples a pixel. ---- */

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void bounds_at_four_samples_are_near_what_is_measured(void **state) {
    enum { MOST = 256 };
    double linear[MOST], delta_e[MOST], seen[MOST];
    const shd_library *library = shd_engine_library(*state);
    size_t count = 0;
    for (size_t k = 0; k < shd_preset_count(library); k++) {
        const shd_preset *preset = shd_preset_at(library, k);
        if (preset->model != SHD_MODEL_PHONG) continue; /* the exact tier has all others */
        const size_t i = count++;
        assert_true(i < MOST);
        char *members = text_of(
            "\"image\": {\"width\": 256, \"height\": 256, \"samples\": 4}, \"ambient\": 0.1, "
            "\"lights\": [{\"type\": \"point\", \"position\": [3, 3, 3]}], \"objects\": "
            "[{\"type\": \"sphere\", \"material\": {\"preset\": \"%s\"}}]",
            preset->name);
        figures bound, got = measure(*state, members, "\"tier\": \"standard\"", &bound);
        assert_true(got.linear <= bound.linear && got.delta_e <= bound.delta_e);
        linear[i] = bound.linear / got.linear;
        delta_e[i] = bound.delta_e / got.delta_e;
        assert_true(got.delta_e <= bound.seen && bound.seen <= bound.delta_e);
        seen[i] = bound.seen / got.delta_e;
        free(members);
    }
    assert_true(count >= 24);
    qsort(linear, count, sizeof *linear, compare_doubles);
    qsort(delta_e, count, sizeof *delta_e, compare_doubles);
    qsort(seen, count, sizeof *seen, compare_doubles);
    print_message("bound over measured at 4 samples, of %zu: median %.3g linear, %.3g deltaE2000, "
                  "%.3g by the picture's own colors\n",
                  count, linear[count / 2], delta_e[count / 2], seen[count / 2]);
    assert_true(linear[count / 2] <= 20);
    assert_true(seen[count / 2] <= 20);
    assert_true(delta_e[count / 2] <= 60);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(budgets_hold_on_edges_of_light),
        cmocka_unit_test(bounds_at_four_samples_are_near_what_is_measured),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
