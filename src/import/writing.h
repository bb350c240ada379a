/* The inside of what writes scenes: only for import/. */
#pragma once

#include <stdio.h>

#include "import/import.h"
#include "import/names.h"

typedef struct shd_scene_writer {
    const shd_model *model;
    const shd_import_options *options;
    FILE *out;
    shd_plain_name *meshes, *materials;
    bool *mesh_used, *material_used; /* by an object that is written */
    bool *object_used;               /* whether it has an inverse */
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

/* ---- view.c: members of the scene ---- */

void shd_put_view(const shd_scene_writer *w);   /* `camera` and `image` */
void shd_put_lights(const shd_scene_writer *w); /* `lights`, unless there are none */
