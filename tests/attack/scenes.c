#include "attack/scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "attack/write.h"

static const double RADIAN = 3.14159265358979323846 / 180;
static const xyz ORIGIN = {0, 0, 0}, ONE = {1, 1, 1};

static void put_end(FILE *out, uint64_t *random) {
    fputs("]", out);
    put_beyond(out, random);
    fputs("}", out);
}

static void put_objects(FILE *out) {
    fputs("], \"objects\": [", out);
}

/* Shapes near the origin, of a size of about 1. */
static void put_some(FILE *out, uint64_t *random, int count, double least, double most) {
    for (int i = 0; i < count; i++) {
        fputs(i ? ", {" : "{", out);
        put_shape(out, random, between(random, 0.5, 1.2));
        put_material(out, random, least, most);
        fputs(", ", out);
        put_turn(out, random, ONE,
                 scaled_by(any_direction(random), between(random, 0, count > 1 ? 1.2 : 0.4)));
        fputs("}", out);
    }
}

static void write_plain(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){64, 16, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 2), 1, 100);
    put_end(out, random);
}

static void write_many(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){40, 16, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 12), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 3 + one_of(random, 12), 0.3, 1e4);
    put_end(out, random);
}

/* A plane or a disc before the camera, and spots whose rims touch, overlap by a fraction of a
 * pixel, or leave a gap as wide: large ones, so that they do so for many pixels; equal ones, so
 * that their sum hides it. */
static void write_rims(FILE *out, uint64_t *random, const char *accuracy) {
    const double pixel = 2.0 / 96, high = decades(random, 1, 20);
    put_frame(out, random, accuracy,
              (frame){96, 16,
                      one_of(random, 2) ? "\"type\": \"orthographic\", \"height\": 2"
                                        : "\"position\": [0, 0, 4], \"fov\": 28.07",
                      NULL});
    const int count = 2 + one_of(random, 3);
    const double strength = decades(random, 0.2, 1), penumbra = decades(random, 1e-4, 0.05);
    const bool soft = one_of(random, 4) == 0, equal = one_of(random, 3);
    const double most = decades(random, 0.15, 1.5);
    xyz at = {between(random, -0.9, 0), between(random, -0.5, 0.5), high};
    double before = 0;
    for (int i = 0; i < count; i++) {
        const double radius = equal ? most : between(random, 0.1, 0.6),
                     turn = between(random, -60, 60) * RADIAN,
                     apart = before + radius - pixel * between(random, -1.2, 1.2);
        if (i) at = sum_of(at, (xyz){apart * cos(turn), apart * sin(turn), 0});
        before = radius;
        fprintf(out,
                "%s{\"type\": \"spot\", \"direction\": [0, 0, -1], \"angle\": %.17g, "
                "\"penumbra\": %.17g, \"intensity\": %.17g, ",
                i ? ", " : "", atan(radius / high) / RADIAN, soft ? penumbra : 0,
                equal ? strength : between(random, 0.2, 1));
        put_vector(out, "position", at);
        fputs("}", out);
    }
    put_objects(out);
    fputs(one_of(random, 2) ? "{\"type\": \"plane\", " : "{\"type\": \"disc\", \"radius\": 3, ",
          out);
    put_material(out, random, 1, 100);
    fprintf(out, ", \"transform\": {\"rotate\": [%.17g, 0, 0]}}",
            one_of(random, 2) ? 90 : between(random, 60, 120));
    put_end(out, random);
}

/* Light that is narrower than a pixel: spots that graze a surface, and wedges between two. */
static void write_slivers(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){56, 16, "\"position\": [0, 0, 4]", NULL});
    const int count = 1 + one_of(random, 4);
    const double turn = between(random, 0, 360) * RADIAN;
    for (int i = 0; i < count; i++) {
        const double angle = decades(random, 0.05, 20), beside = turn + between(random, -0.1, 0.1);
        const xyz from = {2 * cos(beside), 2 * sin(beside), decades(random, 0.01, 1)};
        const xyz aim = {between(random, -0.3, 0.3), between(random, -0.3, 0.3), 0};
        fprintf(out,
                "%s{\"type\": \"spot\", \"angle\": %.17g, \"penumbra\": %.17g, "
                "\"exponent\": %.17g, \"intensity\": %.17g, ",
                i ? ", " : "", angle, one_of(random, 2) ? 0 : between(random, 0, 1),
                one_of(random, 3) ? 0 : decades(random, 0.3, 1000), between(random, 0.3, 1.5));
        put_vector(out, "position", from);
        fputs(", ", out);
        put_vector(out, "direction", sum_of(aim, scaled_by(from, -1)));
        fputs("}", out);
    }
    put_objects(out);
    fputs("{\"type\": \"box\", \"size\": [3, 3, 0.01], ", out);
    put_material(out, random, 0.5, 300);
    fputs("}, {", out);
    put_shape(out, random, 0.6);
    put_material(out, random, 0.5, 300);
    fputs(", ", out);
    put_turn(out, random, ONE, ORIGIN);
    fputs("}", out);
    put_end(out, random);
}

/* Few pixels, broad highlights, steep where they end. */
static void write_coarse(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){6 + one_of(random, 18), 64, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 3), 0.05, 3);
    put_end(out, random);
}

static void write_sharp(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){48, 16, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 5), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 3), 300, 1e6);
    put_end(out, random);
}

static void write_lamps(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){24, 4, NULL, NULL});
    put_lights(out, random, (int)decades(random, 20, 400), ORIGIN,
               one_of(random, 2) ? 1 : decades(random, 0.5, 10));
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 4), 1, 300);
    put_end(out, random);
}

static void write_needles(FILE *out, uint64_t *random, const char *accuracy) {
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

/* Lights in planes, to within rounding: in that of a flat face of a turned and moved object. */
static void write_inplane(FILE *out, uint64_t *random, const char *accuracy) {
    static const char *const flats[] = {"disc", "plane", "box", "cylinder", "cone"};
    static const double faces[] = {0, 0, 0.5, 1, -1};
    put_frame(out, random, accuracy, (frame){40, 4, NULL, NULL});
    const int kind = one_of(random, 5), count = 1 + one_of(random, 3);
    const double turn = between(random, 0, 360), s = sin(turn * RADIAN), c = cos(turn * RADIAN);
    const bool about_x = one_of(random, 2);
    const xyz at = scaled_by(any_direction(random), one_of(random, 3) ? between(random, 0, 1) : 0);
    for (int i = 0; i < count; i++) {
        const double u = between(random, -4, 4), v = between(random, -4, 4), up = faces[kind];
        const xyz p = about_x ? (xyz){u, c * up - s * v, s * up + c * v}
                              : (xyz){c * u - s * up, s * u + c * up, v};
        const bool spot = one_of(random, 4) == 0;
        fprintf(out, "%s{\"type\": \"%s\", \"intensity\": %.17g, ", i ? ", " : "",
                spot ? "spot" : "point", between(random, 0.2, 1));
        if (spot) {
            put_vector(out, "direction", scaled_by(p, -1));
            fputs(", ", out);
        }
        put_vector(out, "position", sum_of(at, p));
        fputs("}", out);
    }
    put_objects(out);
    fprintf(out, "{\"type\": \"%s\", ", flats[kind]);
    put_material(out, random, 1, 300);
    fprintf(out, ", \"transform\": {\"rotate\": [%.17g, 0, %.17g], ", about_x ? turn : 0,
            about_x ? 0 : turn);
    put_vector(out, "translate", at);
    fputs("}}", out);
    put_end(out, random);
}

/* Lights next to surfaces, and eyes in things or next to them. */
static void write_near(FILE *out, uint64_t *random, const char *accuracy) {
    char camera[200];
    const bool inside = one_of(random, 2);
    const double gap = decades(random, 1e-6, 0.3);
    const xyz eye = scaled_by(any_direction(random), inside ? between(random, 0, 0.3) : 1 + gap);
    snprintf(camera, sizeof camera,
             "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, 0, 0.1], \"fov\": %.17g",
             eye.x, eye.y, eye.z, between(random, -0.5, 0.5), between(random, 20, 150));
    put_frame(out, random, accuracy, (frame){40, 8, camera, NULL});
    const int count = 1 + one_of(random, 4);
    for (int i = 0; i < count; i++) {
        const double away = inside ? 1 - decades(random, 1e-6, 0.8) : 1 + decades(random, 1e-6, 2);
        fprintf(out,
                "%s{\"type\": \"point\", \"intensity\": %.17g, \"attenuation\": [%g, %g, %g], ",
                i ? ", " : "", decades(random, 0.01, 1), one_of(random, 2) ? 0.5 : 0.0,
                one_of(random, 2) ? 0.5 : 0.0, 1.0);
        put_vector(out, "position", scaled_by(any_direction(random), away));
        fputs("}", out);
    }
    put_objects(out);
    fputs("{\"type\": \"sphere\", ", out);
    put_material(out, random, 1, 1000);
    fputs("}", out);
    put_end(out, random);
}

/* What an affine map makes of shapes: flat, long, mirrored, sheared. */
static void write_stretched(FILE *out, uint64_t *random, const char *accuracy) {
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
static void write_faceted(FILE *out, uint64_t *random, const char *accuracy) {
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

static void write_smooth(FILE *out, uint64_t *random, const char *accuracy) {
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
static void write_zoom(FILE *out, uint64_t *random, const char *accuracy) {
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
static void write_patches(FILE *out, uint64_t *random, const char *accuracy) {
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
static void write_far(FILE *out, uint64_t *random, const char *accuracy) {
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
static void write_huge(FILE *out, uint64_t *random, const char *accuracy) {
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

/* An eye at something round and huge, against lights in the plane that touches it there: nearly all
 * that is seen is where N.L is 0 to within some rounding, under a highlight. */
static void write_sunset(FILE *out, uint64_t *random, const char *accuracy) {
    static const char *const forms[] = {"sphere", "torus", "cylinder", "ball"};
    static const double turns[][2] = {{0, 0}, {33, 17}, {-21, 50}, {70, -40}};
    const int form = one_of(random, 4);
    const double *turn = turns[one_of(random, 4)], a = turn[0] * RADIAN, b = turn[1] * RADIAN;
    /* Of a frame that is turned about x, then z. */
    const xyz away = {cos(b), sin(b), 0}, up = {-sin(b) * cos(a), cos(b) * cos(a), sin(a)},
              ahead = cross_of(away, up);
    const double radius = decades(random, 1, 1e8), angle = between(random, 0, 6.3),
                 high = decades(random, 0.01, 1), aside = decades(random, 0.3, 10);
    const xyz back = sum_of(scaled_by(up, cos(angle)), scaled_by(ahead, sin(angle))),
              eye = sum_of(scaled_by(away, high), scaled_by(back, aside)),
              target = scaled_by(any_direction(random), high / 2);
    char camera[400];
    snprintf(camera, sizeof camera,
             "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g], \"up\": "
             "[%.17g, %.17g, %.17g]",
             eye.x, eye.y, eye.z, target.x, target.y, target.z, away.x + up.x / 7,
             away.y + up.y / 7, away.z + up.z / 7);
    put_frame(out, random, accuracy, (frame){40, 16, camera, NULL});
    const int count = 1 + one_of(random, 6);
    for (int i = 0; i < count; i++) {
        const double turned = angle + between(random, -1, 1),
                     raised = one_of(random, 3)
                                  ? between(random, -1, 1) * decades(random, 1e-9, 0.1)
                                  : 0,
                     far = decades(random, 0.3, 10 * radius);
        const xyz from = sum_of(sum_of(scaled_by(up, -cos(turned)), scaled_by(ahead, -sin(turned))),
                                scaled_by(away, raised));
        const bool point = one_of(random, 2);
        fprintf(out, "%s{\"type\": \"%s\", \"intensity\": %.17g, ", i ? ", " : "",
                point ? "point" : "directional", between(random, 0.2, 1) / count);
        put_vector(out, point ? "position" : "direction", scaled_by(from, point ? far : -1));
        fputs("}", out);
    }
    put_objects(out);
    fputs("{", out);
    if (form == 3)
        put_ball(out, 16, 8, radius, true);
    else if (form == 1)
        fprintf(out, "\"type\": \"torus\", \"radius\": %.17g, \"tube\": %.17g, ", radius * 0.7,
                radius * 0.3);
    else
        fprintf(out, "\"type\": \"%s\", \"radius\": %.17g, ", forms[form], radius);
    if (form == 2) fprintf(out, "\"height\": %.17g, ", radius);
    put_material(out, random, 0.3, 30);
    fprintf(out, ", \"transform\": {\"rotate\": [%.17g, 0, %.17g], ", turn[0], turn[1]);
    put_vector(out, "translate", scaled_by(away, -radius));
    fputs("}}", out);
    put_end(out, random);
}

/* Planes and discs that are met flatly or from afar, looked at where a light is close to them. */
static void write_flatly(FILE *out, uint64_t *random, const char *accuracy) {
    static const double turns[][2] = {{0, 0}, {30, 0}, {0, 50}, {70, -40}};
    const double *turn = turns[one_of(random, 4)], a = turn[0] * RADIAN, b = turn[1] * RADIAN;
    /* About x, then z. */
    const xyz up = {-sin(b) * cos(a), cos(b) * cos(a), sin(a)}, right = {cos(b), sin(b), 0},
              ahead = cross_of(right, up);
    const double high = decades(random, 1e-3, 1e10), away = high * decades(random, 0.1, 1e7),
                 seen = hypot(high, away), close = seen * decades(random, 1e-6, 0.1),
                 field = 4 * close / seen;
    const xyz at = one_of(random, 2)
                       ? ORIGIN
                       : scaled_by(any_direction(random), seen * decades(random, 1e-3, 1)),
              target = sum_of(at, scaled_by(right, between(random, -1, 1) * close)),
              eye = sum_of(target, sum_of(scaled_by(up, high), scaled_by(ahead, away)));
    char camera[400];
    snprintf(camera, sizeof camera,
             "\"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, %.17g, %.17g], \"up\": "
             "[%.17g, %.17g, %.17g], \"fov\": %.17g",
             eye.x, eye.y, eye.z, target.x, target.y, target.z, up.x + right.x / 7,
             up.y + right.y / 7, up.z + right.z / 7, field / RADIAN);
    put_frame(out, random, accuracy, (frame){32, 4, camera, NULL});
    const int count = 1 + one_of(random, 2);
    for (int i = 0; i < count; i++) {
        fprintf(out, "%s{\"type\": \"point\", \"intensity\": %.17g, ", i ? ", " : "",
                decades(random, 0.1, 1));
        put_vector(out, "position",
                   sum_of(target, sum_of(scaled_by(up, close * decades(random, 0.01, 1)),
                                         scaled_by(ahead, close * between(random, -1, 1)))));
        fputs("}", out);
    }
    put_objects(out);
    if (one_of(random, 2))
        fputs("{\"type\": \"plane\", ", out);
    else
        fprintf(out, "{\"type\": \"disc\", \"radius\": %.17g, ", 3 * (seen + close));
    put_material(out, random, 1, 100);
    fprintf(out, ", \"transform\": {\"rotate\": [%g, 0, %g], ", turn[0], turn[1]);
    put_vector(out, "translate", at);
    fputs("}}", out);
    put_end(out, random);
}

/* What 64 bits of a long double would not do for. */
static void write_vast(FILE *out, uint64_t *random, const char *accuracy) {
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

/* Few lights on few shapes. */
static void write_shaped(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){32, 1, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 2), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 2), 0.5, 1000);
    put_end(out, random);
}

/* Outputs and colors beyond the usual; what they become is the measurement's work, not the
 * model's. */
static void write_shown(FILE *out, uint64_t *random, const char *accuracy) {
    static const char *const outputs[] = {
        "{\"display\": \"Rec.1886\", \"view\": \"Standard\"}",
        "{\"display\": \"Display P3\", \"view\": \"Standard\", \"format\": \"tiff\"}",
        "{\"format\": \"exr\"}",
        "{\"colorSpace\": \"YIQ\"}",
        "{\"colorSpace\": \"HSV\"}",
        "{\"colorSpace\": \"ACEScg\", \"format\": \"exr\"}",
        "{\"format\": \"png\", \"bitDepth\": 16}",
        "{\"format\": \"jpeg\", \"channel\": \"G\"}"};
    put_frame(out, random, accuracy, (frame){40, 8, NULL, outputs[one_of(random, 8)]});
    if (one_of(random, 4) == 0)
        fputs(
            "{\"type\": \"directional\", \"direction\": [0, -1, -1], \"color\": [1, -0.3, 0.2]}, ",
            out);
    put_lights(out, random, 1 + one_of(random, 4), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 3), 1, 1000);
    fprintf(out, "], \"workingSpace\": \"%s\"}", one_of(random, 3) ? "lin_rec709" : "ACEScg");
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

static void write_grazed(FILE *out, uint64_t *random, const char *accuracy) {
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

const family families[] = {
    {"plain", "an object or two, up to four lights", write_plain, true, false, 0},
    {"many", "up to 14 objects, up to 12 lights", write_many, true, false, 0},
    {"rims", "rims of light that overlap by a fraction of a pixel", write_rims, true, false, 0},
    {"slivers", "slivers and wedges of light", write_slivers, true, false, 0},
    {"coarse", "few pixels, shininess down to 0.05", write_coarse, true, false, 0},
    {"sharp", "shininess up to 1e6", write_sharp, true, false, 0},
    {"lamps", "up to 400 lights", write_lamps, true, false, 0},
    {"needles", "cylinders, cones, boxes and rings down to 1e-5 thin", write_needles, true, false,
     0},
    {"inplane", "planes with lights in them", write_inplane, true, false, 0},
    {"near", "lights and eyes next to a surface", write_near, true, false, 0},
    {"stretched", "flat, long and mirrored shapes", write_stretched, true, false, 0},
    {"faceted", "triangles, flat and gouraud", write_faceted, true, false, 0},
    {"smooth", "meshes with normals of their corners", write_smooth, true, false, 0},
    {"zoom", "meshes under a lens", write_zoom, true, false, 0},
    {"patches", "small patches beside large triangles", write_patches, true, false, 0},
    {"far", "scenes of any size, anywhere", write_far, true, false, 0},
    {"huge", "an eye above something huge", write_huge, true, false, 0},
    {"sunset", "an eye at something round and huge, against lights that graze it", write_sunset,
     true, false, 0},
    {"flatly", "planes and discs, flat or far, with lights close to where they are seen",
     write_flatly, true, true, 0},
    {"vast", "sizes up to 1e13 of what is near", write_vast, true, true, 0},
    {"grazed", "round things under a lens where they are met flatly, with a light close to it",
     write_grazed, true, true, 0},
    {"shown", "other outputs, working spaces and negative colors", write_shown, false, false, 0},
    {"models", "other models on an object or two", write_plain, true, false, BEYOND_MODELS},
    {"gloss", "other models, shininess up to 1e6, roughness down to 1e-4", write_sharp, true, false,
     BEYOND_MODELS},
    {"matte", "other models, few pixels, shininess down to 0", write_coarse, true, false,
     BEYOND_MODELS},
    {"beside", "other models, lights and eyes next to a surface", write_near, true, false,
     BEYOND_MODELS},
    {"bent", "other models on meshes with normals of their corners", write_smooth, true, false,
     BEYOND_MODELS},
    {"facets", "other models on triangles, flat and gouraud", write_faceted, true, false,
     BEYOND_MODELS},
    {"away", "other models in scenes of any size, anywhere", write_far, true, false, BEYOND_MODELS},
    {"dusk", "other models, round and huge, against lights that graze them", write_sunset, true,
     false, BEYOND_MODELS},
    {"level", "other models on planes and discs, with lights close to where they are seen",
     write_flatly, true, true, BEYOND_MODELS},
    {"skimmed", "other models under a lens where they are met flatly", write_grazed, true, true,
     BEYOND_MODELS},
    {"shapes", "lights with a shape, Phong's model", write_shaped, true, false, BEYOND_SHAPES},
    {"areas", "lights with a shape, other models", write_shaped, true, false,
     BEYOND_SHAPES | BEYOND_MODELS},
    {"veils", "opacity, up to 14 objects", write_many, true, false, BEYOND_OPACITY},
    {"tinted", "opacity and other models", write_plain, true, false,
     BEYOND_OPACITY | BEYOND_MODELS},
    {"spectra", "spectra of one sample and other models", write_plain, true, false,
     BEYOND_SPECTRUM | BEYOND_MODELS},
};
const int family_count = sizeof families / sizeof families[0];

char *write_scene(const family *f, uint64_t seed, const char *accuracy) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    uint64_t random = seed * 0x9e3779b97f4a7c15u + 1;
    for (const char *c = f->name; *c; c++) random = random * 31 + (unsigned char)*c;
    set_beyond(f->beyond, &random);
    f->write(out, &random, accuracy);
    fclose(out);
    return text;
}
