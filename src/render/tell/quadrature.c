#include "render/tell/quadrature.h"

#include <math.h>

/* The rule's positive nodes and their weights on [-1, 1] (Abramowitz and Stegun, table 25.4). */
static const double nodes[SHD_PANEL / 2] = {0.1252334085114689155, 0.3678314989981801938,
                                            0.5873179542866174473, 0.7699026741943046870,
                                            0.9041172563704748567, 0.9815606342467192507},
                                      weights[SHD_PANEL / 2] = {
                                          0.2491470458134027850, 0.2334925365383548088,
                                          0.2031674267230659217, 0.1600783285433462264,
                                          0.1069393259953184309, 0.0471753363865118272};

/* Panels are cut to 2^-DEPTH of a piece at most. */
enum { DEPTH = 36 };

static void integrate_panel(const shd_quadrature *q, double from, double to, double out[3]) {
    const double middle = (from + to) / 2, half = (to - from) / 2;
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < SHD_PANEL / 2; i++) {
        double low[3], high[3];
        q->at(q->context, middle - half * nodes[i], low);
        q->at(q->context, middle + half * nodes[i], high);
        for (int c = 0; c < 3; c++) out[c] += weights[i] * half * (low[c] + high[c]);
    }
    *q->left -= *q->left < SHD_PANEL ? *q->left : SHD_PANEL;
}

static void refine(const shd_quadrature *q, double from, double to, const double whole[3],
                   double tolerance, int depth, shd_integral *sum) {
    const double middle = (from + to) / 2;
    double low[3], high[3], off = 0, size = 0;
    integrate_panel(q, from, middle, low);
    integrate_panel(q, middle, to, high);
    for (int c = 0; c < 3; c++) {
        off = fmax(off, fabs(low[c] + high[c] - whole[c]));
        size = fmax(size, fabs(whole[c]));
    }
    /* What is below rounding does not become better. */
    if (off <= tolerance || off <= 2e-15 * size || depth == 0 || *q->left == 0) {
        for (int c = 0; c < 3; c++) sum->value[c] += low[c] + high[c];
        sum->error += off;
        return;
    }
    refine(q, from, middle, low, tolerance / 2, depth - 1, sum);
    refine(q, middle, to, high, tolerance / 2, depth - 1, sum);
}

void shd_integrate(const shd_quadrature *q, const double *ends, size_t count, shd_integral *out) {
    *out = (shd_integral){.error = 0};
    for (size_t i = 1; i < count; i++) {
        if (!(ends[i] > ends[i - 1])) continue;
        double whole[3];
        integrate_panel(q, ends[i - 1], ends[i], whole);
        refine(q, ends[i - 1], ends[i], whole, q->tolerance / (double)(count - 1), DEPTH, out);
    }
}
