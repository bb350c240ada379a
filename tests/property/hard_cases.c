/* The hard cases of docs/model.md, of each model under each light: a few samples of a small scene
 * for each of them, in the exact tier, against the evaluation of the model that tests/attack has,
 * which shares no code with src/. They are held to the bound that is told, and to the estimate
 * where that is less. What its splines make of Westin's table is told to that evaluation here. */
#include "attack/model.h"
#include "base/clock.h"
#include "bound/light/extended.h"
#include "property/film_of.h"
#include "shade/westin.h"

/* Lights from POINTS on have a shape. */
enum { LIGHTS = 6, POINTS = 3, MODELS = 6, WESTIN = 5 };

/* `from`, and `along` the way that it shines. Further members: of spots (NULL: as usual), of points
 * and spots, of shapes. */
typedef struct shining {
    const char *from, *along;
    double size;
    const char *spot, *point, *shape;
} shining;

static void write_light(FILE *out, int which, const shining *s) {
    static const char *const types[LIGHTS] = {"point", "directional", "spot",
                                              "rect",  "disc",        "sphere"};
    const double size = s->size;
    fprintf(out, "\"type\": \"%s\"", types[which]);
    if (which != 1) fprintf(out, ", \"position\": %s", s->from);
    if (which > 0 && which < 5) fprintf(out, ", \"direction\": %s", s->along);
    if (which == 2) fputs(s->spot ? s->spot : ", \"angle\": 70, \"exponent\": 2", out);
    if (which % 2 == 0 && which < POINTS && s->point) fputs(s->point, out);
    if (which >= POINTS && s->shape) fputs(s->shape, out);
    if (which == 3)
        fprintf(out, ", \"size\": [%.17g, %.17g], \"up\": [0.1, 1, 0.3]", size, size / 2);
    if (which > 3) fprintf(out, ", \"radius\": %.17g", size / 2);
}

/* How sharp lobes are: Phong's exponents, roughnesses, and Oren and Nayar's sigma in degrees. */
typedef struct end {
    double shininess, roughness, sigma;
} end;

static void write_model(FILE *out, int which, const end *e) {
    static const char *const models[MODELS] = {"phong",      "blinn-phong",   "phong-normalized",
                                               "oren-nayar", "cook-torrance", "westin"};
    fprintf(out, "\"model\": \"%s\"", models[which]);
    if (which < 3) fprintf(out, ", \"specular\": 0.5, \"shininess\": %.17g", e->shininess);
    if (which == 3) fprintf(out, ", \"sigma\": %.17g", e->sigma);
    if (which == 4)
        fprintf(out, ", \"fresnel\": {\"f0\": 0.5}, \"lobes\": [{\"roughness\": %.17g}]",
                e->roughness);
    if (which == WESTIN) fputs(", \"microgeometry\": {\"type\": \"grooves\"}", out);
}

static const end USUAL = {20, 0.3, 25}, SHARP = {1e6, 1e-4, 0}, SHARPER = {1e6, 0.01, 0},
                 DULL = {0, 1, 90}, DULLER = {0.3, 10, 60};

typedef struct hard_case {
    const char *name, *object, *camera, *from, *along;
    double size; /* of the light */
    const end *end;
    const char *diffuse;
    const char *material, *more;      /* further members, of the material and of the document */
    const char *spot, *point, *shape; /* and of lights */
    int count;                        /* of the same light; 0: one */
} hard_case;

#define FLOOR "\"type\": \"disc\", \"radius\": 3"
#define BALL  "\"type\": \"sphere\""
#define ABOVE "\"position\": [0.3, 2, 2.5]"
#define LEVEL                                                                                      \
    "\"type\": \"orthographic\", \"height\": 1e-4, \"position\": [0, 6e-4, 2], \"target\": [0, "   \
    "0, 0]"
#define LEVELER                                                                                    \
    "\"type\": \"orthographic\", \"height\": 1e-8, \"position\": [0, 1e-6, 2], \"target\": [0, "   \
    "0, 0]"
#define BESIDE "\"position\": [0.2, 0.4, 3]"
#define LAMP   "[1, 2, 0.7]", "[-1, -2, -0.7]"
#define GREY   "[0.7, 0.4, 0.2]"

/* A triangle whose corners' normals lean so far that N.V is negative in a part of it. */
#define AWAY                                                                                       \
    "\"type\": \"mesh\", \"positions\": [-2, -2, 0, 2, -2, 0, 0, 2, 0], \"indices\": [0, 1, 2], "  \
    "\"normals\": [-1, 0, -0.5, 0, 0, 1, -1, 0.2, 0.1]"

static const hard_case cases[] = {
    {"as usual", FLOOR, ABOVE, LAMP, 1, &USUAL, GREY, "", .more = ""},
    {"grazing view", FLOOR, LEVEL, LAMP, 1, &USUAL, GREY, "", .more = ""},
    {"grazing view, sharp", FLOOR, LEVEL, LAMP, 1, &SHARPER, GREY, "", .more = ""},
    {"grazing light", FLOOR, ABOVE, "[2, 1e-5, 0]", "[-1, -5e-6, 0]", 1, &USUAL, GREY, "",
     .more = ""},
    {"both grazing", FLOOR, LEVEL, "[0, 1e-5, -2]", "[0, -5e-6, 1]", 0.5, &USUAL, GREY, "",
     .more = ""},
    {"silhouettes", BALL, BESIDE, LAMP, 1, &USUAL, GREY, "", .more = ""},
    {"no roughness", FLOOR, ABOVE, "[0.3, 2, -2.5]", "[-0.3, -2, 2.5]", 1, &SHARP, GREY, "",
     .more = ""},
    {"hardly rough", FLOOR, ABOVE, "[0.3, 2, -2.5]", "[-0.3, -2, 2.5]", 1, &SHARPER, GREY, "",
     .more = ""},
    {"roughness 1, exponent 0", FLOOR, ABOVE, LAMP, 1, &DULL, GREY, "", .more = ""},
    {"roughness 10, exponent 0.3", BALL, BESIDE, LAMP, 2, &DULLER, GREY, "", .more = ""},
    {"L = V", FLOOR, ABOVE, "[0.3, 2, 2.5]", "[-0.3, -2, -2.5]", 0.5, &USUAL, GREY, "", .more = ""},
    {"L = V, upright and sharp", FLOOR, "\"position\": [0, 2, 0], \"up\": [0, 0, 1]", "[0, 2, 0]",
     "[0, -1, 0]", 0.5, &SHARPER, GREY, "", .more = ""},
    {"below the horizon", FLOOR, ABOVE, "[0, -1, 0]", "[0, 1, 0]", 1, &USUAL, GREY, "", .more = ""},
    {"exponent 0 below the horizon", BALL, BESIDE, "[0, -1.3, -2]", "[0, 1, 2]", 1, &DULL, GREY, "",
     .more = ""},
    {"cuts the surface", FLOOR, ABOVE, "[0.5, 0, -0.5]", "[-1, 0, 1]", 1, &USUAL, GREY, "",
     .more = ""},
    {"cuts the surface, exponent 0", FLOOR, ABOVE, "[0.5, 0, -0.5]", "[-1, 0, 1]", 1, &DULL, GREY,
     "", .more = ""},
    {"touches the surface", FLOOR, ABOVE, "[0.1, 0.5, 0.2]", "[0.1, 0, -1]", 1, &USUAL, GREY, "",
     .more = ""},
    {"lies on the surface", FLOOR, ABOVE, "[0.1, 1e-9, 0.2]", "[0, -1, 0]", 1, &USUAL, GREY, "",
     .more = ""},
    {"inside of the object, seen from outside", BALL, BESIDE, "[0.1, 0.2, 0]", "[1, -1, 0]", 0.5,
     &USUAL, GREY, "", .more = ""},
    {"eye and light inside", BALL, "\"position\": [0.1, 0.2, 0.5], \"fov\": 90", "[0.3, 0.2, 0]",
     "[-1, -1, -2]", 0.5, &USUAL, GREY, "", .more = ""},
    {"eye inside, light outside", BALL, "\"position\": [0.1, 0.2, 0.5]", LAMP, 1, &USUAL, GREY, "",
     .more = ""},
    {"eye inside, light through the object", BALL, "\"position\": [0.1, 0.2, 0.5], \"fov\": 90",
     "[0, 0.2, -0.9]", "[0, 0, 1]", 0.7, &SHARPER, GREY, "", .more = ""},
    {"seen from behind, one-sided", FLOOR, "\"position\": [0.3, -2, 2.5]", LAMP, 1, &USUAL, GREY,
     ", \"side\": \"front\"", .more = ""},
    {"one sample of a spectrum", BALL, BESIDE, LAMP, 1, &USUAL,
     "{\"wavelengths\": [560], \"values\": [0.6]}", "", .more = ", \"spectral\": true"},
    {"the fewest channels", FLOOR, ABOVE, LAMP, 1, &SHARPER,
     "{\"wavelengths\": [380], \"values\": [0.6]}", "",
     .more = ", \"spectral\": {\"channels\": 16}"},
    {"a point of a light", FLOOR, ABOVE, LAMP, 1e-7, &USUAL, GREY, "", .more = ""},
    {"a light as wide as the sky", FLOOR, ABOVE, "[0, 5, 0]", "[0, -1, 0]", 9, &DULL, GREY, "",
     .more = ""},
    {"flattened to a tenth", BALL ", \"transform\": {\"scale\": [1, 1, 0.1]}", BESIDE, LAMP, 1,
     &USUAL, GREY, "", .more = ""},
    {"1e5 radii away", BALL, "\"position\": [0, 0, 1e5], \"fov\": 1e-3", LAMP, 1, &USUAL, GREY, "",
     .more = ""},
    {"1e20 large", "\"type\": \"disc\", \"radius\": 3e20", "\"position\": [0.3e20, 2e20, 2.5e20]",
     "[1e20, 2e20, 0.7e20]", "[-1, -2, -0.7]", 1e20, &USUAL, GREY, "", "",
     .shape = ", \"intensity\": 1e40"},
    {"1e-15 large", "\"type\": \"disc\", \"radius\": 3e-15",
     "\"position\": [0.3e-15, 2e-15, 2.5e-15]", "[1e-15, 2e-15, 0.7e-15]", "[-1, -2, -0.7]", 1e-15,
     &USUAL, GREY, "", "", .shape = ", \"intensity\": 1e-30"},
    {"directions of 1e25", FLOOR, ABOVE ", \"up\": [0, 3e25, 0]", "[1, 2, 0.7]",
     "[-1e25, -2e25, -0.7e25]", 1, &USUAL, GREY, "", .more = ""},
    {"directions of 1e-25", FLOOR, ABOVE ", \"up\": [0, 1e-25, 0]", "[1, 2, 0.7]",
     "[-1e-25, -2e-25, -0.7e-25]", 1, &USUAL, GREY, "", .more = ""},
    {"1e-9 before a point", FLOOR,
     "\"type\": \"orthographic\", \"height\": 2, \"position\": [0, 2, 0], \"up\": [0, 0, 1]",
     "[0.5, 1e-9, 0.5]", "[0, -1, 0]", 1e-9, &USUAL, GREY, "", "",
     .point = ", \"attenuation\": [0, 0, 1]"},
    {"a cone of 0.01 degrees", FLOOR, ABOVE ", \"fov\": 0.014", LAMP, 1, &USUAL, GREY, "", "",
     .spot = ", \"angle\": 0.01"},
    {"a cone with a hard edge", FLOOR, ABOVE, LAMP, 1, &USUAL, GREY, "", "",
     .spot = ", \"angle\": 14, \"penumbra\": 0"},
    {"a hundred lights", BALL, BESIDE, LAMP, 1, &USUAL, GREY, "", "", .count = 100},
    {"normals away from the eye", AWAY, "\"position\": [0, 0, 3], \"fov\": 20", "[-1, 0.3, -3]",
     "[1, 0, 3]", 1, &USUAL, GREY, "", .more = ""},
    {"opposite the eye, along the surface", FLOOR, LEVEL, "[0, 6e-4, -2]", "[0, -3e-4, 1]", 1e-4,
     &USUAL, GREY, "", .more = ""},
    {"opposite the eye, 1e-6 above", FLOOR, LEVELER, "[0, 1e-6, -2]", "[0, -5e-7, 1]", 1e-7, &USUAL,
     GREY, "", .more = ""},
    {"1e-6 above", FLOOR, LEVELER, LAMP, 1, &USUAL, GREY, "", .more = ""},
};

/* One cell of the table. */
static char *write_cell(const hard_case *h, int kind, int light) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 2, \"height\": 2, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"exact\"}, \"background\": 0.1, \"camera\": {%s}, \"lights\": [{",
            h->camera);
    for (int i = 0; i == 0 || (i < h->count && light < POINTS); i++) {
        if (i) fputs("}, {", w.out);
        write_light(w.out, light,
                    &(shining){h->from, h->along, h->size, h->spot, h->point, h->shape});
    }
    fprintf(w.out, "}], \"objects\": [{%s, \"material\": {", h->object);
    write_model(w.out, kind, h->end);
    fprintf(w.out, ", \"diffuse\": %s%s}}]%s}", h->diffuse, h->material, h->more);
    return finish(&w);
}

/* ---- Westin. ---- */

/* The quadratic B-spline that is 3/4 at 0. */
static long double spline(long double x) {
    x = fabsl(x);
    return x < 0.5L ? 0.75L - x * x : x < 1.5L ? (1.5L - x) * (1.5L - x) / 2 : 0;
}

/* A pair of nodes, of rises and turns that may be beyond their ends: a rise before the first is
 * across the normal, one after the last is the last. Views of the other three quarters have both
 * turns mirrored into the first. */
static const float *node(const shd_westin *t, const int view[2], const int light[2]) {
    enum { TURNS = SHD_WESTIN_TURNS, RISES = SHD_WESTIN_RISES };
    int way[2][2] = {{view[0], view[1]}, {light[0], light[1]}};
    for (int k = 0; k < 2; k++) {
        if (way[k][0] < 0) {
            way[k][0] = -1 - way[k][0];
            way[k][1] += TURNS / 2;
        }
        if (way[k][0] >= RISES) way[k][0] = RISES - 1;
        way[k][1] = (way[k][1] % TURNS + TURNS) % TURNS;
    }
    if (way[0][1] >= TURNS / 2) /* about the tangent */
        for (int k = 0; k < 2; k++) way[k][1] = TURNS - 1 - way[k][1];
    if (way[0][1] >= TURNS / 4) /* across it */
        for (int k = 0; k < 2; k++) way[k][1] = ((3 * TURNS / 2 - 1) - way[k][1]) % TURNS;
    return t->rho[way[0][0] * (TURNS / 4) + way[0][1]][way[1][0] * TURNS + way[1][1]];
}

typedef struct shone {
    long double nvl[3][3], bounces[SHD_WESTIN_BOUNCES];
} shone;

/* The tangent: around the y axis on round shapes, or the x axis where that is the normal; on others
 * the x axis, laid onto the surface. */
static void lay_tangent(const long double n[3], bool round, long double t[3]) {
    const long double side = round ? hypotl(n[0], n[2]) : sqrtl(1 - n[0] * n[0]);
    t[0] = round ? n[2] / side : side;
    t[1] = round ? 0 : -n[0] * n[1] / side;
    t[2] = round ? -n[0] / side : -n[0] * n[2] / side;
    if (side > 1e-9L) return;
    t[0] = 1;
    t[1] = t[2] = 0;
}

typedef struct laid {
    const shd_westin *table;
    bool round;
    shone *last; /* what was asked for last */
} laid;

/* Each bounce's sum over all nodes that a pair of directions is near to. Of docs/model.md. */
static void add_bounces(const laid *on, shone *s) {
    const long double *n = s->nvl[0];
    long double t[3];
    lay_tangent(n, on->round, t);
    const long double b[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2],
                              n[0] * t[1] - n[1] * t[0]};
    long double u[2][2];
    for (int k = 0; k < 2; k++) {
        const long double *d = s->nvl[1 + k], x = t[0] * d[0] + t[1] * d[1] + t[2] * d[2],
                          y = b[0] * d[0] + b[1] * d[1] + b[2] * d[2],
                          cosine = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
        const long double turn = hypotl(x, y) > 1e-9L ? atan2l(y, x) : 0;
        u[k][0] = atan2l(hypotl(x, y), cosine) * SHD_WESTIN_RISES / M_PI_2l - 0.5L;
        u[k][1] = turn * SHD_WESTIN_TURNS / (2 * M_PIl) - 0.5L;
    }
    memset(s->bounces, 0, sizeof s->bounces);
    for (int i = 0; i < 81; i++) {
        const int step[4] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 % 3 - 1, i / 27 - 1};
        int at[4];
        long double weight = 1;
        for (int k = 0; k < 4; k++) {
            at[k] = (int)floorl(u[k / 2][k % 2] + 0.5L) + step[k];
            weight *= spline(u[k / 2][k % 2] - at[k]);
        }
        const float *rho = node(on->table, at, at + 2);
        for (int k = 0; k < SHD_WESTIN_BOUNCES; k++) s->bounces[k] += weight * (long double)rho[k];
    }
}

/* One channel after the other asks for the same directions. */
static long double weigh_table(const void *context, const long double nvl[3][3], long double kd) {
    const laid *on = context;
    long double cosine[2] = {0, 0};
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++) cosine[k] += nvl[0][c] * nvl[1 + k][c];
    if (!(cosine[0] > 0 && cosine[1] > 0)) return 0;
    bool same = true;
    for (int i = 0; i < 9; i++) same &= on->last->nvl[i / 3][i % 3] == nvl[i / 3][i % 3];
    if (!same) {
        for (int i = 0; i < 9; i++) on->last->nvl[i / 3][i % 3] = nvl[i / 3][i % 3];
        add_bounces(on, on->last);
    }
    long double sum =
        on->last->bounces[SHD_WESTIN_BOUNCES - 1] / (1 - (long double)on->table->tail * kd);
    for (int k = SHD_WESTIN_BOUNCES - 2; k >= 0; k--) sum = sum * kd + on->last->bounces[k];
    return sum * cosine[1];
}

/* ---- Cells. ---- */

/* How much of what is told the worst pixel is off by; above 1 is a mistake. `wanted`: of how many
 * pixels. Westin's estimate is that of simulation, so that what sums over directions aim at is
 * taken of the bound, which is the most that they are. */
static double try_cell(shd_engine *engine, const char *json, int wanted, bool summed,
                       double *bound) {
    const double middle[64][2] = {{0.5, 0.5}};
    const drawn d = shown_film_of(engine, json);
    const shd_plan *plan = d.request->rendering.plan;
    model *m = model_long.read(json, middle);
    double worst = 0;
    assert_non_null(m);
    shone last = {.nvl = {{0}}};
    const laid on = {plan->westin ? plan->westin[0] : NULL,
                     d.request->scene->objects[0].shape == SHD_SPHERE, &last};
    if (plan->westin) model_long.tell(m, weigh_table, &on);
    *bound = fmin(plan->bound.linear, shd_linear_estimate(plan, NULL));
    if (plan->westin && summed) *bound *= 4 * SHD_AREA_MODEL_TOLERANCE;
    for (int i = 0; i < wanted; i++) {
        model_pixel is;
        model_long.evaluate(m, i % d.film.width, i / d.film.width, &is);
        for (int c = 0; c < 3; c++) {
            const double value = (double)d.film.rgba[4 * i + c],
                         off = fmax(is.low[c] - value, value - is.high[c]);
            worst = fmax(worst, isfinite(value) ? off : INFINITY);
        }
    }
    model_long.drop(m);
    shd_request *request = d.request;
    shd_request_drop(request);
    return worst > 0 ? worst / *bound : 0;
}

static void hard_cases_are_within_what_is_told(void **state) {
    const char *only = getenv("SHADED_CASE");
    int cells = 0, unknown = 0, wrong = 0;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++)
        for (int kind = 0; kind < MODELS; kind++)
            for (int light = 0; light < LIGHTS; light++) {
                const bool summed = light >= POINTS;
                if (only && strcmp(only, cases[k].name)) continue;
                double bound;
                char *json = write_cell(&cases[k], kind, light);
                const double began = shd_now(),
                             share = try_cell(*state, json, kind == WESTIN && summed ? 1 : 4,
                                              summed, &bound);
                if (getenv("SHADED_MEASURE") || !(share <= 1))
                    printf("%s: model %d, light %d: %.2g of %.2g, %.3f s\n%s\n", cases[k].name,
                           kind, light, share, bound, shd_now() - began, json);
                cells++;
                unknown += !isfinite(bound);
                wrong += !(share <= 1);
                free(json);
            }
    print_message("%d cells, %d of them without a bound, %d wrong\n", cells, unknown, wrong);
    assert_int_equal(wrong, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(hard_cases_are_within_what_is_told)};
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
