/* Few samples whose weighted mean is that of many: quadrature rules made of the pattern. */
#pragma once

#include <stddef.h>

#include "plan/bend.h"

enum { SHD_RULES = 4, SHD_NODES_MOST = 25, SHD_NODES_OWN = 4 + 7 };
enum { SHD_FINE = 12 }; /* samples from which on quarters of blocks are worth a look */

/* Pixels: how far to each side the shared rules' centers are at most. */
enum { SHD_FRINGE = 2 };

/* Weights add up to 1, so that what samples err by does not add up. Those of the pixel's own nodes
 * are above 0; of the shared rules' some are below, and their sizes add up to SHD_NODES_SPREAD at
 * most, by which samples' errors grow. */
static const double SHD_NODES_SPREAD = 1 + 0x1.5p-5;

/* The mean is that of the pattern for all polynomials of degree 2 in the place, and nearly for some
 * above. With 3 x 3 centers it is for degree 3, too, and with 5 x 5 for 4 and 5, where the pattern
 * is the same upside down; with 5 x 5 for 4 anyway. */
typedef struct shd_rule {
    /* Nodes are the centers of the pixel and of those up to so many rows and columns away, and
     * neighbors share them. 0: they are the pixel's own, within it. */
    int rim;
    size_t count;
    double reach; /* pixels: no node and no sample is farther to a side of the pixel's center */
    double x[SHD_NODES_MOST], y[SHD_NODES_MOST]; /* pixels, from the pixel's center */
    double weight[SHD_NODES_MOST];
    /* How far the two means of a light's weight may be apart, if it is analytic and within 1 of
     * some constant on each line through the pixel's center, in a disc of each radius
     * (plan/bend.h). Infinite: a weight is not what it should be. */
    double share[SHD_DISCS];
} shd_rule;

/* Rules for the pattern of so many samples, shd_rule_count of them: of the centers of 3 x 3 and of
 * 5 x 5 pixels, and of 4 and of 7 nodes of the pixel's own. Only sums, products, quotients and
 * roots are used, so that all machines find the same nodes. */
void shd_rules_of(int samples, shd_rule out[SHD_RULES]);

/* How many of the rules, from the first one on, are worth their while. */
static inline size_t shd_rule_count(int samples) {
    return samples >= 12 ? SHD_RULES : samples >= 8 ? 3 : samples >= 4 ? 2 : 0;
}
