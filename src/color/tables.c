#include "color/tables.h"

#include <stdlib.h>
#include <string.h>

/* Bits of the mantissa that number the buckets. The fewer they are, the more of the tables stays in
 * the nearest cache. */
enum { LEAST_MANTISSA = 7, MOST_MANTISSA = 10 };

typedef struct division {
    const shd_color_transform *transform;
    shd_color_codes *codes;
    size_t buckets;
} division;

static uint32_t bucket_start(const division *d, size_t bucket) {
    return d->codes->first + ((uint32_t)bucket << d->codes->shift);
}

/* Keeps a channel's table in place of one with too few buckets. */
static void *keep_table(division *d, int channel, void *table) {
    free(d->codes->memory[3 + channel]);
    return d->codes->memory[3 + channel] = table;
}

/* ---- 8 bits: a bucket has one threshold at most. ---- */

static bool make_steps(division *d, int c) {
    shd_color_codes *codes = d->codes;
    const float *threshold = codes->threshold[c];
    uint32_t *steps = keep_table(d, c, malloc(d->buckets * sizeof *steps));
    codes->steps[c] = steps;
    if (!steps) return false;
    size_t k = (size_t)codes->least[c];
    for (size_t i = 0; i < d->buckets; i++) {
        uint32_t start = bucket_start(d, i);
        float begin = shd_float_of(start), end = shd_float_of(bucket_start(d, i + 1));
        while (threshold[k + 1] <= begin) k++;
        steps[i] = (uint32_t)k << codes->shift;
        if (!(threshold[k + 1] < end)) continue;
        if (threshold[k + 2] < end) return false;
        steps[i] += (1u << codes->shift) - (shd_bits_of(threshold[k + 1]) - start);
    }
    return true;
}

/* ---- 16 bits: looking up is a guess and a comparison. ---- */

static bool guess_is_right(const shd_color_codes *codes, int c, uint32_t bits, size_t code) {
    float x = shd_float_of(bits);
    if (!(x >= codes->low && x <= codes->high[c])) return true;
    float guess = shd_color_guess(codes, c, x);
    if (!(guess > -1 && guess < (float)codes->max + 1)) return false;
    size_t k = (size_t)(int)guess;
    return k + (x >= codes->threshold[c][k + 1]) == code;
}

/* Checks the guesses at all ends of codes and of buckets. */
static bool guesses_are_right(const division *d, int c) {
    const shd_color_codes *codes = d->codes;
    const float *threshold = codes->threshold[c];
    for (size_t k = (size_t)codes->least[c] + 1; k <= (size_t)codes->most[c]; k++) {
        uint32_t at = shd_bits_of(threshold[k]);
        if (threshold[k] < threshold[k + 1] && !guess_is_right(codes, c, at, k)) return false;
        if (threshold[k - 1] < threshold[k] && !guess_is_right(codes, c, at - 1, k - 1))
            return false;
    }
    for (size_t i = 0, k = (size_t)codes->least[c]; i < d->buckets; i++) {
        uint32_t bits = bucket_start(d, i);
        float start = shd_float_of(bits);
        while (threshold[k + 1] < start) k++;
        if (bits && !guess_is_right(codes, c, bits - 1, k)) return false;
        while (threshold[k + 1] <= start) k++;
        if (!guess_is_right(codes, c, bits, k)) return false;
    }
    return true;
}

/* Makes lines through the values at which buckets begin and end. */
static bool make_lines(division *d, const float *values, int c) {
    shd_color_line *lines = keep_table(d, c, malloc(d->buckets * sizeof *lines));
    d->codes->lines[c] = lines;
    if (!lines) return false;
    const double max = d->codes->max;
    for (size_t i = 0; i < d->buckets; i++) {
        double x0 = (double)shd_float_of(bucket_start(d, i)),
               x1 = (double)shd_float_of(bucket_start(d, i + 1));
        double y0 = (double)values[4 * i + (size_t)c] * max,
               y1 = (double)values[4 * (i + 1) + (size_t)c] * max;
        float slope = (float)((y1 - y0) / (x1 - x0));
        if (!(slope >= 0)) return false;
        lines[i] = (shd_color_line){(float)(y0 - (double)slope * x0), slope};
    }
    return guesses_are_right(d, c);
}

static float *convert_ends(const division *d) {
    float *values = malloc((d->buckets + 1) * sizeof(float[4]));
    for (size_t i = 0; values && i <= d->buckets; i++) {
        for (size_t c = 0; c < 3; c++) values[4 * i + c] = shd_float_of(bucket_start(d, i));
        values[4 * i + 3] = 1;
    }
    if (values) shd_color_apply(d->transform, values, d->buckets + 1);
    return values;
}

static bool make_channels(division *d, int channels) {
    bool ok = true;
    if (d->codes->max == 255) {
        for (int c = 0; ok && c < channels; c++) ok = make_steps(d, c);
        return ok;
    }
    float *values = convert_ends(d);
    for (int c = 0; ok && c < channels; c++) ok = values && make_lines(d, values, c);
    free(values);
    return ok;
}

bool shd_color_make_tables(const shd_color_transform *transform, shd_color_codes *codes,
                           uint32_t from, uint32_t to) {
    codes->first = from;
    codes->low = shd_float_of(from);
    int channels = 1;
    for (int c = 0; c < 3; c++) {
        codes->high[c] = codes->threshold[c][codes->most[c]];
        if (memcmp(codes->threshold[c], codes->threshold[0],
                   (codes->max + 2) * sizeof *codes->threshold[c]))
            channels = 3;
    }
    division d = {.transform = transform, .codes = codes};
    bool ok = false;
    for (int mantissa = LEAST_MANTISSA; !ok && mantissa <= MOST_MANTISSA; mantissa++) {
        codes->shift = 23 - mantissa;
        d.buckets = ((to - from) >> codes->shift) + 1;
        ok = make_channels(&d, channels);
    }
    /* Equal channels share the tables of the first one. */
    for (int c = channels; ok && c < 3; c++) {
        free(codes->memory[c]);
        codes->memory[c] = NULL;
        codes->threshold[c] = codes->threshold[0];
        codes->steps[c] = codes->steps[0];
        codes->lines[c] = codes->lines[0];
    }
    return ok;
}
