#include "base/pattern.h"

static double van_der_corput(unsigned i) {
    double value = 0, half = 0.5;
    for (; i; i >>= 1, half /= 2)
        if (i & 1) value += half;
    return value;
}

void shd_sample_offset(int i, int n, double *x, double *y) {
    double spacing = 1;
    for (int reach = 1; reach < n; reach *= 2) spacing /= 2;
    *x = (i + 0.5) / n;
    *y = van_der_corput((unsigned)i) + spacing / 2;
}
