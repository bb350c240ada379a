/* Few samples whose weighted mean is that of many: quadrature rules made of the pattern. */
#pragma once

#include <stddef.h>

#include "plan/bend.h"

enum { SHD_RULES = 3, SHD_NODES_MOST = 9, SHD_NODES_OWN = 4 + 7 };
enum { SHD_FINE = 12 }; /* samples from which on quarters of blocks are worth a look */

/* Weights add up to 1 and none is below 0, so that what samples err by does not add up. The mean is
 * that of the pattern for all polynomials of degree 2 in the place, and nearly for some above. */
typedef struct shd_rule {
    /* Nodes are the centers of the pixel and of those up to so many rows and columns away, and
     * neighbors share them. 0: they are the pixel's own, within it. */
    int rim;
    size_t count;
    double x[SHD_NODES_MOST], y[SHD_NODES_MOST]; /* pixels, from the pixel's center */
    double weight[SHD_NODES_MOST];
    /* How far the two means of a light's weight may be apart, if it is analytic and within 1 of
     * some constant on each line through the pixel's center, in a disc of each radius
     * (plan/bend.h). Infinite: a weight would be below 0. */
    double share[SHD_DISCS];
} shd_rule;

/* Rules for the pattern of so many samples, 8 or more: of the centers of 3 x 3 pixels, and of 4 and
 * of 7 nodes of the pixel's own. Only sums, products, quotients and roots are used, so that all
 * machines find the same nodes. */
void shd_rules_of(int samples, shd_rule out[SHD_RULES]);

/* How many of the rules, from the first one on, are worth their while. */
static inline size_t shd_rule_count(int samples) {
    return samples >= 12 ? SHD_RULES : samples >= 8 ? 2 : 0;
}
