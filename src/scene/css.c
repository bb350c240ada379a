#include "scene/css.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/status.h"
#include "scene/css_tokens.h"

typedef struct css_reader {
    const char *at; /* behind the token */
    shd_css_token token;
    const char *function; /* that is read */
    shd_css_wrong *wrong;
} css_reader;

static void read_next(css_reader *r) {
    r->at = shd_css_next(r->at, &r->token);
}

static bool fail(css_reader *r, const char *format, ...) SHD_PRINTF(2, 3);

static bool fail(css_reader *r, const char *format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(r->wrong->text, sizeof r->wrong->text, format, args);
    va_end(args);
    return false;
}

static bool is_among(const char *word, const char *const *words) {
    while (*words && strcmp(*words, word) != 0) words++;
    return *words;
}

/* ---- Components ---- */

/* What a component of a function is. */
typedef struct component {
    const char *name;
    double unit;  /* the number that is 1 of what is computed with; 0: it is a hue */
    double whole; /* what 100 % are of that */
    bool positive;
} component;

typedef struct component_value {
    double value;
    bool percent, none;
} component_value;

/* Degrees of a number with a unit. */
static bool read_angle(css_reader *r, double *out) {
    static const struct {
        const char *unit;
        double degrees;
    } units[] = {{"deg", 1}, {"grad", 0.9}, {"rad", 57.295779513082320877}, {"turn", 360}};
    for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
        if (strcmp(r->token.word, units[i].unit) != 0) continue;
        *out = r->token.value * units[i].degrees;
        return true;
    }
    return fail(r, "\"%s\" is no unit of an angle: there is deg, grad, rad, turn", r->token.word);
}

/* What stands where a number or a percentage should. */
static bool refuse_token(css_reader *r, const char *name) {
    const shd_css_token *t = &r->token;
    switch (t->kind) {
    case SHD_CSS_BEYOND:
        return fail(r, "the %s is too long or too large a number", name);
    case SHD_CSS_DIMENSION:
        return fail(r, "the %s takes no unit, got \"%s\"", name, t->word);
    case SHD_CSS_PERCENT:
        return fail(r, "the %s is no percentage", name);
    case SHD_CSS_FUNCTION:
        return fail(r, "%s() is not taken: write the %s itself", t->word, name);
    case SHD_CSS_WORD:
        return fail(r, "the %s is a number, got \"%s\"", name, t->word);
    case SHD_CSS_END:
        return fail(r, "the ) of %s() is missing", r->function);
    default:
        return fail(r, "the %s of %s() is missing", name, r->function);
    }
}

static bool read_component(css_reader *r, const component *c, component_value *out) {
    const shd_css_token *t = &r->token;
    const bool hue = c->unit == 0;
    *out = (component_value){.none = t->kind == SHD_CSS_WORD && !strcmp(t->word, "none")};
    if (t->kind == SHD_CSS_NUMBER) {
        out->value = hue ? t->value : t->value / c->unit;
    } else if (t->kind == SHD_CSS_PERCENT && !hue) {
        out->value = t->value / 100 * c->whole;
        out->percent = true;
    } else if (t->kind == SHD_CSS_DIMENSION && hue) {
        if (!read_angle(r, &out->value)) return false;
    } else if (!out->none) {
        return refuse_token(r, c->name);
    }
    if (c->positive && out->value < 0) return fail(r, "the %s is negative", c->name);
    read_next(r);
    return true;
}

static bool read_alpha(css_reader *r, bool legacy, double *out) {
    static const component alpha = {"alpha", 1, 1, false};
    component_value value;
    if (!read_component(r, &alpha, &value)) return false;
    if (legacy && value.none) return fail(r, "`none` does not go with commas");
    if (!(value.value >= 0 && value.value <= 1))
        return fail(r, "the alpha is from 0 to 1, got %.9g", value.value);
    *out = value.value;
    return true;
}

/* ---- Functions ---- */

typedef enum notation { RGB, HSL, HWB, LAB, LCH, OKLAB, OKLCH, COLOR } notation;

/* In the order of `notation`. */
static const component components[][3] = {
    {{"red", 255, 1, false}, {"green", 255, 1, false}, {"blue", 255, 1, false}},
    {{"hue", 0, 0, false}, {"saturation", 100, 1, true}, {"lightness", 100, 1, false}},
    {{"hue", 0, 0, false}, {"whiteness", 100, 1, false}, {"blackness", 100, 1, false}},
    {{"lightness", 1, 100, false}, {"a", 1, 125, false}, {"b", 1, 125, false}},
    {{"lightness", 1, 100, false}, {"chroma", 1, 150, true}, {"hue", 0, 0, false}},
    {{"lightness", 1, 1, false}, {"a", 1, 0.4, false}, {"b", 1, 0.4, false}},
    {{"lightness", 1, 1, false}, {"chroma", 1, 0.4, true}, {"hue", 0, 0, false}},
    {{"first component", 1, 1, false},
     {"second component", 1, 1, false},
     {"third component", 1, 1, false}},
};

/* Commas are of the legacy syntax, in which all are numbers or all percentages, apart from hues. */
static bool check_legacy(css_reader *r, notation of, const component_value values[3]) {
    for (int i = 0; i < 3; i++)
        if (values[i].none) return fail(r, "`none` does not go with commas");
    if (of == HSL && !(values[1].percent && values[2].percent))
        return fail(r, "with commas, the saturation and the lightness of hsl() are percentages");
    if (of == RGB &&
        (values[0].percent != values[1].percent || values[0].percent != values[2].percent))
        return fail(r, "with commas, all components of rgb() are numbers, or all are percentages");
    return true;
}

/* The components, the alpha and what closes the function. */
static bool read_components(css_reader *r, notation of, double out[3], double *alpha) {
    component_value values[3];
    bool legacy = false;
    for (int i = 0; i < 3; i++) {
        const bool comma = r->token.kind == SHD_CSS_COMMA, closed = r->token.kind == SHD_CSS_CLOSE;
        if (closed) return fail(r, "%s() takes three components, got %d", r->function, i);
        if (i == 1) legacy = comma;
        if (i > 0 && comma != legacy)
            return fail(r, "a comma stands between all components, or between none");
        if (i > 0 && comma && of != RGB && of != HSL)
            return fail(r, "%s() takes no commas", r->function);
        if (i > 0 && comma) read_next(r);
        if (!read_component(r, &components[of][i], &values[i])) return false;
        out[i] = values[i].value;
    }
    if (legacy && !check_legacy(r, of, values)) return false;
    const shd_css_kind kind = r->token.kind;
    if (kind == (legacy ? SHD_CSS_COMMA : SHD_CSS_SLASH)) {
        read_next(r);
        if (!read_alpha(r, legacy, alpha)) return false;
    } else if (kind == SHD_CSS_NUMBER || kind == SHD_CSS_PERCENT || kind == SHD_CSS_SLASH ||
               kind == SHD_CSS_COMMA) {
        return fail(r, "%s() takes three components%s", r->function,
                    legacy ? ", and an alpha behind a comma" : ", and an alpha behind a slash");
    }
    if (r->token.kind == SHD_CSS_END) return fail(r, "the ) of %s() is missing", r->function);
    if (r->token.kind != SHD_CSS_CLOSE)
        return fail(r, "something is left before the ) of %s()", r->function);
    read_next(r);
    return true;
}

/* Degrees in [0,360). */
static double turn_within(double hue) {
    const double rest = fmod(hue, 360);
    return rest < 0 ? rest + 360 : rest;
}

/* "Converting HSL Colors to sRGB" of CSS Color 4. */
static void find_hsl(const double hsl[3], double rgb[3]) {
    static const double offsets[3] = {0, 8, 4};
    const double most = hsl[1] * fmin(hsl[2], 1 - hsl[2]);
    for (int i = 0; i < 3; i++) {
        const double k = fmod(offsets[i] + hsl[0] / 30, 12);
        rgb[i] = hsl[2] - most * fmax(-1, fmin(fmin(k - 3, 9 - k), 1));
    }
}

/* "Converting HWB Colors to sRGB": white and black that are more than 1 leave a grey. */
static void find_hwb(const double hwb[3], double rgb[3]) {
    const double pure[3] = {hwb[0], 1, 0.5}, sum = hwb[1] + hwb[2];
    find_hsl(pure, rgb);
    for (int i = 0; i < 3; i++)
        rgb[i] = sum >= 1 ? hwb[1] / sum : rgb[i] * (1 - hwb[1] - hwb[2]) + hwb[1];
}

static void convert_components(notation of, shd_css_space space, double v[3], shd_css_color *out) {
    static const double radians = 3.14159265358979323846 / 180;
    double rgb[3] = {v[0], v[1], v[2]};
    if (of == HSL || of == HWB) v[0] = turn_within(v[0]);
    if (of == HSL) find_hsl(v, rgb);
    if (of == HWB) find_hwb(v, rgb);
    if (of == LCH || of == OKLCH) {
        const double hue = turn_within(v[2]) * radians;
        rgb[1] = v[1] * cos(hue);
        rgb[2] = v[1] * sin(hue);
    }
    shd_css_convert(space, rgb, out);
}

/* color() begins with the name of its space. */
static bool read_space(css_reader *r, shd_css_space *out) {
    static const struct {
        const char *name;
        shd_css_space space;
    } spaces[] = {{"srgb", SHD_CSS_SRGB},
                  {"srgb-linear", SHD_CSS_SRGB_LINEAR},
                  {"display-p3", SHD_CSS_DISPLAY_P3},
                  {"display-p3-linear", SHD_CSS_DISPLAY_P3_LINEAR},
                  {"a98-rgb", SHD_CSS_A98_RGB},
                  {"prophoto-rgb", SHD_CSS_PROPHOTO_RGB},
                  {"rec2020", SHD_CSS_REC2020},
                  {"xyz", SHD_CSS_XYZ_D65},
                  {"xyz-d65", SHD_CSS_XYZ_D65},
                  {"xyz-d50", SHD_CSS_XYZ_D50}};
    const bool word = r->token.kind == SHD_CSS_WORD;
    for (size_t i = 0; word && i < sizeof spaces / sizeof *spaces; i++) {
        if (strcmp(r->token.word, spaces[i].name) != 0) continue;
        *out = spaces[i].space;
        read_next(r);
        return true;
    }
    return fail(r,
                "color() begins with srgb, srgb-linear, display-p3, display-p3-linear, a98-rgb, "
                "prophoto-rgb, rec2020, xyz, xyz-d50 or xyz-d65%s%s%s",
                word ? ", got \"" : "", r->token.word, word ? "\"" : "");
}

static bool read_function(css_reader *r, shd_css_color *out) {
    static const struct {
        const char *name;
        notation of;
        shd_css_space space;
    } functions[] = {{"rgb", RGB, SHD_CSS_SRGB},      {"rgba", RGB, SHD_CSS_SRGB},
                     {"hsl", HSL, SHD_CSS_SRGB},      {"hsla", HSL, SHD_CSS_SRGB},
                     {"hwb", HWB, SHD_CSS_SRGB},      {"lab", LAB, SHD_CSS_LAB},
                     {"lch", LCH, SHD_CSS_LAB},       {"oklab", OKLAB, SHD_CSS_OKLAB},
                     {"oklch", OKLCH, SHD_CSS_OKLAB}, {"color", COLOR, SHD_CSS_SRGB}};
    static const char *const others[] = {"color-mix", "light-dark", "contrast-color", "device-cmyk",
                                         "var",       "env",        "calc",           "color-hdr",
                                         "ictcp",     "alpha",      "jzazbz",         NULL};
    enum { COUNT = sizeof functions / sizeof *functions };
    size_t which = 0;
    while (which < COUNT && strcmp(functions[which].name, r->token.word) != 0) which++;
    if (which == COUNT)
        return is_among(r->token.word, others)
                   ? fail(r, "%s() is not taken: a color stands for itself here", r->token.word)
                   : fail(r,
                          "there is no function \"%s\": there is rgb, rgba, hsl, hsla, hwb, lab, "
                          "lch, oklab, oklch, color",
                          r->token.word);
    shd_css_space space = functions[which].space;
    r->function = functions[which].name;
    read_next(r);
    if (r->token.kind == SHD_CSS_WORD && !strcmp(r->token.word, "from"))
        return fail(r, "relative colors (`from`) are not taken: a color stands for itself here");
    if (functions[which].of == COLOR && !read_space(r, &space)) return false;
    double values[3];
    if (!read_components(r, functions[which].of, values, &out->alpha)) return false;
    convert_components(functions[which].of, space, values, out);
    return true;
}

/* ---- Names and digits ---- */

static bool read_hex(css_reader *r, shd_css_color *out) {
    const char *digits = r->token.word;
    const size_t length = r->token.length;
    if (length != 3 && length != 4 && length != 6 && length != 8)
        return fail(r, "a # has 3, 4, 6 or 8 digits behind it: \"#rgb\", \"#rgba\", \"#rrggbb\", "
                       "\"#rrggbbaa\"");
    if (strspn(digits, "0123456789abcdef") != length)
        return fail(r, "behind a # stand digits from 0 to 9 and from a to f: \"#rgb\", "
                       "\"#rrggbb\"");
    const size_t each = length <= 4 ? 1 : 2;
    double channel[4] = {0, 0, 0, 1};
    for (size_t c = 0; c < length / each; c++) {
        unsigned byte = 0;
        for (size_t i = 0; i < 2; i++) {
            const char digit = digits[c * each + i % each];
            byte = 16 * byte + (unsigned)(digit <= '9' ? digit - '0' : digit - 'a' + 10);
        }
        channel[c] = byte / 255.0;
    }
    shd_css_convert(SHD_CSS_SRGB, channel, out);
    out->alpha = channel[3];
    read_next(r);
    return true;
}

/* System colors of the text, and deprecated ones that it still knows. */
static const char *const system_colors[] = {"accentcolor",
                                            "accentcolortext",
                                            "activetext",
                                            "buttonborder",
                                            "buttonface",
                                            "buttontext",
                                            "canvas",
                                            "canvastext",
                                            "field",
                                            "fieldtext",
                                            "graytext",
                                            "highlight",
                                            "highlighttext",
                                            "linktext",
                                            "mark",
                                            "marktext",
                                            "selecteditem",
                                            "selecteditemtext",
                                            "visitedtext",
                                            "activeborder",
                                            "activecaption",
                                            "appworkspace",
                                            "background",
                                            "buttonhighlight",
                                            "buttonshadow",
                                            "captiontext",
                                            "inactiveborder",
                                            "inactivecaption",
                                            "inactivecaptiontext",
                                            "infobackground",
                                            "infotext",
                                            "menu",
                                            "menutext",
                                            "scrollbar",
                                            "threeddarkshadow",
                                            "threedface",
                                            "threedhighlight",
                                            "threedlightshadow",
                                            "threedshadow",
                                            "window",
                                            "windowframe",
                                            "windowtext",
                                            NULL};

static bool read_named(css_reader *r, shd_css_color *out) {
    const char *word = r->token.word;
    const shd_css_named *named = shd_css_find_name(word);
    double rgb[3] = {0};
    if (!strcmp(word, "currentcolor"))
        return fail(r, "currentcolor is the color of a text, and here is none");
    if (is_among(word, system_colors))
        return fail(r, "it is a color of whatever system shows it, and pictures are alike on all");
    if (named) {
        for (int c = 0; c < 3; c++) rgb[c] = (named->rgb >> (16 - 8 * c) & 0xff) / 255.0;
    } else if (!strcmp(word, "transparent")) {
        out->alpha = 0;
    } else {
        shd_css_token behind;
        shd_css_next(r->at, &behind);
        if (r->token.length < sizeof r->token.word && behind.kind == SHD_CSS_END)
            memcpy(r->wrong->name, word, sizeof r->wrong->name);
        return false;
    }
    shd_css_convert(SHD_CSS_SRGB, rgb, out);
    read_next(r);
    return true;
}

bool shd_css_read(const char *text, shd_css_color *out, shd_css_wrong *wrong) {
    *wrong = (shd_css_wrong){.text = ""};
    css_reader r = {.at = text, .wrong = wrong};
    shd_css_color color = {.alpha = 1};
    bool good = false;
    read_next(&r);
    if (r.token.kind == SHD_CSS_HASH)
        good = read_hex(&r, &color);
    else if (r.token.kind == SHD_CSS_WORD)
        good = read_named(&r, &color);
    else if (r.token.kind == SHD_CSS_FUNCTION)
        good = read_function(&r, &color);
    if (!good) return false;
    if (r.token.kind != SHD_CSS_END) return fail(&r, "something stands behind the color");
    for (int c = 0; c < 3; c++)
        if (!isfinite(color.rgb[c])) return fail(&r, "its components are too large");
    *out = color;
    return true;
}
