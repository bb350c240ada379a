/* The inside of the module: what MTL files say of their pictures and assimp passes over. */
#pragma once

#include "import/losses.h"

/* A statement such as `map_Kd -s 2 2 -o 0.5 0 wood.png`, `norm` or `bump`. */
typedef struct shd_mtl_map {
    char *material, *statement, *file;
    float scale[2], offset[2]; /* `-s`, `-o`: of u and v */
    float bump;                /* `-bm` */
    bool clamp;
} shd_mtl_map;

typedef struct shd_mtl {
    shd_mtl_map *maps; /* [count]; nobody frees them: the process ends */
    size_t count, capacity;
} shd_mtl;

/* Reads the files that a .obj file names by `mtllib`, beside it; of other files there are none.
 * What scenes do not have goes into `losses`. */
void shd_mtl_read(const char *path, shd_mtl *out, shd_losses *losses);

/* A material's last statement of that name. NULL: it has none. */
const shd_mtl_map *shd_mtl_find(const shd_mtl *mtl, const char *material, const char *statement);

/* What a line of such a file states that nobody reads, "Kd spectral" for instance. NULL: it states
 * something else. */
const char *shd_mtl_beyond(const char *line);
