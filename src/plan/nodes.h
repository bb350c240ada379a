/* Few samples whose weighted mean is that of many: quadrature rules made of the pattern. */
#pragma once

#include <stddef.h>

enum { SHD_RULES = 2, SHD_NODES_MOST = 7, SHD_NODES_ALL = 4 + SHD_NODES_MOST };

/* Weights add up to 1 and none is below 0, so that what samples err by does not add up. The mean is
 * that of the pattern for all polynomials of degree 2 in the place, and nearly for some above. */
typedef struct shd_rule {
    size_t count;
    double x[SHD_NODES_MOST], y[SHD_NODES_MOST]; /* pixels, from the pixel's center */
    double weight[SHD_NODES_MOST];
    /* What the two means of a form of degree 3, 4 and 5 are apart at most, if it is no more than 1
     * on the unit circle: 0 where they are the same. */
    double off[3];
    double sixth; /* the mean of the distances' sixth powers, of both means together */
} shd_rule;

/* No node or sample is farther from the pixel's center. */
static const double SHD_RULE_REACH = 0.7071067812;

/* Rules of 4 and of 7 nodes for the pattern of so many samples, 2 or more. Only sums, products,
 * quotients and roots are used, so that all machines find the same nodes. */
void shd_rules_of(int samples, shd_rule out[SHD_RULES]);

/* How many of the rules, from the first one on, are worth their while. */
static inline size_t shd_rule_count(int samples) {
    return samples >= 12 ? SHD_RULES : samples >= 8 ? 1 : 0;
}
