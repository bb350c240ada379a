/* Tables that give an input its code.
 *
 * Inputs that share their exponent and the first bits of their mantissa share a bucket. With 8 bits
 * a bucket has one threshold at most, and looking up an input is an addition that carries into the
 * code at the threshold. With 16 bits looking up is a guess and a comparison: a straight line for
 * each bucket gives the code or the one below for every float in it. That is checked at both ends
 * of each code and each bucket; between these the guess rises and the code does not change. */
#pragma once

#include <stdint.h>

#include "base/bits.h"
#include "color/color.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shd_color_line {
    float add, slope; /* the guess for x is the integer part of add + slope x */
} shd_color_line;

struct shd_color_codes {
    unsigned max;          /* 255 or 65535 */
    int least[3], most[3]; /* the codes that channels have */
    /* Inputs are held between them, beyond which codes do not change; low >= 0. */
    float low, high[3];
    uint32_t first; /* the bits of `low`, where the first bucket begins */
    int shift;      /* shifts an input's bits, less `first`, to its bucket's index */
    /* 8 bits, [bucket]: code << shift at the bucket's beginning, plus what makes the input's other
     * bits carry into the next code from the threshold on. */
    uint32_t *steps[3];
    shd_color_line *lines[3]; /* 16 bits, [bucket] */
    /* [max + 2]: the smallest input of each code. -infinity if the lowest inputs have this code or
     * a higher one, infinity if no input has it. */
    float *threshold[3];
    float finite_least[3], finite_most[3]; /* inputs between them have finite values */
    float clip_least[3], clip_most[3];     /* inputs at them or beyond are clipped */
    void *memory[6];                       /* malloc'd tables; equal channels share theirs */
};

/* The guess for an input in [low, high]. It is multiplied and added in two steps, so that every
 * build and vector width guesses what was checked. */
static inline float shd_color_guess(const struct shd_color_codes *codes, int channel, float x) {
    uint32_t offset = shd_bits_of(x) - codes->first;
    shd_color_line line = codes->lines[channel][offset >> codes->shift];
    return line.add + line.slope * x;
}

/* Makes tables from thresholds. All thresholds lie between the inputs with the bits `from`, a
 * multiple of 2^21, and `to`. False: so few buckets do not do, or memory is short. */
bool shd_color_make_tables(const shd_color_transform *transform, shd_color_codes *codes,
                           uint32_t from, uint32_t to);

#ifdef __cplusplus
}
#endif
