/* A version 4 display profile of the matrix/TRC kind (ICC.1:2010, 8.4.3): the device's linear
 * RGB goes by a 3x3 matrix to XYZ under D50. */
#include "image/icc.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "base/primaries.h"
#include "base/vec3.h"

static const struct {
    const char *name;
    const double *xy;
} known_primaries[] = {{"Rec.709", shd_rec709},       {"Display P3", shd_display_p3},
                       {"Rec.2020", shd_rec2020},     {"DCI-P3", shd_p3_dci},
                       {"P3-D60", shd_p3_d60},        {"ACEScg", shd_acescg},
                       {"ACES2065-1", shd_aces2065_1}};

static const char *name_of_profile(const double xy[8]) {
    for (size_t k = 0; k < sizeof known_primaries / sizeof known_primaries[0]; k++)
        if (!memcmp(xy, known_primaries[k].xy, 8 * sizeof *xy)) return known_primaries[k].name;
    return "RGB";
}

static bool is_rec709(const double xy[8]) {
    return !memcmp(xy, shd_rec709, sizeof shd_rec709);
}

bool shd_image_is_srgb(const shd_image *image) {
    return image->transfer == SHD_TRANSFER_SRGB &&
           (!image->has_primaries || is_rec709(image->primaries));
}

bool shd_image_code_points(const shd_image *image, unsigned char codes[4]) {
    static const unsigned char curves[] = {[SHD_TRANSFER_LINEAR] = 8,
                                           [SHD_TRANSFER_SRGB] = 13,
                                           [SHD_TRANSFER_GAMMA22] = 4,
                                           [SHD_TRANSFER_PQ] = 16,
                                           [SHD_TRANSFER_HLG] = 18};
    static const struct {
        const double *xy;
        unsigned char code;
    } known[] = {{shd_rec709, 1}, {shd_rec2020, 9}, {shd_p3_dci, 11}, {shd_display_p3, 12}};
    if (image->channel >= 0 || !image->has_primaries || !curves[image->transfer]) return false;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (memcmp(image->primaries, known[i].xy, sizeof image->primaries)) continue;
        memcpy(codes, (unsigned char[]){known[i].code, curves[image->transfer], 0, 1}, 4);
        return true;
    }
    return false;
}

/* The profile connection space's white, as ICC.1:2010 7.2.16 fixes it, exact in s15Fixed16. */
static const double d50[3] = {0xF6D6 / 65536.0, 1.0, 0xD32D / 65536.0};

/* ---- Bytes, big-endian. ---- */

static void append_u32(shd_icc *icc, uint32_t v) {
    for (int shift = 24; shift >= 0; shift -= 8)
        icc->data[icc->size++] = (unsigned char)(v >> shift);
}

static void put_tag(shd_icc *icc, const char tag[4]) {
    memcpy(icc->data + icc->size, tag, 4);
    icc->size += 4;
}

static int32_t fixed_of(double v) {
    return (int32_t)lround(v * 65536);
}

static void put_fixed(shd_icc *icc, const double *values, int count) {
    for (int i = 0; i < count; i++) append_u32(icc, (uint32_t)fixed_of(values[i]));
}

/* What an element begins with: its type, and four bytes of 0. */
static void put_type(shd_icc *icc, const char type[4]) {
    put_tag(icc, type);
    append_u32(icc, 0);
}

static bool is_hdr(shd_transfer transfer) {
    return transfer == SHD_TRANSFER_PQ || transfer == SHD_TRANSFER_HLG;
}

/* Version 4.3, or 4.4, which knows of cicpTag; a display's RGB, from XYZ, on a fixed date,
 * 2026-01-01: equal pictures are equal bytes. What is not here is 0. */
static void put_icc_header(shd_icc *icc, shd_transfer transfer) {
    static const char head[] = "\0\0\0\0\0\0\0\0\x04\x30\0\0mntrRGB XYZ "
                               "\x07\xEA\0\1\0\1\0\0\0\0\0\0acsp";
    memcpy(icc->data, head, sizeof head);
    if (is_hdr(transfer)) icc->data[9] = 0x40;
    icc->size = 68;
    put_fixed(icc, d50, 3);
    icc->size = 128;
}

/* ---- Elements: bytes that one entry of the tag table, or several, point to. ---- */

enum { TAG_COUNT = 10 }; /* without cicp */

/* Enters the element that began at `start` into the tag table. */
static void enter_tag(shd_icc *icc, int *tags, const char tag[4], size_t start) {
    const size_t end = icc->size;
    icc->size = 132 + 12 * (size_t)(*tags)++;
    put_tag(icc, tag);
    append_u32(icc, (uint32_t)start);
    append_u32(icc, (uint32_t)(end - start));
    icc->size = end;
}

/* Multi-localized text with one record, UTF-16. `text` is ASCII. */
static void add_text(shd_icc *icc, int *tags, const char tag[4], const char *text) {
    const size_t start = icc->size, length = strlen(text);
    put_type(icc, "mluc");
    append_u32(icc, 1);
    append_u32(icc, 12);
    put_tag(icc, "enUS");
    append_u32(icc, (uint32_t)(2 * length));
    append_u32(icc, 28);
    for (size_t i = 0; i < length; i++, icc->size += 2)
        icc->data[icc->size + 1] = (unsigned char)text[i];
    enter_tag(icc, tags, tag, start);
    icc->size = (icc->size + 3) / 4 * 4;
}

/* Fixed-point numbers: three of the type "XYZ ", or nine of "sf32". */
static void add_numbers(shd_icc *icc, int *tags, const char tag[4], const char type[4],
                        const double *values, int count) {
    const size_t start = icc->size;
    put_type(icc, type);
    put_fixed(icc, values, count);
    enter_tag(icc, tags, tag, start);
}

/* Samples of a curveType (ICC.1:2022, 10.6). Lines between them are off by 0.025 codes of
 * sRGB of 8 bits. */
enum { SAMPLES = 1024 };

/* Light of a grey's signal, in reference whites of 203 cd/m2 (ITU-R BT.2408): PQ's 1 is
 * 10,000 cd/m2, HLG's 1,000, with the gamma of such a display (BT.2100, table 5). */
static double light_of(shd_transfer transfer, double signal) {
    const double v = shd_curve_decode(transfer, signal);
    return transfer == SHD_TRANSFER_PQ ? v * 10000 / 203 : pow(v, 1.2) * 1000 / 203;
}

/* Up to the knee as it is; from there exponentially to 1, without a step in the slope. */
static double roll_off(double light) {
    const double knee = 0.6;
    return light <= knee ? light : 1 - (1 - knee) * exp((knee - light) / (1 - knee));
}

static void put_samples(shd_icc *icc, shd_transfer transfer) {
    const double most = roll_off(light_of(transfer, 1));
    put_type(icc, "curv");
    append_u32(icc, SAMPLES);
    for (int i = 0; i < SAMPLES; i++) {
        const double v = roll_off(light_of(transfer, i / (SAMPLES - 1.0))) / most;
        const long code = lround(v * 65535);
        icc->data[icc->size++] = (unsigned char)(code >> 8);
        icc->data[icc->size++] = (unsigned char)code;
    }
}

static void add_code_points(shd_icc *icc, int *tags, const unsigned char codes[4]) {
    const size_t start = icc->size;
    put_type(icc, "cicp");
    memcpy(icc->data + icc->size, codes, 4);
    icc->size += 4;
    enter_tag(icc, tags, "cicp", start);
}

static void put_parameters(shd_icc *icc, shd_transfer transfer) {
    static const double srgb[5] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
    const double power = transfer == SHD_TRANSFER_REC1886   ? 2.4
                         : transfer == SHD_TRANSFER_GAMMA22 ? 2.2
                         : transfer == SHD_TRANSFER_GAMMA26 ? 2.6
                                                            : 1;
    const bool is_srgb = transfer == SHD_TRANSFER_SRGB;
    put_type(icc, "para");
    append_u32(icc, is_srgb ? 3u << 16 : 0); /* 3: (aX + b)^g from d on, cX below; 0: X^g */
    put_fixed(icc, is_srgb ? srgb : &power, is_srgb ? 5 : 1);
}

/* Encoded to linear, as a parametricCurveType (ICC.1:2010, 10.16) or samples: one element for the
 * three. */
static void add_curve(shd_icc *icc, int *tags, shd_transfer transfer) {
    const size_t start = icc->size;
    if (is_hdr(transfer))
        put_samples(icc, transfer);
    else
        put_parameters(icc, transfer);
    enter_tag(icc, tags, "rTRC", start);
    enter_tag(icc, tags, "gTRC", start);
    enter_tag(icc, tags, "bTRC", start);
}

static void name_profile(shd_icc *icc, shd_transfer transfer, const double xy[8]) {
    const bool is_usual = is_rec709(xy) || !memcmp(xy, shd_display_p3, sizeof shd_display_p3);
    const bool is_srgb = transfer == SHD_TRANSFER_SRGB;
    const char *curve = transfer == SHD_TRANSFER_LINEAR    ? " linear"
                        : transfer == SHD_TRANSFER_REC1886 ? " gamma 2.4"
                        : transfer == SHD_TRANSFER_GAMMA22 ? " gamma 2.2"
                        : transfer == SHD_TRANSFER_GAMMA26 ? " gamma 2.6"
                        : transfer == SHD_TRANSFER_PQ      ? " PQ"
                        : transfer == SHD_TRANSFER_HLG     ? " HLG"
                        : is_usual                         ? ""
                                                           : " with sRGB curve";
    snprintf(icc->name, sizeof icc->name, "%s%s",
             is_srgb && is_rec709(xy) ? "sRGB" : name_of_profile(xy), curve);
}

shd_icc shd_icc_make(const shd_image *image) {
    shd_icc icc = {.size = 0};
    if (image->transfer == SHD_TRANSFER_UNKNOWN || image->channel >= 0) return icc;
    if (!image->has_primaries && image->transfer != SHD_TRANSFER_SRGB) return icc;
    const double *xy = image->has_primaries ? image->primaries : shd_rec709;
    shd_affine chad, rgb;
    if (!shd_primaries_adapt(xy, (shd_vec3){d50[0], d50[1], d50[2]}, &chad, &rgb)) return icc;

    name_profile(&icc, image->transfer, xy);
    unsigned char codes[4];
    const bool coded = is_hdr(image->transfer) && shd_image_code_points(image, codes);
    const int count = TAG_COUNT + coded;
    put_icc_header(&icc, image->transfer);
    append_u32(&icc, (uint32_t)count);
    icc.size += 12 * (size_t)count;
    int tags = 0;
    add_text(&icc, &tags, "desc", icc.name);
    add_text(&icc, &tags, "cprt", "No copyright, use freely");
    add_numbers(&icc, &tags, "wtpt", "XYZ ", d50, 3);
    add_numbers(&icc, &tags, "chad", "sf32", chad.linear[0], 9);

    /* Rounded columns must still add up to D50, or white gets a tint of its own: green, the
     * largest, takes the difference. */
    double column[3][3];
    for (int i = 0; i < 3; i++) {
        column[0][i] = rgb.linear[i][0];
        column[2][i] = rgb.linear[i][2];
        column[1][i] =
            (fixed_of(d50[i]) - fixed_of(column[0][i]) - fixed_of(column[2][i])) / 65536.0;
    }
    static const char colorant[3][5] = {"rXYZ", "gXYZ", "bXYZ"};
    for (int c = 0; c < 3; c++) add_numbers(&icc, &tags, colorant[c], "XYZ ", column[c], 3);
    add_curve(&icc, &tags, image->transfer);
    if (coded) add_code_points(&icc, &tags, codes);

    const size_t size = icc.size;
    assert(tags == count && size <= sizeof icc.data);
    icc.size = 0;
    append_u32(&icc, (uint32_t)size);
    icc.size = size;
    return icc;
}
