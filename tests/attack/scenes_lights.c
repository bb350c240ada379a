/* Scenes whose lights are hard. */
#include "attack/makers.h"

#include <math.h>
#include <stdlib.h>

#include "attack/write.h"

static const double RADIAN = 3.14159265358979323846 / 180;
static const xyz ORIGIN = {0, 0, 0}, ONE = {1, 1, 1};

/* A plane or a disc before the camera, and spots whose rims touch, overlap by a fraction of a
 * pixel, or leave a gap as wide: large ones, so that they do so for many pixels; equal ones, so
 * that their sum hides it. */
void write_rims(FILE *out, uint64_t *random, const char *accuracy) {
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
void write_slivers(FILE *out, uint64_t *random, const char *accuracy) {
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

void write_lamps(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){24, 4, NULL, NULL});
    put_lights(out, random, (int)decades(random, 20, 400), ORIGIN,
               one_of(random, 2) ? 1 : decades(random, 0.5, 10));
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 4), 1, 300);
    put_end(out, random);
}

/* Lamps above a plane or a disc, or before something round, that fall off in all ways: so many, and
 * most of them so far, that what they add is told for many together. Some are near, all over or all
 * on one side, and some weak. */
/* `crowded`: more of them, that fall off alike, and exponents that are whole numbers. */
static void write_lamps_of(FILE *out, uint64_t *random, const char *accuracy, bool crowded) {
    static const char *const falls[] = {"[1, 0, 0]", "[0, 0, 1]", "[0, 1, 0]", "[1, 0.2, 0.5]",
                                        "[0.1, 0, 1]"};
    put_frame(out, random, accuracy, (frame){32, 4, NULL, NULL});
    const int count = (int)decades(random, 100, crowded ? 900 : 350),
              one = one_of(random, crowded ? 5 : 6);
    const double far = decades(random, 4, 200), bright = decades(random, 0.3, 3);
    const bool grey = one_of(random, 2), aside = one_of(random, 3) == 0;
    const bool extreme = one_of(random, 4) == 0;
    const int pure = one_of(random, 6); /* a component of colors that is 0, or none */
    for (int i = 0; i < count; i++) {
        const int fall = one < 5 ? one : one_of(random, 5);
        const double away =
            one_of(random, 20) ? far * between(random, 0.5, 2) : decades(random, 1, 9);
        xyz at = any_direction(random);
        at.z = fabs(at.z);
        if (aside) at = sum_of((xyz){0.5, 0.5, 0.3}, scaled_by(at, 0.1));
        at = scaled_by(at, away);
        const double squared = at.x * at.x + at.y * at.y + at.z * at.z;
        const double fallen = fall == 0 ? 1 : fall == 2 ? 1 / sqrt(squared) : 1 / squared;
        const bool spot = one_of(random, 8) == 0;
        /* Some powers are next to nothing, or too much for a picture; some lamps are in objects. */
        const double wild = one_of(random, 25) || !extreme ? 1
                            : one_of(random, 2)            ? decades(random, 1e-300, 1e-6)
                                                           : decades(random, 1, 1e30);
        if (extreme && one_of(random, 25) == 0) at = scaled_by(at, between(random, 0, 1) / away);
        fprintf(out, "%s{\"type\": \"%s\", \"attenuation\": %s, \"intensity\": %.17g, ",
                i ? ", " : "", spot ? "spot" : "point", falls[fall],
                decades(random, 0.3, 3) * bright / count / fallen * wild);
        if (spot) { /* the picture is in its cone, or at its rim */
            fprintf(out, "\"angle\": %.17g, \"penumbra\": %.17g, ",
                    atan(decades(random, 1, 4) / away) / RADIAN, between(random, 0, 0.5));
            put_vector(out, "direction", scaled_by(at, -1));
            fputs(", ", out);
        }
        if (!grey && pure < 3 && one_of(random, 2))
            fprintf(out, "\"color\": [%d, %d, %d], ", pure != 2, pure != 0, pure != 1);
        else if (!grey)
            put_color(out, "color", random, 1), fputs(", ", out);
        if (one_of(random, 30) == 0) fprintf(out, "\"minDistance\": %.17g, ", sqrt(squared));
        put_vector(out, "position", at);
        fputs("}", out);
    }
    put_objects(out);
    const bool flat = one_of(random, 2);
    if (flat)
        fprintf(out, "{\"type\": \"%s\", ", one_of(random, 2) ? "plane" : "disc");
    else
        fputs("{", out), put_shape(out, random, 1);
    if (one_of(random, 3)) {
        const double dull = between(random, 0.1, 1),
                     shine = one_of(random, 2) ? between(random, 0, 0.5) : 0,
                     power = decades(random, crowded ? 6 : 1, crowded ? 80 : 1000);
        fprintf(out,
                "\"material\": {\"diffuse\": [%.17g, %.17g, %.17g], \"specular\": %.17g, "
                "\"shininess\": "
                "%.17g}",
                pure == 0 ? 0 : dull, pure == 1 ? 0 : dull, pure == 2 ? 0 : dull, shine,
                crowded ? floor(power) : power);
    } else {
        put_material(out, random, 1, 300);
    }
    if (flat)
        fprintf(out, ", \"transform\": {\"rotate\": [%.17g, 0, 0]}}",
                one_of(random, 2) ? 90 : between(random, 50, 130));
    else
        fputs(", ", out), put_turn(out, random, ONE, ORIGIN), fputs("}", out);
    if (one_of(random, 3) == 0) {
        fputs(", {", out);
        put_shape(out, random, 0.6);
        put_material(out, random, 1, 300);
        fputs(", ", out);
        put_turn(out, random, ONE, ORIGIN);
        fputs("}", out);
    }
    put_end(out, random);
}

void write_thousands(FILE *out, uint64_t *random, const char *accuracy) {
    write_lamps_of(out, random, accuracy, false);
}

void write_crowds(FILE *out, uint64_t *random, const char *accuracy) {
    write_lamps_of(out, random, accuracy, true);
}

/* Lights in planes, to within rounding: in that of a flat face of a turned and moved object. */
void write_inplane(FILE *out, uint64_t *random, const char *accuracy) {
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
void write_near(FILE *out, uint64_t *random, const char *accuracy) {
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

/* An eye at something round and huge, against lights in the plane that touches it there: nearly all
 * that is seen is where N.L is 0 to within some rounding, under a highlight. */
void write_sunset(FILE *out, uint64_t *random, const char *accuracy) {
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
void write_flatly(FILE *out, uint64_t *random, const char *accuracy) {
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

/* Few lights on few shapes. */
void write_shaped(FILE *out, uint64_t *random, const char *accuracy) {
    put_frame(out, random, accuracy, (frame){32, 1, NULL, NULL});
    put_lights(out, random, 1 + one_of(random, 2), ORIGIN, 1);
    put_objects(out);
    put_some(out, random, 1 + one_of(random, 2), 0.5, 1000);
    put_end(out, random);
}

/* Outputs and colors beyond the usual; what they become is the measurement's work, not the
 * model's. */
void write_shown(FILE *out, uint64_t *random, const char *accuracy) {
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
