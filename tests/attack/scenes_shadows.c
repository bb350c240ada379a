/* Scenes whose shadows are hard. */
#include "attack/makers.h"

#include <math.h>
#include <stdlib.h>

#include "attack/write.h"

static const double RADIAN = 3.14159265358979323846 / 180;
static const xyz ORIGIN = {0, 0, 0}, ONE = {1, 1, 1};

/* A camera before something of a size somewhere, which looks down a little. */
static void put_view(FILE *out, uint64_t *random, const char *accuracy, xyz at, double size,
                     int pixels) {
    char camera[300];
    const double turn = between(random, 0, 360) * RADIAN;
    const xyz from = {4 * sin(turn), between(random, 0.3, 3), 4 * cos(turn)},
              eye = sum_of(at, scaled_by(from, size));
    snprintf(camera, sizeof camera,
             "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g], \"fov\": "
             "%.17g",
             eye.x, eye.y, eye.z, at.x, at.y, at.z, between(random, 20, 50));
    put_frame(out, random, accuracy, (frame){pixels, 4, camera, NULL});
}

static const char *any_way(uint64_t *random) {
    static const char *const ways[] = {"phong", "flat", "gouraud", "gouraud"};
    return ways[one_of(random, 4)];
}

static void put_way(FILE *out, uint64_t *random) {
    fprintf(out, ", \"interpolation\": \"%s\", \"segments\": %d, ", any_way(random),
            3 + one_of(random, 9));
}

/* A ground at y = -1, of a plane, a disc, a box or two triangles. */
static void put_ground(FILE *out, uint64_t *random) {
    const double wide = decades(random, 2, 20);
    static const double turns[] = {0, 0, 180, 90};
    switch (one_of(random, 4)) {
    case 0:
        fputs("{\"type\": \"plane\", ", out);
        put_material(out, random, 1, 100);
        fputs(", \"transform\": {\"translate\": [0, -1, 0]}}", out);
        return;
    case 1:
        fprintf(out, "{\"type\": \"disc\", \"radius\": %.17g, ", wide);
        put_material(out, random, 1, 100);
        fprintf(out, ", \"transform\": {\"rotate\": [%g, 0, 0], \"translate\": [0, -1, 0]}}",
                turns[one_of(random, 3)]);
        return;
    case 2:
        fprintf(out, "{\"type\": \"box\", \"size\": [%.17g, 1, %.17g], ", wide, wide);
        put_material(out, random, 1, 100);
        fputs(", \"transform\": {\"translate\": [0, -1.5, 0]}}", out);
        return;
    default:
        fprintf(out,
                "{\"type\": \"mesh\", \"positions\": [%.17g, -1, %.17g, %.17g, -1, %.17g, %.17g, "
                "-1, %.17g, %.17g, -1, %.17g], \"indices\": [0, 1, 2, 0, 2, 3], ",
                -wide, -wide, -wide, wide, wide, wide, wide, -wide);
        put_material(out, random, 1, 100);
        fputs("}", out);
    }
}

void write_hidden(FILE *out, uint64_t *random, const char *accuracy) {
    put_view(out, random, accuracy, ORIGIN, 1.3, 32);
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    if (one_of(random, 4)) {
        put_ground(out, random);
        fputs(", ", out);
    }
    if (one_of(random, 2)) {
        fputs("{", out);
        put_ball(out, 4 + one_of(random, 9), 3 + one_of(random, 5), 0.7, one_of(random, 2));
        put_material(out, random, 1, 100);
        fputs(", ", out);
        put_turn(out, random, ONE, scaled_by(any_direction(random), 1));
        fputs("}, ", out);
    }
    put_some(out, random, 1 + one_of(random, 5), 1, 100);
    put_end(out, random);
}

/* Its lowest point is at y = -1, and its highest one at y = 1. */
static void put_stander(FILE *out, uint64_t *random, xyz scale, xyz at) {
    static const char *const shapes[] = {
        "\"type\": \"box\", \"size\": [2, 2, 2], ", "\"type\": \"sphere\", ",
        "\"type\": \"cylinder\", \"radius\": 0.7, ", "\"type\": \"cone\", ",
        "\"type\": \"torus\", \"radius\": 2, \"tube\": 1, "};
    fputs("{", out);
    fputs(shapes[one_of(random, 5)], out);
    put_material(out, random, 1, 100);
    fputs(", \"transform\": {", out);
    put_vector(out, "scale", scale);
    fprintf(out, ", \"rotate\": [0, %.17g, 0], ", one_of(random, 2) ? 0 : between(random, 0, 360));
    put_vector(out, "translate", at);
    fputs("}}", out);
}

/* Things on the ground and on each other: to the bit, or to within rounding of decimals. */
void write_standing(FILE *out, uint64_t *random, const char *accuracy) {
    const double size = one_of(random, 2) ? 1 : decades(random, 1e-7, 1e7), s = 0.4 * size;
    const xyz at = one_of(random, 2)
                       ? ORIGIN
                       : scaled_by(any_direction(random), size * decades(random, 1, 1e3));
    put_view(out, random, accuracy, sum_of(at, (xyz){0, 0.5 * size, 0}), size, 32);
    put_lights(out, random, 1 + one_of(random, 3), at, size);
    put_objects(out);
    fprintf(out, "{\"type\": \"%s\", ", one_of(random, 2) ? "plane" : "disc");
    put_material(out, random, 1, 100);
    fputs(", \"transform\": {", out);
    put_vector(out, "scale", (xyz){5 * size, size, 5 * size});
    fputs(", ", out);
    put_vector(out, "translate", at);
    fputs("}}", out);
    const int count = 1 + one_of(random, 3);
    double top = at.y;
    for (int i = 0; i < count; i++) {
        const bool beside = one_of(random, 3) == 0;
        fputs(", ", out);
        put_stander(out, random, (xyz){s, s, s},
                    (xyz){at.x + (beside ? 2 * s * (i + 1) : 0), (beside ? at.y : top) + s, at.z});
        if (!beside) top += 2 * s;
    }
    put_end(out, random);
}

/* A sheet of triangles, folded at random: saddles, valleys and crests in one vertex. */
static void put_sheet(FILE *out, uint64_t *random) {
    enum { MOST = 7 };
    const int n = 3 + one_of(random, MOST - 3);
    double y[MOST * MOST];
    const double high = decades(random, 1e-3, 1);
    fputs("\"type\": \"mesh\", \"positions\": [", out);
    for (int i = 0; i < n * n; i++) {
        y[i] = high * between(random, -1, 1);
        fprintf(out, "%s%.17g, %.17g, %.17g", i ? ", " : "", 2.0 * (i % n) / (n - 1) - 1, y[i],
                2.0 * (i / n) / (n - 1) - 1);
    }
    if (one_of(random, 2)) {
        fputs("], \"normals\": [", out);
        for (int i = 0; i < n * n; i++) {
            const xyz d = any_direction(random);
            fprintf(out, "%s%.17g, 1, %.17g", i ? ", " : "", 0.8 * d.x, 0.8 * d.z);
        }
    }
    fputs("], \"indices\": [", out);
    const char *comma = "";
    for (int r = 0; r + 1 < n; r++)
        for (int c = 0; c + 1 < n; c++) {
            const int a = r * n + c;
            fprintf(out, "%s%d, %d, %d, %d, %d, %d", comma, a, a + n, a + n + 1, a, a + n + 1,
                    a + 1);
            comma = ", ";
        }
    fputs("], ", out);
}

void write_folds(FILE *out, uint64_t *random, const char *accuracy) {
    const double away = one_of(random, 2) ? 0 : decades(random, 1, 1e6);
    const xyz at = scaled_by(any_direction(random), away);
    put_view(out, random, accuracy, at, 1, 24);
    put_lights(out, random, 1 + one_of(random, 4), at, 1);
    put_objects(out);
    const int kind = one_of(random, 4);
    fputs("{", out);
    if (kind == 0)
        put_sheet(out, random);
    else if (kind == 1)
        put_ball(out, 4 + one_of(random, 9), 3 + one_of(random, 5), 0.8, one_of(random, 2));
    else if (kind == 2)
        fprintf(out, "\"type\": \"torus\", \"radius\": 1, \"tube\": %.17g, ",
                between(random, 0.1, one_of(random, 3) ? 0.95 : 1.5));
    else
        put_shape(out, random, 1);
    put_material(out, random, 1, 100);
    if (kind < 2)
        fprintf(out, ", \"interpolation\": \"%s\", ", any_way(random));
    else
        put_way(out, random);
    put_turn(out, random,
             (xyz){between(random, 0.4, 1), between(random, 0.4, 1), one_of(random, 4) ? 1 : -1},
             at);
    fputs("}", out);
    put_end(out, random);
}

void write_touched(FILE *out, uint64_t *random, const char *accuracy) {
    put_view(out, random, accuracy, ORIGIN, 1, 32);
    const int count = 1 + one_of(random, 3);
    for (int i = 0; i < count; i++) {
        const double off = one_of(random, 3) ? decades(random, 1e-12, 0.5) : 0;
        xyz p = scaled_by(any_direction(random), 1 + (one_of(random, 2) ? off : -off));
        if (one_of(random, 3) == 0)
            p = (xyz){between(random, -2, 2), -1 + (one_of(random, 4) ? off : -off),
                      between(random, -2, 2)};
        fprintf(out, "%s{\"type\": \"point\", \"intensity\": %.17g, ", i ? ", " : "",
                between(random, 0.1, 1));
        put_vector(out, "position", p);
        fputs("}", out);
    }
    put_objects(out);
    put_ground(out, random);
    fputs(", {\"type\": \"sphere\", ", out);
    put_material(out, random, 1, 100);
    if (one_of(random, 3) == 0) {
        put_way(out, random);
        put_turn(out, random, ONE, ORIGIN);
    }
    fputs("}", out);
    put_end(out, random);
}

/* Lights in and along the faces of boxes, caps and grounds. */
void write_level(FILE *out, uint64_t *random, const char *accuracy) {
    put_view(out, random, accuracy, ORIGIN, 1, 32);
    const int count = 1 + one_of(random, 3);
    for (int i = 0; i < count; i++) {
        static const double levels[] = {-1, -0.5, 0.5, 0};
        const double level = levels[one_of(random, 4)],
                     off = one_of(random, 2) ? 0 : decades(random, 1e-15, 1e-3),
                     turn = between(random, 0, 360) * RADIAN, far = between(random, 1.5, 5);
        if (one_of(random, 3) == 0) {
            fprintf(out, "%s{\"type\": \"directional\", \"intensity\": 0.5, ", i ? ", " : "");
            put_vector(out, "direction", (xyz){sin(turn), -off, cos(turn)});
        } else {
            fprintf(out, "%s{\"type\": \"point\", \"intensity\": 0.5, ", i ? ", " : "");
            put_vector(out, "position", (xyz){far * sin(turn), level + off, far * cos(turn)});
        }
        fputs("}", out);
    }
    put_objects(out);
    put_ground(out, random);
    static const char *const shapes[] = {"\"type\": \"box\", ",
                                         "\"type\": \"cylinder\", \"radius\": 0.5, \"height\": 1, ",
                                         "\"type\": \"torus\", \"radius\": 1, \"tube\": 0.5, ",
                                         "\"type\": \"cone\", \"radius\": 0.5, \"height\": 1, "};
    for (int i = 0; i < 2; i++) {
        fputs(", {", out);
        fputs(shapes[one_of(random, 4)], out);
        put_material(out, random, 1, 100);
        if (one_of(random, 3) == 0)
            put_way(out, random);
        else
            fputs(", ", out);
        fprintf(out, "\"transform\": {\"translate\": [%g, %g, 0]}}",
                i ? 1.25 * one_of(random, 2) : 0, i ? 1.0 : -0.5 * one_of(random, 2));
    }
    put_end(out, random);
}

/* A grid of round numbers, lit and seen through its edges and corners. */
void write_straight(FILE *out, uint64_t *random, const char *accuracy) {
    const double half = one_of(random, 2) ? 0 : 0.5;
    char camera[300];
    snprintf(camera, sizeof camera,
             "\"type\": \"orthographic\", \"height\": 4, \"position\": [%g, 6, %g], \"target\": "
             "[%g, 0, %g], \"up\": [0, 0, -1]",
             half, half, half, half);
    put_frame(out, random, accuracy, (frame){32, 4, camera, NULL});
    const int count = 1 + one_of(random, 3);
    for (int i = 0; i < count; i++) {
        const double x = one_of(random, 5) - 2, z = one_of(random, 5) - 2;
        fprintf(out, "%s{\"type\": \"%s\", \"intensity\": 0.4, ", i ? ", " : "",
                i % 2 ? "directional" : "point");
        put_vector(out, i % 2 ? "direction" : "position", i % 2 ? (xyz){x, -2, z} : (xyz){x, 4, z});
        fputs("}", out);
    }
    put_objects(out);
    fputs("{\"type\": \"plane\", ", out);
    put_material(out, random, 1, 100);
    fputs(", \"transform\": {\"translate\": [0, -2, 0]}}, {", out);
    if (one_of(random, 2)) {
        fputs("\"type\": \"box\", \"size\": [2, 1, 2], ", out);
        put_material(out, random, 1, 100);
        if (one_of(random, 2))
            put_way(out, random);
        else
            fputs(", ", out);
        fputs("\"transform\": {}}", out);
    } else {
        put_ball(out, 4, 2 * (1 + one_of(random, 2)), 1, one_of(random, 2));
        put_material(out, random, 1, 100);
        fprintf(out, ", \"interpolation\": \"%s\"}", any_way(random));
    }
    put_end(out, random);
}
