#include "render/show/output.h"

#include <float.h>
#include <string.h>

#include "base/clock.h"

/* Holds values in what the sample type or format can store, and counts those that are not. */
static void saturate(shd_request *request, const shd_output *output, float *values, size_t count) {
    float largest = output->depth == SHD_HALF ? 65504 : FLT_MAX, least = -largest;
    if (output->format == SHD_HDR) {
        largest = 1.7e38f; /* a shared 8-bit exponent: below 2^127 ... */
        least = 0;         /* ... and no signs */
    }
    request->saturated += shd_saturate(values, count, least, largest);
}

shd_status shd_output_transform(const shd_request *request, const shd_output *output,
                                const shd_color_transform **out, shd_error *error) {
    shd_color_config *color = request->engine->color;
    const char *from = request->scene->working_space->name;
    if (output->color_space)
        return shd_color_to_space(color, from, output->color_space->name, out, error);
    return shd_color_to_view(color, from, output->display, output->view, out, error);
}

/* I spans [-.60,.60] and Q [-.52,.52]; stored as integers they are scaled to the full range
 * around a code that grey falls on exactly (docs/model.md, Color). */
shd_packing shd_output_packing(shd_channels channels) {
    shd_packing packing = {{1, 1, 1}, {0, 0, 0}, {0, 0, 0}};
    if (channels != SHD_YIQ) return packing;
    packing.scale[1] = 1 / 1.2;
    packing.scale[2] = 1 / 1.04;
    for (int c = 1; c < 3; c++) {
        packing.offset8[c] = 128.0 / 255;
        packing.offset16[c] = 32768.0 / 65535;
    }
    return packing;
}

/* RGB values converted in place; RGBA is what OpenColorIO takes. */
static void convert_rgb(shd_request *request, const shd_color_transform *transform, float *rgb,
                        size_t count) {
    enum { ROW = 1024 };
    float row[4 * ROW];
    for (size_t first = 0; first < count && !shd_is_cancelled(&request->cancelled); first += ROW) {
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

/* The values of a color layer, converted like the picture. The beauty is the picture itself,
 * multiplied by its alpha as the other layers are by their coverage. */
static float *color_layer(shd_request *request, const shd_film *film, const shd_layer *layer,
                          const float *converted, const shd_color_transform *transform) {
    const shd_plan *plan = request->plan;
    size_t pixels = (size_t)film->width * (size_t)film->height;
    if (layer->kind == SHD_LAYER_BEAUTY) {
        float *rgb = shd_arena_alloc(request->arena, pixels, 3 * sizeof *rgb);
        for (size_t i = 0; rgb && i < pixels; i++)
            for (size_t c = 0; c < 3; c++)
                rgb[3 * i + c] = converted[4 * i + c] * converted[4 * i + 3];
        return rgb;
    }
    size_t p = 1;
    while (plan->planes[p].kind != layer->kind ||
           (layer->kind == SHD_LAYER_LIGHT && plan->planes[p].light != layer->light))
        p++;
    float *rgb = copy_floats(request->arena, film->planes[p], 3 * pixels);
    if (rgb) convert_rgb(request, transform, rgb, pixels);
    return rgb;
}

/* A layer but for its values. */
static shd_image_layer describe_layer(const shd_layer *layer) {
    static const char *const rgb[] = {"R", "G", "B"}, *const xyz[] = {"X", "Y", "Z"},
                             *const z[] = {"Z"}, *const id[] = {"id"};
    switch (layer->kind) {
    case SHD_LAYER_NORMAL:
    case SHD_LAYER_POSITION:
        return (shd_image_layer){layer->name, xyz, 3, true, NULL};
    case SHD_LAYER_DEPTH:
        return (shd_image_layer){layer->name, z, 1, true, NULL};
    case SHD_LAYER_OBJECT:
        return (shd_image_layer){layer->name, id, 1, true, NULL};
    default:
        return (shd_image_layer){layer->name, rgb, 3, false, NULL};
    }
}

static bool make_layers(shd_request *request, const shd_film *film, const shd_output *output,
                        const float *converted, const shd_color_transform *transform,
                        shd_image_layer **out) {
    size_t pixels = (size_t)film->width * (size_t)film->height;
    shd_image_layer *layers = shd_arena_alloc(request->arena, output->layer_count, sizeof *layers);
    if (!layers) return false;
    for (size_t l = 0; l < output->layer_count; l++) {
        if (shd_is_cancelled(&request->cancelled)) return false;
        const shd_layer *layer = &output->layers[l];
        layers[l] = describe_layer(layer);
        switch (layer->kind) {
        case SHD_LAYER_NORMAL:
            layers[l].values = film->normal;
            break;
        case SHD_LAYER_POSITION:
            layers[l].values = film->position;
            break;
        case SHD_LAYER_DEPTH:
            layers[l].values = film->depth;
            break;
        case SHD_LAYER_OBJECT:
            layers[l].values = film->object;
            break;
        default: {
            float *values = color_layer(request, film, layer, converted, transform);
            if (!values) return false;
            saturate(request, output, values, 3 * pixels);
            layers[l].values = values;
        }
        }
    }
    *out = layers;
    return true;
}

bool shd_output_is_flat(const shd_scene *scene, const shd_output *output) {
    return scene->transparent && !shd_format_get(output->format)->alpha && output->channel != 3;
}

void shd_output_flatten(float *rgba, size_t pixels) {
    for (size_t i = 0; i < pixels; i++) {
        for (int c = 0; c < 3; c++) rgba[4 * i + (size_t)c] *= rgba[4 * i + 3];
        rgba[4 * i + 3] = 1;
    }
}

/* Converts rows side by side on the pool: a pixel's result does not depend on the split. */
typedef struct conversion {
    const shd_color_transform *transform;
    float *rgba;
    size_t width, rows, height;
    double *seconds; /* [slot] */
    const atomic_bool *cancelled;
} conversion;

static void convert_rows(void *context, size_t index, unsigned slot) {
    const conversion *work = context;
    if (shd_is_cancelled(work->cancelled)) return;
    double began = shd_thread_seconds();
    size_t first = index * work->rows;
    size_t rows = work->height - first < work->rows ? work->height - first : work->rows;
    shd_color_apply(work->transform, work->rgba + 4 * first * work->width, rows * work->width);
    work->seconds[slot] += shd_thread_seconds() - began;
}

static bool convert_picture(shd_request *request, const shd_color_transform *transform,
                            const shd_film *film, float *rgba) {
    shd_pool *pool = request->engine->pool;
    unsigned slots = shd_pool_slots(pool);
    conversion work = {transform,
                       rgba,
                       (size_t)film->width,
                       0,
                       (size_t)film->height,
                       shd_arena_zalloc(request->arena, slots, sizeof *work.seconds),
                       &request->cancelled};
    if (!work.seconds) return false;
    work.rows = 1 + 32768 / work.width;
    request->times.color -=
        shd_pool_for(pool, (work.height + work.rows - 1) / work.rows, convert_rows, &work);
    for (unsigned i = 1; i < slots; i++) request->times.color += work.seconds[i];
    return true;
}

/* ---- Pictures whose colors go straight to codes. ---- */

typedef struct coding {
    const shd_color_codes *codes;
    shd_isa isa;
    const float *rgba;
    shd_layout layout;
    bool flatten;
    size_t pixels, step; /* of an index */
    unsigned char *samples;
    double *seconds;     /* [slot], */
    uint64_t *saturated; /* as is this */
    const atomic_bool *cancelled;
} coding;

static void code_pixels(void *context, size_t index, unsigned slot) {
    enum { BLOCK = 1024 };
    const coding *work = context;
    if (shd_is_cancelled(work->cancelled)) return;
    double began = shd_thread_seconds();
    size_t end = (index + 1) * work->step < work->pixels ? (index + 1) * work->step : work->pixels;
    for (size_t first = index * work->step; first < end; first += BLOCK) {
        size_t some = end - first < BLOCK ? end - first : BLOCK;
        const float *rgba = work->rgba + 4 * first;
        float flat[4 * BLOCK];
        if (work->flatten) {
            memcpy(flat, rgba, 4 * some * sizeof *flat);
            shd_output_flatten(flat, some);
            rgba = flat;
        }
        const shd_layout *layout = &work->layout;
        work->saturated[slot] +=
            shd_color_encode(work->codes, work->isa, rgba, some, layout->source, layout->count,
                             work->samples + first * (size_t)layout->count * layout->bytes);
    }
    work->seconds[slot] += shd_thread_seconds() - began;
}

/* Whether the picture's colors can go straight to its samples: nobody needs converted floats, and
 * a sample depends on one channel alone. */
static const shd_color_codes *find_codes(const shd_request *request, const shd_output *output,
                                         const shd_color_transform *transform,
                                         const shd_image *image) {
    const shd_packing *packing = &image->packing;
    if (request->engine->floats_only || output->layer_count) return NULL;
    if (output->depth != SHD_U8 && output->depth != SHD_U16) return NULL;
    if (shd_image_layout(image, output->format).premultiplied) return NULL;
    for (int c = 0; c < 3; c++)
        if (packing->scale[c] != 1 || packing->offset8[c] != 0 || packing->offset16[c] != 0)
            return NULL;
    return shd_color_codes_of(transform, output->depth == SHD_U8 ? 255 : 65535,
                              (size_t)image->width * (size_t)image->height);
}

static bool code_picture(shd_request *request, const shd_color_codes *codes, const shd_film *film,
                         bool flat, shd_format format, shd_image *image) {
    shd_pool *pool = request->engine->pool;
    unsigned slots = shd_pool_slots(pool);
    coding work = {.codes = codes,
                   .isa = request->engine->isa,
                   .rgba = film->rgba,
                   .layout = shd_image_layout(image, format),
                   .flatten = flat,
                   .pixels = (size_t)film->width * (size_t)film->height,
                   .step = 32768,
                   .seconds = shd_arena_zalloc(request->arena, slots, sizeof *work.seconds),
                   .saturated = shd_arena_zalloc(request->arena, slots, sizeof *work.saturated),
                   .cancelled = &request->cancelled};
    work.samples =
        shd_arena_alloc(request->arena, work.pixels, (size_t)work.layout.count * work.layout.bytes);
    if (!work.seconds || !work.saturated || !work.samples) return false;
    request->times.color -=
        shd_pool_for(pool, (work.pixels + work.step - 1) / work.step, code_pixels, &work);
    for (unsigned i = 0; i < slots; i++) {
        request->times.color += i ? work.seconds[i] : 0;
        request->saturated += work.saturated[i];
    }
    image->samples = work.samples;
    return true;
}

/* ---- The other ones, and layers. ---- */

static bool convert_film(shd_request *request, const shd_film *film, size_t index,
                         const shd_color_transform *transform, bool flat, shd_image *image) {
    const shd_output *output = &request->scene->outputs[index];
    size_t pixels = (size_t)film->width * (size_t)film->height;
    bool last = index + 1 == request->scene->output_count;
    float *rgba = last ? film->rgba : copy_floats(request->arena, film->rgba, 4 * pixels);
    if (!rgba) return false;
    if (flat) shd_output_flatten(rgba, pixels);
    if (!convert_picture(request, transform, film, rgba)) return false;
    saturate(request, output, rgba, 4 * pixels);
    shd_image_layer *layers = NULL;
    if (output->layer_count && !make_layers(request, film, output, rgba, transform, &layers))
        return false;
    image->rgba = rgba;
    image->layers = layers;
    image->layer_count = output->layer_count;
    return true;
}

/* Between the pieces of a long encoding: it is left where the request was cancelled, and other
 * requests take their turn. */
static bool go_on(void *context) {
    shd_request *request = context;
    request->times.encode -= shd_pool_lend(request->engine->pool);
    return !shd_is_cancelled(&request->cancelled);
}

/* An encoder's loop, whose every thread counts. */
typedef struct encoding {
    void (*run)(void *work, size_t index, unsigned slot);
    void *work;
    double *seconds; /* [slots] */
} encoding;

static void encode_part(void *context, size_t index, unsigned slot) {
    encoding *e = context;
    const double began = shd_thread_seconds();
    e->run(e->work, index, slot);
    e->seconds[slot] += shd_thread_seconds() - began;
}

static void spread(void *context, size_t count,
                   void (*run)(void *work, size_t index, unsigned slot), void *work) {
    shd_request *request = context;
    shd_pool *pool = request->engine->pool;
    const unsigned slots = shd_pool_slots(pool);
    encoding e = {run, work, shd_arena_zalloc(request->arena, slots, sizeof *e.seconds)};
    if (!e.seconds) { /* without memory for that, alone */
        for (size_t i = 0; i < count; i++) run(work, i, 0);
        return;
    }
    request->times.encode -= shd_pool_for(pool, count, encode_part, &e);
    for (unsigned i = 1; i < slots; i++) request->times.encode += e.seconds[i];
}

/* ---- Both. ---- */

/* What the encoder will be told, but for the pixels. */
static shd_status begin_image(shd_request *request, size_t index,
                              const shd_color_transform **transform, shd_image *image,
                              shd_error *error) {
    const shd_scene *scene = request->scene;
    const shd_output *output = &scene->outputs[index];
    shd_status status = shd_output_transform(request, output, transform, error);
    if (status != SHD_OK) return status;
    const shd_color_info *info = shd_color_describe(*transform);
    *image = (shd_image){
        .width = scene->raster.w,
        .height = scene->raster.h,
        .channel = output->channel,
        .alpha = scene->transparent && shd_format_get(output->format)->alpha,
        .packing = shd_output_packing(info->channels),
        .depth = output->depth,
        .quality = output->quality,
        .effort = output->effort,
        .transfer = info->transfer,
        .has_primaries = info->has_primaries,
        .channel_names = shd_channel_names(info->channels),
        .isa = request->engine->isa,
        .go_on = go_on,
        .spread = spread,
        .slots = shd_pool_slots(request->engine->pool),
        .context = request,
    };
    memcpy(image->primaries, info->primaries, sizeof image->primaries);
    return SHD_OK;
}

shd_status shd_output_prepare(shd_request *request, shd_film *film, shd_error *error) {
    const shd_scene *scene = request->scene;
    const shd_output *output = &scene->outputs[0];
    if (scene->output_count > 1 || scene->transparent) return SHD_OK;
    const shd_color_transform *transform;
    shd_image image;
    shd_status status = begin_image(request, 0, &transform, &image, error);
    if (status != SHD_OK) return status;
    film->codes = find_codes(request, output, transform, &image);
    if (!film->codes) return SHD_OK;
    film->layout = shd_image_layout(&image, output->format);
    film->samples = shd_arena_alloc(request->arena, (size_t)image.width * (size_t)image.height,
                                    (size_t)film->layout.count * film->layout.bytes);
    if (!film->samples)
        return shd_fail(error, SHD_MEMORY, "/image",
                        "the limit `memory` (%llu bytes) is reached by this picture",
                        (unsigned long long)request->limits.memory);
    return SHD_OK;
}

/* Of one picture, which is made in the film's own pixels where it is the last. */
static shd_status size_output(shd_request *request, const shd_film *film, size_t index,
                              uint64_t *out, shd_error *error) {
    const shd_output *output = &request->scene->outputs[index];
    const shd_color_transform *transform;
    shd_image image;
    shd_status status = begin_image(request, index, &transform, &image, error);
    if (status != SHD_OK) return status;
    const bool codes = film->codes || find_codes(request, output, transform, &image);
    const bool last = index + 1 == request->scene->output_count;
    const shd_layout layout = shd_image_layout(&image, output->format);
    const uint64_t pixels = (uint64_t)image.width * (uint64_t)image.height;
    uint64_t floats = codes || last ? 0 : 4;
    shd_image_layer *layers = shd_arena_alloc(request->arena, output->layer_count, sizeof *layers);
    if (!layers) return shd_fail(error, SHD_MEMORY, "/image", "the limit `memory` is reached");
    for (size_t l = 0; l < output->layer_count; l++) {
        layers[l] = describe_layer(&output->layers[l]);
        if (output->layers[l].kind < SHD_LAYER_NORMAL) floats += 3;
    }
    image.layers = layers;
    image.layer_count = output->layer_count;
    *out = shd_image_scratch(&image, output->format, codes) + pixels * floats * sizeof(float);
    if (codes && !film->codes) *out += pixels * (uint64_t)layout.count * layout.bytes;
    return SHD_OK;
}

shd_status shd_output_size(shd_request *request, const shd_film *film, uint64_t *out,
                           shd_error *error) {
    uint64_t most = 0, one = 0;
    for (size_t i = 0; i < request->scene->output_count; i++) {
        shd_status status = size_output(request, film, i, &one, error);
        if (status != SHD_OK) return status;
        if (one > most) most = one;
    }
    *out = most;
    return SHD_OK;
}

shd_status shd_output_make(shd_request *request, const shd_film *film, size_t index,
                           shd_error *error) {
    const shd_scene *scene = request->scene;
    const shd_output *output = &scene->outputs[index];

    double began = shd_thread_seconds();
    const shd_arena_mark mark = shd_arena_mark_here(request->arena);
    const shd_color_transform *transform;
    shd_image image;
    shd_status status = begin_image(request, index, &transform, &image, error);
    if (status != SHD_OK) return status;

    bool made = true;
    if (film->codes) {
        image.samples = film->samples;
    } else {
        const bool flat = shd_output_is_flat(scene, output);
        const shd_color_codes *codes = find_codes(request, output, transform, &image);
        made = codes ? code_picture(request, codes, film, flat, output->format, &image)
                     : convert_film(request, film, index, transform, flat, &image);
    }
    if (shd_is_cancelled(&request->cancelled))
        return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    if (!made)
        return shd_fail(error, SHD_MEMORY, "/image",
                        "the limit `memory` (%llu bytes) is reached by this picture",
                        (unsigned long long)request->limits.memory);
    double colored = shd_thread_seconds();
    request->times.color += colored - began;

    shd_bytes bytes;
    status = shd_image_encode(&image, output->format, request->arena, &bytes, error);
    request->times.encode += shd_thread_seconds() - colored;
    if (status != SHD_OK) return status;
    shd_arena_return(request->arena, mark);
    request->pictures[index] = (shd_picture){output->name, output->format, bytes.data, bytes.size};
    return SHD_OK;
}
