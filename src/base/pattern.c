#include "base/pattern.h"

/* The rows of samples from left to right, n of each pattern, one pattern after the other. */
static const char rows[] =
#include "base/pattern_rows.inc"
    ;

void shd_sample_offset(int i, int n, double *x, double *y) {
    *x = (i + 0.5) / n;
    *y = (rows[n * (n - 1) / 2 + i] - '0' + 0.5) / n;
}
