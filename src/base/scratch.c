#include "base/scratch.h"

void *shd_scratch_take(shd_scratch *scratch, size_t count, size_t size) {
    const size_t bytes = shd_arena_size(count, size);
    if (!bytes || __builtin_add_overflow(scratch->bytes, bytes, &scratch->bytes))
        scratch->bytes = UINT64_MAX;
    if (!scratch->arena || scratch->full) return NULL;
    void *at = shd_arena_alloc(scratch->arena, count, size);
    scratch->full = !at;
    return at;
}

float **shd_scratch_rows32(shd_scratch *scratch, size_t rows, size_t length) {
    float **out = shd_scratch_take(scratch, rows, sizeof *out);
    float *values = shd_scratch_take(scratch, rows * length, sizeof *values);
    for (size_t i = 0; out && values && i < rows; i++) out[i] = values + i * length;
    return out;
}

double **shd_scratch_rows64(shd_scratch *scratch, size_t rows, size_t length) {
    double **out = shd_scratch_take(scratch, rows, sizeof *out);
    double *values = shd_scratch_take(scratch, rows * length, sizeof *values);
    for (size_t i = 0; out && values && i < rows; i++) out[i] = values + i * length;
    return out;
}
