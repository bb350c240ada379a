/* Highlights of surfaces that bend within a pixel (`specularAntialiasing`): nearer to what many
 * rays see, as bright together, and nothing where nothing bends. */
#include "property/pieces.h"
#include "render/tiles/seen_by.h"
#include "scene/read.h"
#include "shade/bend.h"

enum { MODELS = 4 };

static char *material_of(size_t model, const char *sharp, const char *members) {
    char *lobe = model == 0   ? text_of("\"specular\": 0.6, \"shininess\": %s", sharp)
                 : model == 1 ? text_of("\"model\": \"blinn-phong\", \"specular\": 0.6, "
                                        "\"shininess\": %s",
                                        sharp)
                 : model == 2 ? text_of("\"model\": \"phong-normalized\", \"specular\": 0.6, "
                                        "\"shininess\": %s",
                                        sharp)
                              : text_of("\"model\": \"cook-torrance\", \"lobes\": "
                                        "[{\"roughness\": %s}]",
                                        sharp);
    char *out = text_of("{\"diffuse\": 0, \"ambient\": 0, %s%s}", lobe, members);
    free(lobe);
    return out;
}

#define SMOOTH ", \"specularAntialiasing\": true"

/* ---- Small glossy balls. ---- */

enum { SIDE = 16, FINE = 16 };

#define LAMP                                                                                       \
    "\"accuracy\": {\"tier\": \"exact\"}, \"lights\": [{\"type\": \"directional\", "               \
    "\"direction\": "                                                                              \
    "[-0.5, -0.6, -1]}]"
#define SKY "\"lights\": [{\"type\": \"environment\", \"map\": \"sky\"}]"

/* `"type": ...`: a ball, or a mesh with its normals, of `MESHED` slices. */
enum { MESHED = 12 };
static char *shape_of(bool meshed) {
    if (!meshed) return text_of("%s", "\"type\": \"sphere\"");
    writing w;
    start(&w);
    for (int part = 0; part < 2; part++) {
        fprintf(w.out, part ? "], \"normals\": [" : "\"type\": \"mesh\", \"positions\": [");
        for (int j = 0; j <= MESHED; j++)
            for (int i = 0; i < MESHED; i++) {
                const double down = SHD_PI * j / MESHED, turn = 2 * SHD_PI * i / MESHED;
                fprintf(w.out, "%s%.17g, %.17g, %.17g", i || j ? ", " : "", sin(down) * sin(turn),
                        cos(down), sin(down) * cos(turn));
            }
    }
    const char *comma = "], \"indices\": [";
    for (int j = 0; j < MESHED; j++)
        for (int i = 0; i < MESHED; i++) {
            const int a = j * MESHED + i, b = j * MESHED + (i + 1) % MESHED;
            if (j > 0) fprintf(w.out, "%s%d, %d, %d", comma, a, b + MESHED, b), comma = ", ";
            if (j < MESHED - 1)
                fprintf(w.out, "%s%d, %d, %d", comma, a, a + MESHED, b + MESHED), comma = ", ";
        }
    fputs("]", w.out);
    return finish(&w);
}

/* What shines, and how. */
typedef struct glint {
    const char *light;
    size_t model;
    const char *sharp;
    double radii[2]; /* in pixels */
    bool meshed;
    int samples;
} glint;

/* A ball some pixels wide, at a place that no pixel's grid knows. */
static char *ball(const glint *g, const char *members, double radius, const double at[2], int times,
                  int samples) {
    char *material = material_of(g->model, g->sharp, members), *shape = shape_of(g->meshed);
    char *out = text_of(
        "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, "
        "\"camera\": {\"type\": \"orthographic\", \"height\": %d, \"position\": [0, 0, "
        "50]}, %s, "
        "\"objects\": [{%s, \"transform\": {\"scale\": %.17g, \"translate\": "
        "[%.17g, %.17g, 0]}, \"material\": %s}]}",
        SIDE * times, SIDE * times, samples, SIDE, g->light, shape, radius, at[0], at[1], material);
    free(material);
    free(shape);
    return out;
}

/* The picture's first channel, in means of times x times pixels. */
static void draw_means(shd_engine *engine, char *text, int times, double out[SIDE][SIDE]) {
    drawn d = shown_film_of(engine, text);
    memset(out, 0, sizeof(double[SIDE][SIDE]));
    for (int y = 0; y < SIDE * times; y++)
        for (int x = 0; x < SIDE * times; x++)
            out[y / times][x / times] +=
                (double)d.film.rgba[4 * (y * SIDE * times + x)] / (times * times);
    drop_drawn(&d);
    free(text);
}

typedef struct error {
    double square, sum, wanted;
} error;

static void add_error(double seen[SIDE][SIDE], double wanted[SIDE][SIDE], error *e) {
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double off = seen[y][x] - wanted[y][x];
            e->square += off * off;
            e->sum += seen[y][x];
            e->wanted += wanted[y][x];
        }
}

/* `count` balls without and with it, against `fine` by `fine` rays a pixel. */
static void compare_balls(shd_engine *engine, const glint *g, int count, int fine, error e[2]) {
    uint64_t random = 7;
    e[0] = e[1] = (error){0};
    for (int k = 0; k < count; k++) {
        const double at[2] = {uniform(&random, -1, 1), uniform(&random, -1, 1)},
                     radius = uniform(&random, g->radii[0], g->radii[1]);
        double many[SIDE][SIDE], seen[SIDE][SIDE];
        draw_means(engine, ball(g, "", radius, at, fine, 1), fine, many);
        draw_means(engine, ball(g, "", radius, at, 1, g->samples), 1, seen);
        add_error(seen, many, &e[0]);
        draw_means(engine, ball(g, SMOOTH, radius, at, 1, g->samples), 1, seen);
        add_error(seen, many, &e[1]);
    }
    if (getenv("SHADED_MEASURE"))
        printf("%s, %s, model %zu, %s, radii %g to %g, %d samples: error %.3g was %.3g, light %.3f "
               "was %.3f\n",
               strstr(g->light, "sky") ? "sky" : "lamp", g->meshed ? "mesh" : "ball", g->model,
               g->sharp, g->radii[0], g->radii[1], g->samples, sqrt(e[1].square), sqrt(e[0].square),
               e[1].sum / e[1].wanted, e[0].sum / e[0].wanted);
}

static const char *const usual[MODELS] = {"1500", "500", "1500", "0.04"};
static const int few[] = {1, 4};

static void small_highlights_come_nearer(void **state) {
    for (size_t m = 0; m < MODELS; m++)
        for (size_t s = 0; s < SHD_LENGTH(few); s++) {
            const glint g = {LAMP, m, usual[m], {1.5, 6}, false, few[s]};
            error e[2];
            compare_balls(*state, &g, 24, FINE, e);
            assert_below(e[1].square, 0.5 * e[0].square);
            assert_below(fabs(e[1].sum / e[1].wanted - 1), 0.15);
        }
}

/* The same of what the sky's sun makes. */
static void small_highlights_of_the_sky_come_nearer(void **state) {
    const bool measures = getenv("SHADED_MEASURE");
    for (size_t m = 0; m < MODELS; m++)
        for (size_t s = 0; s < (measures ? SHD_LENGTH(few) : 1); s++) {
            const glint g = {SKY, m, usual[m], {1.5, 6}, false, few[s]};
            error e[2];
            compare_balls(*state, &g, measures ? 6 : 3, measures ? 8 : 4, e);
            assert_below(e[1].square, 0.5 * e[0].square);
            assert_below(fabs(e[1].sum / e[1].wanted - 1), 0.2);
        }
}

/* Balls and meshes of two pixels, and exponents of 10,000: of which some 4 rays of 4,096 meet the
 * highlight. */
static void sparks_come_nearer(void **state) {
    static const char *const sharp[MODELS] = {"10000", "10000", "10000", "0.014"};
    const bool measures = getenv("SHADED_MEASURE");
    for (size_t k = 0; k < (measures ? 4 * MODELS : 2); k++) {
        const size_t m = k % MODELS;
        const bool meshed = measures ? k / MODELS % 2 : k % 2;
        const glint shown = {LAMP, m, sharp[m], {1, 1}, meshed, k < 2 * MODELS ? 1 : 4};
        error e[2];
        compare_balls(*state, &shown, measures ? 8 : 4, measures ? 64 : 32, e);
        if (!measures) assert_below(e[1].square, e[0].square);
    }
}

/* ---- What stays. ---- */

static const char bodies[] =
    "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 4%s}, \"accuracy\": {\"tier\": "
    "\"%s\"}, \"camera\": {\"position\": [1, 2, 5]}, \"lights\": [{\"type\": \"point\", "
    "\"position\": [2, 3, 4]}, {\"type\": \"directional\", \"direction\": [-1, -1, -0.4]}], "
    "\"materials\": {\"a\": %s, \"b\": %s}, \"objects\": [{\"type\": \"plane\", \"material\": "
    "\"a\", \"transform\": {\"translate\": [0, -1, 0]}}, {\"type\": \"box\", \"material\": \"a\", "
    "\"transform\": {\"rotate\": [20, 30, 0]}}, {\"type\": \"disc\", \"material\": \"a\", "
    "\"transform\": {\"rotate\": [70, 0, 0], \"translate\": [-1.5, 0, 0]}}, {\"type\": \"mesh\", "
    "\"positions\": [1, 0, 0, 2, 0, 0.4, 1.5, 1, 0], \"indices\": [0, 1, 2], \"material\": "
    "\"a\"}%s]}";

#define TORUS                                                                                      \
    ", {\"type\": \"torus\", \"radius\": 0.4, \"tube\": 0.15, \"material\": \"b\", "               \
    "\"transform\": "                                                                              \
    "{\"translate\": [-0.5, 1.2, 0.5], \"rotate\": [40, 0, 10]}}"

static char *flat_text(size_t model, const char *tier, const char *members, const char *of_torus,
                       const char *more) {
    const char *sharp = model == 3 ? "0.1" : "200";
    char *a = material_of(model, sharp, members), *b = material_of(model, sharp, of_torus),
         *out = text_of(bodies, "", tier, a, b, more);
    free(a);
    free(b);
    return out;
}

static void flat_surfaces_stay(void **state) {
    static const char *const tiers[] = {"standard", "exact"};
    for (size_t m = 0; m < MODELS; m++)
        for (size_t t = 0; t < SHD_LENGTH(tiers); t++) {
            char *with = flat_text(m, tiers[t], SMOOTH, "", ""),
                 *without = flat_text(m, tiers[t], "", "", "");
            drawn a = film_of(*state, with), b = film_of(*state, without);
            assert_true(film_difference(&a, &b) == 0);
            assert_false(a.request->rendering.plan->antialiased);
            drop_drawn(&a);
            drop_drawn(&b);
            free(with);
            free(without);
        }
}

/* Beside something that bends, lobes of flat surfaces are read point by point: the same bits. */
static void flat_surfaces_stay_beside_others(void **state) {
    for (size_t m = 0; m < MODELS; m++) {
        if (m == 2) continue; /* by the reference there, which rounds otherwise */
        char *with = flat_text(m, "exact", SMOOTH, SMOOTH, TORUS),
             *without = flat_text(m, "exact", "", SMOOTH, TORUS);
        drawn a = film_of(*state, with), b = film_of(*state, without);
        assert_true(a.request->rendering.plan->antialiased);
        assert_true(film_difference(&a, &b) == 0);
        drop_drawn(&a);
        drop_drawn(&b);
        free(with);
        free(without);
    }
}

/* ---- How normals turn. ---- */

static const char close_up[] =
    "{\"image\": {\"width\": 9, \"height\": 9, \"samples\": 1}, \"accuracy\": {\"tier\": "
    "\"exact\"}, \"camera\": {%s\"position\": [0.3, 0.8, 4], \"target\": [0.1, 0.35, 0], "
    "\"up\": [0.2, 1, 0.1]}, \"objects\": [{%s, \"transform\": {\"matrix\": [1.2, 0.3, 0, 0, "
    "-0.1, 0.9, 0.2, 0, 0.1, 0.1, -0.8, 0, 0, 0, 0, 1]}}]}";

static shd_vec3 vector_of(double *const v[3], size_t i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

/* The weights of a mesh of one triangle at a point. */
static void weigh_corners(const shd_object *object, shd_charted_point *point) {
    shd_vec3 corner[3];
    double weights[2];
    for (size_t k = 0; k < 3; k++)
        corner[k] = shd_transform(&object->transform, shd_vec3_at(object->mesh->positions, k));
    const shd_vec3 side[2] = {shd_sub(corner[1], corner[0]), shd_sub(corner[2], corner[0])};
    shd_step_weights(side, shd_sub(point->position, corner[0]), weights);
    point->b = weights[0];
    point->c = weights[1];
}

/* Against differences of the normals that neighboring pixels see. */
static void normals_turn_as_told(void **state) {
    enum { SEEN = 9, MIDDLE = 4 * SEEN + 4 };
    static const char *const shapes[] = {"\"type\": \"sphere\"",
                                         "\"type\": \"cylinder\", \"height\": 3",
                                         "\"type\": \"cone\", \"radius\": 1.5, \"height\": 2",
                                         "\"type\": \"torus\", \"radius\": 0.7, \"tube\": 0.45",
                                         "\"type\": \"mesh\", \"positions\": [-3, -2, 0.4, 3, -2, "
                                         "0, 0, 4, -0.7], \"indices\": [0, 1, "
                                         "2], \"normals\": [-1, 0, 1, 1, 0.2, 2, 0, 1, -0.2]"};
    for (size_t k = 0; k < SHD_LENGTH(shapes); k++)
        for (int perspective = 0; perspective < 2; perspective++) {
            char *text = text_of(close_up,
                                 perspective ? "\"fov\": 0.5, "
                                             : "\"type\": \"orthographic\", \"height\": 0.03, ",
                                 shapes[k]);
            sampled d = samples_of(*state, text);
            const shd_scene *scene = d.request->rendering.plan->scene;
            const shd_object *object = &scene->objects[0];
            const shd_chart chart = shd_chart_of(object);
            const shd_image_plane plane = shd_image_plane_of(scene);
            shd_charted_point point = {.position = vector_of(d.seen.position, MIDDLE),
                                       .normal = vector_of(d.seen.normal, MIDDLE)};
            assert_int_equal(d.seen.object[MIDDLE], 0);
            if (object->mesh) weigh_corners(object, &point);
            const shd_seen_by ray = shd_see_point(&plane, point.position, 0);
            shd_vec3 bend[2];
            assert_true(shd_bend_at(&chart, &point, &ray, bend));
            for (size_t axis = 0; axis < 2; axis++) {
                const size_t step = axis ? SEEN : 1;
                const shd_vec3 wanted = shd_scale(shd_sub(vector_of(d.seen.normal, MIDDLE + step),
                                                          vector_of(d.seen.normal, MIDDLE - step)),
                                                  0.5);
                assert_below(1e-5, shd_length(wanted));
                assert_below(shd_length(shd_sub(wanted, bend[axis])), 1e-3 * shd_length(wanted));
            }
            drop_sampled(&d);
            free(text);
        }
}

/* ---- Bounds. ---- */

static const char turned[] =
    "{\"image\": {\"width\": 48, \"height\": 32, \"samples\": 1}, \"accuracy\": {\"tier\": "
    "\"exact\"}, \"camera\": {\"position\": [%.17g, %g, %.17g], \"fov\": %g}, \"lights\": "
    "[{\"type\": \"%s\", %s: [%.17g, %g, %.17g]}], \"objects\": [%s]}";

static void add_object(FILE *out, const char *shape, const char *material, double x, double z,
                       double angle) {
    fprintf(out,
            "{\"type\": \"%s\", \"material\": %s, \"transform\": {\"rotate\": [0, %.17g, 0], "
            "\"translate\": [%.17g, 0, %.17g], \"scale\": 0.8}}, ",
            shape, material, angle * 180 / SHD_PI, x, z);
}

/* The same scene turned around the vertical axis is the same picture, within the bounds of both. */
static void bounds_hold_for_turned_scenes(void **state) {
    static const char *const shapes[] = {"sphere", "cylinder", "cone", "torus", "teapot"};
    for (size_t m = 0; m < MODELS; m++)
        for (int k = 0; k < 2; k++) {
            char *material = material_of(m, m == 3 ? "0.05" : k ? "1000" : "60", SMOOTH);
            drawn d[2];
            for (int turn = 0; turn < 2; turn++) {
                const double angle = turn * 2.1, c = cos(angle), s = sin(angle);
                writing w;
                start(&w);
                for (size_t i = 0; i < SHD_LENGTH(shapes); i++) {
                    const double x = 1.6 * ((double)i - 2), z = -0.4 * (double)i;
                    add_object(w.out, shapes[i], material, c * x + s * z, c * z - s * x, angle);
                }
                fputs("{\"type\": \"plane\", \"material\": {\"diffuse\": [0.1, 0.2, 0]}, "
                      "\"transform\": "
                      "{\"translate\": [0, -3, 0]}}",
                      w.out);
                char *objects = finish(&w);
                const double far = k ? 30 : 1, ex = 0.5 * far, ez = 6 * far, lx = k ? 1 : -0.6,
                             lz = k ? 4 : -0.7;
                char *text =
                    text_of(turned, c * ex + s * ez, far, c * ez - s * ex, 50 / far,
                            k ? "point" : "directional", k ? "\"position\"" : "\"direction\"",
                            c * lx + s * lz, k ? 3 : -0.5, c * lz - s * lx, objects);
                d[turn] = film_of(*state, text);
                free(objects);
                free(text);
            }
            const double a = d[0].request->rendering.plan->bound.linear,
                         b = d[1].request->rendering.plan->bound.linear;
            double most = 0, brightest = 0;
            for (size_t i = 0; i < pixels_of(&d[0]); i++) {
                const double one = (double)d[0].film.rgba[4 * i],
                             other = (double)d[1].film.rgba[4 * i];
                most = fmax(most, fabs(one - other));
                if ((double)d[0].film.rgba[4 * i + 1] == one) brightest = fmax(brightest, one);
            }
            assert_true(isfinite(a + b) && brightest > 0.02);
            assert_below(a, 1);
            assert_below(most, a + b);
            drop_drawn(&d[0]);
            drop_drawn(&d[1]);
            free(material);
        }
}

/* ---- Parts. ---- */

static void regions_are_crops(void **state) {
    char *material = material_of(0, "3000", SMOOTH),
         *whole = text_of(bodies, "", "standard", material, material, TORUS),
         *part = text_of(bodies, ", \"region\": [13, 7, 31, 22]", "standard", material, material,
                         TORUS);
    drawn a = film_of(*state, whole), b = film_of(*state, part);
    for (size_t y = 0; y < 22; y++)
        assert_memory_equal(a.film.rgba + 4 * ((y + 7) * 64 + 13), b.film.rgba + 4 * y * 31,
                            4 * 31 * sizeof *a.film.rgba);
    drop_drawn(&a);
    drop_drawn(&b);
    free(material);
    free(whole);
    free(part);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_highlights_come_nearer),
        cmocka_unit_test(flat_surfaces_stay),
        cmocka_unit_test(small_highlights_of_the_sky_come_nearer),
        cmocka_unit_test(sparks_come_nearer),
        cmocka_unit_test(flat_surfaces_stay_beside_others),
        cmocka_unit_test(normals_turn_as_told),
        cmocka_unit_test(bounds_hold_for_turned_scenes),
        cmocka_unit_test(regions_are_crops),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
