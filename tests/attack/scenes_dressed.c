/* Documents whose surfaces have patterns, pictures and maps of normals, in environments. */
#include <math.h>

#include "attack/coats.h"
#include "attack/knobs.h"
#include "attack/makers.h"
#include "attack/write.h"

static const xyz ONE = {1, 1, 1};

/* Some of them degenerate: all corners at one place, on one line, mirrored, far beyond. */
static void put_uvs(FILE *out, uint64_t *random, int across, int down) {
    const int kind = one_of(random, 7);
    const double by = kind == 5 ? decades(random, 1e-9, 1e9) : 1;
    fputs("\"uvs\": [", out);
    for (int j = 0; j <= down; j++)
        for (int i = 0; i <= across; i++) {
            const double u = (double)i / across, v = (double)j / down;
            const double s = kind == 0   ? 0.3
                             : kind == 1 ? u + v
                             : kind == 2 ? -u
                                         : by * u,
                         t = kind == 0   ? 0.7
                             : kind == 1 ? 2 * (u + v)
                             : kind == 3 ? 0
                             : kind == 4 ? between(random, 0, 1)
                                         : by * v;
            fprintf(out, "%s%.17g, %.17g", i || j ? ", " : "", s, t);
        }
    fputs("], ", out);
}

/* A sheet with waves, or a flat one, with normals of its corners or without. */
static void put_sheet(FILE *out, uint64_t *random) {
    const int across = 1 + one_of(random, 5), down = 1 + one_of(random, 5);
    const double high = one_of(random, 3) ? between(random, 0, 0.4) : 0;
    fputs("\"type\": \"mesh\", \"positions\": [", out);
    for (int j = 0; j <= down; j++)
        for (int i = 0; i <= across; i++)
            fprintf(out, "%s%.17g, %.17g, %.17g", i || j ? ", " : "", 2.0 * i / across - 1,
                    2.0 * j / down - 1, high * between(random, -1, 1));
    fputs("], ", out);
    if (one_of(random, 2)) {
        fputs("\"normals\": [", out);
        for (int k = 0; k < (across + 1) * (down + 1); k++)
            fprintf(out, "%s%.17g, %.17g, 1", k ? ", " : "", high * between(random, -2, 2),
                    high * between(random, -2, 2));
        fputs("], ", out);
    }
    put_uvs(out, random, across, down);
    fputs("\"indices\": [", out);
    for (int j = 0; j < down; j++)
        for (int i = 0; i < across; i++) {
            const int a = j * (across + 1) + i, b = a + across + 1;
            fprintf(out, "%s%d, %d, %d, %d, %d, %d", i || j ? ", " : "", a, a + 1, b + 1, a, b + 1,
                    b);
        }
    fputs("], ", out);
}

/* It may be lit once a face or a corner. */
static void put_way(FILE *out, uint64_t *random, bool cut) {
    static const char *const ways[] = {"flat", "gouraud"};
    if (!goes_beyond(BEYOND_FACETS) || one_of(random, 4) == 0) return;
    fprintf(out, "\"interpolation\": \"%s\", ", ways[knob_of(random, 2)]);
    /* All corners have integrals over environments, which are slow. */
    const int most = goes_beyond(BEYOND_SKY) ? 2 : 14;
    if (cut) fprintf(out, "\"segments\": %d, ", 3 + one_of(random, most));
}

/* In steps of a tenth, and of 45 degrees. */
static void put_square_turn(FILE *out, uint64_t *random, double up) {
    fputs("\"transform\": {", out);
    if (one_of(random, 3) == 0)
        fprintf(out, "\"scale\": [%d, 1, %d], ", one_of(random, 2) ? 1 : -1, 1 + one_of(random, 2));
    fprintf(out, "\"rotate\": [%d, %d, %d], \"translate\": [%.17g, %.17g, %.17g]}",
            45 * one_of(random, 8), 45 * one_of(random, 8), 45 * one_of(random, 8),
            0.1 * one_of(random, 5), up, 0.1 * one_of(random, 5));
}

static void put_square(FILE *out, uint64_t *random, int index) {
    static const char *const shapes[] = {"sphere", "cylinder", "cone", "torus", "box", "disc"};
    fprintf(out, "%s\"type\": \"%s\", ", index ? ", {" : "{", shapes[one_of(random, 6)]);
    put_way(out, random, true);
    put_coat(out, random);
    fputs(", ", out);
    put_square_turn(out, random, 0.1 * one_of(random, 5));
    fputs("}", out);
}

static void put_dressed(FILE *out, uint64_t *random, int index) {
    const int kind = one_of(random, 5);
    fputs(index ? ", {" : "{", out);
    if (kind == 0 && !goes_beyond(BEYOND_FACETS)) {
        fputs("\"type\": \"plane\", ", out);
        put_coat(out, random);
        fprintf(out,
                ", \"transform\": {\"rotate\": [%.17g, %.17g, %.17g], \"translate\": "
                "[0, %.17g, 0]}}",
                one_of(random, 2) ? between(random, -10, 10) : 0, between(random, 0, 360),
                one_of(random, 3) ? 0 : between(random, 0, 360), between(random, -1.5, -0.3));
        return;
    }
    if (kind == 1)
        put_sheet(out, random);
    else if (goes_beyond(BEYOND_LEVEL) && goes_beyond(BEYOND_PRINTS))
        fputs(one_of(random, 2) ? "\"type\": \"box\", " : "\"type\": \"disc\", ", out);
    else
        put_shape(out, random, between(random, 0.5, 1.2));
    put_way(out, random, kind != 1);
    put_coat(out, random);
    fputs(", ", out);
    const xyz scale = one_of(random, 4) ? ONE
                                        : (xyz){between(random, -1, 1), between(random, 0.1, 1),
                                                knob_of(random, 2) ? 1 : 1e-3};
    put_turn(out, random, scale, scaled_by(any_direction(random), between(random, 0, 0.8)));
    fputs("}", out);
}

static void put_shine_from(FILE *out, uint64_t *random) {
    const xyz at = scaled_by(any_direction(random), between(random, 2, 7));
    fprintf(out, "{\"color\": [%.17g, %.17g, %.17g], ", knob(random, 0, 1), between(random, 0, 1),
            between(random, 0, 1));
    if (one_of(random, 4))
        fprintf(out, "\"type\": \"point\", \"position\": [%.17g, %.17g, %.17g]}",
                at.x + knob(random, 0, 1), fabs(at.y), at.z);
    else
        fprintf(out, "\"type\": \"directional\", \"direction\": [%.17g, %.17g, %.17g]}", -at.x,
                -fabs(at.y) - 0.1, -at.z);
}

static void put_all_light(FILE *out, uint64_t *random) {
    const bool sky = goes_beyond(BEYOND_SKY);
    const int count = sky ? knob_of(random, 3) : 1 + knob_of(random, 3);
    int put = 0;
    for (int i = 0; i < count; i++, put++) {
        if (put) fputs(", ", out);
        put_shine_from(out, random);
    }
    const int skies = !sky ? 0 : goes_beyond(BEYOND_LEVEL) || knob_of(random, 8) ? 1 : 2;
    for (int i = 0; i < skies; i++, put++) {
        if (put) fputs(", ", out);
        put_sky(out, random, i == 0);
    }
}

void write_dressed(FILE *out, uint64_t *random, const char *accuracy) {
    static const char *const outputs[] = {
        NULL, "{\"format\": \"png\", \"bitDepth\": 16}",
        "{\"format\": \"png\", \"display\": \"sRGB\", \"view\": \"Standard\", \"exposure\": 1}",
        NULL};
    const bool slow = goes_beyond(BEYOND_SKY);
    char camera[200];
    const int view = one_of(random, 4);
    if (goes_beyond(BEYOND_SQUARE)) {
        const double x = 0.1 * one_of(random, 5), y = 0.1 * one_of(random, 5),
                     z = 0.1 * one_of(random, 5);
        snprintf(camera, sizeof camera,
                 "\"type\": \"%s\", \"position\": [%.17g, %.17g, %.17g], \"target\": [%.17g, "
                 "%.17g, %.17g]",
                 one_of(random, 2) ? "orthographic" : "perspective", x, y, view ? 4 : z, x, y,
                 view ? z : z - 1);
    } else if (view == 0) /* along a floor */
        snprintf(camera, sizeof camera,
                 "\"position\": [0, %.17g, 3], \"target\": [0, %.17g, -9], \"fov\": 60",
                 decades(random, 1e-3, 1), between(random, -2, 0.5));
    else if (view == 1)
        snprintf(camera, sizeof camera,
                 "\"type\": \"orthographic\", \"height\": %.17g, \"position\": [1, 1, 3]",
                 decades(random, 1, 100));
    else
        snprintf(camera, sizeof camera, "\"position\": [%.17g, %.17g, 4]", between(random, -1, 1),
                 between(random, -0.5, 2));
    put_frame(out, random, accuracy,
              (frame){slow ? 8 : 24,
                      one_of(random, 12) == 0 ? 64
                      : slow                  ? 2
                                              : 8,
                      camera, outputs[one_of(random, 4)]});
    put_all_light(out, random);
    put_objects(out);
    const int count = 1 + one_of(random, 3);
    for (int i = 0; i < count; i++)
        (goes_beyond(BEYOND_SQUARE) ? put_square : put_dressed)(out, random, i);
    put_end(out, random);
}
