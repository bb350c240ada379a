#include "render/tell/photo.h"

#include <math.h>
#include <string.h>

#include "render/show/conversion.h"

enum { BLOCK = 256, STEPS = 16, SIDES = 4 };

/* Of the largest entry of a row of the inverse slopes: below, a channel does not depend on another
 * one. Transforms of f32 were seen to leave 1e-5 there. */
static const double APART = 1e-3;

typedef struct undoing {
    const atomic_bool *cancelled;
    const shd_color_transform *transform;
    const shd_samples *samples;
    const uint32_t *pixels;
    size_t count;
    double max; /* of codes; 0: floats */
    bool hdr;   /* one exponent a pixel */
    shd_photo *out;
} undoing;

/* A block in work: what is wanted, what is tried, and how that answers. */
typedef struct block {
    size_t count;
    uint32_t pixels[BLOCK];
    double wanted[BLOCK][3], tried[BLOCK][3], slopes[BLOCK][3][3], off[BLOCK];
    double rounding[BLOCK][3];          /* standard deviation of what it has left of `wanted` */
    bool low[BLOCK][3], high[BLOCK][3]; /* the code is the first one, or the last */
    float rgba[SIDES * BLOCK * 4];
} block;

/* ---- Samples ---- */

/* What rounding to the samples' depth leaves. Radiance HDR has 8 bits for the largest channel, and
 * cuts what is below: half of a step is missing on average (G. Ward's own reader adds it, too). */
static void take_rounding(const undoing *u, double value[3], double rounding[3]) {
    int exponent;
    frexp(fmax(fmax(value[0], value[1]), value[2]), &exponent);
    const double step = u->hdr ? ldexp(1, exponent - 8) : 0;
    for (int c = 0; c < 3; c++) {
        if (u->hdr && value[c] > 0) value[c] += step / 2;
        rounding[c] = u->max > 0 ? 1 / (u->max * sqrt(12))
                      : u->hdr   ? fmax(step, 1e-6) / sqrt(12)
                      : u->samples->depth == SHD_HALF
                          ? ldexp(fmax(fabs(value[c]), 1e-2), -11) / sqrt(3)
                          : 1;
    }
}

/* False: the pixel tells nothing. */
static bool take_pixel(const undoing *u, uint32_t pixel, block *b) {
    const shd_samples *s = u->samples;
    const float *at = s->values + (size_t)pixel * (size_t)s->count;
    const int colors = s->count - s->alpha;
    const double unit = u->max > 0 ? u->max : 1;
    if (s->alpha && (double)at[colors] < unit) {
        u->out->transparent++;
        return false;
    }
    const size_t i = b->count;
    for (int c = 0; c < 3; c++) {
        const double value = (double)at[colors < 3 ? 0 : c];
        if (!isfinite(value)) {
            u->out->outside++;
            return false;
        }
        b->wanted[i][c] = value / unit;
        b->low[i][c] = u->max > 0 && value <= 0;
        b->high[i][c] = u->max > 0 && value >= u->max;
        /* Most curves are near to this one. */
        b->tried[i][c] = u->max > 0 ? pow(b->wanted[i][c], 2.2) : b->wanted[i][c];
    }
    take_rounding(u, b->wanted[i], b->rounding[i]);
    b->pixels[b->count++] = pixel;
    return true;
}

/* ---- Newton's method ---- */

static double width_at(double value) {
    return fmax(1e-3 * fabs(value), 1e-5);
}

/* What the transform makes of each color, and of it with one channel a little larger. */
static void try_block(const undoing *u, block *b) {
    for (size_t i = 0; i < b->count; i++)
        for (size_t side = 0; side < SIDES; side++) {
            float *at = b->rgba + 4 * (SIDES * i + side);
            for (size_t c = 0; c < 3; c++)
                at[c] = (float)(b->tried[i][c] + (side == c + 1 ? width_at(b->tried[i][c]) : 0));
            at[3] = 1;
        }
    float before[SIDES * BLOCK * 4];
    memcpy(before, b->rgba, sizeof before);
    shd_color_apply(u->transform, b->rgba, SIDES * b->count);
    for (size_t i = 0; i < b->count; i++) {
        const float *made = b->rgba + 4 * SIDES * i, *from = before + 4 * SIDES * i;
        b->off[i] = 0;
        for (size_t row = 0; row < 3; row++) {
            b->off[i] = fmax(b->off[i], fabs((double)made[row] - b->wanted[i][row]));
            for (size_t c = 0; c < 3; c++)
                b->slopes[i][row][c] = ((double)made[4 * (c + 1) + row] - (double)made[row]) /
                                       ((double)from[4 * (c + 1) + c] - (double)from[c]);
        }
    }
}

/* False: it has no inverse. */
static bool invert(double m[3][3], double out[3][3]) {
    double size = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
            size = fmax(size, fabs(m[i][j]));
        }
    const double determinant = m[0][0] * out[0][0] + m[0][1] * out[1][0] + m[0][2] * out[2][0];
    if (!(fabs(determinant) > 1e-9 * size * size * size)) return false;
    for (int i = 0; i < 9; i++) out[i / 3][i % 3] /= determinant;
    return true;
}

/* Returns whether any color has moved. */
static bool step_block(block *b) {
    bool moved = false;
    for (size_t i = 0; i < b->count; i++) {
        double back[3][3], to[3];
        if (!(b->off[i] > 1e-7) || !invert(b->slopes[i], back)) continue;
        for (size_t c = 0; c < 3; c++) {
            to[c] = b->tried[i][c];
            for (size_t k = 0; k < 3; k++)
                to[c] += back[c][k] * (b->wanted[i][k] - (double)b->rgba[4 * SIDES * i + k]);
            /* A curve that is steep at 0 sends it beyond, where there may be no slope. */
            if (b->tried[i][c] > 1e-6 && to[c] < b->tried[i][c] / 8) to[c] = b->tried[i][c] / 8;
        }
        if (!isfinite(to[0]) || !isfinite(to[1]) || !isfinite(to[2])) continue;
        moved = true;
        memcpy(b->tried[i], to, sizeof to);
    }
    return moved;
}

/* ---- What is known ---- */

/* The weights of a pixel's channels. False: the output does not make its color. */
static bool weigh(const undoing *u, block *b, size_t i, double weight[3]) {
    double back[3][3];
    double most = 0;
    for (int c = 0; c < 3; c++) most = fmax(most, fabs(b->wanted[i][c]));
    /* A quarter of a code, or what f32 makes of conversions. */
    if (!(b->off[i] < (u->max > 0 ? 0.25 / u->max : 1e-4 * fmax(most, 1e-3)))) return false;
    if (!invert(b->slopes[i], back)) return false;
    bool any = false;
    for (int c = 0; c < 3; c++) {
        double sum = 0, row = 0;
        bool known = true, mixed = false;
        for (int k = 0; k < 3; k++) row = fmax(row, fabs(back[c][k]));
        for (int k = 0; k < 3; k++) mixed |= k != c && fabs(back[c][k]) > APART * row;
        for (int k = 0; k < 3; k++) {
            sum += back[c][k] * back[c][k] * b->rounding[i][k] * b->rounding[i][k];
            if (fabs(back[c][k]) <= APART * row) continue;
            /* The first code is a color as any other, but where a gamut may have been cut. */
            known &= !b->high[i][k] && !(mixed && b->low[i][k]);
        }
        weight[c] = known ? 1 / sqrt(sum) : 0;
        any |= !known;
    }
    u->out->clipped += any;
    return true;
}

static void undo_block(const undoing *u, block *b) {
    shd_photo *out = u->out;
    try_block(u, b);
    for (int step = 0; step < STEPS && step_block(b); step++) try_block(u, b);
    for (size_t i = 0; i < b->count; i++) {
        double weight[3];
        if (!weigh(u, b, i, weight)) {
            out->outside++;
            continue;
        }
        for (size_t c = 0; c < 3; c++) {
            out->light[3 * out->count + c] = (float)b->tried[i][c];
            out->weight[3 * out->count + c] = (float)weight[c];
        }
        out->pixels[out->count++] = b->pixels[i];
    }
}

static shd_status check_output(const shd_scene *scene, const shd_output *output,
                               const shd_samples *samples, const shd_color_info *info,
                               shd_error *error) {
    const bool codes = samples->depth == SHD_U8 || samples->depth == SHD_U16;
    if (scene->multipart)
        return shd_fail(error, SHD_SCENE, "/outputs",
                        "the photo is of one output: give one `output` instead");
    if (output->scope)
        return shd_fail(error, SHD_SCENE, "/output/scope", "a scope shows no pixels of the scene");
    if (output->channel >= 0)
        return shd_fail(error, SHD_SCENE, "/output/channel",
                        "a photo has colors: give no `channel`");
    if (info->data || info->channels != SHD_RGB)
        return shd_fail(error, SHD_SCENE, "/output",
                        "its values are not red, green and blue, as a photo's are");
    if (codes != (output->depth == SHD_U8 || output->depth == SHD_U16))
        return shd_fail(error, SHD_SCENE, "/output",
                        "the photo has samples of depth %s, the output those of depth %s: one are "
                        "codes, the others light",
                        shd_depth_name(samples->depth), shd_depth_name(output->depth));
    return SHD_OK;
}

shd_status shd_photo_undo(shd_rendering *r, const shd_scene *scene, const shd_samples *samples,
                          shd_format format, const uint32_t *pixels, size_t count, shd_photo *out,
                          shd_error *error) {
    shd_output output = scene->outputs[0];
    const bool same = (samples->depth >= SHD_HALF) == (output.depth >= SHD_HALF);
    if (same) output.depth = samples->depth;
    shd_photo photo = {.codes = samples->depth < SHD_HALF,
                       .exact = samples->depth == SHD_FLOAT && format != SHD_HDR};
    undoing u = {.cancelled = r->cancelled,
                 .samples = samples,
                 .pixels = pixels,
                 .count = count,
                 .max = samples->depth == SHD_U8    ? 255
                        : samples->depth == SHD_U16 ? 65535
                                                    : 0,
                 .hdr = format == SHD_HDR,
                 .out = &photo};
    shd_status status = shd_output_transform(r, scene, &output, &u.transform, error);
    if (status == SHD_OK)
        status = check_output(scene, &output, samples, shd_color_describe(u.transform), error);
    if (status != SHD_OK) return status;
    photo.pixels = shd_arena_alloc(r->arena, count, sizeof *photo.pixels);
    photo.light = shd_arena_alloc(r->arena, count, 3 * sizeof *photo.light);
    photo.weight = shd_arena_alloc(r->arena, count, 3 * sizeof *photo.weight);
    block *b = shd_arena_alloc(r->arena, 1, sizeof *b);
    if (!photo.pixels || !photo.light || !photo.weight || !b)
        return shd_rendering_full(r, "fit", error);
    for (size_t i = 0; i < count;) {
        if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
        b->count = 0;
        while (i < count && b->count < BLOCK) take_pixel(&u, pixels[i++], b);
        undo_block(&u, b);
    }
    *out = photo;
    return SHD_OK;
}
