/* Least squares of up to three columns, from their sums of products: a few numbers, whatever the
 * number of rows. Any thread. */
#pragma once

#include <stdbool.h>

enum { SHD_COLUMNS = 3 };

/* Sums over rows, weights applied: of columns with each other, with what they are to add up to, and
 * of that with itself. */
typedef struct shd_products {
    double columns[SHD_COLUMNS][SHD_COLUMNS]; /* symmetric */
    double values[SHD_COLUMNS];
    double square;
} shd_products;

/* The x >= 0 that minimizes |A x - y|^2, which is returned: the best of all sets of columns whose
 * own solution has no negative (Lawson and Hanson, "Solving Least Squares Problems", chapter 23,
 * for so few columns that every set is tried). Columns that are sums of others, to 1e-6 of their
 * length, are 0 where the others do without them; of two that are alike the later one is used. */
double shd_least_squares(const shd_products *p, double x[SHD_COLUMNS]);

/* How much of a column no sum of the others is, from 0 (it is one, or 0) to 1 (it is perpendicular
 * to them). */
double shd_column_share(const shd_products *p, int column);

/* The inverse of `columns`, of those that are set in `uses`; others are 0. False: they depend on
 * each other. */
bool shd_invert_products(const shd_products *p, const bool uses[SHD_COLUMNS],
                         double out[SHD_COLUMNS][SHD_COLUMNS]);
