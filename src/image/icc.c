/* A version 4 display profile of the matrix/TRC kind (ICC.1:2010, 8.4.3): the device's linear
 * RGB goes by a 3x3 matrix to XYZ under D50. */
#include "image/icc.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name;
    double xy[8];
} known[] = {
    {"Rec.709", {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290}},
    {"Display P3", {0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290}},
    {"Rec.2020", {0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290}},
    {"ACEScg", {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767}},
    {"ACES2065-1", {0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767}},
};

/* Index into `known`, or -1. Primaries computed from matrices carry some rounding. */
static int find_primaries(const double xy[8]) {
    for (size_t k = 0; k < sizeof known / sizeof known[0]; k++) {
        bool same = true;
        for (int i = 0; i < 8; i++) same = same && fabs(xy[i] - known[k].xy[i]) < 5e-4;
        if (same) return (int)k;
    }
    return -1;
}

bool shd_image_is_srgb(const shd_image *image) {
    return image->transfer == SHD_TRANSFER_SRGB &&
           (!image->has_primaries || find_primaries(image->primaries) == 0);
}

typedef struct matrix {
    double m[3][3];
} matrix;

static matrix multiply(const matrix *a, const matrix *b) {
    matrix out = {{{0}}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) out.m[i][j] += a->m[i][k] * b->m[k][j];
    return out;
}

static bool invert(const matrix *a, matrix *out) {
    const double(*m)[3] = a->m;
    matrix cofactor;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            cofactor.m[i][j] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
        }
    double det =
        m[0][0] * cofactor.m[0][0] + m[0][1] * cofactor.m[0][1] + m[0][2] * cofactor.m[0][2];
    if (!(fabs(det) > 1e-9)) return false;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out->m[i][j] = cofactor.m[j][i] / det;
    return true;
}

static void apply(const matrix *a, const double v[3], double out[3]) {
    for (int i = 0; i < 3; i++) out[i] = a->m[i][0] * v[0] + a->m[i][1] * v[1] + a->m[i][2] * v[2];
}

/* The profile connection space's white, as ICC.1:2010 7.2.16 fixes it, exact in s15Fixed16. */
static const double d50[3] = {0xF6D6 / 65536.0, 1.0, 0xD32D / 65536.0};

/* Bradford adaptation from `white` to D50: `chad` of ICC.1:2010, annex E. */
static bool adaptation(const double white[3], matrix *out) {
    static const matrix bradford = {
        {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    matrix back, scale = {{{0}}};
    double from[3], to[3];
    apply(&bradford, white, from);
    apply(&bradford, d50, to);
    for (int i = 0; i < 3; i++) {
        if (!(from[i] > 1e-6)) return false;
        scale.m[i][i] = to[i] / from[i];
    }
    if (!invert(&bradford, &back)) return false;
    scale = multiply(&scale, &bradford);
    *out = multiply(&back, &scale);
    return true;
}

/* Columns are XYZ of red, green and blue at full drive, adapted to D50. */
static bool colorants(const double xy[8], matrix *adapt, matrix *out) {
    matrix p, inverse, rgb;
    for (int c = 0; c < 3; c++) {
        p.m[0][c] = xy[2 * c];
        p.m[1][c] = xy[2 * c + 1];
        p.m[2][c] = 1 - xy[2 * c] - xy[2 * c + 1];
    }
    if (!(xy[7] > 1e-6) || !invert(&p, &inverse)) return false;
    double white[3] = {xy[6] / xy[7], 1, (1 - xy[6] - xy[7]) / xy[7]}, gain[3];
    apply(&inverse, white, gain);
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++) rgb.m[i][c] = p.m[i][c] * gain[c];
    if (!adaptation(white, adapt)) return false;
    *out = multiply(adapt, &rgb);
    return true;
}

/* ---- Bytes, big-endian. ---- */

static void put32(shd_icc *icc, uint32_t v) {
    for (int shift = 24; shift >= 0; shift -= 8)
        icc->data[icc->size++] = (unsigned char)(v >> shift);
}

static void put_tag(shd_icc *icc, const char tag[4]) {
    memcpy(icc->data + icc->size, tag, 4);
    icc->size += 4;
}

static int32_t fixed(double v) {
    return (int32_t)lround(v * 65536);
}

static void put_fixed(shd_icc *icc, double v) {
    put32(icc, (uint32_t)fixed(v));
}

/* Multi-localized text with one record, UTF-16. `text` is ASCII. */
static void put_text(shd_icc *icc, const char *text) {
    size_t length = strlen(text);
    put_tag(icc, "mluc");
    put32(icc, 0);
    put32(icc, 1);
    put32(icc, 12);
    put_tag(icc, "enUS");
    put32(icc, (uint32_t)(2 * length));
    put32(icc, 28);
    for (size_t i = 0; i < length; i++) {
        icc->data[icc->size++] = 0;
        icc->data[icc->size++] = (unsigned char)text[i];
    }
}

static void put_xyz(shd_icc *icc, double x, double y, double z) {
    put_tag(icc, "XYZ ");
    put32(icc, 0);
    put_fixed(icc, x);
    put_fixed(icc, y);
    put_fixed(icc, z);
}

/* Encoded to linear, as a parametricCurveType (ICC.1:2010, 10.16). */
static void put_curve(shd_icc *icc, shd_transfer transfer) {
    put_tag(icc, "para");
    put32(icc, 0);
    if (transfer == SHD_TRANSFER_SRGB) {
        put32(icc, 3u << 16); /* (aX + b)^g from d on, cX below */
        put_fixed(icc, 2.4);
        put_fixed(icc, 1 / 1.055);
        put_fixed(icc, 0.055 / 1.055);
        put_fixed(icc, 1 / 12.92);
        put_fixed(icc, 0.04045);
    } else {
        put32(icc, 0);
        put_fixed(icc, transfer == SHD_TRANSFER_REC1886 ? 2.4 : 1);
    }
}

static void put_header(shd_icc *icc) {
    memset(icc->data, 0, 128);
    icc->size = 8;
    put32(icc, 0x04300000); /* version 4.3 */
    put_tag(icc, "mntr");
    put_tag(icc, "RGB ");
    put_tag(icc, "XYZ ");
    /* A fixed date, 2026-01-01: equal pictures are equal bytes. */
    put32(icc, 2026u << 16 | 1);
    put32(icc, 1u << 16);
    put32(icc, 0);
    put_tag(icc, "acsp");
    icc->size = 68;
    for (int i = 0; i < 3; i++) put_fixed(icc, d50[i]);
    icc->size = 128;
}

enum { TAG_COUNT = 10 };

/* Ends an element that began at `start`: enters it into the tag table. */
static void close_element(shd_icc *icc, int index, const char tag[4], size_t start) {
    size_t end = icc->size;
    icc->size = 132 + 12 * (size_t)index;
    put_tag(icc, tag);
    put32(icc, (uint32_t)start);
    put32(icc, (uint32_t)(end - start));
    icc->size = end;
    while (icc->size % 4) icc->data[icc->size++] = 0;
}

static void name_profile(shd_icc *icc, shd_transfer transfer, int primaries) {
    const char *space = primaries < 0 ? "RGB" : known[primaries].name;
    if (transfer == SHD_TRANSFER_SRGB && primaries == 0) space = "sRGB";
    const char *curve = transfer == SHD_TRANSFER_LINEAR    ? " linear"
                        : transfer == SHD_TRANSFER_REC1886 ? " gamma 2.4"
                        : primaries == 0 || primaries == 1 ? ""
                                                           : " with sRGB curve";
    snprintf(icc->name, sizeof icc->name, "%s%s", space, curve);
}

shd_icc shd_icc_make(const shd_image *image) {
    shd_icc icc = {.size = 0};
    if (image->transfer == SHD_TRANSFER_UNKNOWN || image->channel >= 0) return icc;
    if (!image->has_primaries && image->transfer != SHD_TRANSFER_SRGB) return icc;
    const double *xy = image->has_primaries ? image->primaries : known[0].xy;
    matrix chad, rgb;
    if (!colorants(xy, &chad, &rgb)) return icc;

    /* Rounded columns must still add up to D50, or white gets a tint of its own: green, the
     * largest, takes the difference. */
    for (int i = 0; i < 3; i++)
        rgb.m[i][1] = (fixed(d50[i]) - fixed(rgb.m[i][0]) - fixed(rgb.m[i][2])) / 65536.0;

    name_profile(&icc, image->transfer, find_primaries(xy));
    put_header(&icc);
    put32(&icc, TAG_COUNT);
    icc.size += 12 * TAG_COUNT;

    int tag = 0;
    size_t start = icc.size;
    put_text(&icc, icc.name);
    close_element(&icc, tag++, "desc", start);
    start = icc.size;
    put_text(&icc, "No copyright, use freely");
    close_element(&icc, tag++, "cprt", start);
    start = icc.size;
    put_xyz(&icc, d50[0], d50[1], d50[2]);
    close_element(&icc, tag++, "wtpt", start);
    start = icc.size;
    put_tag(&icc, "sf32");
    put32(&icc, 0);
    for (int i = 0; i < 9; i++) put_fixed(&icc, chad.m[i / 3][i % 3]);
    close_element(&icc, tag++, "chad", start);
    static const char colorant[3][5] = {"rXYZ", "gXYZ", "bXYZ"};
    for (int c = 0; c < 3; c++) {
        start = icc.size;
        put_xyz(&icc, rgb.m[0][c], rgb.m[1][c], rgb.m[2][c]);
        close_element(&icc, tag++, colorant[c], start);
    }
    /* The three curves are one element. */
    static const char curve[3][5] = {"rTRC", "gTRC", "bTRC"};
    start = icc.size;
    put_curve(&icc, image->transfer);
    size_t end = icc.size;
    for (int c = 0; c < 3; c++) {
        icc.size = end;
        close_element(&icc, tag++, curve[c], start);
    }

    size_t size = icc.size;
    icc.size = 0;
    put32(&icc, (uint32_t)size);
    icc.size = size;
    return icc;
}
