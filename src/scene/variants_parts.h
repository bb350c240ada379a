/* The inside of a batch: what its text is made of. Only for variants*.c. */
#pragma once

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
    shd_span *labels; /* strings; NULL: they are made */
    size_t label_count;
};

shd_field_read shd_read_sheet_wish; /* shd_sheet_wish */
