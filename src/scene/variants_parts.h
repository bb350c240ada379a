/* The inside of a batch: what its text is made of. Only for variants*.c. */
#pragma once

#include "scene/patch.h"
#include "scene/read.h"
#include "scene/span.h"
#include "scene/variants.h"

/* A list of values for one place. */
typedef struct shd_axis {
    char *pointer;
    shd_span *values;
    size_t count;
} shd_axis;

struct shd_variants {
    shd_span scene;
    char *name; /* NULL: there is none */
    size_t count;
    shd_span *patches; /* NULL: there is a sweep, or nothing is varied */
    shd_axis axes[SHD_AXES_MOST];
    size_t axis_count;
    shd_sheet_wish wish;
    shd_turn turn;
    shd_span *labels; /* strings; NULL: they are made */
    size_t label_count;
};

shd_field_read shd_read_sheet_wish; /* shd_sheet_wish */
shd_field_read shd_read_turn;       /* shd_turn */

/* What the turn goes around, of the scene as far as that is sound. */
void shd_find_orbit(const json_t *scene, shd_turn *turn);

/* Adds what the frame changes in the scene, a merge patch. */
void shd_put_frame(const shd_turn *turn, size_t index, shd_draft *draft, shd_span scene);
