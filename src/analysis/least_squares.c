#include "analysis/least_squares.h"

#include <math.h>
#include <string.h>

/* A column's part that others are not, squared, of the column squared. What sums of so many
 * products lose is below. */
static const double DEPENDENT = 1e-12;

/* Cholesky's factor, below the diagonal, of the columns of `set` in their order, each divided by
 * its length. False: one depends on those before it. */
static bool factor_set(const shd_products *p, const int *set, int count,
                       double out[SHD_COLUMNS][SHD_COLUMNS], double length[SHD_COLUMNS]) {
    for (int i = 0; i < count; i++) {
        length[i] = sqrt(p->columns[set[i]][set[i]]);
        if (!(length[i] > 0)) return false;
        for (int j = 0; j <= i; j++) {
            double rest = p->columns[set[i]][set[j]] / (length[i] * length[j]);
            for (int k = 0; k < j; k++) rest -= out[i][k] * out[j][k];
            if (j == i && !(rest > DEPENDENT)) return false;
            out[i][j] = j == i ? sqrt(rest) : rest / out[j][j];
        }
    }
    return true;
}

/* Solves with the factor: b becomes x. */
static void solve_set(int count, double factor[SHD_COLUMNS][SHD_COLUMNS],
                      const double length[SHD_COLUMNS], double *b) {
    for (int i = 0; i < count; i++) {
        b[i] /= length[i];
        for (int k = 0; k < i; k++) b[i] -= factor[i][k] * b[k];
        b[i] /= factor[i][i];
    }
    for (int i = count - 1; i >= 0; i--) {
        for (int k = i + 1; k < count; k++) b[i] -= factor[k][i] * b[k];
        b[i] /= factor[i][i];
    }
    for (int i = 0; i < count; i++) b[i] /= length[i];
}

static double rest_of(const shd_products *p, const double x[SHD_COLUMNS]) {
    double sum = p->square;
    for (int i = 0; i < SHD_COLUMNS; i++) {
        sum -= 2 * x[i] * p->values[i];
        for (int j = 0; j < SHD_COLUMNS; j++) sum += x[i] * x[j] * p->columns[i][j];
    }
    return fmax(sum, 0);
}

static int list_set(unsigned bits, int set[SHD_COLUMNS]) {
    int count = 0;
    for (int i = 0; i < SHD_COLUMNS; i++)
        if (bits >> i & 1) set[count++] = i;
    return count;
}

double shd_least_squares(const shd_products *p, double x[SHD_COLUMNS]) {
    double best = p->square;
    memset(x, 0, SHD_COLUMNS * sizeof *x);
    for (unsigned bits = 1; bits < 1u << SHD_COLUMNS; bits++) {
        int set[SHD_COLUMNS];
        double factor[SHD_COLUMNS][SHD_COLUMNS], length[SHD_COLUMNS], b[SHD_COLUMNS];
        double full[SHD_COLUMNS] = {0};
        const int count = list_set(bits, set);
        if (!factor_set(p, set, count, factor, length)) continue;
        for (int i = 0; i < count; i++) b[i] = p->values[set[i]];
        solve_set(count, factor, length, b);
        bool good = true;
        for (int i = 0; i < count; i++) {
            good &= b[i] >= 0;
            full[set[i]] = b[i];
        }
        const double rest = good ? rest_of(p, full) : INFINITY;
        if (!(rest <= best)) continue;
        best = rest;
        memcpy(x, full, sizeof full);
    }
    return best;
}

double shd_column_share(const shd_products *p, int column) {
    int set[SHD_COLUMNS], count = 0;
    double factor[SHD_COLUMNS][SHD_COLUMNS], length[SHD_COLUMNS];
    if (!(p->columns[column][column] > 0)) return 0;
    /* Others that depend on each other are one. */
    for (int i = 0; i < SHD_COLUMNS; i++) {
        if (i == column) continue;
        set[count++] = i;
        if (!factor_set(p, set, count, factor, length)) count--;
    }
    set[count++] = column;
    return factor_set(p, set, count, factor, length) ? factor[count - 1][count - 1] : 0;
}

bool shd_invert_products(const shd_products *p, const bool uses[SHD_COLUMNS],
                         double out[SHD_COLUMNS][SHD_COLUMNS]) {
    int set[SHD_COLUMNS], count = 0;
    double factor[SHD_COLUMNS][SHD_COLUMNS], length[SHD_COLUMNS];
    memset(out, 0, SHD_COLUMNS * sizeof *out);
    for (int i = 0; i < SHD_COLUMNS; i++)
        if (uses[i]) set[count++] = i;
    if (!factor_set(p, set, count, factor, length)) return false;
    for (int j = 0; j < count; j++) {
        double b[SHD_COLUMNS] = {0};
        b[j] = 1;
        solve_set(count, factor, length, b);
        for (int i = 0; i < count; i++) out[set[i]][set[j]] = b[i];
    }
    return true;
}
