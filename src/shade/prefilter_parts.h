/* The inside of tables of environments. Only for shade/prefilter*.c. */
#pragma once

#include "shade/prefilter.h"

enum {
    SHD_KERNEL_TERMS = 7,
    SHD_CELL_LANES = 4,
    SHD_HOT_MOST = 128,
    SHD_WATCHED_MOST = 512,
    SHD_HOT_PARTS = 8
};

/* Of a cell of the sphere: the direction of its middle, and the integral of radiance over it. Each
 * is an array of its own. */
enum { SHD_CELL_AT = 0, SHD_CELL_FLUX = 3, SHD_CELL_ROWS = 6 };

/* How many cells row `row` of `rows` has: about as wide as high. */
static inline int shd_cells_in_row(int rows, int row) {
    return (int)ceil(2 * rows * sin(SHD_PI * (row + 0.5) / rows));
}

/* [rows + 4][columns + 4][3]: two nodes beyond each end are those of the other side. */
static inline const float *shd_table_of(const shd_prefilter *t) {
    return (const float *)(const void *)((const char *)t + t->table_at);
}
static inline const uint32_t *shd_starts_of(const shd_prefilter *t) {
    return (const uint32_t *)(const void *)((const char *)t + t->starts_at);
}
/* [cell_rows]: the cosine and the sine of each row's latitude. */
typedef struct shd_row_place {
    double cosine, sine;
} shd_row_place;
static inline const shd_row_place *shd_rows_of(const shd_prefilter *t) {
    return (const shd_row_place *)(const void *)((const char *)t + t->rows_at);
}
/* [SHD_CELL_ROWS][cell_stride]: what lies behind the last cell may be read, too. */
static inline const float *shd_cells_of(const shd_prefilter *t) {
    return (const float *)(const void *)((const char *)t + t->cells_at);
}

/* [watched]: indices of cells, the one in which radiance differs most first, of which the first
 * hot_count have smaller ones; and by how much it does, times their size. */
static inline const uint32_t *shd_hot_of(const shd_prefilter *t) {
    return (const uint32_t *)(const void *)((const char *)t + t->hot_at);
}
static inline const float *shd_contrast_of(const shd_prefilter *t) {
    return (const float *)(const void *)((const char *)t + t->contrast_at);
}
/* [hot_count][SHD_CELL_ROWS][hot_parts^2]: smaller cells of each. */
static inline const float *shd_hot_cells_of(const shd_prefilter *t) {
    return (const float *)(const void *)((const char *)t + t->hot_cells_at);
}

/* Fill their part of the block. False: cancelled. */
bool shd_make_cells(const shd_surroundings *map, shd_prefilter *t, const atomic_bool *cancelled);
bool shd_filter_map(const shd_surroundings *map, shd_prefilter *t, const atomic_bool *cancelled,
                    void *scratch);
size_t shd_filter_scratch(double exponent, int columns);
bool shd_measure_filter(const shd_surroundings *map, shd_prefilter *t,
                        const atomic_bool *cancelled);
