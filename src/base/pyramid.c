#include "base/pyramid.h"

#include <math.h>

enum { HEAD = 64 }; /* whether it is grey; texels are aligned behind it */

static int half_of(int side) {
    return side / 2 + side % 2;
}

/* The levels' sides, and where the second one and those behind it are. Returns how many floats
 * these are. */
static size_t lay_out(const shd_texels *texels, const float *memory, shd_pyramid *out) {
    size_t used = 0;
    out->levels[0] = (shd_level){texels->width, texels->height, texels->rgba};
    out->count = 1;
    for (const shd_level *last = out->levels; last->width > 1 || last->height > 1; last++) {
        const shd_level next = {half_of(last->width), half_of(last->height),
                                memory ? memory + used : NULL};
        used += 4 * (size_t)next.width * (size_t)next.height;
        out->levels[out->count++] = next;
    }
    return used;
}

size_t shd_pyramid_size(const shd_texels *texels) {
    shd_pyramid pyramid;
    return HEAD + lay_out(texels, NULL, &pyramid) * sizeof(float);
}

/* What a texel covers of the level before, along one axis: up to four of its texels, and the share
 * of each in it. */
typedef struct span {
    int first, count;
    double share[4];
} span;

static span span_of(int index, int sides, int before) {
    const double scale = (double)before / sides, from = index * scale,
                 to = index + 1 == sides ? before : (index + 1) * scale;
    span s = {.first = (int)from};
    double whole = 0;
    for (int i = s.first; i < before && i < to && s.count < 4; i++) {
        const double share = fmin(to, i + 1) - fmax(from, i);
        s.share[s.count++] = share;
        whole += share;
    }
    for (int k = 0; k < s.count; k++) s.share[k] /= whole;
    return s;
}

static void make_row(const shd_level *from, const shd_level *to, int y, float *out) {
    const span rows = span_of(y, to->height, from->height);
    for (int x = 0; x < to->width; x++, out += 4) {
        const span columns = span_of(x, to->width, from->width);
        double sum[4] = {0};
        for (int j = 0; j < rows.count; j++) {
            const float *texel = from->rgba + 4 * ((size_t)(rows.first + j) * (size_t)from->width +
                                                   (size_t)columns.first);
            for (int i = 0; i < columns.count; i++, texel += 4) {
                const double share = rows.share[j] * columns.share[i];
                for (int c = 0; c < 4; c++) sum[c] += share * (double)texel[c];
            }
        }
        for (int c = 0; c < 4; c++) out[c] = (float)sum[c];
    }
}

static bool is_grey(const shd_texels *texels) {
    const size_t count = (size_t)texels->width * (size_t)texels->height;
    for (size_t i = 0; i < count; i++) {
        const float *texel = texels->rgba + 4 * i;
        if (texel[0] != texel[1] || texel[0] != texel[2]) return false;
    }
    return true;
}

bool shd_pyramid_fill(const shd_texels *texels, const atomic_bool *cancelled, void *memory) {
    shd_pyramid pyramid;
    bool *grey = memory;
    float *out = (float *)(void *)((char *)memory + HEAD);
    lay_out(texels, out, &pyramid);
    *grey = is_grey(texels);
    for (int k = 1; k < pyramid.count; k++) {
        const shd_level *to = &pyramid.levels[k];
        for (int y = 0; y < to->height; y++, out += 4 * (size_t)to->width) {
            if (shd_is_cancelled(cancelled)) return false;
            make_row(to - 1, to, y, out);
        }
    }
    return true;
}

void shd_pyramid_open(const shd_texels *texels, const void *memory, shd_pyramid *out) {
    const bool *grey = memory;
    lay_out(texels, (const float *)(const void *)((const char *)memory + HEAD), out);
    out->texels = texels;
    out->grey = *grey;
}
