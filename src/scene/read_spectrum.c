/* Spectra: `spectral`, and colors that are curves over wavelengths. */
#include <string.h>

#include "scene/read.h"

enum { SAMPLES_MOST = 1000 };

#define NO_SPACE "the color configuration has no space lin_rec709, through which spectra go"

/* ---- `spectral` ---- */

typedef struct raw_spectral {
    int channels;
    double from, to;
} raw_spectral;

/* The map from linear Rec.709, of whose colors spectra are made. False, and an error: there is
 * none. */
static bool find_working(shd_reader *r, const shd_node *node, shd_affine *out) {
    const shd_space_info *space = shd_catalog_space(r->catalog, "lin_rec709");
    *out = (shd_affine){.origin = {0, 0, 0}};
    if (!r->scene->working_space) return false;
    if (!space) {
        shd_wrong(r, node, NO_SPACE);
        return false;
    }
    for (int i = 0; i < 3; i++) {
        double rgb[3] = {i == 0, i == 1, i == 2};
        shd_convert_color(r, node, space, rgb);
        for (int row = 0; row < 3; row++) out->linear[row][i] = rgb[row];
    }
    return !isnan(out->linear[0][0]);
}

void shd_read_spectral(shd_reader *r, const shd_node *node, void *out) {
    static const shd_range channels = {SHD_BINS_LEAST, SHD_BINS_MOST, false, false, "16 to 256"},
                           from = {360, 380, false, false, "360 to 380 nm"},
                           to = {730, 830, false, false, "730 to 830 nm"};
    static const shd_field fields[] = {
        {"channels", shd_read_integer, offsetof(raw_spectral, channels), .range = &channels},
        {"from", shd_read_number, offsetof(raw_spectral, from), .range = &from},
        {"to", shd_read_number, offsetof(raw_spectral, to), .range = &to},
    };
    raw_spectral raw = {16, 380, 730};
    if (json_is_false(node->value)) return;
    if (json_is_object(node->value)) {
        shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "spectral", &raw);
    } else if (!json_is_true(node->value)) {
        shd_node_expect(r->report, node, "true, false or {channels, from, to}");
        return;
    }
    if (find_working(r, node, &r->scene->to_working))
        *(shd_spectral *)out = (shd_spectral){raw.channels, raw.from, raw.to};
}

/* ---- Curves ---- */

typedef struct raw_samples {
    size_t count;
    const double *values; /* NULL: wrong */
} raw_samples;

typedef struct raw_curve {
    shd_curve named;
    raw_samples wavelengths, values;
    double scale;
} raw_curve;

static void read_samples(shd_reader *r, const shd_node *node, void *out) {
    const size_t given = json_array_size(node->value),
                 count = given < SAMPLES_MOST ? given : SAMPLES_MOST;
    raw_samples *samples = out;
    double *values = shd_take(r, count ? count : 1, sizeof *values);
    if (!values) return;
    if (!shd_get_numbers(r, node, 1, SAMPLES_MOST, "an array of 1 to 1000 numbers", values)) return;
    *samples = (raw_samples){count, values};
}

static bool is_ascending(const raw_samples *at) {
    for (size_t i = 1; i < at->count; i++)
        if (!(at->values[i] > at->values[i - 1])) return false;
    return true;
}

static void read_name(shd_reader *r, const shd_node *node, void *out) {
    enum { MOST = 64 };
    const char *name = shd_get_text(r, node, "the name of a spectrum"), *names[MOST];
    const size_t count = shd_curve_names();
    shd_curve_kind kind = SHD_CURVE_LIGHT;
    if (!name) return;
    for (size_t i = 0; i < count && i < MOST; i++) {
        const shd_curve curve = shd_curve_named(i, &kind);
        names[i] = curve.name;
        if (strcmp(name, curve.name)) continue;
        *(shd_curve *)out = curve;
        return;
    }
    shd_wrong(r, node, "there is no spectrum \"%s\"%s", shd_quote(name).text,
              shd_suggest(r->report, name, names, count < MOST ? count : MOST).text);
}

static shd_curve_kind kind_of(const char *name) {
    shd_curve_kind kind = SHD_CURVE_LIGHT;
    for (size_t i = 0; i < shd_curve_names(); i++)
        if (shd_curve_named(i, &kind).name == name) break;
    return kind;
}

/* NULL: it is wrong. */
static const shd_curve *make_curve(shd_reader *r, const shd_node *node, const raw_curve *raw,
                                   bool lamp) {
    const char *name = raw->named.name;
    shd_curve *curve = shd_take(r, 1, sizeof *curve);
    if (!curve) return NULL;
    *curve = name ? raw->named
                  : (shd_curve){.count = raw->wavelengths.count,
                                .at = raw->wavelengths.values,
                                .values = raw->values.values};
    curve->scale = raw->scale;
    if (name && (kind_of(name) == SHD_CURVE_LIGHT) != lamp) {
        shd_wrong(
            r, node,
            lamp ? "\"%s\" is the reflectance of a surface: light has the spectrum of an illuminant"
                 : "\"%s\" is an illuminant: a surface has a reflectance",
            name);
        return NULL;
    }
    if (!name && raw->wavelengths.count != raw->values.count) {
        shd_wrong(r, node, "there are %zu `wavelengths` and %zu `values`", raw->wavelengths.count,
                  raw->values.count);
        return NULL;
    }
    if (!name && !is_ascending(&raw->wavelengths)) {
        shd_wrong(r, node, "the `wavelengths` must ascend");
        return NULL;
    }
    return curve;
}

/* False, and an error: it has no members of a spectrum, or wrong ones. */
static bool read_curve(shd_reader *r, const shd_node *node, raw_curve *raw) {
    enum { NAME = 1, WAVELENGTHS = 2, VALUES = 4 };
    static const shd_range values = {0, 1e30, false, false, "0 to 1e30"};
    static const shd_field fields[] = {
        {"spectrum", read_name, offsetof(raw_curve, named), .mark = NAME},
        {"wavelengths", read_samples, offsetof(raw_curve, wavelengths), .range = &shd_positive,
         .mark = WAVELENGTHS},
        {"values", read_samples, offsetof(raw_curve, values), .range = &values, .mark = VALUES},
        {"scale", shd_read_number, offsetof(raw_curve, scale), .range = &values},
    };
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a spectrum", raw);
    const unsigned seen = r->seen & (NAME | WAVELENGTHS | VALUES);
    if (r->wrong) return false;
    if (seen == NAME || seen == (WAVELENGTHS | VALUES)) return true;
    shd_wrong(r, node, "give either `spectrum`, a name, or both `wavelengths` and `values`");
    return false;
}

static bool has_spectrum(const shd_node *node) {
    return json_is_object(node->value) &&
           (json_object_get(node->value, "spectrum") ||
            json_object_get(node->value, "wavelengths") || json_object_get(node->value, "values"));
}

static void warn_of_spectra(shd_reader *r, const shd_node *node) {
    if (r->scene->spectral.channels || r->spectra_told) return;
    r->spectra_told = true;
    shd_warn(
        r, node,
        "without `spectral`, this spectrum and all others become RGB once, under D65, and light "
        "is computed in RGB");
}

void shd_read_color_or_spectrum(shd_reader *r, const shd_node *node, void *out) {
    const shd_field *field = r->field;
    void *at = (char *)out - field->offset + field->curve;
    const shd_curve **place = at;
    raw_curve raw = {.scale = 1};
    const shd_curve_kind kind = field->lamp ? SHD_CURVE_LIGHT : SHD_CURVE_REFLECTANCE;
    *place = NULL;
    if (!has_spectrum(node)) {
        shd_read_color(r, node, out);
        return;
    }
    const shd_curve *curve =
        read_curve(r, node, &raw) ? make_curve(r, node, &raw, field->lamp) : NULL;
    const shd_space_info *space = shd_catalog_space(r->catalog, "lin_rec709");
    double rgb[3];
    if (!curve || (r->eye.white == 0 && !shd_eye_make(&r->eye))) return;
    if (!space) {
        shd_wrong(r, node, NO_SPACE);
    } else if (!shd_curve_rgb(&r->eye, curve, kind, rgb)) {
        shd_wrong(r, node,
                  "nothing of this light is visible, so that it cannot be scaled to Y = 1");
    } else {
        shd_convert_color(r, node, space, rgb);
        if (!isfinite(rgb[0]) || !isfinite(rgb[1]) || !isfinite(rgb[2])) return;
        memcpy(out, rgb, sizeof rgb);
        *place = curve;
        warn_of_spectra(r, node);
    }
}

const shd_curve *shd_read_measured(shd_reader *r, const shd_node *node, double means[3]) {
    const shd_range *range = r->field->range;
    const shd_node values = shd_node_member(node, "values"),
                   name = shd_node_member(node, "spectrum");
    raw_curve raw = {.scale = 1};
    if (name.value) {
        shd_wrong(r, &name,
                  "named spectra are light or reflectances: give `wavelengths` and "
                  "`values`");
        return NULL;
    }
    const shd_curve *curve = read_curve(r, node, &raw) ? make_curve(r, node, &raw, false) : NULL;
    if (!curve) return NULL;
    for (size_t i = 0; i < curve->count; i++) {
        const double value = curve->values[i] * curve->scale;
        if (shd_in_range(value, range)) continue;
        const shd_node item = shd_node_item(&values, i);
        shd_wrong(r, &item, "must be %s, got %.9g", range->text, value);
        return NULL;
    }
    shd_curve_means(curve, means);
    warn_of_spectra(r, node);
    return curve;
}

const shd_curve *shd_scale_curve(shd_reader *r, const shd_curve *curve, double factor) {
    if (!curve) return NULL;
    shd_curve *scaled = shd_take(r, 1, sizeof *scaled);
    if (!scaled) return NULL;
    *scaled = *curve;
    scaled->scale *= factor;
    return scaled;
}
