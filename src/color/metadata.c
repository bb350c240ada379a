#include "color/metadata.h"

#include <string.h>

#include "base/primaries.h"

static const shd_encoding spaces[] = {
    {"lin_rec709", SHD_TRANSFER_LINEAR, shd_rec709},
    {"ACEScg", SHD_TRANSFER_LINEAR, shd_acescg},
    {"ACES2065-1", SHD_TRANSFER_LINEAR, shd_aces2065_1},
    {"sRGB", SHD_TRANSFER_SRGB, shd_rec709},
    {"Rec.1886", SHD_TRANSFER_REC1886, shd_rec709},
    {"Display P3", SHD_TRANSFER_SRGB, shd_display_p3},
    {"Linear Rec.709 (sRGB)", SHD_TRANSFER_LINEAR, shd_rec709},
    {"sRGB - Texture", SHD_TRANSFER_SRGB, shd_rec709},
};

static const shd_encoding displays[] = {
    {"sRGB", SHD_TRANSFER_SRGB, shd_rec709},
    {"Rec.1886", SHD_TRANSFER_REC1886, shd_rec709},
    {"Display P3", SHD_TRANSFER_SRGB, shd_display_p3},
    {"sRGB - Display", SHD_TRANSFER_SRGB, shd_rec709},
    {"Rec.1886 Rec.709 - Display", SHD_TRANSFER_REC1886, shd_rec709},
};

static const shd_encoding *find_encoding(const shd_encoding *table, size_t count,
                                         const char *name) {
    for (size_t i = 0; i < count; i++)
        if (!strcmp(table[i].name, name)) return &table[i];
    return NULL;
}

const shd_encoding *shd_encoding_of_space(const char *name) {
    return find_encoding(spaces, sizeof spaces / sizeof *spaces, name);
}

const shd_encoding *shd_encoding_of_display(const char *name) {
    return find_encoding(displays, sizeof displays / sizeof *displays, name);
}
