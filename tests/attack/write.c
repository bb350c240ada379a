#include "attack/write.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double TURN = 2 * 3.14159265358979323846;

static _Thread_local unsigned style;
static _Thread_local bool grey_stuff;

void set_beyond(unsigned beyond, uint64_t *random) {
    style = beyond;
    grey_stuff = beyond && one_of(random, 2);
}

bool goes_beyond(unsigned bits) {
    return style & bits;
}

void put_beyond(FILE *out, uint64_t *random) {
    if (style & BEYOND_SPECTRUM)
        fprintf(out, ", \"spectral\": {\"channels\": %d}", 16 + one_of(random, 64));
    if (!(style & (BEYOND_MIRRORS | BEYOND_OPACITY | BEYOND_SHADOWS))) return;
    fputs(", \"trace\": {", out);
    if (style & BEYOND_SHADOWS)
        fprintf(out, "\"shadows\": true, \"shadowSamples\": %d%s", 1 + one_of(random, 20),
                style & (BEYOND_MIRRORS | BEYOND_OPACITY) ? ", " : "");
    if (style & (BEYOND_MIRRORS | BEYOND_OPACITY))
        fprintf(out, "\"depth\": %d, \"minContribution\": %.17g",
                1 + one_of(random, !(style & BEYOND_MIRRORS) ? 16
                                   : style & BEYOND_GLASS    ? 4
                                                             : 6),
                one_of(random, 2) ? 0 : decades(random, 1e-4, 0.2));
    fputs("}", out);
}

double between(uint64_t *random, double low, double high) {
    *random += 0x9e3779b97f4a7c15u; /* splitmix64 */
    uint64_t z = *random;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * ((double)(z >> 11) * 0x1p-53);
}

int one_of(uint64_t *random, int count) {
    return (int)between(random, 0, count);
}

double decades(uint64_t *random, double low, double high) {
    return pow(10, between(random, log10(low), log10(high)));
}

xyz scaled_by(xyz v, double by) {
    return (xyz){v.x * by, v.y * by, v.z * by};
}

xyz sum_of(xyz a, xyz b) {
    return (xyz){a.x + b.x, a.y + b.y, a.z + b.z};
}

xyz cross_of(xyz a, xyz b) {
    return (xyz){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

xyz any_direction(uint64_t *random) {
    const double y = between(random, -1, 1), angle = between(random, 0, TURN), r = sqrt(1 - y * y);
    return (xyz){r * cos(angle), y, r * sin(angle)};
}

void put_vector(FILE *out, const char *name, xyz v) {
    fprintf(out, "\"%s\": [%.17g, %.17g, %.17g]", name, v.x, v.y, v.z);
}

/* A checker of which nothing but the middle of one check is seen, whose color is chosen. */
static void put_pattern(FILE *out, const char *name, uint64_t *random, xyz chosen, bool grey,
                        double most) {
    const double r = between(random, 0, most), g = between(random, 0, most),
                 b = between(random, 0, most);
    const xyz other = {r, grey ? r : g, grey ? r : b};
    const int second = one_of(random, 2);
    const xyz low = second ? other : chosen, high = second ? chosen : other;
    fprintf(out,
            "\"%s\": {\"pattern\": \"checker\", \"colors\": [[%.17g, %.17g, %.17g], [%.17g, %.17g, "
            "%.17g]], \"uv\": {\"scale\": 1e-9, \"offset\": [%s, 0.5]}}",
            name, low.x, low.y, low.z, high.x, high.y, high.z, second ? "1.5" : "0.5");
}

void put_color(FILE *out, const char *name, uint64_t *random, double most) {
    const double r = between(random, 0, most), g = between(random, 0, most),
                 b = between(random, 0, most);
    const bool shines = strcmp(name, "color") == 0;
    bool grey = one_of(random, 3) == 0;
    if (style & BEYOND_SPECTRUM) {
        grey = shines != grey_stuff;
        if (!shines && grey && one_of(random, 2)) {
            fprintf(out, "\"%s\": {\"wavelengths\": [%.17g], \"values\": [%.17g]}", name,
                    between(random, 380, 730), r);
            return;
        }
    }
    const xyz chosen = {r, grey ? r : g, grey ? r : b};
    const bool may = strcmp(name, "diffuse") == 0 || strcmp(name, "specular") == 0 ||
                     strcmp(name, "reflection") == 0 || strcmp(name, "transmission") == 0;
    if (style & BEYOND_TEXTURES && may && one_of(random, 3))
        put_pattern(out, name, random, chosen, grey, most);
    else
        put_vector(out, name, chosen);
}

void put_frame(FILE *out, uint64_t *random, const char *accuracy, frame f) {
    static const int counts[] = {1, 1, 2, 3, 4, 4, 4, 5, 8, 16, 64};
    int samples = counts[one_of(random, sizeof counts / sizeof counts[0])];
    if (samples > f.most_samples) samples = f.most_samples;
    const int width = (int)(f.pixels * between(random, 0.8, 1.3)),
              height = (int)(f.pixels * between(random, 0.7, 1.1));
    static const char *const backgrounds[] = {"[0, 0, 0]", "[0.1, 0.2, 0.3]", "null", "0.02"};
    fprintf(out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"accuracy\": {%s}, "
            "\"output\": %s, \"ambient\": %g, \"background\": %s, \"camera\": {",
            width, height, samples, accuracy, f.output ? f.output : "{}",
            one_of(random, 2) ? 0.1 : 0,
            backgrounds[one_of(random, style & BEYOND_OPACITY ? 2 : 4)]);
    if (f.camera) {
        fputs(f.camera, out);
    } else {
        put_vector(out, "position",
                   (xyz){between(random, -1, 1), between(random, -1, 1), between(random, 3.5, 5)});
        if (one_of(random, 3) == 0) fputs(", \"type\": \"orthographic\", \"height\": 2.5", out);
    }
    fputs("}, \"lights\": [", out);
}

/* Shininess at its ends, too. */
static double any_shininess(uint64_t *random, double least, double most) {
    if (!style) return decades(random, least, most);
    const int kind = one_of(random, 10);
    if (style & BEYOND_SHAPES) most = fmin(most, 3000);
    return kind == 0   ? 0
           : kind == 1 ? (style & BEYOND_SHAPES ? 1e4 : 1e6)
                       : decades(random, least, most);
}

static void put_phong(FILE *out, uint64_t *random, double least, double most) {
    put_color(out, "specular", random, 0.8);
    fprintf(out, ", \"shininess\": %.17g", any_shininess(random, least, most));
}

static void put_lobes(FILE *out, uint64_t *random, double least, double most) {
    if (one_of(random, 4)) return;
    fprintf(out, ", \"lobes\": [{\"specular\": %.17g, ", between(random, 0, 0.5));
    fprintf(out, "\"shininess\": %.17g}]", any_shininess(random, least, most));
}

static void put_fresnel(FILE *out, uint64_t *random) {
    const bool grey = (style & BEYOND_SPECTRUM) && grey_stuff;
    fputs("\"fresnel\": {", out);
    if (one_of(random, 2)) {
        const double r = one_of(random, 3) ? between(random, 0, 1) : one_of(random, 2),
                     g = grey ? r : between(random, 0, 1);
        const xyz chosen = {r, g, grey ? r : one_of(random, 5) ? 0.5 : 0};
        if (style & BEYOND_TEXTURES && one_of(random, 2))
            put_pattern(out, "f0", random, chosen, grey, 1);
        else
            put_vector(out, "f0", chosen);
    } else {
        const double n = decades(random, 0.05, 10),
                     k = one_of(random, 2) ? 0 : decades(random, 0.01, 30);
        put_vector(out, "n", (xyz){n, grey ? n : 1.5, n});
        fputs(", ", out);
        put_vector(out, "k", (xyz){k, grey ? k : 0, k});
    }
    fputs("}", out);
}

static void put_facets(FILE *out, uint64_t *random) {
    const int lobes = 1 + (one_of(random, 4) == 0);
    put_fresnel(out, random);
    fputs(", \"lobes\": [", out);
    for (int k = 0; k < lobes; k++) {
        const int kind = one_of(random, 10);
        const double least = style & BEYOND_SHAPES ? 0.02 : 1e-4;
        fprintf(out, "%s{\"roughness\": %.17g, \"weight\": %.17g}", k ? ", " : "",
                kind == 0   ? 10
                : kind == 1 ? least
                : kind == 2 ? 1
                            : decades(random, 0.02, 1),
                between(random, 0, 1));
    }
    fputs("]", out);
}

/* What a material of another model has. True: also what Phong's has. */
static bool put_model(FILE *out, uint64_t *random) {
    static const char *const models[] = {"phong", "blinn-phong", "phong-normalized", "oren-nayar",
                                         "cook-torrance"};
    const int model = style & BEYOND_MODELS ? one_of(random, 5) : 0;
    fprintf(out, "\"model\": \"%s\", ", models[model]);
    if (style & BEYOND_OPACITY && one_of(random, 3))
        fprintf(out, "\"opacity\": [%.17g, %.17g, %.17g], ", between(random, 0, 1),
                between(random, 0, 1),
                one_of(random, 3) ? between(random, 0, 1) : one_of(random, 2));
    if (style & BEYOND_MIRRORS && one_of(random, 3)) {
        put_color(out, "reflection", random, one_of(random, 2) ? 0.5 : 0.2);
        fputs(", ", out);
    }
    if (style & BEYOND_GLASS && one_of(random, 2)) {
        put_color(out, "transmission", random, 0.5);
        fprintf(out, ", \"ior\": %.17g, ", decades(random, 0.5, 2.5));
    }
    if (model == 3)
        fprintf(out, "\"sigma\": %.17g", one_of(random, 6) ? between(random, 0, 60) : 0);
    if (model == 4) put_facets(out, random);
    return model < 3;
}

void put_material(FILE *out, uint64_t *random, double least, double most) {
    fputs("\"material\": {", out);
    put_color(out, "diffuse", random, 0.9);
    fputs(", ", out);
    const bool kin = !style || put_model(out, random);
    if (kin) put_phong(out, random, least, most);
    if (one_of(random, 6) == 0) fprintf(out, ", \"emissive\": %.17g", between(random, 0, 0.3));
    if (kin) put_lobes(out, random, least, most);
    if (one_of(random, 8) == 0) fputs(", \"side\": \"front\"", out);
    fputs("}", out);
}

/* A light with a shape: also in or through what is lit, and small and far. */
static void put_shaped(FILE *out, uint64_t *random, double strength, xyz at, double size) {
    static const char *const types[] = {"rect", "disc", "sphere"};
    const int type = one_of(random, 3);
    const xyz from = scaled_by(any_direction(random), size * decades(random, 0.5, 7));
    const double wide = size * decades(random, one_of(random, 4) ? 0.1 : 1e-5, 2);
    fprintf(out, "{\"type\": \"%s\", ", types[type]);
    put_color(out, "color", random, strength);
    fputs(", ", out);
    put_vector(out, "position", sum_of(at, from));
    if (type == 0)
        fprintf(out, ", \"size\": [%.17g, %.17g]", wide, wide * decades(random, 0.1, 1));
    else
        fprintf(out, ", \"radius\": %.17g", wide / 2);
    if (type < 2) {
        const xyz aim = sum_of(scaled_by(from, -1 / size), scaled_by(any_direction(random), 0.7));
        fputs(", ", out);
        put_vector(out, "direction", aim);
    }
    if (type == 0) {
        fputs(", ", out);
        put_vector(out, "up", any_direction(random));
    }
    fputs("}", out);
}

static void put_light(FILE *out, uint64_t *random, double strength, xyz at, double size) {
    static const char *const types[] = {"point", "spot", "directional", "point"};
    const int type = one_of(random, 4);
    const xyz from = scaled_by(any_direction(random), size * between(random, 2, 7));
    fprintf(out, "{\"type\": \"%s\", ", types[type]);
    put_color(out, "color", random, strength);
    if (type != 2) {
        fputs(", ", out);
        put_vector(out, "position", sum_of(at, from));
        if (one_of(random, 3) == 0)
            fprintf(out, ", \"attenuation\": [%.17g, %.17g, %.17g], \"minDistance\": %.17g",
                    between(random, 0, 1), between(random, 0, 1) / size,
                    between(random, 0.01, 1) / size / size, between(random, 0, 0.5) * size);
    }
    if (type == 1 || type == 2) {
        fputs(", ", out);
        put_vector(out, "direction",
                   sum_of(scaled_by(from, -1 / size), scaled_by(any_direction(random), 0.5)));
    }
    if (type == 1)
        fprintf(out, ", \"angle\": %.17g, \"penumbra\": %.17g, \"exponent\": %.17g",
                between(random, 5, 100), one_of(random, 3) ? between(random, 0, 1) : 0,
                one_of(random, 2) ? decades(random, 0.3, 100) : 0);
    fputs("}", out);
}

void put_lights(FILE *out, uint64_t *random, int count, xyz at, double size) {
    const double strength = decades(random, 0.1, 2) / sqrt(count);
    for (int i = 0; i < count; i++) {
        if (i) fputs(", ", out);
        if ((style & BEYOND_SHAPES) && one_of(random, 3))
            put_shaped(out, random, strength, at, size);
        else
            put_light(out, random, strength, at, size);
    }
}

void put_shape(FILE *out, uint64_t *random, double size) {
    const double r = size * between(random, 0.4, 1), h = size * between(random, 0.5, 2);
    switch (one_of(random, 6)) {
    case 0:
        fprintf(out, "\"type\": \"sphere\", \"radius\": %.17g, ", r);
        break;
    case 1:
        fprintf(out, "\"type\": \"box\", ");
        put_vector(out, "size", (xyz){r, h, size});
        fputs(", ", out);
        break;
    case 2:
        fprintf(out, "\"type\": \"cylinder\", \"radius\": %.17g, \"height\": %.17g, ", r, h);
        break;
    case 3:
        fprintf(out, "\"type\": \"cone\", \"radius\": %.17g, \"height\": %.17g, ", r, h);
        break;
    case 4:
        fprintf(out, "\"type\": \"torus\", \"radius\": %.17g, \"tube\": %.17g, ", r,
                r * between(random, 0.1, 0.9));
        break;
    default:
        fprintf(out, "\"type\": \"disc\", \"radius\": %.17g, ", r);
    }
}

void put_turn(FILE *out, uint64_t *random, xyz scale, xyz at) {
    fputs("\"transform\": {", out);
    put_vector(out, "scale", scale);
    fprintf(out, ", \"rotate\": [%.17g, %.17g, %.17g], ", between(random, 0, 360),
            between(random, 0, 360), between(random, 0, 360));
    put_vector(out, "translate", at);
    fputs("}", out);
}

void put_ball(FILE *out, int slices, int stacks, double size, bool smooth) {
    static const char *const members[] = {"positions", "normals"};
    fputs("\"type\": \"mesh\"", out);
    for (int pass = 0; pass < (smooth ? 2 : 1); pass++) {
        fprintf(out, ", \"%s\": [", members[pass]);
        for (int s = 0; s <= stacks; s++)
            for (int i = 0; i < slices; i++) {
                const double a = TURN / 2 * s / stacks, b = TURN * i / slices, r = pass ? 1 : size;
                fprintf(out, "%s%.17g, %.17g, %.17g", s || i ? ", " : "", r * sin(a) * sin(b),
                        r * cos(a), r * sin(a) * cos(b));
            }
        fputs("]", out);
    }
    for (int s = 0; s <= stacks && style & BEYOND_TEXTURES; s++)
        for (int i = 0; i < slices; i++)
            fprintf(out, "%s%.17g, %.17g", s || i ? ", " : ", \"uvs\": [", (double)i / slices,
                    (double)s / stacks);
    fputs(style & BEYOND_TEXTURES ? "], \"indices\": [" : ", \"indices\": [", out);
    const char *comma = "";
    for (int s = 0; s < stacks; s++)
        for (int i = 0; i < slices; i++) {
            const int a = s * slices + i, b = s * slices + (i + 1) % slices;
            if (s + 1 < stacks)
                fprintf(out, "%s%d, %d, %d", comma, a, a + slices, b + slices), comma = ", ";
            if (s > 0) fprintf(out, "%s%d, %d, %d", comma, a, b + slices, b), comma = ", ";
        }
    fputs("], ", out);
}

void put_end(FILE *out, uint64_t *random) {
    fputs("]", out);
    put_beyond(out, random);
    fputs("}", out);
}

void put_objects(FILE *out) {
    fputs("], \"objects\": [", out);
}

void put_some(FILE *out, uint64_t *random, int count, double least, double most) {
    for (int i = 0; i < count; i++) {
        fputs(i ? ", {" : "{", out);
        put_shape(out, random, between(random, 0.5, 1.2));
        put_material(out, random, least, most);
        fputs(", ", out);
        put_turn(out, random, (xyz){1, 1, 1},
                 scaled_by(any_direction(random), between(random, 0, count > 1 ? 1.2 : 0.4)));
        fputs("}", out);
    }
}
