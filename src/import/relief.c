#include "import/relief.h"

#include <math.h>
#include <spng.h>
#include <stdint.h>
#include <stdlib.h>

#include "import/encode.h"
#include "import/mean.h"

typedef struct field {
    const float *heights; /* [height][width], the top row first */
    size_t width, height;
    bool repeats;
} field;

static void read_heights(const shd_decoded *p, const void *samples, float *out) {
    static const double luminance[3] = {0.2126, 0.7152, 0.0722};
    const size_t count = (size_t)p->count, pixels = (size_t)p->width * (size_t)p->height;
    const bool colored = p->count - p->alpha >= 3;
    const uint8_t *codes = samples;
    const uint16_t *deep = samples;
    for (size_t i = 0; i < pixels; i++) {
        double sum = 0;
        for (size_t c = 0; c < (colored ? 3 : 1); c++) {
            const size_t at = i * count + c;
            const double code = p->depth == SHD_U8 ? codes[at] / 255.0 : deep[at] / 65535.0;
            sum += (colored ? luminance[c] : 1) * code;
        }
        out[i] = (float)sum;
    }
}

/* How much heights rise from a texel to the next, by both of its neighbors on an axis of `count`,
 * which are `step` apart. */
static double slope(const field *f, size_t at, size_t i, size_t step, size_t count) {
    const bool first = i == 0, last = i + 1 == count;
    size_t before = first ? at : at - step, after = last ? at : at + step;
    if (f->repeats && first) before = at + (count - 1) * step;
    if (f->repeats && last) after = at - i * step;
    const double apart = f->repeats ? 2 : (double)!first + (double)!last;
    const double rise = (double)f->heights[after] - (double)f->heights[before];
    return apart > 0 ? rise / apart : 0;
}

static void find_slopes(const field *f, size_t x, size_t y, double out[2]) {
    const size_t at = y * f->width + x;
    out[0] = slope(f, at, x, 1, f->width);
    out[1] = -slope(f, at, y, f->width, f->height);
}

static double find_steepest(const field *f) {
    double most = 0, slopes[2];
    for (size_t y = 0; y < f->height; y++)
        for (size_t x = 0; x < f->width; x++) {
            find_slopes(f, x, y, slopes);
            most = fmax(most, hypot(slopes[0], slopes[1]));
        }
    return most;
}

static uint16_t code_of(double x) {
    return (uint16_t)lround(65535 * (0.5 + 0.5 * x));
}

static void write_normals(const field *f, double steepest, uint16_t *out) {
    for (size_t y = 0; y < f->height; y++)
        for (size_t x = 0; x < f->width; x++, out += 3) {
            double slopes[2];
            find_slopes(f, x, y, slopes);
            const double p = slopes[0] / steepest, q = slopes[1] / steepest,
                         unit = 1 / sqrt(1 + p * p + q * q);
            out[0] = code_of(-p * unit);
            out[1] = code_of(-q * unit);
            out[2] = code_of(unit);
        }
}

bool shd_normals_of_heights(const void *bytes, size_t size, bool repeats, shd_relief *out) {
    shd_decoded p;
    *out = (shd_relief){.file = NULL};
    void *samples = shd_decode_codes(bytes, size, &p);
    if (!samples) return false;
    const size_t pixels = (size_t)p.width * (size_t)p.height;
    float *heights = malloc(pixels * sizeof *heights);
    uint16_t *normals = malloc(3 * pixels * sizeof *normals);
    bool made = heights && normals;
    if (made) {
        read_heights(&p, samples, heights);
        const field f = {heights, (size_t)p.width, (size_t)p.height, repeats};
        out->steepest = find_steepest(&f);
        if (out->steepest > 0) {
            const shd_png_head head = {p.width, p.height, 16, SPNG_COLOR_TYPE_TRUECOLOR};
            write_normals(&f, out->steepest, normals);
            made = shd_encode_png(&head, normals, 3 * pixels * sizeof *normals, &out->file,
                                  &out->length);
        }
    }
    free(normals);
    free(heights);
    free(samples);
    return made;
}
