#include "render/show/output.h"

#include <assert.h>
#include <float.h>
#include <string.h>

#include "base/sample.h"
#include "render/show/codec.h"
#include "render/show/conversion.h"
#include "render/show/scope.h"

shd_route shd_route_of(const shd_scene *scene, const shd_output *output, bool apart) {
    const bool integers = output->depth == SHD_U8 || output->depth == SHD_U16;
    const bool mixed = scene->transparent && shd_format_get(output->format)->premultiplied;
    const bool codes =
        apart && integers && !mixed && !output->layer_count && !output->dither && !output->scope;
    return (shd_route){codes, !codes || scene->transparent || scene->output_count > 1};
}

/* Holds values in the range that the sample type or the format can store. HDR has a shared 8-bit
 * exponent, below 2^127, and no signs. */
static void saturate_values(shd_rendering *r, const shd_output *output, float *values,
                            size_t count) {
    const bool hdr = output->format == SHD_HDR;
    const float largest = hdr ? 1.7e38f : output->depth == SHD_HALF ? 65504 : FLT_MAX;
    r->saturated += shd_saturate(values, count, hdr ? 0 : -largest, largest);
}

/* Converts RGB values in place. OpenColorIO takes RGBA. */
static void convert_rgb(const shd_rendering *r, const shd_color_transform *transform, float *rgb,
                        size_t count) {
    enum { ROW = 1024 };
    float row[4 * ROW];
    for (size_t first = 0; first < count && !shd_is_cancelled(r->cancelled); first += ROW) {
        size_t some = count - first < ROW ? count - first : ROW;
        for (size_t i = 0; i < some; i++) {
            memcpy(row + 4 * i, rgb + 3 * (first + i), 3 * sizeof *row);
            row[4 * i + 3] = 1;
        }
        shd_color_apply(transform, row, some);
        for (size_t i = 0; i < some; i++)
            memcpy(rgb + 3 * (first + i), row + 4 * i, 3 * sizeof *row);
    }
}

static float *copy_floats(shd_arena *arena, const float *values, size_t count) {
    float *copy = shd_arena_alloc(arena, count, sizeof *copy);
    return copy ? memcpy(copy, values, count * sizeof *copy) : NULL;
}

/* ---- Before there are pixels. ---- */

/* A picture that is made, as far as it is known without the values of its pixels. */
typedef struct drawing {
    const shd_output *output;
    const shd_color_transform *transform;
    bool flat;
    bool last; /* it may be made in the film's own pixels */
    shd_image image;
    shd_image_layer *layers; /* image.layers */
    shd_pack layout;
    shd_codec *codec; /* NULL: nothing is lost, or nobody wants to know */
} drawing;

/* Between the pieces of a long encoding, other requests take their turn. */
static bool go_on_encoding(void *context) {
    shd_rendering *r = context;
    r->beside -= shd_pool_lend(r->engine->pool);
    return !shd_is_cancelled(r->cancelled);
}

static void spread_encoding(void *context, size_t count,
                            void (*run)(void *work, size_t index, unsigned slot), void *work) {
    shd_stage_spread(context, count, run, work);
}

/* Color layers have no values yet. */
static shd_image_layer describe_layer(const shd_layer *layer, const shd_film *film) {
    static const char *const rgb[] = {"R", "G", "B"}, *const xyz[] = {"X", "Y", "Z"},
                             *const z[] = {"Z"}, *const id[] = {"id"}, *const error[] = {"error"};
    const shd_image_layer data[SHD_LAYER_KINDS] = {
        [SHD_LAYER_NORMAL] = {layer->name, xyz, 3, true, film->normal},
        [SHD_LAYER_POSITION] = {layer->name, xyz, 3, true, film->position},
        [SHD_LAYER_DEPTH] = {layer->name, z, 1, true, film->depth},
        [SHD_LAYER_OBJECT] = {layer->name, id, 1, true, film->object},
        [SHD_LAYER_BOUND] = {layer->name, error, 1, true, film->bound}};
    const shd_image_layer color = {layer->name, rgb, 3, false, NULL};
    return layer->kind < SHD_LAYER_NORMAL ? color : data[layer->kind];
}

/* What the samples are, if they are not R, G and B. A text less is no reason to fail. */
static const char *find_about(const shd_rendering *r, const shd_output *output,
                              const shd_color_info *info) {
    if (output->channel < 0 || !info->about) return info->about;
    if (output->channel == 3) return NULL;
    return shd_arena_printf(r->arena, "%s of %s",
                            shd_channel_names(info->channels)[output->channel], info->about);
}

static shd_status begin_drawing(shd_rendering *r, const shd_film *film, size_t index, drawing *out,
                                shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    const shd_output *output = &scene->outputs[index];
    const shd_color_transform *transform;
    shd_status status = shd_output_transform(r, scene, output, &transform, error);
    if (status != SHD_OK) return status;
    const size_t count = output->layer_count;
    shd_image_layer *layers = shd_arena_alloc(r->arena, count, sizeof *layers);
    if (!layers) return shd_fail(error, SHD_MEMORY, "/image", "the limit `memory` is reached");
    for (size_t l = 0; l < count; l++) layers[l] = describe_layer(&output->layers[l], film);
    const shd_color_info *info = shd_color_describe(transform);
    *out = (drawing){.output = output,
                     .transform = transform,
                     .flat = shd_output_is_flat(scene, output),
                     .last = index + 1 == scene->output_count,
                     .layers = layers};
    out->image = (shd_image){
        .width = scene->raster.w,
        .height = scene->raster.h,
        .channel = output->channel,
        .alpha = scene->transparent && shd_format_get(output->format)->alpha,
        .depth = output->depth,
        .quality = output->quality,
        .effort = output->effort,
        .compression = output->compression,
        .transfer = info->data ? SHD_TRANSFER_UNKNOWN : info->transfer,
        .has_primaries = info->has_primaries && !info->data,
        .space = info->name,
        .about = find_about(r, output, info),
        .channel_names = shd_channel_names(info->channels),
        .layers = layers,
        .layer_count = count,
        .isa = r->engine->isa,
        .go_on = go_on_encoding,
        .spread = spread_encoding,
        .slots = shd_pool_slots(r->engine->pool),
        .context = r,
        .elsewhere = &r->beside,
    };
    memcpy(out->image.primaries, info->primaries, sizeof info->primaries);
    if (output->scope) shd_scope_describe(r, output, &out->image);
    out->layout = shd_pack_of(&out->image, output->format);
    return shd_codec_new(r, index, info, &out->image, &out->codec, error);
}

static bool go_on_baking(const void *context) {
    const shd_rendering *r = context;
    return !shd_is_cancelled(r->cancelled);
}

/* The tables that the output's colors are looked up in. NULL: they go through floats. */
static const shd_color_codes *find_codes(const shd_rendering *r, const drawing *d) {
    const shd_scene *scene = r->plan->scene;
    if (r->engine->floats_only || !shd_route_of(scene, d->output, true).codes) return NULL;
    return shd_color_codes_of(d->transform, d->output->depth == SHD_U8 ? 255 : 65535,
                              (size_t)scene->raster.w * (size_t)scene->raster.h, go_on_baking, r);
}

static unsigned char *new_samples(const shd_rendering *r, const drawing *d) {
    return shd_arena_alloc(r->arena, (size_t)d->image.width * (size_t)d->image.height,
                           (size_t)d->layout.count * d->layout.bytes);
}

shd_status shd_output_prepare(shd_rendering *r, shd_film *film, shd_error *error) {
    drawing d;
    if (shd_route_of(r->plan->scene, r->plan->scene->outputs, true).film) return SHD_OK;
    shd_status status = begin_drawing(r, film, 0, &d, error);
    if (status != SHD_OK) return status;
    film->codes = find_codes(r, &d);
    if (!film->codes) return SHD_OK;
    film->layout = d.layout;
    film->samples = new_samples(r, &d);
    return film->samples ? SHD_OK : shd_rendering_full(r, "picture", error);
}

size_t shd_output_color_layers(const shd_output *output) {
    size_t count = 0;
    for (size_t l = 0; l < output->layer_count; l++)
        count += output->layers[l].kind < SHD_LAYER_NORMAL;
    return count;
}

shd_status shd_output_size(shd_rendering *r, const shd_film *film, uint64_t *out,
                           shd_error *error) {
    uint64_t most = 0;
    for (size_t i = 0; i < r->plan->scene->output_count; i++) {
        drawing d;
        shd_status status = begin_drawing(r, film, i, &d, error);
        if (status != SHD_OK) return status;
        const bool scope = d.output->scope, codes = film->codes || find_codes(r, &d);
        const uint64_t pixels = (uint64_t)d.image.width * (uint64_t)d.image.height,
                       floats = (codes || d.last || scope ? 0 : 4) +
                                3 * shd_output_color_layers(d.output);
        uint64_t bytes = shd_image_scratch(&d.image, d.output->format, codes || scope) +
                         pixels * floats * sizeof(float);
        if (codes && !film->codes) bytes += pixels * (uint64_t)d.layout.count * d.layout.bytes;
        if (scope) bytes += shd_scope_size(d.output, pixels);
        if (bytes > most) most = bytes;
    }
    *out = most;
    return SHD_OK;
}

/* ---- Layers. ---- */

/* A color layer's values, converted like the picture. The beauty is the picture itself, multiplied
 * by its alpha as the other layers are by their coverage. */
static float *color_layer(const shd_rendering *r, const shd_film *film, const shd_layer *layer,
                          const drawing *d) {
    const shd_plan *plan = r->plan;
    const float *converted = d->image.rgba;
    size_t pixels = (size_t)film->width * (size_t)film->height;
    if (layer->kind == SHD_LAYER_BEAUTY) {
        float *rgb = shd_arena_alloc(r->arena, pixels, 3 * sizeof *rgb);
        for (size_t i = 0; rgb && i < pixels; i++)
            for (size_t c = 0; c < 3; c++)
                rgb[3 * i + c] = converted[4 * i + c] * converted[4 * i + 3];
        return rgb;
    }
    size_t p = 1;
    while (plan->planes[p].kind != layer->kind ||
           (layer->kind >= SHD_LAYER_LOBE && plan->planes[p].light != layer->light))
        p++;
    assert(p < plan->plane_count);
    float *rgb = copy_floats(r->arena, film->planes[p], 3 * pixels);
    if (rgb) convert_rgb(r, d->transform, rgb, pixels);
    return rgb;
}

/* False: the arena is full, or the request is cancelled. */
static bool color_layers(shd_rendering *r, const shd_film *film, drawing *d) {
    const size_t pixels = (size_t)film->width * (size_t)film->height;
    for (size_t l = 0; l < d->output->layer_count; l++) {
        if (shd_is_cancelled(r->cancelled)) return false;
        if (d->layers[l].values) continue;
        float *values = color_layer(r, film, &d->output->layers[l], d);
        if (!values) return false;
        saturate_values(r, d->output, values, 3 * pixels);
        d->layers[l].values = values;
    }
    return true;
}

/* ---- Pixels, side by side on the pool: none depends on the split. ---- */

enum { PIXELS_AT_ONCE = 32768 };

typedef struct coloring {
    const shd_rendering *rendering;
    const drawing *drawing;
    const shd_color_codes *codes; /* NULL: colors are converted in place, */
    unsigned char *samples;       /* and not straight to these */
    float *rgba;
    size_t pixels;
    atomic_uint_least64_t saturated, clipped;
} coloring;

static void code_pixels(coloring *work, size_t first, size_t end) {
    enum { BLOCK = 1024 };
    const shd_pack *layout = &work->drawing->layout;
    shd_encoded sum = {0, 0};
    for (; first < end; first += BLOCK) {
        const size_t some = end - first < BLOCK ? end - first : BLOCK;
        const float *rgba = work->rgba + 4 * first;
        float flat[4 * BLOCK];
        if (work->drawing->flat) {
            memcpy(flat, rgba, 4 * some * sizeof *flat);
            shd_output_flatten(work->drawing->output->matte, flat, some);
            rgba = flat;
        }
        const shd_encoded counts = shd_color_encode(
            work->codes, work->rendering->engine->isa, rgba, some, layout->source, layout->count,
            work->samples + first * (size_t)layout->count * layout->bytes);
        sum.beyond += counts.beyond;
        sum.clipped += counts.clipped;
    }
    atomic_fetch_add(&work->saturated, sum.beyond);
    atomic_fetch_add(&work->clipped, sum.clipped);
}

/* Color samples of converted pixels that integers cannot hold. */
static uint64_t count_clipped(const shd_pack *pack, const float *rgba, size_t pixels) {
    uint64_t clipped = 0;
    for (int s = 0; s < pack->count; s++) {
        const int c = pack->source[s];
        for (size_t i = 0; c < 3 && i < pixels; i++)
            clipped += shd_is_clipped((double)rgba[4 * i + (size_t)c] * pack->max, pack->max);
    }
    return clipped;
}

/* By Bayer's pattern (B. E. Bayer, "An optimum method for two-level rendition of continuous-tone
 * pictures", ICC 1973): what is a code stays so, and what lies between two becomes both, in its
 * proportions. Greys stay grey. */
void shd_output_dither(const shd_raster *raster, float *rgba, size_t first, size_t end) {
    const size_t width = (size_t)raster->w;
    for (size_t i = first; i < end; i++, rgba += 4) {
        const unsigned x = (unsigned)raster->x + (unsigned)(i % width),
                       y = (unsigned)raster->y + (unsigned)(i / width), mixed = x ^ y;
        unsigned rank = 0;
        for (unsigned bit = 0; bit < 3; bit++)
            rank |= (mixed >> bit & 1) << (5 - 2 * bit) | (y >> bit & 1) << (4 - 2 * bit);
        const float offset = ((float)rank - 31.5f) / (64 * 255);
        for (size_t c = 0; c < 3; c++) rgba[c] += offset;
    }
}

static void color_pixels(void *context, size_t index, unsigned slot) {
    (void)slot;
    coloring *work = context;
    if (shd_is_cancelled(work->rendering->cancelled)) return;
    const size_t first = index * PIXELS_AT_ONCE, left = work->pixels - first,
                 some = left < PIXELS_AT_ONCE ? left : PIXELS_AT_ONCE;
    if (work->codes) {
        code_pixels(work, first, first + some);
        return;
    }
    shd_color_apply(work->drawing->transform, work->rgba + 4 * first, some);
    if (work->drawing->layout.max > 0)
        atomic_fetch_add(&work->clipped,
                         count_clipped(&work->drawing->layout, work->rgba + 4 * first, some));
    if (work->drawing->output->dither)
        shd_output_dither(&work->rendering->plan->scene->raster, work->rgba + 4 * first, first,
                          first + some);
}

/* Makes samples, or floats for the encoder to pack. False: the arena is full, or cancelled. */
static bool color_film(shd_rendering *r, const shd_film *film, drawing *d) {
    coloring work = {.rendering = r,
                     .drawing = d,
                     .codes = find_codes(r, d),
                     .rgba = film->rgba,
                     .pixels = (size_t)film->width * (size_t)film->height};
    if (work.codes) {
        d->image.samples = work.samples = new_samples(r, d);
        if (!work.samples) return false;
    } else {
        if (!d->last) work.rgba = copy_floats(r->arena, film->rgba, 4 * work.pixels);
        if (!work.rgba) return false;
        if (d->flat) shd_output_flatten(d->output->matte, work.rgba, work.pixels);
        d->image.rgba = work.rgba;
    }
    shd_stage_spread(r, (work.pixels + PIXELS_AT_ONCE - 1) / PIXELS_AT_ONCE, color_pixels, &work);
    r->saturated += atomic_load(&work.saturated);
    r->clipped += atomic_load(&work.clipped);
    if (work.codes) return true;
    saturate_values(r, d->output, work.rgba, 4 * work.pixels);
    return color_layers(r, film, d);
}

static shd_status color_drawing(shd_rendering *r, const shd_film *film, drawing *d,
                                shd_error *error) {
    const bool made = film->codes || color_film(r, film, d);
    if (film->codes) d->image.samples = film->samples;
    if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    return made ? SHD_OK : shd_rendering_full(r, "picture", error);
}

/* Its pixels, in the arena. */
static shd_status make_drawing(shd_rendering *r, const shd_film *film, size_t index, drawing *out,
                               shd_error *error) {
    shd_stage_begin(r);
    shd_status status = begin_drawing(r, film, index, out, error);
    if (status == SHD_OK && out->output->scope)
        status = shd_scope_make(r, film, out->output, &out->image.samples, error);
    else if (status == SHD_OK)
        status = color_drawing(r, film, out, error);
    shd_stage_end(r, &r->times.color);
    return status;
}

shd_status shd_output_paint(shd_rendering *r, const shd_film *film, size_t index, shd_image *out,
                            shd_error *error) {
    drawing d;
    const shd_status status = make_drawing(r, film, index, &d, error);
    if (status == SHD_OK) *out = d.image;
    return status;
}

void shd_output_hand_over(shd_rendering *r, shd_image *image) {
    image->context = r;
    image->elsewhere = &r->beside;
}

shd_status shd_output_make(shd_rendering *r, const shd_film *film, size_t index, shd_picture *out,
                           shd_error *error) {
    const shd_arena_mark mark = shd_arena_mark_here(r->arena);
    drawing d;
    shd_status status = make_drawing(r, film, index, &d, error);
    if (status != SHD_OK) return status;

    shd_bytes bytes;
    shd_lost lost = {0};
    if (d.codec)
        status = shd_codec_encode(r, d.codec, &d.image, &bytes, &lost, error);
    else
        status = shd_image_encode(&d.image, d.output->format, r->arena, &bytes, error);
    shd_stage_end(r, &r->times.encode);
    if (status != SHD_OK) return status;
    shd_arena_return(r->arena, mark);
    *out = (shd_picture){d.output->name, d.output->format, bytes.data, bytes.size, false};
    return shd_codec_tell(r, index, &lost) ? SHD_OK : shd_rendering_full(r, "picture", error);
}
