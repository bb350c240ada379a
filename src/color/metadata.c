#include "color/metadata.h"

#include <string.h>

/* Chromaticities: ITU-R BT.709-6 (and IEC 61966-2-1), SMPTE EG 432-1 with white D65, SMPTE ST
 * 2065-1 (AP0), Academy S-2014-004 (AP1). */
static const double rec709[8] = {0.640, 0.330, 0.300, 0.600, 0.150, 0.060, 0.3127, 0.3290};
static const double p3_d65[8] = {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};
static const double aces_ap0[8] = {0.7347, 0.2653,  0.0000,  1.0000,
                                   0.0001, -0.0770, 0.32168, 0.33767};
static const double aces_ap1[8] = {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767};

static const shd_encoding spaces[] = {
    {"lin_rec709", SHD_TRANSFER_LINEAR, rec709},
    {"ACEScg", SHD_TRANSFER_LINEAR, aces_ap1},
    {"ACES2065-1", SHD_TRANSFER_LINEAR, aces_ap0},
    {"sRGB", SHD_TRANSFER_SRGB, rec709},
    {"Rec.1886", SHD_TRANSFER_REC1886, rec709},
    {"Display P3", SHD_TRANSFER_SRGB, p3_d65},
    {"Linear Rec.709 (sRGB)", SHD_TRANSFER_LINEAR, rec709},
    {"sRGB - Texture", SHD_TRANSFER_SRGB, rec709},
};

static const shd_encoding displays[] = {
    {"sRGB", SHD_TRANSFER_SRGB, rec709},
    {"Rec.1886", SHD_TRANSFER_REC1886, rec709},
    {"Display P3", SHD_TRANSFER_SRGB, p3_d65},
    {"sRGB - Display", SHD_TRANSFER_SRGB, rec709},
    {"Rec.1886 Rec.709 - Display", SHD_TRANSFER_REC1886, rec709},
};

static const shd_encoding *find(const shd_encoding *table, size_t count, const char *name) {
    for (size_t i = 0; i < count; i++)
        if (!strcmp(table[i].name, name)) return &table[i];
    return NULL;
}

const shd_encoding *shd_encoding_of_space(const char *name) {
    return find(spaces, sizeof spaces / sizeof *spaces, name);
}

const shd_encoding *shd_encoding_of_display(const char *name) {
    return find(displays, sizeof displays / sizeof *displays, name);
}
