#include "scene/surroundings.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 256, HEIGHT = 128, SKY = 0, STUDIO, BUILTINS };

const char *const shd_surroundings_names[] = {[SKY] = "sky", [STUDIO] = "studio", NULL};

/* ---- The maps that are built in. ---- */

static double ramp(double from, double to, double x) {
    const double t = fmin(fmax((x - from) / (to - from), 0), 1);
    return t * t * (3 - 2 * t);
}

/* A clear sky: pale at the horizon, blue above, with a sun that is 40 degrees high, and a ground
 * whose edge is soft. */
static void paint_sky(shd_vec3 d, double rgb[3]) {
    static const double pale[3] = {0.75, 0.87, 1}, blue[3] = {0.12, 0.28, 0.7},
                        ground[3] = {0.2, 0.18, 0.15}, sun[3] = {250, 235, 205};
    static const double HIGH = 40 * (SHD_PI / 180), DISC = 2.4 * (SHD_PI / 180),
                        RIM = 4.8 * (SHD_PI / 180);
    const shd_vec3 toward = {cos(HIGH) * 0.6, sin(HIGH), cos(HIGH) * 0.8};
    const double low = pow(1 - fmax(d.y, 0), 3), above = ramp(-0.06, 0.03, d.y),
                 away = acos(fmin(fmax(shd_dot(d, toward), -1), 1)),
                 shine = 1 - ramp(DISC, RIM, away);
    for (int c = 0; c < 3; c++) {
        const double sky = blue[c] + (pale[c] - blue[c]) * low;
        rgb[c] = ground[c] + (sky - ground[c]) * above + sun[c] * shine;
    }
}

/* A soft box: seen around the direction (azimuth from +z toward +x, elevation), with these tangents
 * of half its width and height, whose edges are soft. */
typedef struct soft_box {
    double azimuth, elevation, wide, high, radiance;
} soft_box;

static double through_box(const soft_box *box, shd_vec3 d) {
    static const double EDGE = 0.07;
    const double a = box->azimuth * (SHD_PI / 180), e = box->elevation * (SHD_PI / 180);
    const shd_vec3 out = {cos(e) * sin(a), sin(e), cos(e) * cos(a)}, right = {cos(a), 0, -sin(a)},
                   up = shd_cross(out, right);
    const double along = shd_dot(d, out);
    if (!(along > 1e-3)) return 0;
    const double u = fabs(shd_dot(d, right)) / along, v = fabs(shd_dot(d, up)) / along;
    return box->radiance * (1 - ramp(box->wide, box->wide + EDGE, u)) *
           (1 - ramp(box->high, box->high + EDGE, v));
}

/* A dark room with a key box, a strip, a lamp overhead and two more at the back. */
static void paint_studio(shd_vec3 d, double rgb[3]) {
    static const soft_box boxes[] = {{-48, 34, 0.42, 0.42, 7},
                                     {62, 12, 0.16, 0.75, 5},
                                     {0, 88, 0.8, 0.5, 3.2},
                                     {148, 22, 0.2, 0.6, 4.5},
                                     {-140, 18, 0.3, 0.5, 2.5}};
    double all = 0.05 + 0.1 * ramp(-0.9, -0.1, -fabs(d.y)) + 0.12 * ramp(0.05, 0.9, -d.y);
    for (size_t i = 0; i < sizeof boxes / sizeof boxes[0]; i++) all += through_box(&boxes[i], d);
    rgb[0] = rgb[1] = rgb[2] = all;
}

/* ---- What is known of a map. ---- */

typedef struct texel {
    double most, angle;
} texel;

static int compare_texels(const void *a, const void *b) {
    const double x = ((const texel *)a)->most, y = ((const texel *)b)->most;
    return x > y ? -1 : x < y;
}

/* Parts whose sizes grow, so that a small sun is a part of its own. Between texels radiance is no
 * more than the largest of four: each part begins with what is brightest in it, and each texel
 * counts as the brightest of its neighbors. */
static void find_levels(shd_surroundings *map, texel *sorted, size_t count) {
    qsort(sorted, count, sizeof *sorted, compare_texels);
    size_t at = 0;
    for (int k = 0; k < SHD_SURROUNDINGS_LEVELS; k++) {
        const double share = pow(2, (k + 1 - SHD_SURROUNDINGS_LEVELS) / 3.0);
        const size_t end =
            k + 1 == SHD_SURROUNDINGS_LEVELS ? count : (size_t)(share * (double)count);
        map->levels[k] = at < count ? sorted[at].most : 0;
        map->angles[k] = 0;
        for (; at < end; at++) map->angles[k] += sorted[at].angle;
    }
}

static double brightest_near(const shd_surroundings *map, int row, int column) {
    double most = 0;
    for (int j = row - 1; j <= row + 1; j++)
        for (int i = column - 1; i <= column + 1; i++) {
            if (j < 0 || j >= map->height) continue;
            const size_t x = (size_t)((i + map->width) % map->width);
            const float *t = map->texels + 3 * ((size_t)j * (size_t)map->width + x);
            for (int c = 0; c < 3; c++) most = fmax(most, (double)t[c]);
        }
    return most;
}

/* Along a meridian a step between rows is pi / height long; along a row, as much less than 2 pi /
 * width as the row is shorter than the equator. */
static double steepest(const shd_surroundings *map, const atomic_bool *cancelled) {
    double most = 0;
    const size_t w = (size_t)map->width, h = (size_t)map->height;
    for (size_t j = 0; j < h && !shd_is_cancelled(cancelled); j++) {
        const double across = 2 * SHD_PI / (double)w * sin(SHD_PI * ((double)j + 0.5) / (double)h);
        for (size_t i = 0; i < w; i++)
            for (size_t c = 0; c < 3; c++) {
                const double here = (double)map->texels[3 * (j * w + i) + c],
                             right = (double)map->texels[3 * (j * w + (i + 1) % w) + c],
                             below =
                                 j + 1 < h ? (double)map->texels[3 * ((j + 1) * w + i) + c] : here;
                /* Between two rows the one that is nearer to the pole counts. */
                most = fmax(most, 1.5 * hypot((right - here) / across,
                                              (below - here) * (double)h / SHD_PI));
            }
    }
    return most;
}

static double brightest(const shd_surroundings *map) {
    const size_t values = 3 * (size_t)map->width * (size_t)map->height;
    double most = 0;
    for (size_t k = 0; k < values; k++) most = fmax(most, (double)map->texels[k]);
    return most;
}

bool shd_surroundings_measure(shd_surroundings *map, bool levels, const atomic_bool *cancelled) {
    map->most = brightest(map);
    map->slope = steepest(map, cancelled);
    if (shd_is_cancelled(cancelled)) return false;
    if (!levels) return true;
    const size_t count = (size_t)map->width * (size_t)map->height;
    texel *sorted = malloc(count * sizeof *sorted);
    if (!sorted) return false;
    for (int j = 0; j < map->height; j++) {
        const double top = cos(SHD_PI * j / map->height),
                     bottom = cos(SHD_PI * (j + 1) / map->height);
        for (int i = 0; i < map->width; i++)
            sorted[(size_t)j * (size_t)map->width + (size_t)i] =
                (texel){brightest_near(map, j, i), (top - bottom) * 2 * SHD_PI / map->width};
    }
    find_levels(map, sorted, count);
    free(sorted);
    return true;
}

/* ---- Made once. ---- */

static pthread_once_t once[BUILTINS] = {PTHREAD_ONCE_INIT, PTHREAD_ONCE_INIT};
/* Written once, under pthread_once, and constant from then on. */
static float texels[BUILTINS][3 * WIDTH * HEIGHT];
static shd_surroundings builtin[BUILTINS];

static void make_builtin(int which, void (*paint)(shd_vec3 d, double rgb[3])) {
    for (int j = 0; j < HEIGHT; j++)
        for (int i = 0; i < WIDTH; i++) {
            const double down = SHD_PI * (j + 0.5) / HEIGHT,
                         turn = 2 * SHD_PI * ((i + 0.5) / WIDTH - 0.5);
            const shd_vec3 d = {sin(down) * sin(turn), cos(down), -sin(down) * cos(turn)};
            double rgb[3];
            paint(d, rgb);
            for (int c = 0; c < 3; c++) texels[which][3 * (j * WIDTH + i) + c] = (float)rgb[c];
        }
    shd_surroundings map = {.name = shd_surroundings_names[which],
                            .key = shd_surroundings_names[which],
                            .width = WIDTH,
                            .height = HEIGHT,
                            .texels = texels[which]};
    if (shd_surroundings_measure(&map, true, NULL)) builtin[which] = map;
}

static void make_sky(void) {
    make_builtin(SKY, paint_sky);
}

static void make_studio(void) {
    make_builtin(STUDIO, paint_studio);
}

const shd_surroundings *shd_surroundings_find(const char *name) {
    static void (*const make[BUILTINS])(void) = {[SKY] = make_sky, [STUDIO] = make_studio};
    for (int k = 0; k < BUILTINS; k++) {
        if (strcmp(name, shd_surroundings_names[k])) continue;
        pthread_once(&once[k], make[k]);
        return builtin[k].name ? &builtin[k] : NULL;
    }
    return NULL;
}

/* ---- By direction. ---- */

void shd_surroundings_at(const shd_surroundings *map, shd_vec3 d, double rgb[3]) {
    shd_surroundings_between(map, atan2(d.x, -d.z) / (2 * SHD_PI) + 0.5,
                             atan2(hypot(d.x, d.z), d.y) / SHD_PI, rgb);
}

void shd_surroundings_between(const shd_surroundings *map, double u, double v, double rgb[3]) {
    const double x = u * map->width - 0.5,
                 y = fmin(fmax(v * map->height - 0.5, 0), map->height - 1);
    const int left = (int)floor(x), top = (int)y, w = map->width;
    const double s = x - left, t = y - top;
    const size_t i0 = (size_t)((left + w) % w), i1 = (size_t)((left + 1) % w);
    const int below = top + 1 < map->height ? top + 1 : top;
    const float *upper = map->texels + 3 * (size_t)w * (size_t)top,
                *lower = map->texels + 3 * (size_t)w * (size_t)below;
    for (size_t c = 0; c < 3; c++) {
        const double a = (1 - s) * (double)upper[3 * i0 + c] + s * (double)upper[3 * i1 + c],
                     b = (1 - s) * (double)lower[3 * i0 + c] + s * (double)lower[3 * i1 + c];
        rgb[c] = (1 - t) * a + t * b;
    }
}

/* The integral is largest if the brightest parts are where the power is: the first ones in a cap
 * around W, the others in rings around it (G. Hardy and J. Littlewood's rearrangement). Over a cap
 * down to the cosine z the power's integral is 2 pi (1 - z^(n+1)) / (n + 1). */
double shd_surroundings_most(const shd_surroundings *map, double exponent) {
    double sum = 0, used = 0, before = 0;
    for (int k = 0; k < SHD_SURROUNDINGS_LEVELS && used < 2 * SHD_PI; k++) {
        used += map->angles[k];
        const double z = fmax(1 - used / (2 * SHD_PI), 0),
                     inside = 1 - (z > 0 ? pow(z, exponent + 1) : 0);
        sum += map->levels[k] * (inside - before);
        before = inside;
    }
    return sum * 2 / (exponent + 1) * (1 + 1e-12);
}

double shd_surroundings_brightest(const shd_surroundings *map, double angle) {
    double sum = 0, left = fmin(angle, 2 * SHD_PI);
    for (int k = 0; k < SHD_SURROUNDINGS_LEVELS && left > 0; k++) {
        sum += map->levels[k] * fmin(map->angles[k], left);
        left -= map->angles[k];
    }
    return sum * (1 + 1e-12);
}
