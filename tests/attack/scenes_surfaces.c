/* Scenes whose surfaces are hard. */
#include "attack/makers.h"

#include <math.h>
#include <stdlib.h>

#include "attack/write.h"

static const double RADIAN = 3.14159265358979323846 / 180;
static const xyz ORIGIN = {0, 0, 0}, ONE = {1, 1, 1};

void write_plain(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){64, 16, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 2), 1, 100);
    put_end(out, random);
}

void write_many(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){40, 16, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 12), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 3 + one_of(random, 12), 0.3, 1e4);
    put_end(out, random);
}

/* Few pixels, broad highlights, steep where they end. */
void write_coarse(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){6 + one_of(random, 18), 64, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 3), 0.05, 3);
    put_end(out, random);
}

void write_sharp(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){48, 16, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 5), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 3), 300, 1e6);
    put_end(out, random);
}

void write_needles(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){48, 16, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    const int count = 1 + one_of(random, 8);
    for (int i = 0; i < count; i++) {
        const double thin = decades(random, 1e-5, 0.05);
        fputs(i ? ", {" : "{", out);
        switch (one_of(random, 4)) {
        case 0:
            fprintf(out, "\"type\": \"cylinder\", \"height\": 2, \"radius\": %.17g, ", thin);
            break;
        case 1:
            fprintf(out, "\"type\": \"cone\", \"height\": 2, \"radius\": %.17g, ", thin);
            break;
        case 2:
            fprintf(out, "\"type\": \"box\", \"size\": [%.17g, 2, %.17g], ", thin,
                    decades(random, 1e-4, 1));
            break;
        default:
            fprintf(out, "\"type\": \"torus\", \"radius\": %.17g, \"tube\": %.17g, ",
                    between(random, 0.4, 1.2), thin);
        }
        put_material(out, random, 1, 300);
        fputs(", ", out);
        put_turn(out, random, ONE, scaled_by(any_direction(random), between(random, 0, 0.7)));
        fputs("}", out);
    }
    put_end(out, random);
}

/* What an affine map makes of shapes: flat, long, mirrored, sheared. */
void write_stretched(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){40, 8, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    const int count = 1 + one_of(random, 3);
    for (int i = 0; i < count; i++) {
        fputs(i ? ", {" : "{", out);
        put_shape(out, random, 1);
        put_material(out, random, 1, 300);
        fputs(", ", out);
        double s[3];
        for (int k = 0; k < 3; k++)
            s[k] = (one_of(random, 3) ? 1 : -1) *
                   (one_of(random, 3) ? between(random, 0.3, 1.5) : decades(random, 1e-3, 1));
        put_turn(out, random, (xyz){s[0], s[1], s[2]},
                 scaled_by(any_direction(random), between(random, 0, 0.6)));
        fputs("}", out);
    }
    put_end(out, random);
}

/* Triangles with a normal of their own, and evaluations a face or a corner. */
void write_faceted(FILE *out, uint64_t *random, const char *accuracy) {
    static const char *const ways[] = {"phong", "flat", "gouraud"};
    put_frame(out, random, accuracy, (frame){40, 8, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    const int count = 1 + one_of(random, 2);
    for (int i = 0; i < count; i++) {
        const int way = one_of(random, 3);
        fputs(i ? ", {" : "{", out);
        if (way == 1 && one_of(random, 2))
            fputs("\"type\": \"box\", ", out);
        else
            put_ball(out, 4 + one_of(random, 9), 3 + one_of(random, 5), 1, false);
        put_material(out, random, 1, 300);
        fprintf(out, ", \"interpolation\": \"%s\", ", ways[way]);
        put_turn(out, random, (xyz){1, between(random, 0.4, 1), 1},
                 scaled_by(any_direction(random), between(random, 0, 0.6)));
        fputs("}", out);
    }
    put_end(out, random);
}

void write_smooth(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){40, 8, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    fputs("{", out);
    put_ball(out, 4 + one_of(random, 9), 3 + one_of(random, 5), 1, true);
    put_material(out, random, 1, 300);
    fprintf(out, ", \"interpolation\": \"%s\", ", one_of(random, 3) ? "phong" : "gouraud");
    put_turn(out, random, (xyz){between(random, 0.4, 1), between(random, 0.4, 1), 1}, ORIGIN);
    fputs("}", out);
    put_end(out, random);
}

/* A mesh under a lens: onto one of its edges or corners, up to 1e5 times. */
void write_zoom(FILE *out, uint64_t *random, const char *accuracy) {
    char camera[300];
    const double a = 45 * (1 + one_of(random, 3)) * RADIAN, b = 60 * one_of(random, 6) * RADIAN,
                 next = b + 60 * RADIAN;
    const xyz corner = {sin(a) * sin(b), cos(a), sin(a) * cos(b)},
              other = {sin(a) * sin(next), cos(a), sin(a) * cos(next)};
    const double share = one_of(random, 2) ? between(random, 0, 1) : 0;
    const xyz target = sum_of(scaled_by(corner, 1 - share), scaled_by(other, share)),
              eye = sum_of(scaled_by(corner, between(random, 2, 5)),
                           scaled_by(any_direction(random), 0.5));
    snprintf(camera, sizeof camera,
             "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g], \"fov\": "
             "%.17g",
             eye.x, eye.y, eye.z, target.x, target.y, target.z, decades(random, 1e-4, 10));
    put_frame(out, random, accuracy, (frame){32, 4, camera, NULL});
    put_lights(out, random, 1 + one_of(random, 3), ORIGIN, 1);
    put_objects(out);
    fputs("{", out);
    put_ball(out, 6, 4, 1, false);
    put_material(out, random, 1, 100);
    fputs("}", out);
    put_end(out, random);
}

/* Two triangles of a ground of up to 1e7, and a patch of 1 on it or 1e-7 of the ground above it. */
void write_patches(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){32, 4, "\"position\": [0.3, 2, 2.5]", NULL});
    put_lights(out, random, 1 + one_of(random, 3), ORIGIN, 1);
    put_objects(out);
    const double g = decades(random, 1, 1e7),
                 up = one_of(random, 2) ? between(random, 0, 0.3) : g * decades(random, 1e-9, 1e-7);
    const double p[8][3] = {{-g, 0, -g},  {g, 0, -g},  {g, 0, g},  {-g, 0, g},
                            {-1, up, -1}, {1, up, -1}, {1, up, 1}, {-1, up, 1}};
    fputs("{\"type\": \"mesh\", \"positions\": [", out);
    for (int i = 0; i < 8; i++)
        fprintf(out, "%s%.17g, %.17g, %.17g", i ? ", " : "", p[i][0], p[i][1], p[i][2]);
    fputs("], \"indices\": [0, 3, 2, 0, 2, 1, 4, 7, 6, 4, 6, 5], ", out);
    put_material(out, random, 1, 100);
    fputs("}", out);
    put_end(out, random);
}

/* A plain scene of another size, somewhere else. */
void write_far(FILE *out, uint64_t *random, const char *accuracy) {
    const double size = decades(random, 1e-9, 1e9),
                 away = size * (one_of(random, 2) ? 0 : decades(random, 1, 1e5));
    const xyz at = scaled_by(any_direction(random), away), eye = sum_of(at, (xyz){0, 0, 4 * size});
    char camera[300];
    snprintf(camera, sizeof camera,
             "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g]", eye.x, eye.y,
             eye.z, at.x, at.y, at.z);
    put_frame(out, random, accuracy, (frame){32, 4, camera, NULL});
    put_lights(out, random, 1 + one_of(random, 3), at, size);
    put_objects(out);
    const int count = 1 + one_of(random, 2);
    for (int i = 0; i < count; i++) {
        fputs(i ? ", {" : "{", out);
        put_shape(out, random, size);
        put_material(out, random, 1, 100);
        fputs(", ", out);
        put_turn(out, random, ONE,
                 sum_of(at, scaled_by(any_direction(random), size * between(random, 0, 0.5))));
        fputs("}", out);
    }
    put_end(out, random);
}

/* An eye close above something huge. */
void write_huge(FILE *out, uint64_t *random, const char *accuracy) {
    const double radius = decades(random, 10, 1e8);
    put_frame(out, random, accuracy, (frame){32, 4, "\"position\": [0, 1, 3]", NULL});
    put_lights(out, random, 1 + one_of(random, 3), ORIGIN, 1);
    put_objects(out);
    static const char *const forms[] = {"sphere", "cylinder", "disc"};
    const int form = one_of(random, 3);
    fprintf(out, "{\"type\": \"%s\", \"radius\": %.17g, ", forms[form], radius);
    put_material(out, random, 1, 100);
    fprintf(out, ", \"transform\": {\"rotate\": [0, 0, %d], \"translate\": [0, %.17g, 0]}}, {",
            form == 1 ? 90 : 0, form == 2 ? -0.5 : -radius - 0.5);
    put_shape(out, random, 0.8);
    put_material(out, random, 1, 100);
    fputs("}", out);
    put_end(out, random);
}

/* What 64 bits of a long double would not do for. */
void write_vast(FILE *out, uint64_t *random, const char *accuracy) {
    const double radius = decades(random, 1e8, 1e13), gap = radius * decades(random, 1e-9, 1e-2);
    char camera[200];
    snprintf(camera, sizeof camera, "\"position\": [0, %.17g, %.17g], \"fov\": %.17g", 0.3 * gap,
             gap, between(random, 20, 100));
    put_frame(out, random, accuracy, (frame){32, 4, camera, NULL});
    put_lights(out, random, 1 + one_of(random, 3), ORIGIN, gap);
    put_objects(out);
    fprintf(out, "{\"type\": \"%s\", \"radius\": %.17g, ", one_of(random, 2) ? "sphere" : "disc",
            radius);
    put_material(out, random, 1, 100);
    fprintf(out,
            ", \"transform\": {\"translate\": [0, %.17g, 0]}}, {\"type\": \"disc\", "
            "\"radius\": %.17g, ",
            -radius, radius / 4);
    put_material(out, random, 1, 100);
    fprintf(out, ", \"transform\": {\"translate\": [0, %.17g, 0]}}",
            -radius + radius * decades(random, 1e-14, 1e-9));
    put_end(out, random);
}

/* Where a round surface or a triangle with normals of its corners is met as flatly as bounds count,
 * under a lens: a point, its normal, and what is of the size of the surface's curves there. */
typedef struct grazed {
    xyz at, normal;
    double curve;
} grazed;

/* A triangle through the origin, up to 1e4 times as long as it is high, its corners' normals up to
 * 60 degrees off its own. */
static grazed put_turned_triangle(FILE *out, uint64_t *random, double size) {
    const double high = size * decades(random, 1e-4, 1);
    const double p[3][3] = {{-size, -high / 3, 0}, {size, -high / 3, 0}, {0, 2 * high / 3, 0}};
    fputs("\"type\": \"mesh\", \"positions\": [", out);
    for (int i = 0; i < 9; i++) fprintf(out, "%s%.17g", i ? ", " : "", p[i / 3][i % 3]);
    fputs("], \"indices\": [0, 1, 2], \"normals\": [", out);
    for (int i = 0; i < 3; i++)
        fprintf(out, "%s%.17g, %.17g, 1", i ? ", " : "", between(random, -1.2, 1.2),
                between(random, -1.2, 1.2));
    fputs("], ", out);
    return (grazed){{0, 0, 0}, {0, 0, 1}, high};
}

static grazed put_round(FILE *out, uint64_t *random, double size) {
    const double a = between(random, 0, 360) * RADIAN, b = between(random, 0, 360) * RADIAN;
    const xyz side = {cos(a), 0, sin(a)};
    switch (one_of(random, 4)) {
    case 0: {
        const xyz n = any_direction(random);
        fprintf(out, "\"type\": \"sphere\", \"radius\": %.17g, ", size);
        return (grazed){scaled_by(n, size), n, size};
    }
    case 1:
        fprintf(out, "\"type\": \"cylinder\", \"radius\": %.17g, \"height\": %.17g, ", size,
                2 * size);
        return (grazed){
            sum_of(scaled_by(side, size), (xyz){0, between(random, -0.9, 0.9) * size, 0}), side,
            size};
    case 2: {
        const double tube = size * decades(random, 1e-3, 0.5);
        const xyz n = sum_of(scaled_by(side, cos(b)), (xyz){0, sin(b), 0});
        fprintf(out, "\"type\": \"torus\", \"radius\": %.17g, \"tube\": %.17g, ", size, tube);
        return (grazed){sum_of(scaled_by(side, size), scaled_by(n, tube)), n, tube};
    }
    default:
        return put_turned_triangle(out, random, size);
    }
}

void write_grazed(FILE *out, uint64_t *random, const char *accuracy) {
    const double size = decades(random, 1e-6, 1e13), flat = decades(random, 1e-3, 1);
    char *shape = NULL, camera[400];
    size_t length = 0;
    FILE *part = open_memstream(&shape, &length);
    if (!part) return;
    grazed g = put_round(part, random, size);
    fclose(part);
    const xyz offset = scaled_by(any_direction(random),
                                 one_of(random, 2) ? 0 : size * decades(random, 1, 1e6)),
              across = cross_of(g.normal, any_direction(random)),
              along = scaled_by(across, 1 / sqrt(across.x * across.x + across.y * across.y +
                                                 across.z * across.z)),
              view = sum_of(scaled_by(g.normal, flat), scaled_by(along, sqrt(1 - flat * flat)));
    g.at = sum_of(g.at, offset);
    /* Half of what is seen, beside which N.V is half as large at least. */
    const double half = flat * flat * g.curve / 2 * decades(random, 0.01, 0.5),
                 away = fmin(size * decades(random, 0.3, 1e7), half * 1e8),
                 close = half / flat * decades(random, 0.3, 1e4);
    const xyz eye = sum_of(g.at, scaled_by(view, away));
    snprintf(camera, sizeof camera,
             "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g], \"up\": "
             "[%.17g, %.17g, %.17g], \"fov\": %.17g",
             eye.x, eye.y, eye.z, g.at.x, g.at.y, g.at.z, g.normal.x, g.normal.y, g.normal.z,
             2 * atan(half / away) / RADIAN);
    put_frame(out, random, accuracy, (frame){24, 2, camera, NULL});
    fputs("{\"type\": \"point\", ", out);
    put_vector(out, "position",
               sum_of(sum_of(g.at, scaled_by(g.normal, close * decades(random, 1e-3, 1))),
                      scaled_by(any_direction(random), close * between(random, 0, 1))));
    fprintf(out, "}], \"objects\": [{%s", shape);
    put_material(out, random, 1, 100);
    fputs(", \"transform\": {", out);
    put_vector(out, "translate", offset);
    fputs("}}", out);
    put_end(out, random);
    free(shape);
}

/* Mirrors and glass before each other, also over a ground, and flat ones that see each other. */
void write_mirrors(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){32, 4, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 3), ORIGIN, 1);
    put_objects(out);
    if (one_of(random, 3) == 0) {
        fputs("{\"type\": \"plane\", ", out);
        put_material(out, random, 1, 1000);
        fprintf(out, ", \"transform\": {\"rotate\": [%.17g, 0, 5], \"translate\": [0, -1.3, 0]}}, ",
                between(random, -5, 5));
    }
    if (one_of(random, 3) == 0) {
        fputs("{", out);
        put_ball(out, 5 + one_of(random, 9), 4 + one_of(random, 5), 0.7, one_of(random, 2));
        put_material(out, random, 1, 1000);
        fputs(", ", out);
        put_turn(out, random, ONE, scaled_by(any_direction(random), 1));
        fputs("}, ", out);
    }
    put_some(out, random, 1 + one_of(random, 4), 1, one_of(random, 3) ? 300 : 1e6);
    put_end(out, random);
}
