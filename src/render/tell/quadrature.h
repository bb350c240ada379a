/* Integrals by adaptive Gauss-Legendre quadrature: of three channels at once, over an interval that
 * is cut where the integrand is known to bend. Pure; any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct shd_integral {
    double value[3];
    double error; /* the largest channel's, estimated: see below */
} shd_integral;

/* Writes the integrand's channels at x. */
typedef void shd_integrand(void *context, double x, double out[3]);

typedef struct shd_quadrature {
    shd_integrand *at;
    void *context;
    double tolerance; /* of the integral, absolute */
    /* Points that may still be taken of the integrand, counted down by 12 for each panel; panels
     * are not cut any more when it is 0. Several quadratures may share it. */
    size_t *left;
} shd_quadrature;

enum { SHD_PANEL = 12 };

/* The integral from ends[0] to ends[count - 1], ascending, count >= 2. A panel of 12 points is
 * compared with its two halves, and cut there until they agree. The halves' sum is what counts,
 * whose error is far below the difference where the integrand is smooth. */
void shd_integrate(const shd_quadrature *q, const double *ends, size_t count, shd_integral *out);
