#include "analysis/figures.h"

#include <math.h>
#include <string.h>

#include "base/bits.h"

const int shd_percentiles[SHD_PERCENTILES] = {1, 5, 25, 50, 75, 95, 99};

/* Floats in order have keys in order, which are found by their upper, middle and lower bits: three
 * looks at all values, without a copy of them. */
enum { LEVELS = 3, DIGIT = 11, DIGITS = 1 << DIGIT };
static const int shifts[LEVELS] = {21, 10, 0}, widths[LEVELS] = {DIGIT, DIGIT, 10};

struct shd_figures_scratch {
    uint64_t counts[SHD_PERCENTILES][DIGITS];
    unsigned char wanted[DIGITS]; /* by the upper digit: bits of percentiles that have it */
};

shd_figures_scratch *shd_figures_scratch_new(shd_arena *arena) {
    return shd_arena_alloc(arena, 1, sizeof(shd_figures_scratch));
}

static uint32_t key_of(float value) {
    const uint32_t bits = shd_bits_of(value);
    return bits >> 31 ? ~bits : bits | 0x80000000u;
}

static float value_of(uint32_t key) {
    return shd_float_of(key >> 31 ? key & 0x7fffffffu : ~key);
}

static bool count_all(const float *values, size_t count, shd_figures_scratch *s,
                      const atomic_bool *cancelled) {
    for (size_t i = 0; i < count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) return false;
        if (isfinite(values[i])) s->counts[0][key_of(values[i]) >> shifts[0]]++;
    }
    return true;
}

/* Counts the next digits of those values that begin as the percentiles do, as far as is known. */
static bool count_some(const float *values, size_t count, int level, const uint32_t *found,
                       shd_figures_scratch *s, const atomic_bool *cancelled) {
    const uint32_t mask = (1u << widths[level]) - 1;
    for (size_t i = 0; i < count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) return false;
        if (!isfinite(values[i])) continue;
        const uint32_t key = key_of(values[i]);
        unsigned wanted = s->wanted[key >> shifts[0]];
        for (int p = 0; wanted; p++, wanted >>= 1)
            if (wanted & 1 && key >> shifts[level - 1] == found[p])
                s->counts[p][key >> shifts[level] & mask]++;
    }
    return true;
}

static bool find_percentiles(const float *values, size_t count, shd_figures_scratch *s,
                             const atomic_bool *cancelled, shd_figures *out) {
    uint32_t found[SHD_PERCENTILES] = {0};
    uint64_t rank[SHD_PERCENTILES]; /* among those that begin as was found, from 1 */
    for (int p = 0; p < SHD_PERCENTILES; p++)
        rank[p] = (out->count * (uint64_t)shd_percentiles[p] + 99) / 100;
    for (int level = 0; level < LEVELS; level++) {
        memset(s->counts, 0, sizeof s->counts);
        if (level ? !count_some(values, count, level, found, s, cancelled)
                  : !count_all(values, count, s, cancelled))
            return false;
        for (int p = 0; p < SHD_PERCENTILES; p++) {
            const uint64_t *counts = s->counts[level ? p : 0];
            uint32_t digit = 0;
            while (counts[digit] < rank[p]) rank[p] -= counts[digit++];
            found[p] = found[p] << widths[level] | digit;
        }
        if (level) continue;
        memset(s->wanted, 0, sizeof s->wanted);
        for (int p = 0; p < SHD_PERCENTILES; p++) s->wanted[found[p]] |= (unsigned char)(1 << p);
    }
    for (int p = 0; p < SHD_PERCENTILES; p++) out->percentiles[p] = (double)value_of(found[p]);
    return true;
}

static bool find_extremes(const float *values, size_t count, const atomic_bool *cancelled,
                          shd_figures *out) {
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) return false;
        const double value = (double)values[i];
        if (!isfinite(value)) continue;
        sum += value;
        out->min = out->count && out->min <= value ? out->min : value;
        out->max = out->count && out->max >= value ? out->max : value;
        out->count++;
    }
    if (out->count) out->mean = sum / (double)out->count;
    return true;
}

static bool fill_bins(const float *values, size_t count, const atomic_bool *cancelled,
                      shd_figures *out) {
    const double scale = SHD_BINS / (out->high - out->low);
    for (size_t i = 0; i < count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) return false;
        if (!isfinite(values[i])) continue;
        const double at = ((double)values[i] - out->low) * scale;
        out->bins[at < SHD_BINS - 1 ? (size_t)at : SHD_BINS - 1]++;
    }
    return true;
}

bool shd_figures_find(const float *values, size_t count, shd_extent extent,
                      shd_figures_scratch *scratch, const atomic_bool *cancelled,
                      shd_figures *out) {
    shd_figures figures = {.count = 0};
    if (!find_extremes(values, count, cancelled, &figures)) return false;
    figures.low = fmin(extent.low, figures.min);
    figures.high = fmax(extent.high, figures.max);
    *out = figures;
    if (!figures.count) return true;
    return fill_bins(values, count, cancelled, out) &&
           find_percentiles(values, count, scratch, cancelled, out);
}
