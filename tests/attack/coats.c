#include "attack/coats.h"

#include <math.h>

#include "attack/knobs.h"
#include "attack/pictures.h"
#include "attack/scenes.h"
#include "attack/write.h"

/* ---- What a coefficient is. ---- */

/* Mostly of a few tiles, and now and then beyond all that anybody would want. */
static void put_uv(FILE *out, uint64_t *random, const char *wrap) {
    if (goes_beyond(BEYOND_SQUARE)) {
        static const double scales[] = {1, 2, 3, 0.5, 10, 0.1};
        const double s = scales[knob_of(random, 6)], t = scales[one_of(random, 6)];
        fprintf(out,
                ", \"uv\": {\"scale\": [%.17g, %.17g], \"rotate\": %d, \"offset\": [%.17g, "
                "%.17g]",
                s, one_of(random, 2) ? s : t, 45 * knob_of(random, 8), 0.25 * one_of(random, 8),
                0.1 * one_of(random, 20));
        if (wrap) fprintf(out, ", \"wrap\": \"%s\"", wrap);
        fputs("}", out);
        return;
    }
    const bool level = goes_beyond(BEYOND_LEVEL), wild = !level && one_of(random, 4) == 0;
    const double s = wild ? knob_decades(random, 1e-9, 4e8) : knob_decades(random, 0.3, 30),
                 t = one_of(random, 2) ? s : s * between(random, -2, 2);
    fprintf(out, ", \"uv\": {\"scale\": [%.17g, %.17g], \"rotate\": %.17g, \"offset\": ", s, t,
            one_of(random, 3) ? knob(random, -400, 400) : 90.0 * one_of(random, 5));
    const double far = level || one_of(random, 6) ? 2 : decades(random, 1, 1e9);
    fprintf(out, "[%.17g, %.17g]", knob(random, -far, far),
            one_of(random, 3) ? between(random, -far, far) : 0.5 * one_of(random, 3));
    if (wrap) fprintf(out, ", \"wrap\": \"%s\"", wrap);
    fputs("}", out);
}

static const char *any_wrap(uint64_t *random) {
    static const char *const wraps[] = {"clamp", "repeat", "mirror"};
    return wraps[knob_of(random, 3)];
}

static void put_knobbed(FILE *out, uint64_t *random, double most, bool grey) {
    const double r = knob(random, 0, most), g = between(random, 0, most),
                 b = between(random, 0, most);
    const int kind = one_of(random, 12);
    if (grey || kind == 0)
        fprintf(out, "[%.17g, %.17g, %.17g]", r, r, r);
    else if (kind == 1)
        fprintf(out, "[%.17g, 0, 0]", r);
    else
        fprintf(out, "[%.17g, %.17g, %.17g]", r, g, b);
}

static const char *const patterns[] = {"checker", "grid", "gradient", "noise"};

/* What a pattern has beside its colors. */
static void put_field(FILE *out, uint64_t *random, int pattern) {
    if (pattern == 1) fprintf(out, ", \"width\": %.17g", knob_decades(random, 1e-4, 0.999));
    if (pattern == 3) fprintf(out, ", \"octaves\": %d", 1 + knob_of(random, 8));
    put_uv(out, random, pattern == 2 ? any_wrap(random) : NULL);
}

static void put_print(FILE *out, uint64_t *random, double most, bool grey) {
    const int pattern = knob_of(random, 4);
    fprintf(out, "{\"pattern\": \"%s\", \"colors\": [", patterns[pattern]);
    put_knobbed(out, random, most, grey);
    fputs(", ", out);
    put_knobbed(out, random, most, grey);
    fputs("]", out);
    put_field(out, random, pattern);
    fputs("}", out);
}

/* `plain`: of an opacity, which has no tint. */
static void put_image(FILE *out, uint64_t *random, double most, bool plain) {
    static const char *const channels[] = {"R", "G", "B", "A"};
    fprintf(out, "{\"texture\": \"%s\"", picture_name(FOR_COLORS, random));
    if (!plain && one_of(random, 3)) {
        fputs(", \"tint\": ", out);
        put_knobbed(out, random, most, false);
    }
    if (plain || one_of(random, 4) == 0)
        fprintf(out, ", \"channel\": \"%s\"", channels[knob_of(random, 4)]);
    if (!plain && knob_of(random, 6) == 0) fputs(", \"space\": \"lin_rec709\"", out);
    put_uv(out, random, any_wrap(random));
    fputs("}", out);
}

static void put_coefficient(FILE *out, const char *name, uint64_t *random, double most) {
    const bool print = goes_beyond(BEYOND_PRINTS), image = goes_beyond(BEYOND_PICTURES);
    fprintf(out, "\"%s\": ", name);
    const int kind = knob_of(random, 4);
    if (print && (kind == 0 || (kind == 1 && !image)))
        put_print(out, random, most, false);
    else if (image && kind < 2)
        put_image(out, random, most, false);
    else
        put_knobbed(out, random, most, false);
}

/* ---- Materials. ---- */

/* Powers at their ends, too. Tables of environments are made for each, and kept. */
static double any_power(uint64_t *random) {
    static const double few[] = {2, 9, 32, 75.5, 500, 4096};
    const int kind = one_of(random, 10);
    if (goes_beyond(BEYOND_SKY) && goes_beyond(BEYOND_LEVEL)) return few[one_of(random, 4)];
    if (kind > 3 && goes_beyond(BEYOND_SKY)) return few[one_of(random, 6)];
    return kind == 0   ? 0
           : kind == 1 ? decades(random, 1e-3, 2)
           : kind == 2 ? decades(random, 4096, 1e6)
           : kind == 3 ? knob_decades(random, 1, 1e4)
                       : floor(decades(random, 1, 300));
}

/* An exponent, or a pattern or a picture of such. Of models whose lobes are no powers, the
 * evaluation of the model knows of numbers alone. */
static void put_power(FILE *out, uint64_t *random, bool is_power) {
    const bool print = goes_beyond(BEYOND_PRINTS), image = goes_beyond(BEYOND_PICTURES);
    const int kind = print || image ? one_of(random, 4) : 3;
    if (kind > 1 || (goes_beyond(BEYOND_LEVEL) && !is_power)) {
        fprintf(out, "%.17g", any_power(random));
        return;
    }
    static const char *const channels[] = {"R", "G", "B", "A"};
    const double one = fmax(any_power(random), 1),
                 other = one_of(random, 6) ? fmax(any_power(random), 1) : 1;
    const int pattern = knob_of(random, 4);
    const bool is_print = print && (kind || !image);
    if (is_print)
        fprintf(out, "{\"pattern\": \"%s\", ", patterns[pattern]);
    else
        fprintf(out, "{\"texture\": \"%s\", \"channel\": \"%s\", ",
                picture_name(FOR_COLORS, random), channels[knob_of(random, 4)]);
    fprintf(out, "\"values\": [%.17g, %.17g]", one, other);
    if (is_print)
        put_field(out, random, pattern);
    else
        put_uv(out, random, any_wrap(random));
    fputs("}", out);
}

static double any_roughness(uint64_t *random) {
    const int kind = one_of(random, 8);
    if (goes_beyond(BEYOND_LEVEL)) return decades(random, 0.1, 1);
    return kind == 0 ? decades(random, 1e-3, 0.02) : kind == 1 ? 1 : knob_decades(random, 0.05, 1);
}

/* Patterns of f0 are not on faces, and the model beside knows none. */
static void put_fresnel(FILE *out, uint64_t *random) {
    static const char *const metals[] = {"gold", "copper", "silver", "aluminium"};
    switch (goes_beyond(BEYOND_LEVEL) ? 1 + one_of(random, 2) : one_of(random, 4)) {
    case 0:
        fprintf(out, "\"fresnel\": {\"n\": \"%s\", \"k\": \"%s\"}", metals[one_of(random, 2)],
                metals[one_of(random, 2)]);
        break;
    case 1:
        fprintf(out, "\"fresnel\": {\"n\": %.17g, \"k\": %.17g}", knob_decades(random, 0.05, 10),
                one_of(random, 2) ? 0 : decades(random, 0.01, 30));
        break;
    default:
        fputs("\"fresnel\": {", out);
        if (goes_beyond(BEYOND_LEVEL) || goes_beyond(BEYOND_FACETS)) {
            fputs("\"f0\": ", out);
            put_knobbed(out, random, 1, false);
        } else {
            put_coefficient(out, "f0", random, 1);
        }
        fputs("}", out);
    }
}

static void put_shine(FILE *out, uint64_t *random, int model) {
    const int lobes = knob_of(random, 3) == 0 ? 1 + one_of(random, 2) : 0;
    if (model == 3) fprintf(out, ", \"sigma\": %.17g", knob(random, 0, 90));
    if (model == 4) {
        fputs(", ", out);
        put_fresnel(out, random);
        fprintf(out, ", \"lobes\": [{\"roughness\": %.17g, \"weight\": %.17g}",
                any_roughness(random), knob(random, 0, 1));
        if (lobes) {
            fputs(", {\"roughness\": ", out);
            if (goes_beyond(BEYOND_PRINTS) && !goes_beyond(BEYOND_LEVEL) && one_of(random, 2)) {
                const int pattern = knob_of(random, 4);
                const double one = any_roughness(random), other = any_roughness(random);
                fprintf(out, "{\"pattern\": \"%s\", \"values\": [%.17g, %.17g]", patterns[pattern],
                        one, other);
                put_field(out, random, pattern);
                fputs("}", out);
            } else {
                fprintf(out, "%.17g", any_roughness(random));
            }
            fputs("}", out);
        }
        fputs("]", out);
    }
    if (model >= 3) return;
    fputs(", ", out);
    put_coefficient(out, "specular", random, 0.8);
    fputs(", \"shininess\": ", out);
    put_power(out, random, model < 2);
    for (int k = 0; k < lobes; k++) {
        fputs(k ? ", {" : ", \"lobes\": [{", out);
        put_coefficient(out, "specular", random, 0.4);
        fputs(", \"shininess\": ", out);
        put_power(out, random, model < 2);
        fputs(k + 1 < lobes ? "}" : "}]", out);
    }
}

/* A normal of any direction, or one that is near to the surface's own. */
static void put_code(FILE *out, uint64_t *random) {
    const double x = knob(random, 0, 1), y = between(random, 0, 1);
    if (one_of(random, 3))
        fprintf(out, "[%.17g, %.17g, %.17g]", 0.3 + 0.4 * x, 0.3 + 0.4 * y,
                between(random, 0.8, 1));
    else
        fprintf(out, "[%.17g, %.17g, %.17g]", x, y, between(random, 0, 1));
}

static void put_bumps(FILE *out, uint64_t *random) {
    const double scale = one_of(random, 4)
                             ? knob(random, -2, 2)
                             : (one_of(random, 2) ? 1 : -1) * decades(random, 1e-6, 1000);
    fprintf(out, ", \"normal\": {\"scale\": %.17g, ", scale);
    if (goes_beyond(BEYOND_PRINTS) && one_of(random, 2)) {
        const int pattern = knob_of(random, 4);
        fprintf(out, "\"pattern\": \"%s\", \"colors\": [", patterns[pattern]);
        put_code(out, random);
        fputs(", ", out);
        if (one_of(random, 4))
            put_code(out, random);
        else
            fputs("\"#8080ff\"", out);
        fputs("]", out);
        put_field(out, random, pattern);
    } else {
        fprintf(out, "\"texture\": \"%s\"", picture_name(FOR_NORMALS, random));
        put_uv(out, random, any_wrap(random));
    }
    fputs("}", out);
}

/* In spectra textures of rays are greys: a channel, which has no tint here. */
static void put_bounced(FILE *out, uint64_t *random, double most) {
    const bool print = goes_beyond(BEYOND_PRINTS), image = goes_beyond(BEYOND_PICTURES),
               grey = goes_beyond(BEYOND_SPECTRUM);
    const int kind = print || image ? one_of(random, 3) : 2;
    if (kind == 0 && print)
        put_print(out, random, most, grey);
    else if (kind < 2 && image)
        put_image(out, random, most, grey);
    else
        put_knobbed(out, random, most, false);
}

static void put_passage(FILE *out, uint64_t *random) {
    const bool textured = goes_beyond(BEYOND_PRINTS | BEYOND_PICTURES) && one_of(random, 2);
    if (goes_beyond(BEYOND_OPACITY) && one_of(random, 2)) {
        fputs(", \"opacity\": ", out);
        if (!textured)
            put_knobbed(out, random, 1, goes_beyond(BEYOND_SPECTRUM));
        else if (goes_beyond(BEYOND_PICTURES) && one_of(random, 2))
            put_image(out, random, 1, true);
        else
            put_print(out, random, 1, goes_beyond(BEYOND_SPECTRUM));
    }
    if (goes_beyond(BEYOND_MIRRORS) && one_of(random, 2)) {
        fputs(", \"reflection\": ", out);
        put_bounced(out, random, 0.6);
    }
    if (goes_beyond(BEYOND_GLASS) && one_of(random, 3) == 0) {
        fputs(", \"transmission\": ", out);
        put_bounced(out, random, 0.5);
        fprintf(out, ", \"ior\": %.17g", decades(random, 0.5, 2.5));
    }
}

/* Microgeometries that are few, since each is simulated. */
static void put_westin(FILE *out, uint64_t *random) {
    static const char *const types[] = {"grooves", "weave", "heightfield"};
    fprintf(out, "\"model\": \"westin\", \"microgeometry\": {\"type\": \"%s\"}, \"diffuse\": %.17g",
            types[knob_of(random, 3)], knob(random, 0, 1));
    put_bumps(out, random);
}

static void put_reflectance(FILE *out, uint64_t *random) {
    static const char *const models[] = {"phong", "blinn-phong", "phong-normalized", "oren-nayar",
                                         "cook-torrance"};
    const int model = goes_beyond(BEYOND_MODELS) ? knob_of(random, 5) : 0;
    fprintf(out, "\"model\": \"%s\", ", models[model]);
    put_coefficient(out, "diffuse", random, 0.9);
    put_shine(out, random, model);
    if (one_of(random, 4) == 0) {
        fputs(", ", out);
        put_coefficient(out, "emissive", random, 0.3);
    }
    if (one_of(random, 6) == 0) {
        fputs(", ", out);
        put_coefficient(out, "ambient", random, 0.5);
    }
    if (goes_beyond(BEYOND_BUMPS) && knob_of(random, 4)) put_bumps(out, random);
    if (!goes_beyond(BEYOND_LEVEL) && model != 3 && knob_of(random, 8) == 0)
        fputs(", \"specularAntialiasing\": true", out);
}

void put_coat(FILE *out, uint64_t *random) {
    fputs("\"material\": {", out);
    if (goes_beyond(BEYOND_FACETS) && goes_beyond(BEYOND_BUMPS) && one_of(random, 5) == 0)
        put_westin(out, random);
    else
        put_reflectance(out, random);
    if (knob_of(random, 8) == 0) fputs(", \"side\": \"front\"", out);
    put_passage(out, random);
    fputs("}", out);
}

/* ---- Light from all around. ---- */

void put_sky(FILE *out, uint64_t *random, bool may_be_seen) {
    const int kind = knob_of(random, 5);
    const char *map = kind < 2 ? "sky" : kind < 4 ? "studio" : picture_name(FOR_SKIES, random);
    const double strength = one_of(random, 6)   ? knob(random, 0, 0.5)
                            : one_of(random, 4) ? decades(random, 1e-9, 1e6)
                                                : 0;
    fprintf(out,
            "{\"type\": \"environment\", \"map\": \"%s\", \"rotate\": %.17g, \"intensity\": "
            "%.17g%s}",
            map, one_of(random, 4) ? knob(random, -720, 720) : 1.40625 * one_of(random, 256),
            strength,
            may_be_seen && !goes_beyond(BEYOND_LEVEL) && knob_of(random, 2) ? ", \"visible\": true"
                                                                            : "");
}
