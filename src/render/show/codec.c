#include "render/show/codec.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bits.h"
#include "color/delta_e.h"
#include "image/pack.h"
#include "render/show/shown.h"

enum { LOSSLESS = 100 }; /* WebP's quality without loss, and JPEG's best */

/* Errors are counted in classes of the upper halves of their floats, from 2^-20 to 2^9, so that
 * whole codes have classes of their own and others are rounded up by less than 1 %. */
enum { LEAST = 0x3580, CLASSES = 0x4400 - LEAST + 1 };

struct shd_codec {
    const shd_rendering *r;
    const shd_output *output;
    size_t index;
    shd_metric metric;
    size_t width, count;
    bool alpha;         /* the last sample of a pixel is */
    bool grey;          /* all others are the same color's */
    bool unknown;       /* colors have no error in the metric but 0, of what is not lost at all */
    double linear[256]; /* light of a code on the display */
    shd_lab_space lab;
    double room;      /* what the plan leaves of the budget; what is beyond needs no measure */
    bool to_the_end;  /* but where it is told */
    atomic_bool over; /* an error is beyond the room */
    shd_lost lost;    /* by the best try */
    pthread_mutex_t mutex;
    /* Under the mutex. */
    double most;
    uint64_t total, classes[CLASSES];
};

/* ---- Measuring, on several threads ---- */

typedef struct tally {
    double most;
    uint32_t total, classes[CLASSES];
} tally;

static void count_error(tally *t, double error) {
    const uint32_t at = shd_bits_of((float)error) >> 16;
    t->most = fmax(t->most, error);
    t->total++;
    t->classes[at < LEAST ? 0 : at - LEAST >= CLASSES ? CLASSES - 1 : at - LEAST]++;
}

static double error_of_colors(const shd_codec *c, const unsigned char *a, const unsigned char *b) {
    double lab[2][3];
    const unsigned char *const pixels[2] = {a, b};
    for (int k = 0; k < 2; k++) {
        float rgb[3];
        for (size_t i = 0; i < 3; i++) rgb[i] = (float)pixels[k][c->grey ? 0 : i] / 255;
        shd_lab_of(&c->lab, rgb, lab[k]);
    }
    return shd_delta_e_2000(lab[0], lab[1]);
}

/* Where alpha is 0 in both, only that is compared. */
static void count_pixel(const shd_codec *c, const unsigned char *a, const unsigned char *b,
                        tally *t) {
    const size_t count = c->count, colors = c->alpha ? count - 1 : count;
    const bool seen = !c->alpha || a[count - 1] || b[count - 1];
    if (c->unknown) {
        count_error(t, !seen || !memcmp(a, b, count) ? 0 : INFINITY);
        return;
    }
    if (c->metric == SHD_DELTA_E_2000) {
        count_error(t, !seen || !memcmp(a, b, colors) ? 0 : error_of_colors(c, a, b));
        return;
    }
    for (size_t i = 0; i < count; i++) {
        if (i < colors && !seen)
            count_error(t, 0);
        else if (c->metric == SHD_CODE)
            count_error(t, abs(a[i] - b[i]));
        else if (i < colors)
            count_error(t, fabs(c->linear[a[i]] - c->linear[b[i]]));
        else
            count_error(t, abs(a[i] - b[i]) / 255.0);
    }
}

static void add_tally(shd_codec *c, const tally *t) {
    pthread_mutex_lock(&c->mutex);
    c->most = fmax(c->most, t->most);
    c->total += t->total;
    for (int i = 0; i < CLASSES; i++) c->classes[i] += t->classes[i];
    pthread_mutex_unlock(&c->mutex);
    if (!(t->most <= c->room)) atomic_store(&c->over, true);
}

static void measure_rows(void *context, size_t first, size_t rows, const unsigned char *given,
                         const unsigned char *made) {
    enum { AT_ONCE = 4096 };
    (void)first;
    shd_codec *c = context;
    const size_t pixels = rows * c->width;
    for (size_t i = 0; i < pixels;) {
        if (shd_is_cancelled(c->r->cancelled)) return;
        if (!c->to_the_end && atomic_load(&c->over)) return;
        tally t = {0};
        const size_t end = pixels - i < AT_ONCE ? pixels : i + AT_ONCE;
        for (; i < end; i++) count_pixel(c, given + i * c->count, made + i * c->count, &t);
        add_tally(c, &t);
    }
}

/* The least error that 99 % do not exceed, rounded up to its class's end. */
static double find_p99(const shd_codec *c) {
    uint64_t below = 0;
    int at = 0;
    while ((below += c->classes[at]) < c->total - c->total / 100) at++;
    const uint32_t begin = (uint32_t)(LEAST + at) << 16;
    if (at == 0 && c->classes[0] && !(c->most > 0)) return 0;
    if (c->metric == SHD_CODE) return at ? (double)shd_float_of(begin) : 0;
    return fmin(c->most, (double)shd_float_of(begin + 0x10000));
}

/* ---- Setting up ---- */

static shd_status refuse_metric(const shd_codec *c, shd_error *error) {
    return shd_fail(error, SHD_SCENE, "/accuracy/metric",
                    "what %s loses is not known in %s for the colors of this output: it is in "
                    "`code`, and formats that lose nothing need not know it",
                    shd_format_get(c->output->format)->name, shd_metric_names[c->metric]);
}

static shd_status find_display(shd_codec *c, const shd_color_info *info, shd_error *error) {
    const bool rgb = info->channels <= SHD_XYZ && info->transfer != SHD_TRANSFER_UNKNOWN &&
                     info->transfer <= SHD_TRANSFER_REC1886 && !info->data;
    const bool known =
        c->metric == SHD_CODE || (rgb && (c->metric == SHD_LINEAR || info->has_primaries));
    c->unknown = !known && c->output->format == SHD_WEBP && !c->output->quality;
    if (c->metric == SHD_CODE || c->unknown) return SHD_OK;
    if (!rgb) return refuse_metric(c, error);
    for (int i = 0; i < 256; i++) c->linear[i] = shd_curve_decode(info->transfer, i / 255.0);
    if (c->metric == SHD_LINEAR) return SHD_OK;
    return info->has_primaries && shd_lab_space_make(info->transfer, info->primaries, &c->lab)
               ? SHD_OK
               : refuse_metric(c, error);
}

/* What the answer tells of the plan's bound, which is rounded up, so that it and what is told of
 * the format add up to no more than the budget. */
static double find_told(const shd_plan *plan, shd_metric metric) {
    char text[SHD_BOUND_TEXT];
    shd_plan_print_bound(plan, metric, text);
    return strtod(text, NULL);
}

shd_status shd_codec_new(shd_rendering *r, size_t index, const shd_color_info *info,
                         shd_image *image, shd_codec **out, shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    const shd_output *output = &scene->outputs[index];
    const shd_pack pack = shd_pack_of(image, output->format);
    *out = NULL;
    if (!output->measured) return SHD_OK;
    shd_codec *c = shd_arena_zalloc(r->arena, 1, sizeof *c);
    if (!c) return shd_fail(error, SHD_MEMORY, "/image", "the limit `memory` is reached");
    const shd_accuracy *accuracy = &scene->accuracy;
    c->r = r;
    c->output = output;
    c->index = index;
    c->metric = accuracy->metric;
    c->width = (size_t)image->width;
    c->count = (size_t)pack.count;
    c->alpha = pack.alpha;
    c->grey = image->channel >= 0 || pack.count < 3;
    c->room = accuracy->whole - find_told(r->plan, accuracy->metric);
    image->decoded = measure_rows;
    image->measuring = c;
    *out = c;
    return find_display(c, info, error);
}

/* ---- Trying qualities ---- */

/* Encodes at a quality. *bytes replaces what the last one that met the budget has left; otherwise
 * it stays. */
static shd_status try_quality(shd_rendering *r, shd_codec *c, shd_image *image, int quality,
                              bool to_the_end, shd_bytes *bytes, bool *meets, shd_error *error) {
    const shd_arena_mark mark = shd_arena_mark_here(r->arena);
    shd_bytes made;
    c->to_the_end = to_the_end;
    c->most = 0;
    c->total = 0;
    memset(c->classes, 0, sizeof c->classes);
    atomic_store(&c->over, false);
    image->quality = quality;
    shd_status status = shd_image_encode(image, c->output->format, r->arena, &made, error);
    if (status != SHD_OK) return status;
    shd_arena_return(r->arena, mark);
    *meets = !atomic_load(&c->over) && !shd_is_cancelled(r->cancelled);
    if (*meets || to_the_end) {
        c->lost = (shd_lost){quality, c->most, find_p99(c), c->room};
    }
    shd_bytes *drop = *meets ? bytes : &made;
    shd_arena_repay(r->arena, drop->size);
    free(drop->data);
    *drop = (shd_bytes){NULL, 0};
    if (*meets) *bytes = made;
    return shd_is_cancelled(r->cancelled) ? shd_rendering_cancelled(error) : SHD_OK;
}

static shd_status refuse_quality(const shd_rendering *r, const shd_codec *c, shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    const double bound = find_told(r->plan, c->metric);
    const char *metric = shd_metric_names[c->metric];
    const char *format = shd_format_get(c->output->format)->name;
    char pointer[64], lost[SHD_BOUND_TEXT], light[SHD_BOUND_TEXT], both[SHD_BOUND_TEXT];
    shd_print_bound(c->lost.most, INFINITY, lost);
    shd_print_bound(bound, INFINITY, light);
    shd_print_bound(bound + c->lost.most, INFINITY, both);
    if (!c->output->quality)
        return shd_fail(error, SHD_SCENE, "/accuracy/maxError",
                        "no quality of %s stays within %.9g %s: light is within %s, and quality "
                        "%d loses %s, together %s; png, and webp of quality 100, lose nothing",
                        format, scene->accuracy.whole, metric, light, c->lost.quality, lost, both);
    snprintf(pointer, sizeof pointer, scene->multipart ? "/outputs/%zu/quality" : "/output/quality",
             c->index);
    return shd_fail(
        error, SHD_SCENE, pointer,
        "%s of quality %d does not stay within %.9g %s: light is within %s, and it loses "
        "%s, together %s; without `quality` the least that does is looked for",
        format, c->lost.quality, scene->accuracy.whole, metric, light, lost, both);
}

/* Bisects between a quality that does not meet the budget and one that does. */
static shd_status bisect(shd_rendering *r, shd_codec *c, shd_image *image, int top,
                         shd_bytes *bytes, shd_error *error) {
    int broken = 0, met = top;
    while (met - broken > 1) {
        const int middle = (broken + met) / 2;
        bool meets;
        const shd_status status = try_quality(r, c, image, middle, false, bytes, &meets, error);
        if (status != SHD_OK) return status;
        *(meets ? &met : &broken) = middle;
    }
    return SHD_OK;
}

static void give_up(shd_rendering *r, shd_bytes *bytes) {
    shd_arena_repay(r->arena, bytes->size);
    free(bytes->data);
}

shd_status shd_codec_encode(shd_rendering *r, shd_codec *c, shd_image *image, shd_bytes *out,
                            shd_lost *lost, shd_error *error) {
    /* WebP's 100 is another format, without loss: it is for what no other quality meets. */
    const bool webp = c->output->format == SHD_WEBP;
    const int named = c->output->quality, top = named                 ? named
                                                : webp && !c->unknown ? LOSSLESS - 1
                                                                      : LOSSLESS;
    bool search = !named && !c->unknown;
    const shd_pack pack = shd_pack_of(image, c->output->format);
    const void *samples;
    shd_bytes bytes = {NULL, 0};
    bool meets = false;
    shd_status status = shd_pack_samples(&pack, image, r->arena, &samples, error);
    if (status != SHD_OK) return status;
    image->samples = samples; /* of all tries */
    pthread_mutex_init(&c->mutex, NULL);
    status = try_quality(r, c, image, top, true, &bytes, &meets, error);
    if (status == SHD_OK && !meets && search && webp) {
        search = false;
        status = try_quality(r, c, image, LOSSLESS, true, &bytes, &meets, error);
    }
    if (status == SHD_OK && !meets) status = refuse_quality(r, c, error);
    if (status == SHD_OK && search) status = bisect(r, c, image, top, &bytes, error);
    pthread_mutex_destroy(&c->mutex);
    if (status != SHD_OK) give_up(r, &bytes);
    if (status != SHD_OK) return status;
    *out = bytes;
    *lost = c->lost;
    return SHD_OK;
}

bool shd_codec_tell(shd_rendering *r, size_t index, const shd_lost *lost) {
    const shd_scene *scene = r->plan->scene;
    char most[SHD_BOUND_TEXT], p99[SHD_BOUND_TEXT], which[32] = "";
    if (!lost->quality) return true;
    shd_print_bound(lost->most, lost->room, most);
    shd_print_bound(lost->p99, lost->room, p99);
    if (scene->multipart) snprintf(which, sizeof which, "output=%zu; ", index);
    r->codec = shd_arena_printf(r->arena, "%s%s%squality=%d; error<=%s %s; p99<=%s",
                                r->codec ? r->codec : "", r->codec ? ", " : "", which,
                                lost->quality, most, shd_metric_names[scene->accuracy.metric], p99);
    return r->codec;
}
