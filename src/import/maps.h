/* The inside of the module: the pictures that a file's materials name, their files' bytes, and
 * where on a surface they are. */
#pragma once

#include <assimp/material.h>
#include <assimp/scene.h>

#include "import/block.h"
#include "import/mtl.h"

typedef struct shd_picture_key {
    char *text;     /* what materials call a picture */
    float steepest; /* of normals that are made: shd_relief's; -1: the heights cannot be read */
} shd_picture_key;

typedef struct shd_map_reader {
    const struct aiScene *scene;
    const char *model; /* path of the file, beside which pictures are */
    shd_block *block;
    const shd_mtl *mtl;
    shd_losses *losses;
    /* [capacity], each once; nobody frees them: the process ends */
    shd_model_picture *pictures;
    shd_picture_key *keys;
    size_t count, capacity;
    bool full; /* memory ran out */
} shd_map_reader;

/* Fills out->maps, and appends pictures that are new; tells those of other uses. `name` is the
 * material's. */
void shd_put_maps(shd_map_reader *reader, const struct aiMaterial *material, const char *name,
                  shd_model_material *out);

/* glTF: where metal differs on its picture, and the base color has none or one at the same place,
 * or the base color has one and metal is between 0 and 1, pictures are made of what mirrors and
 * what does not: SHD_MAP_MIRRORED and SHD_MAP_BENEATH. No picture of metal, or of base color
 * without one, becomes more than eight of each. All else of `out` is set. */
void shd_put_metal(shd_map_reader *reader, shd_model_material *out);

/* glTF: what is cut out has a picture of its own, of opacity, if the base color's has an alpha that
 * `factor` multiplies, and fewer than eight have been cut out of that picture at other values.
 * out->cutoff is set. */
void shd_put_cut_out(shd_map_reader *reader, float factor, shd_model_material *out);
