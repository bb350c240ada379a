/* Baking answers in this order: whether the channels keep apart, roughly where codes change,
 * exactly where, and whether they change there only. */
#include "color/codes.h"

#include <float.h>
#include <malloc.h>
#include <math.h>
#include <stdlib.h>

#include "base/sample.h"

enum { BLOCK = 256 };        /* codes that are searched for at once */
enum { INTERVAL = 1 << 16 }; /* inputs between two, with whose values the search starts */

/* Positive inputs are ordered as their bits are. The survey takes four inputs an octave, and the
 * largest. */
enum { LARGEST = 0x7f7fffff, STEP = 1 << 21, SURVEY = LARGEST / STEP + 2 };

typedef struct bake {
    const shd_color_transform *transform;
    shd_color_codes *codes;
    shd_color_go_on *go_on;
    const void *context;
    int max;
    uint32_t from, to; /* codes change between these inputs */
    size_t intervals;  /* between the same inputs */
    float *values;     /* [intervals + 1][4]: the converted values at the ends of the intervals */
    float pixels[4 * BLOCK];
} bake;

static bool goes_on(const bake *b) {
    return !b->go_on || b->go_on(b->context);
}

static int code_of(const bake *b, float value) {
    return shd_code((double)value * b->max, b->max);
}

static void set_grey(float *pixel, float x) {
    pixel[0] = pixel[1] = pixel[2] = x;
    pixel[3] = 1;
}

/* ---- Channels. ---- */

/* Compares every probe beside every other one with the same probe beside itself. */
static bool channels_keep_apart(bake *b) {
    static const float probes[] = {0, 1e-42f, 1e-30f, 1e-6f, 0.002f, 0.04f, 0.18f, 0.5f,   0.999f,
                                   1, 1.5f,   10,     65504, 1e10f,  1e25f, 1e38f, FLT_MAX};
    enum { COUNT = 2 * sizeof probes / sizeof probes[0] };
    float in[COUNT], alone[4 * COUNT];
    for (int i = 0; i < COUNT; i++) {
        in[i] = i % 2 ? -probes[i / 2] : probes[i / 2];
        set_grey(alone + 4 * i, in[i]);
    }
    shd_color_apply(b->transform, alone, COUNT);
    for (int i = 0; i < COUNT; i++) {
        int from[COUNT][3];
        for (int j = 0; j < COUNT; j++) {
            from[j][0] = i;
            from[j][1] = j;
            from[j][2] = (7 * i + 3 * j + 1) % COUNT;
            for (int c = 0; c < 3; c++) b->pixels[4 * j + c] = in[from[j][(c + i) % 3]];
            b->pixels[4 * j + 3] = (float)(j % 3) / 2;
        }
        shd_color_apply(b->transform, b->pixels, COUNT);
        for (int j = 0; j < COUNT; j++)
            for (int c = 0; c < 3; c++)
                if (shd_bits_of(b->pixels[4 * j + c]) !=
                    shd_bits_of(alone[4 * from[j][(c + i) % 3] + c]))
                    return false;
    }
    return true;
}

/* ---- The survey. ---- */

static float survey_input(int i) {
    return shd_float_of(i == SURVEY - 1 ? LARGEST : (uint32_t)i * STEP);
}

/* Finds the last input, by size, whose value in a channel is finite. It lies between a finite and
 * another one. */
static uint32_t last_finite(bake *b, int channel, uint32_t finite, uint32_t other, bool negative) {
    while (other - finite > 1) {
        uint32_t middle = finite + (other - finite) / 2;
        set_grey(b->pixels, negative ? -shd_float_of(middle) : shd_float_of(middle));
        shd_color_apply(b->transform, b->pixels, 1);
        *(isfinite(b->pixels[channel]) ? &finite : &other) = middle;
    }
    return finite;
}

/* Codes must rise with inputs above 0 and must not change below. Values must be finite up to some
 * size. */
static bool survey_curves(bake *b, bool negative) {
    float *values = malloc(sizeof(float[4]) * SURVEY);
    if (!values) return false;
    for (int i = 0; i < SURVEY; i++)
        set_grey(values + 4 * i, negative ? -survey_input(i) : survey_input(i));
    shd_color_apply(b->transform, values, SURVEY);
    bool ok = true;
    for (int c = 0; c < 3; c++) {
        int before = code_of(b, values[c]), end = SURVEY;
        if (!negative) b->codes->least[c] = before;
        ok = ok && isfinite(values[c]) && before == b->codes->least[c];
        for (int i = 1; i < SURVEY; i++) {
            int code = code_of(b, values[4 * i + c]);
            bool finite = isfinite(values[4 * i + c]);
            ok = ok && code >= before && !(finite && end < SURVEY) && !(negative && code > before);
            if (!finite && end == SURVEY) end = i;
            if (!negative && before == b->codes->least[c] && code > before) {
                uint32_t start = shd_bits_of(survey_input(i - 1));
                b->from = start < b->from ? start : b->from;
            }
            if (!negative && code > before && shd_bits_of(survey_input(i)) > b->to)
                b->to = shd_bits_of(survey_input(i));
            before = code;
        }
        if (!negative) b->codes->most[c] = before;
        float limit = FLT_MAX;
        if (ok && end < SURVEY)
            limit = shd_float_of(last_finite(b, c, shd_bits_of(survey_input(end - 1)),
                                             shd_bits_of(survey_input(end)), negative));
        if (negative)
            b->codes->finite_least[c] = -limit;
        else
            b->codes->finite_most[c] = limit;
    }
    free(values);
    return ok;
}

/* ---- Thresholds. ---- */

static uint32_t interval_start(const bake *b, size_t interval) {
    uint32_t bits = b->from + (uint32_t)interval * INTERVAL;
    return bits < LARGEST ? bits : LARGEST;
}

static bool convert_intervals(bake *b) {
    b->intervals = (b->to - b->from) / INTERVAL + 1;
    b->values = malloc((b->intervals + 1) * sizeof(float[4]));
    if (!b->values) return false;
    for (size_t i = 0; i <= b->intervals; i++)
        set_grey(b->values + 4 * i, shd_float_of(interval_start(b, i)));
    shd_color_apply(b->transform, b->values, b->intervals + 1);
    for (size_t i = 0; i < b->intervals; i++)
        for (size_t c = 0; c < 3; c++)
            if (!(b->values[4 * i + c] <= b->values[4 * (i + 1) + c])) return false;
    return true;
}

/* An interval between two inputs: one below code k's threshold, and one at it or above. */
typedef struct bracket {
    uint32_t below, above;
    float value_below, value_above;
} bracket;

/* The input to look at next. It is first the one at which a straight line has the threshold, a
 * little to either side, so that the bracket closes from both sides. Later it is the middle. */
static uint32_t next_look(const bake *b, const bracket *s, int code, int round) {
    static const double aside[] = {-64, 64, -2, 2};
    uint32_t width = s->above - s->below, step = width / 2;
    if (round < 4) {
        double rise = (double)s->value_above - (double)s->value_below;
        double wanted = (code - 0.5) / b->max - (double)s->value_below;
        double at = wanted / rise * width + aside[round];
        step = at >= 1 && at < width ? (uint32_t)at : step;
    }
    return s->below + (step ? step : 1);
}

/* Brackets the thresholds of `count` codes from `first` on. False: there is nothing to search. */
static bool open_brackets(const bake *b, int first, int count, bracket open[BLOCK][3]) {
    bool searching = false;
    for (int c = 0; c < 3; c++) {
        size_t i = 0;
        for (int n = 0; n < count; n++) {
            bracket *s = &open[n][c];
            *s = (bracket){0, 1, 0, 0};
            if (first + n <= b->codes->least[c] || first + n > b->codes->most[c]) continue;
            if (n == 0 || !i) { /* the first look of this block: halve the interval */
                size_t high = b->intervals;
                while (high - i > 1) {
                    size_t middle = i + (high - i) / 2;
                    if (code_of(b, b->values[4 * middle + (size_t)c]) < first + n)
                        i = middle;
                    else
                        high = middle;
                }
            }
            while (code_of(b, b->values[4 * (i + 1) + (size_t)c]) < first + n) i++;
            *s = (bracket){interval_start(b, i), interval_start(b, i + 1),
                           b->values[4 * i + (size_t)c], b->values[4 * (i + 1) + (size_t)c]};
            searching = true;
        }
    }
    return searching;
}

/* Looks once within each bracket. Each code is a pixel whose channels are searched on their own.
 * False: all brackets are closed. */
static bool narrow_brackets(bake *b, int first, int count, int round, bracket open[BLOCK][3]) {
    bool searching = false;
    for (int n = 0; n < count; n++) {
        for (int c = 0; c < 3; c++)
            b->pixels[4 * n + c] = shd_float_of(next_look(b, &open[n][c], first + n, round));
        b->pixels[4 * n + 3] = 1;
    }
    shd_color_apply(b->transform, b->pixels, (size_t)count);
    for (int n = 0; n < count; n++) {
        for (int c = 0; c < 3; c++) {
            bracket *s = &open[n][c];
            if (s->above - s->below < 2) continue;
            uint32_t look = next_look(b, s, first + n, round);
            float value = b->pixels[4 * n + c];
            if (code_of(b, value) < first + n)
                s->below = look, s->value_below = value;
            else
                s->above = look, s->value_above = value;
            searching = searching || s->above - s->below > 1;
        }
    }
    return searching;
}

static bool search_thresholds(bake *b, int first, int count) {
    if (!goes_on(b)) return false;
    bracket open[BLOCK][3];
    bool searching = open_brackets(b, first, count, open);
    for (int round = 0; searching; round++)
        searching = narrow_brackets(b, first, count, round, open);
    for (int n = 0; n < count; n++)
        for (int c = 0; c < 3; c++) {
            int code = first + n;
            b->codes->threshold[c][code] = code <= b->codes->least[c] ? -INFINITY
                                           : code > b->codes->most[c]
                                               ? INFINITY
                                               : shd_float_of(open[n][c].above);
        }
    return true;
}

/* Checks that codes do not change on either side of each threshold, at growing distances up to the
 * neighboring thresholds. A curve that falls by more than roundings fails here. */
static bool codes_stay(bake *b, int first, int count, uint32_t distance) {
    if (!goes_on(b)) return false;
    int expected[BLOCK][3];
    for (int side = 0; side < 2; side++) {
        bool any = false;
        for (int n = 0; n < count; n++)
            for (int c = 0; c < 3; c++) {
                int code = first + n;
                const float *threshold = b->codes->threshold[c];
                b->pixels[4 * n + c] = 0;
                b->pixels[4 * n + 3] = 1;
                expected[n][c] = b->codes->least[c];
                if (code <= b->codes->least[c] || code > b->codes->most[c]) continue;
                uint32_t at = shd_bits_of(threshold[code]);
                if (!side && distance > at) continue;
                float x = shd_float_of(side ? at + distance : at - 1 - distance);
                if (side ? !(x < threshold[code + 1] && x <= FLT_MAX) : !(x >= threshold[code - 1]))
                    continue;
                b->pixels[4 * n + c] = x;
                expected[n][c] = side ? code : code - 1;
                any = true;
            }
        if (!any) continue;
        shd_color_apply(b->transform, b->pixels, (size_t)count);
        for (int n = 0; n < count; n++)
            for (int c = 0; c < 3; c++)
                if (code_of(b, b->pixels[4 * n + c]) != expected[n][c]) return false;
    }
    return true;
}

static bool find_thresholds(bake *b) {
    for (int c = 0; c < 3; c++) {
        float *threshold = malloc(((size_t)b->max + 2) * sizeof *threshold);
        if (!threshold) return false;
        b->codes->memory[c] = b->codes->threshold[c] = threshold;
        threshold[b->max + 1] = INFINITY;
    }
    for (int first = 0; first <= b->max; first += BLOCK)
        if (!search_thresholds(b, first, b->max + 1 - first < BLOCK ? b->max + 1 - first : BLOCK))
            return false;
    const uint32_t farther = b->max == 255 ? 4 : 64;
    for (int first = 0; first <= b->max; first += BLOCK)
        for (uint32_t distance = 1; distance < 1u << 23; distance *= farther)
            if (!codes_stay(b, first, b->max + 1 - first < BLOCK ? b->max + 1 - first : BLOCK,
                            distance))
                return false;
    return true;
}

/* The bits of the smallest size at which inputs of one sign are clipped; those of infinity if none
 * is. */
static uint32_t first_clipped(bake *b, int channel, bool negative) {
    uint32_t within = 0, clipped = LARGEST + 1;
    while (clipped - within > 1) {
        const uint32_t middle = within + (clipped - within) / 2;
        set_grey(b->pixels, negative ? -shd_float_of(middle) : shd_float_of(middle));
        shd_color_apply(b->transform, b->pixels, 1);
        *(shd_is_clipped((double)b->pixels[channel] * b->max, b->max) ? &clipped : &within) =
            middle;
    }
    return clipped;
}

static void find_clipped(bake *b) {
    for (int c = 0; c < 3; c++) {
        b->codes->clip_least[c] = -shd_float_of(first_clipped(b, c, true));
        b->codes->clip_most[c] = shd_float_of(first_clipped(b, c, false));
    }
}

static bool bake_codes(bake *b) {
    if (shd_color_mixes(b->transform) || !channels_keep_apart(b)) return false;
    if (!survey_curves(b, false) || !survey_curves(b, true)) return false;
    for (int c = 0; c < 3; c++)
        if (b->codes->least[c] == b->codes->most[c]) return false;
    find_clipped(b);
    return convert_intervals(b) && find_thresholds(b) && goes_on(b) &&
           shd_color_make_tables(b->transform, b->codes, b->from, b->to);
}

shd_color_codes *shd_color_codes_bake(const shd_color_transform *transform, unsigned max,
                                      shd_color_go_on *go_on, const void *context) {
    shd_color_codes *codes = calloc(1, sizeof *codes);
    if (!codes) return NULL;
    codes->max = max;
    bake b = {.transform = transform,
              .codes = codes,
              .go_on = go_on,
              .context = context,
              .max = (int)max,
              .from = LARGEST};
    bool ok = bake_codes(&b);
    free(b.values);
    if (ok) return codes;
    shd_color_codes_drop(codes);
    return NULL;
}

size_t shd_color_codes_size(const shd_color_codes *codes) {
    size_t bytes = sizeof *codes;
    for (size_t i = 0; i < sizeof codes->memory / sizeof codes->memory[0]; i++)
        bytes += malloc_usable_size(codes->memory[i]);
    return bytes;
}

void shd_color_codes_drop(shd_color_codes *codes) {
    if (!codes) return;
    for (size_t i = 0; i < sizeof codes->memory / sizeof codes->memory[0]; i++)
        free(codes->memory[i]);
    free(codes);
}
