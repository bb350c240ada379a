/* Maps of normals on flat and gouraud objects, which are lit once a face or a corner: what these
 * see of a map is its mean by the weights that show their light. */
#include "property/pieces.h"
#include "property/put_normals.h"
#include "scene/read.h"

static const code TILT = {200, 90, 210};

static void same_pictures(shd_engine *engine, char *one, char *other, double most, int line) {
    drawn a = shown_film_of(engine, one), b = shown_film_of(engine, other);
    assert_int_equal(a.request->rendering.plan->westin != NULL, strstr(one, "westin") != NULL);
    double light = 0;
    for (size_t i = 0; i < 4 * pixels_of(&b); i++)
        if (i % 4 < 3) light = fmax(light, (double)b.film.rgba[i]);
    assert_true(light > 0.1);
    assert_true(a.request->rendering.plan->tier == SHD_EXACT);
    if (!(film_difference(&a, &b) < most))
        fail_msg("line %d: %g\n%s\n%s", line, film_difference(&a, &b), one, other);
    drop_drawn(&a);
    drop_drawn(&b);
    free(one);
    free(other);
}

/* ---- A map of one normal. ---- */

static const char *const models[] = {
    "\"specular\": 0.6, \"shininess\": 20, \"lobes\": [{\"specular\": 0.1, \"shininess\": 300}]",
    "\"model\": \"blinn-phong\", \"specular\": 0.6, \"shininess\": 50",
    "\"model\": \"phong-normalized\", \"specular\": 0.4, \"shininess\": 40",
    "\"model\": \"oren-nayar\", \"sigma\": 25",
    "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 0.3}]",
    "\"model\": \"westin\", \"microgeometry\": {\"type\": \"grooves\"}",
    "\"specular\": 0.6, \"shininess\": 9, \"specularAntialiasing\": true",
    "\"emissive\": {\"pattern\": \"checker\", \"colors\": [0.2, 0.7]}, \"specular\": 0.2",
};

#define POINTS                                                                                     \
    "\"positions\": [-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0], \"indices\": [0, 1, 2, 0, 2, 3], "

/* A square that has the map, or this normal at its corners. It is seen in a mirror behind it, too.
 */
static char *square(const char *by, const char *material, const char *map, shd_vec3 n, bool behind,
                    bool shadows, const char *camera, const char *lights) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 16, \"height\": 12, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"exact\"}, \"background\": [0.2, 0.1, 0.3], \"trace\": {\"shadows\": %s, \"depth\": "
            "3, \"shadowSamples\": 4}, \"camera\": {%s\"position\": [0.6, 0.4, %s3.5]}, "
            "\"lights\": [%s], \"objects\": [{\"type\": \"disc\", \"radius\": 9, \"transform\": "
            "{\"rotate\": [%s90, 0, 0], \"translate\": [3, 0, %s2]}, \"material\": {\"diffuse\": "
            "0.1, \"reflection\": 0.8}}, {\"type\": \"mesh\", \"interpolation\": \"%s\", " POINTS
            "\"uvs\": [-2, -2, 2, -2, 2, 2, -2, 2], ",
            shadows ? "true" : "false", camera, behind ? "-" : "", lights, behind ? "-" : "",
            behind ? "" : "-", by);
    if (!map || !strcmp(by, "gouraud"))
        for (int i = 0; i < 4; i++)
            fprintf(w.out, "%s%.17g, %.17g, %.17g%s", i ? ", " : "\"normals\": [", map ? 0 : n.x,
                    map ? 0 : n.y, map ? 1 : n.z, i == 3 ? "], " : "");
    fprintf(w.out,
            "\"transform\": {\"rotate\": [20, 10, 5], \"scale\": [0.7, 0.7, -0.7]}, "
            "\"material\": {\"diffuse\": [0.5, 0.6, 0.4], \"reflection\": 0.1, %s",
            material);
    if (map) fprintf(w.out, ", \"normal\": {\"texture\": \"%s\", \"scale\": 0.5}", map);
    fputs("}}]}", w.out);
    return finish(&w);
}

#define FAR                                                                                        \
    "{\"type\": \"directional\", \"direction\": [-1, 0.3, -0.4]}, {\"type\": \"directional\", "    \
    "\"direction\": [0.2, -0.5, 1], \"color\": [0.3, 0.4, 0.9]}"
#define NEAR                                                                                       \
    ", {\"type\": \"point\", \"position\": [3, 2, 2.5]}, {\"type\": \"spot\", \"position\": [-2, " \
    "1, -2], \"direction\": [1, -0.3, 1], \"angle\": 50}, {\"type\": \"rect\", \"position\": "     \
    "[-3, 0, 1], \"direction\": [1, 0, -0.2], \"up\": [0, 1, 0], \"size\": [1, 2], "               \
    "\"intensity\": 3}"

/* The map of a mesh with corners of other normals, in any light: gouraud. */
static void corners_have_the_normal(void **state) {
    const put_name map = put_normals(*state, 2, 2, &TILT, 1);
    for (size_t m = 0; m < SHD_LENGTH(models); m++)
        for (int k = 0; k < 2; k++) {
            const shd_vec3 n = vector_of(TILT, 0.5);
            same_pictures(*state, square("gouraud", models[m], map.text, n, k, !k, "", FAR NEAR),
                          square("gouraud", models[m], NULL, n, k, !k, "", FAR NEAR), 2e-6,
                          __LINE__);
        }
}

/* Where light is the same at all points, a face is lit as each of them is. */
static void faces_have_the_normal(void **state) {
    static const char camera[] = "\"type\": \"orthographic\", \"height\": 3, ";
    const put_name map = put_normals(*state, 2, 2, &TILT, 1);
    for (size_t m = 0; m < SHD_LENGTH(models); m++)
        for (int k = 0; k < 2; k++) {
            const shd_vec3 n = vector_of(TILT, 0.5);
            same_pictures(*state, square("flat", models[m], map.text, n, k, false, camera, FAR),
                          square("gouraud", models[m], NULL, n, k, false, camera, FAR), 2e-6,
                          __LINE__);
        }
}

/* The same of shapes, whose charts turn the map. */
static char *bodies(const char *by, const char *map, const char *rotate) {
    return text_of(
        "{\"image\": {\"width\": 32, \"height\": 24, \"samples\": 1}, \"accuracy\": {\"tier\": "
        "\"exact\"}, \"camera\": {\"type\": \"orthographic\", \"height\": 4, \"position\": [1, 2, "
        "3]}, \"lights\": [" FAR "], \"interpolation\": \"%s\", \"materials\": {\"m\": "
        "{\"specular\": 0.3, \"normal\": {\"texture\": \"%s\", \"uv\": {\"rotate\": 30, \"scale\": "
        "[2, 3]}}}}, \"objects\": [{\"type\": \"box\", \"material\": \"m\", \"transform\": "
        "{\"rotate\": "
        "[%s], \"translate\": [-1, 0, 0], \"scale\": [1.5, 1, -1]}}, {\"type\": \"disc\", "
        "\"material\": \"m\", \"segments\": 40, \"transform\": {\"rotate\": [%s], \"translate\": "
        "[1, 0.2, 0]}}]}",
        by, map, rotate, rotate);
}

static void shapes_have_their_charts(void **state) {
    static const char *const turns[] = {"20, 30, 10", "130, 70, 200", "-40, -170, 0"};
    const put_name map = put_normals(*state, 2, 2, &TILT, 1);
    for (size_t t = 0; t < SHD_LENGTH(turns); t++)
        for (int k = 0; k < 2; k++) {
            char *one = bodies(k ? "flat" : "gouraud", map.text, turns[t]),
                 *other = bodies("phong", map.text, turns[t]);
            drawn a = film_of(*state, one), b = film_of(*state, other);
            free(one);
            free(other);
            size_t seen = 0, differ = 0; /* slices of a disc end before its rim */
            for (size_t i = 0; i < pixels_of(&a); i++) {
                const float *p = a.film.rgba + 4 * i, *q = b.film.rgba + 4 * i;
                const bool same = fabsf(p[0] - q[0]) < 2e-6f && fabsf(p[2] - q[2]) < 2e-6f;
                seen += p[2] > 0.01f;
                differ += !same;
            }
            assert_true(seen > 70);
            assert_true(differ < 6);
            drop_drawn(&a);
            drop_drawn(&b);
        }
}

/* ---- Maps of many normals: means over faces, and around corners. ---- */

enum { TEXELS = 64, STEPS = 60, CORNERS = 5, TRIANGLES = 4 };

static const double places[CORNERS][2] = {
    {-1.3, -0.9}, {1.1, -1}, {1.2, 0.9}, {-1, 1.1}, {0.2, -0.1}};
static const int fan[TRIANGLES][3] = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

enum { WIDE = 8 };

/* Smooth hills. */
static code hill(double s, double t) {
    const double x = 0.6 * sin(2 * SHD_PI * (s + 0.2)), y = 0.5 * cos(2 * SHD_PI * (t + 0.4 * s)),
                 by = 1 / sqrt(1 + x * x + y * y);
    return (code){(uint8_t)lrint(127.5 * (1 + x * by)), (uint8_t)lrint(127.5 * (1 + y * by)),
                  (uint8_t)lrint(127.5 * (1 + by))};
}

static double twice_the_area(const int *corner) {
    const double *a = places[corner[0]], *b = places[corner[1]], *c = places[corner[2]];
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Sums over a triangle of its normals by the weights of its corners. */
static void sum_triangle(const int *corner, shd_vec3 out[3]) {
    for (int k = 0; k < 3; k++) out[k] = (shd_vec3){0, 0, 0};
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; i + j < STEPS; j++)
            for (int half = 0; half < 2 && i + j + half < STEPS; half++) {
                const double u = (i + (half ? 2 : 1) / 3.0) / STEPS,
                             v = (j + (half ? 2 : 1) / 3.0) / STEPS, weight[3] = {1 - u - v, u, v};
                double at[2] = {0, 0};
                for (int k = 0; k < 3; k++)
                    for (int c = 0; c < 2; c++) at[c] += weight[k] * places[corner[k]][c];
                const shd_vec3 n = vector_of(hill(at[0] / WIDE + 0.5, at[1] / WIDE + 0.5), 1);
                for (int k = 0; k < 3; k++)
                    out[k] = shd_madd(out[k], n, weight[k] * twice_the_area(corner));
            }
}

/* What the corners of each triangle are lit by. */
static void find_normals(bool flat, bool shared, shd_vec3 out[TRIANGLES][3]) {
    shd_vec3 parts[TRIANGLES][3], sums[CORNERS] = {{0, 0, 0}};
    for (int t = 0; t < TRIANGLES; t++) {
        sum_triangle(fan[t], parts[t]);
        for (int k = 0; k < 3; k++) sums[fan[t][k]] = shd_add(sums[fan[t][k]], parts[t][k]);
    }
    for (int t = 0; t < TRIANGLES; t++)
        for (int k = 0; k < 3; k++) {
            const shd_vec3 face = shd_add(shd_add(parts[t][0], parts[t][1]), parts[t][2]);
            shd_normalize(flat ? face : shared ? sums[fan[t][k]] : parts[t][k], &out[t][k]);
        }
}

static void write_fan(FILE *out, bool shared) {
    fputs("\"type\": \"mesh\", \"indices\": [0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4], \"positions\": [",
          out);
    for (int i = 0; i < CORNERS; i++)
        fprintf(out, "%s%g, %g, 0", i ? ", " : "", places[i][0], places[i][1]);
    fputs("], \"uvs\": [", out);
    for (int i = 0; i < CORNERS; i++)
        fprintf(out, "%s%.17g, %.17g", i ? ", " : "", places[i][0] / WIDE + 0.5,
                places[i][1] / WIDE + 0.5);
    for (int i = 0; shared && i < CORNERS; i++)
        fprintf(out, "%s0, 0, 1", i ? ", " : "], \"normals\": [");
    fputs("]", out);
}

static put_name put_hills(shd_engine *engine) {
    code *list = malloc(TEXELS * TEXELS * sizeof *list);
    for (int y = 0; y < TEXELS; y++)
        for (int x = 0; x < TEXELS; x++)
            list[y * TEXELS + x] = hill((x + 0.5) / TEXELS, 1 - (y + 0.5) / TEXELS);
    const put_name out = put_normals(engine, TEXELS, TEXELS, list, TEXELS * TEXELS);
    free(list);
    return out;
}

/* The triangle at a place, and its weights there, which are not near an edge. False: none. */
static bool find_place(double x, double y, int *triangle, double weight[3]) {
    for (int t = 0; t < TRIANGLES; t++) {
        const double *p[3] = {places[fan[t][0]], places[fan[t][1]], places[fan[t][2]]};
        for (int k = 0; k < 3; k++) {
            const double *a = p[(k + 1) % 3], *b = p[(k + 2) % 3];
            weight[k] =
                ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / twice_the_area(fan[t]);
        }
        *triangle = t;
        if (weight[0] > 0.001 && weight[1] > 0.001 && weight[2] > 0.001) return true;
    }
    return false;
}

/* Red, green and blue are light from three sides, so that a color tells of a normal. */
static void corners_see_means_around_them(void **state) {
    static const shd_vec3 way[3] = {{0.6, 0, 0.8}, {-0.3, 0.52, 0.8}, {-0.3, -0.52, 0.8}};
    const put_name map = put_hills(*state);
    for (int k = 0; k < 3; k++) {
        const bool flat = k == 0, shared = k == 2;
        shd_vec3 normals[TRIANGLES][3];
        find_normals(flat, shared, normals);
        writing w;
        start(&w);
        fputs("{\"image\": {\"width\": 30, \"height\": 24, \"samples\": 1}, \"camera\": {\"type\": "
              "\"orthographic\", \"height\": 2.4}, \"lights\": [",
              w.out);
        for (int c = 0; c < 3; c++)
            fprintf(w.out,
                    "%s{\"type\": \"directional\", \"direction\": [%g, %g, %g], \"color\": "
                    "[%d, %d, %d]}",
                    c ? ", " : "", -way[c].x, -way[c].y, -way[c].z, c == 0, c == 1, c == 2);
        fprintf(w.out, "], \"objects\": [{\"interpolation\": \"%s\", ", flat ? "flat" : "gouraud");
        write_fan(w.out, shared);
        fprintf(w.out, ", \"material\": {\"diffuse\": 1, \"normal\": {\"texture\": \"%s\"}}}]}",
                map.text);
        char *text = finish(&w);
        drawn d = film_of(*state, text);
        size_t seen = 0;
        double most = 0;
        for (int y = 0; y < 24; y++)
            for (int x = 0; x < 30; x++) {
                int triangle;
                double weight[3];
                if (!find_place((x - 14.5) / 10, (11.5 - y) / 10, &triangle, weight)) continue;
                seen++;
                for (int c = 0; c < 3; c++) {
                    shd_vec3 to;
                    shd_normalize(way[c], &to);
                    double light = 0;
                    for (int v = 0; v < 3; v++)
                        light += weight[v] * shd_larger(shd_dot(normals[triangle][v], to), 0);
                    most = fmax(most, fabs(light - (double)d.film.rgba[4 * (30 * y + x) + c]));
                }
            }
        assert_true(seen > 300);
        assert_below(most,
                     0.015); /* pictures are blurred a little; points alone are off by 0.028 */
        drop_drawn(&d);
        free(text);
    }
}

/* Two normals in turn, of which a face sees as many: its own normal, and Toksvig's lobe. */
static void differences_widen_highlights(void **state) {
    static const code two[] = {{188, 128, 240}, {67, 128, 240}};
    const put_name map = put_normals(*state, 2, 1, two, 2);
    const shd_vec3 one = vector_of(two[0], 1);
    const double length = hypot(one.y, one.z), v = (1 - length) / length, up = atan(one.y / one.z);
    for (int k = 0; k < 3; k++) {
        const double n = 40, turns = k ? 1 : 4, wide = n / (1 + turns * v * n),
                     cosine = k ? cos(0.1 - up) : cos(0.2 - 2 * up), /* of N.H, or R.V */
            lobe = 0.5 * (wide + 1) / (n + 1) * pow(cosine, wide);
        char *text = text_of(
            "{\"image\": {\"width\": 8, \"height\": 6, \"samples\": 1}, \"camera\": {\"type\": "
            "\"orthographic\", \"height\": 1}, \"lights\": [{\"type\": \"directional\", "
            "\"direction\": [0, %.17g, %.17g]}], \"objects\": [{\"type\": \"box\", \"size\": [4, "
            "4, 1], \"interpolation\": \"%s\", \"material\": {\"model\": \"%s\", \"diffuse\": 0, "
            "\"ambient\": 0, \"specular\": 0.5, \"shininess\": 40, \"normal\": {\"texture\": "
            "\"%s\", \"uv\": {\"scale\": 200}}}}]}",
            -sin(0.2), -cos(0.2), k == 2 ? "gouraud" : "flat", k ? "blinn-phong" : "phong",
            map.text);
        drawn d = film_of(*state, text);
        for (size_t i = 0; i < pixels_of(&d); i++)
            assert_below(fabs((double)d.film.rgba[4 * i] / lobe - 1), 1e-6);
        drop_drawn(&d);
        free(text);
    }
}

/* ---- What stays. ---- */

static void parts_are_those_of_the_whole(void **state) {
    const put_name map = put_hills(*state);
    static const char *const regions[] = {"", ", \"region\": [7, 5, 21, 17]"};
    drawn d[2];
    for (int k = 0; k < 2; k++) {
        char *text = text_of(
            "{\"image\": {\"width\": 40, \"height\": 30%s}, \"camera\": {\"position\": [1, 2, 5]}, "
            "\"trace\": {\"shadows\": true, \"depth\": 2}, \"lights\": [{\"type\": \"point\", "
            "\"position\": [3, 4, 5]}], \"materials\": {\"m\": {\"specular\": 0.3, \"reflection\": "
            "0.2, \"normal\": {\"texture\": \"%s\"}}}, \"objects\": [{\"type\": \"torus\", "
            "\"interpolation\": \"gouraud\", \"material\": \"m\"}, {\"type\": \"cone\", "
            "\"interpolation\": \"flat\", \"material\": \"m\", \"transform\": {\"translate\": [1, "
            "1, 0]}}, {\"type\": \"sphere\", \"radius\": 0.6, \"material\": \"m\", \"transform\": "
            "{\"translate\": [-1, 1, 0]}}]}",
            regions[k], map.text);
        d[k] = film_of(*state, text);
        assert_true(isfinite(d[k].request->rendering.plan->bound.linear));
        free(text);
    }
    for (int y = 0; y < 17; y++)
        for (int x = 0; x < 21; x++)
            assert_memory_equal(d[1].film.rgba + 4 * (y * 21 + x),
                                d[0].film.rgba + 4 * ((y + 5) * 40 + x + 7), 4 * sizeof(float));
    drop_drawn(&d[0]);
    drop_drawn(&d[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(corners_have_the_normal),
        cmocka_unit_test(faces_have_the_normal),
        cmocka_unit_test(shapes_have_their_charts),
        cmocka_unit_test(corners_see_means_around_them),
        cmocka_unit_test(differences_widen_highlights),
        cmocka_unit_test(parts_are_those_of_the_whole),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
