/* `shade import`: models of other programs as scenes. Main thread, before any other is made. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "import/fit.h"
#include "import/model.h"

/* ---- run.c ---- */

typedef struct shd_model_limits {
    size_t memory;    /* bytes that the importer may take */
    unsigned seconds; /* of a processor; it may last five times as long */
} shd_model_limits;

/* Reads a file (obj, gltf, glb, ply, stl; glTF may name buffers beside it) in a process of its own,
 * and checks what comes of it. The caller ends the model with shd_model_drop. SHD_SCENE: the file
 * cannot be read, or its reader ended by a limit or a signal; SHD_CONFIG: the module is not
 * installed; SHD_EXHAUSTED. */
shd_status shd_model_load(const char *path, const shd_model_limits *limits, const shd_model **out,
                          shd_error *error);
void shd_model_drop(const shd_model *model); /* NULL is fine */

/* ---- material.c ---- */

/* A picture that a coefficient follows; of none `map` is NULL. */
typedef struct shd_import_texture {
    const shd_model_map *map;
    const shd_model_picture *picture;
    double mean[3];   /* of the picture, or 1: the coefficient over this is the picture's factor */
    double factor[3]; /* that of the file, where the mean is 0 */
    double most[3];   /* what either is cut to */
    char channel;     /* 'R' or 'A': it is no color; else 0 */
    bool is_tinted;   /* of a channel: it has a factor all the same */
    bool is_made;     /* as colors that need no factor */
} shd_import_texture;

/* A material in our terms. */
typedef struct shd_import_material {
    shd_native light; /* diffuse and lobes */
    double ambient[3], emissive[3], opacity, reflection[3], transmission[3], ior;
    bool is_fit; /* an approximation of `foreign` */
    shd_foreign foreign;
    /* By kind: SHD_MAP_AMBIENT, SHD_MAP_DIFFUSE, SHD_MAP_SPECULAR, SHD_MAP_EMISSIVE,
     * SHD_MAP_OPACITY, SHD_MAP_NORMAL, SHD_MAP_GLOSS. */
    shd_import_texture textures[SHD_MAP_TAKEN];
} shd_import_material;

/* `phong`: all is to be Phong's model. What pictures do to it is not in it. */
void shd_import_material_of(const shd_model_material *from, bool phong, shd_import_material *out);

/* Of a material that three.js has written (Material.toJSON): MeshPhongMaterial, MeshLambertMaterial
 * or MeshStandardMaterial. `name` gets its name and `maps` the members that hold pictures, cut.
 * SHD_SCENE. */
shd_status shd_import_three(const char *json, size_t length, bool phong, char name[64],
                            char maps[256], shd_import_material *out, shd_error *error);

/* ---- scene.c ---- */

typedef struct shd_import_options {
    bool phong;
    /* Takes a mesh as PUT /v1/meshes has it, and returns whether to go on; NULL: arrays are in the
     * document. `digest` has 64 digits. */
    bool (*keep)(void *context, const void *bytes, size_t size, const char *digest);
    /* Takes the file of a picture in the same way; NULL: pictures are left out. `suffix` is that of
     * its format. */
    bool (*picture)(void *context, const void *bytes, size_t size, const char *digest,
                    const char *suffix);
    /* Takes a sentence on what is left out or approximated. */
    void (*note)(void *context, const char *text);
    void *context;
} shd_import_options;

/* The scene document, which the caller frees. SHD_EXHAUSTED, or SHD_CANCELLED if `keep` or
 * `picture` say so. */
shd_status shd_import_scene(const shd_model *model, const shd_import_options *options, char **json,
                            size_t *length, shd_error *error);

/* A sphere of the material. */
shd_status shd_import_sphere(const char *name, const shd_import_material *material,
                             const shd_import_options *options, char **json, size_t *length,
                             shd_error *error);
