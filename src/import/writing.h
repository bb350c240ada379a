/* The inside of what writes scenes: only for import/. */
#pragma once

#include <stdio.h>

#include "base/digest.h"
#include "import/import.h"
#include "import/names.h"

typedef struct shd_kept_picture {
    char digits[SHD_DIGEST_TEXT];
} shd_kept_picture;

typedef struct shd_scene_writer {
    const shd_model *model;
    const shd_import_options *options;
    FILE *out;
    shd_plain_name *meshes, *materials;
    bool *mesh_used, *material_used; /* by an object that is written */
    bool *object_used;               /* whether it has an inverse */
    bool *material_bare;             /* a mesh that it is used on has no uvs */
    shd_kept_picture *pictures;      /* by their index; digits are "" until a file is kept */
    bool rays;                       /* whether a material wants them */
    bool cancelled;
} shd_scene_writer;

/* A sentence for options->note. */
void shd_import_note(const shd_import_options *options, const char *format, ...) SHD_PRINTF(2, 3);

/* ---- text.c: JSON ---- */

void shd_put_text(FILE *out, const char *text); /* which has no control characters */
void shd_put_float(FILE *out, float value);     /* the shortest digits that are this float */
void shd_put_floats(FILE *out, const float *values, size_t count);
/* Rounded to floats, which files have: with blanks, for people. */
void shd_put_numbers(FILE *out, const double *values, size_t count);

/* ---- textures.c ---- */

/* A material of the file as one of ours: pictures that can be taken are its `textures`, and the
 * others leave their mean, both with a note. `name` is the material's. */
void shd_make_material(shd_scene_writer *w, size_t index, const char *name,
                       shd_import_material *out);

/* A coefficient (an opacity, without `rgb`) that follows a picture, whose file is kept. False: out
 * of memory, or cancelled. */
bool shd_put_texture(shd_scene_writer *w, const shd_import_texture *texture, const double rgb[3]);
/* An exponent of `most` or less, but no less than 1. */
bool shd_put_gloss(shd_scene_writer *w, const shd_import_texture *texture, double most);
bool shd_put_normals(shd_scene_writer *w,
                     const shd_import_texture *texture); /* the same of these */

/* ---- view.c: members of the scene ---- */

void shd_put_view(const shd_scene_writer *w);   /* `camera` and `image` */
void shd_put_lights(const shd_scene_writer *w); /* `lights`, unless there are none */
