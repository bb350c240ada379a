/* The inside of the module: pictures of what is metal here and none there, as glTF has them. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "import/model.h"

/* A file, and what its samples are multiplied by. */
typedef struct shd_metal_source {
    const void *bytes; /* NULL: the factor alone */
    size_t size;
    float factor[3];
} shd_metal_source;

/* PNG files of sRGB, of 8 bits, malloc'ed; NULL: there are none. */
typedef struct shd_metal {
    void *beneath, *mirrored;
    size_t beneath_size, mirrored_size;
} shd_metal;

/* Of two PNG, JPEG or WebP files, either of which may be absent, the base color, of sRGB, and the
 * metal m in blue, times the first of its factors, of which the first, if there is one, tells the
 * size, and the texel that is nearest is taken of the other: the picture of f0, which is what no
 * metal has, mixed with the base color by m, and that of the diffuse color, as
 * shd_import_material_of makes it of each texel and the mean roughness of `material`, whose kind is
 * SHD_MODEL_METAL_ROUGH. False: one picture can do, as m is 0 or 1 everywhere, or m and the base
 * color are the same everywhere, or a file is another one, damaged or too large, or there is no
 * memory. */
bool shd_split_metal(const shd_metal_source *base, const shd_metal_source *metal,
                     const shd_model_material *material, shd_metal *out);
