/* The inside of tables of environments. Only for shade/prefilter*.c. */
#pragma once

#include "shade/prefilter.h"

enum { SHD_KERNEL_STEPS = 1024 };

/* A cell of the sphere: a direction in its middle, and the integral of radiance over it. */
typedef struct shd_cell {
    float at[3], flux[3];
} shd_cell;

/* How many cells row `row` of `rows` has: about as wide as high. */
int shd_cells_in_row(int rows, int row);

static inline const float *shd_kernel_of(const shd_prefilter *t) {
    return (const float *)(const void *)((const char *)t + t->kernel_at);
}
/* [rows + 4][columns + 4][3]: two nodes beyond each end are those of the other side. */
static inline const float *shd_table_of(const shd_prefilter *t) {
    return (const float *)(const void *)((const char *)t + t->table_at);
}
static inline const uint32_t *shd_starts_of(const shd_prefilter *t) {
    return (const uint32_t *)(const void *)((const char *)t + t->starts_at);
}
static inline const shd_cell *shd_cells_of(const shd_prefilter *t) {
    return (const shd_cell *)(const void *)((const char *)t + t->cells_at);
}

/* Fill their part of the block. False: cancelled. */
bool shd_make_cells(const shd_surroundings *map, shd_prefilter *t, const atomic_bool *cancelled);
bool shd_filter_map(const shd_surroundings *map, shd_prefilter *t, const atomic_bool *cancelled,
                    void *scratch);
size_t shd_filter_scratch(int columns);
bool shd_measure_filter(const shd_surroundings *map, shd_prefilter *t,
                        const atomic_bool *cancelled);
