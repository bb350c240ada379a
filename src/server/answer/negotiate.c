#include "negotiate.h"

#include <string.h>

#include "shaded.h"

static const struct {
    const char *media_type;
    shd_format format;
} aliases[] = {{"image/jpg", SHD_JPEG}, {"image/pjpeg", SHD_JPEG}, {"image/tif", SHD_TIFF},
               {"image/exr", SHD_EXR},  {"image/aces", SHD_EXR},   {"image/hdr", SHD_HDR},
               {"image/x-hdr", SHD_HDR}};

static const char *skip_blanks(const char *c) {
    while (*c == ' ' || *c == '\t') c++;
    return c;
}

/* The end of a list element or of a parameter: the next separator outside quotes. */
static const char *element_end(const char *c, const char *separators) {
    bool quoted = false;
    for (; *c; c++) {
        if (quoted && *c == '\\' && c[1])
            c++;
        else if (*c == '"')
            quoted = !quoted;
        else if (!quoted && strchr(separators, *c))
            break;
    }
    return c;
}

static bool is_same(const char *from, size_t length, const char *text) {
    return strlen(text) == length && !strncasecmp(from, text, length);
}

/* How exactly a media range names a type: 0 not at all, 1 by a star for both halves, 2 for the
 * subtype, 3 in full. */
static int find_specificity(const char *range, size_t length, const char *media_type) {
    if (is_same(range, length, "*/*")) return 1;
    if (is_same(range, length, media_type)) return 3;
    const char *slash = strchr(media_type, '/');
    size_t prefix = (size_t)(slash - media_type) + 1;
    bool subtype_star = length == prefix + 1 && range[prefix] == '*';
    return subtype_star && !strncasecmp(range, media_type, prefix) ? 2 : 0;
}

/* The q parameter of the element in [c, end), 1 if it has none. Digits by hand: strtod would
 * follow the locale and take "0x1" or "inf". */
static double read_quality(const char *c, const char *end) {
    for (const char *p = element_end(c, ";,"); p < end && *p == ';'; p = element_end(p + 1, ";,")) {
        const char *q = skip_blanks(p + 1);
        if ((*q != 'q' && *q != 'Q') || q[1] != '=') continue;
        q += 2;
        double value = 0, place = 1;
        if (*q < '0' || *q > '9') return 1;
        for (; *q >= '0' && *q <= '9'; q++) value = value * 10 + (*q - '0');
        if (*q == '.')
            for (q++; *q >= '0' && *q <= '9'; q++) value += (*q - '0') * (place /= 10);
        return value < 1 ? value : 1;
    }
    return 1;
}

/* The quality of a type: that of the range that names it most exactly, if more exactly than
 * *best, which it raises; else `result`. */
static double type_quality(const char *accept, const char *media_type, int *best, double result) {
    for (const char *c = accept; *c;) {
        const char *start = skip_blanks(c), *end = element_end(start, ",");
        const char *name_end = start + strcspn(start, " \t;,");
        int here = find_specificity(start, (size_t)(name_end - start), media_type);
        if (here > *best) {
            *best = here;
            result = read_quality(start, end);
        }
        c = *end ? end + 1 : end;
    }
    return result;
}

static bool has_preferences(const char *accept) {
    return accept && *skip_blanks(accept);
}

bool shd_accepts(const char *accept, const char *media_type) {
    int best = 0;
    return !has_preferences(accept) || type_quality(accept, media_type, &best, 0) > 0;
}

bool shd_prefers(const char *accept, const char *media_type, const char *other) {
    int best = 0, of_other = 0;
    return has_preferences(accept) &&
           type_quality(accept, media_type, &best, 0) > type_quality(accept, other, &of_other, 0);
}

bool shd_accepts_picture(const char *accept, shd_format *out) {
    if (!has_preferences(accept)) accept = "*/*";
    double best = 0;
    for (int format = 0; format < SHD_FORMAT_COUNT; format++) {
        if (!shd_writes((shd_format)format)) continue;
        /* An alias counts if it is what the client wrote; stars speak of the real name. */
        int how = 0;
        double q = type_quality(accept, shd_format_get((shd_format)format)->media_type, &how, 0);
        for (size_t i = 0; i < sizeof aliases / sizeof aliases[0]; i++)
            if ((int)aliases[i].format == format)
                q = type_quality(accept, aliases[i].media_type, &how, q);
        if (q > best) {
            best = q;
            *out = (shd_format)format;
        }
    }
    return best > 0;
}

/* The first of those that `accept` likes best. -1: it admits none. */
static int find_best(const char *accept, const char *const *types, int count) {
    if (!has_preferences(accept)) accept = "*/*";
    double best = 0;
    int found = -1;
    for (int i = 0; i < count; i++) {
        int how = 0;
        const double q = type_quality(accept, types[i], &how, 0);
        if (!(q > best)) continue;
        best = q;
        found = i;
    }
    return found;
}

bool shd_accepts_figure(const char *accept, shd_brdf_form *out) {
    static const char *const types[] = {[SHD_BRDF_JSON] = "application/json",
                                        [SHD_BRDF_SVG] = "image/svg+xml",
                                        [SHD_BRDF_PNG] = "image/png"};
    const int best = find_best(accept, types, SHD_BRDF_PNG + 1);
    if (best >= 0) *out = (shd_brdf_form)best;
    return best >= 0;
}

bool shd_accepts_map(const char *accept, bool *map) {
    static const char *const types[] = {"application/json", "image/png"};
    const int best = find_best(accept, types, 2);
    *map = best == 1;
    return best >= 0;
}

bool shd_accepts_gzip(const char *accept_encoding) {
    double star = 0, gzip = -1, identity = 0;
    for (const char *c = accept_encoding ? accept_encoding : ""; *c;) {
        const char *start = skip_blanks(c), *end = element_end(start, ",");
        size_t length = strcspn(start, " \t;,");
        if (is_same(start, length, "*")) star = read_quality(start, end);
        if (is_same(start, length, "gzip") || is_same(start, length, "x-gzip"))
            gzip = read_quality(start, end);
        if (is_same(start, length, "identity")) identity = read_quality(start, end);
        c = *end ? end + 1 : end;
    }
    if (gzip < 0) gzip = star;
    return gzip > 0 && gzip >= identity;
}

bool shd_is_json(const char *content_type) {
    if (!content_type) return false;
    const char *start = skip_blanks(content_type);
    size_t length = strcspn(start, " \t;,");
    if (is_same(start, length, "application/json")) return true;
    const char *slash = memchr(start, '/', length);
    return slash && slash > start && length > 5 && start + length - 5 > slash + 1 &&
           is_same(start + length - 5, 5, "+json");
}

bool shd_is_binary(const char *content_type) {
    if (!content_type) return false;
    const char *start = skip_blanks(content_type);
    return is_same(start, strcspn(start, " \t;,"), "application/octet-stream");
}

bool shd_is_image(const char *content_type) {
    if (!content_type) return false;
    const char *start = skip_blanks(content_type);
    return strcspn(start, " \t;,") > 6 && is_same(start, 6, "image/");
}

bool shd_etag_matches(const char *if_none_match, const char *etag, bool star) {
    if (!if_none_match) return false;
    for (const char *c = if_none_match; *c;) {
        const char *start = skip_blanks(c), *end = element_end(start, ",");
        size_t length = (size_t)(end - start);
        while (length && (start[length - 1] == ' ' || start[length - 1] == '\t')) length--;
        if (length == 1 && *start == '*' && star) return true;
        if (length > 2 && start[0] == 'W' && start[1] == '/') {
            start += 2;
            length -= 2;
        }
        if (length == strlen(etag) + 2 && start[0] == '"' && start[length - 1] == '"' &&
            !memcmp(start + 1, etag, length - 2))
            return true;
        c = *end ? end + 1 : end;
    }
    return false;
}
