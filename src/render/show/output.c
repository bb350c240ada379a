#include "render/show/output.h"

#include <float.h>
#include <string.h>

shd_route shd_route_of(const shd_scene *scene, const shd_output *output, bool apart) {
    const bool integers = output->depth == SHD_U8 || output->depth == SHD_U16;
    const bool mixed = scene->transparent && shd_format_get(output->format)->premultiplied;
    const bool codes = apart && integers && !mixed && !output->layer_count;
    return (shd_route){codes, !codes || scene->transparent || scene->output_count > 1};
}

/* Holds values in the range that the sample type or the format can store, and counts those
 * outside. */
static void saturate_values(shd_rendering *r, const shd_output *output, float *values,
                            size_t count) {
    float largest = output->depth == SHD_HALF ? 65504 : FLT_MAX, least = -largest;
    if (output->format == SHD_HDR) {
        largest = 1.7e38f; /* a shared 8-bit exponent: below 2^127 ... */
        least = 0;         /* ... and no signs */
    }
    r->saturated += shd_saturate(values, count, least, largest);
}

shd_status shd_output_transform(shd_color_config *color, const shd_scene *scene,
                                const shd_output *output, const shd_color_transform **out,
                                shd_error *error) {
    const char *from = scene->working_space->name;
    if (output->color_space)
        return shd_color_to_space(color, from, output->color_space->name, out, error);
    return shd_color_to_view(color, from, output->display, output->view, out, error);
}

/* I spans [-.60,.60] and Q [-.52,.52]. For integers they are scaled to the full range around a code
 * that grey falls on exactly (docs/model.md, Color). */
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

/* The values of a color layer, converted like the picture. The beauty is the picture itself. It is
 * multiplied by its alpha, as the other layers are by their coverage. */
static float *color_layer(const shd_rendering *r, const shd_film *film, const shd_layer *layer,
                          const float *converted, const shd_color_transform *transform) {
    const shd_plan *plan = r->plan;
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
           (layer->kind == SHD_LAYER_LIGHT && plan->planes[p].light != layer->light))
        p++;
    float *rgb = copy_floats(r->arena, film->planes[p], 3 * pixels);
    if (rgb) convert_rgb(r, transform, rgb, pixels);
    return rgb;
}

/* The values of color layers are left to the caller: NULL. */
static shd_image_layer describe_layer(const shd_layer *layer, const shd_film *film) {
    static const char *const rgb[] = {"R", "G", "B"}, *const xyz[] = {"X", "Y", "Z"},
                             *const z[] = {"Z"}, *const id[] = {"id"};
    switch (layer->kind) {
    case SHD_LAYER_NORMAL:
        return (shd_image_layer){layer->name, xyz, 3, true, film->normal};
    case SHD_LAYER_POSITION:
        return (shd_image_layer){layer->name, xyz, 3, true, film->position};
    case SHD_LAYER_DEPTH:
        return (shd_image_layer){layer->name, z, 1, true, film->depth};
    case SHD_LAYER_OBJECT:
        return (shd_image_layer){layer->name, id, 1, true, film->object};
    default:
        return (shd_image_layer){layer->name, rgb, 3, false, NULL};
    }
}

static bool make_layers(shd_rendering *r, const shd_film *film, const shd_output *output,
                        const float *converted, const shd_color_transform *transform,
                        shd_image_layer **out) {
    const size_t pixels = (size_t)film->width * (size_t)film->height;
    shd_image_layer *layers = shd_arena_alloc(r->arena, output->layer_count, sizeof *layers);
    if (!layers) return false;
    for (size_t l = 0; l < output->layer_count; l++) {
        if (shd_is_cancelled(r->cancelled)) return false;
        const shd_layer *layer = &output->layers[l];
        layers[l] = describe_layer(layer, film);
        if (layers[l].values) continue;
        float *values = color_layer(r, film, layer, converted, transform);
        if (!values) return false;
        saturate_values(r, output, values, 3 * pixels);
        layers[l].values = values;
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

/* ---- Pixels, side by side on the pool: none depends on the split. ---- */

enum { PIXELS_AT_ONCE = 32768 };

typedef struct coloring {
    const shd_rendering *rendering;
    const shd_color_transform *transform; /* in place; */
    const shd_color_codes *codes;         /* or, unless NULL, straight to codes: */
    bool flatten;
    shd_layout layout;
    unsigned char *samples;
    float *rgba;
    size_t pixels;
    atomic_uint_least64_t saturated;
} coloring;

static void code_pixels(coloring *work, size_t first, size_t end) {
    enum { BLOCK = 1024 };
    const shd_layout *layout = &work->layout;
    uint64_t saturated = 0;
    for (; first < end; first += BLOCK) {
        const size_t some = end - first < BLOCK ? end - first : BLOCK;
        const float *rgba = work->rgba + 4 * first;
        float flat[4 * BLOCK];
        if (work->flatten) {
            memcpy(flat, rgba, 4 * some * sizeof *flat);
            shd_output_flatten(flat, some);
            rgba = flat;
        }
        saturated += shd_color_encode(
            work->codes, work->rendering->engine->isa, rgba, some, layout->source, layout->count,
            work->samples + first * (size_t)layout->count * layout->bytes);
    }
    atomic_fetch_add(&work->saturated, saturated);
}

static void color_pixels(void *context, size_t index, unsigned slot) {
    (void)slot;
    coloring *work = context;
    if (shd_is_cancelled(work->rendering->cancelled)) return;
    const size_t first = index * PIXELS_AT_ONCE, left = work->pixels - first,
                 some = left < PIXELS_AT_ONCE ? left : PIXELS_AT_ONCE;
    if (work->codes)
        code_pixels(work, first, first + some);
    else
        shd_color_apply(work->transform, work->rgba + 4 * first, some);
}

static void color_picture(shd_rendering *r, coloring *work) {
    shd_stage_spread(r, (work->pixels + PIXELS_AT_ONCE - 1) / PIXELS_AT_ONCE, color_pixels, work);
    r->saturated += atomic_load(&work->saturated);
}

static bool go_on_baking(const void *context) {
    const shd_rendering *r = context;
    return !shd_is_cancelled(r->cancelled);
}

/* The tables that the output's colors are looked up in. NULL: they go through floats. */
static const shd_color_codes *find_codes(const shd_rendering *r, const shd_output *output,
                                         const shd_color_transform *transform) {
    const shd_scene *scene = r->plan->scene;
    if (r->engine->floats_only || !shd_route_of(scene, output, true).codes) return NULL;
    if (shd_color_describe(transform)->channels == SHD_YIQ) return NULL; /* samples are scaled */
    return shd_color_codes_of(transform, output->depth == SHD_U8 ? 255 : 65535,
                              (size_t)scene->raster.w * (size_t)scene->raster.h, go_on_baking, r);
}

static bool code_film(shd_rendering *r, const shd_color_codes *codes, const shd_film *film,
                      bool flat, shd_format format, shd_image *image) {
    coloring work = {.rendering = r,
                     .codes = codes,
                     .flatten = flat,
                     .layout = shd_image_layout(image, format),
                     .rgba = film->rgba,
                     .pixels = (size_t)film->width * (size_t)film->height};
    work.samples =
        shd_arena_alloc(r->arena, work.pixels, (size_t)work.layout.count * work.layout.bytes);
    if (!work.samples) return false;
    color_picture(r, &work);
    image->samples = work.samples;
    return true;
}

static bool convert_film(shd_rendering *r, const shd_film *film, size_t index,
                         const shd_color_transform *transform, bool flat, shd_image *image) {
    const shd_scene *scene = r->plan->scene;
    const shd_output *output = &scene->outputs[index];
    size_t pixels = (size_t)film->width * (size_t)film->height;
    bool last = index + 1 == scene->output_count;
    float *rgba = last ? film->rgba : copy_floats(r->arena, film->rgba, 4 * pixels);
    if (!rgba) return false;
    if (flat) shd_output_flatten(rgba, pixels);
    color_picture(
        r, &(coloring){.rendering = r, .transform = transform, .rgba = rgba, .pixels = pixels});
    saturate_values(r, output, rgba, 4 * pixels);
    shd_image_layer *layers = NULL;
    if (output->layer_count && !make_layers(r, film, output, rgba, transform, &layers))
        return false;
    image->rgba = rgba;
    image->layers = layers;
    image->layer_count = output->layer_count;
    return true;
}

/* Called between the pieces of a long encoding. Other requests take their turn, and the encoding
 * ends if the request was cancelled. */
static bool go_on_encoding(void *context) {
    shd_rendering *r = context;
    shd_stage_lend(r);
    return !shd_is_cancelled(r->cancelled);
}

static void spread_encoding(void *context, size_t count,
                            void (*run)(void *work, size_t index, unsigned slot), void *work) {
    shd_stage_spread(context, count, run, work);
}

/* ---- Outputs. ---- */

/* What the encoder will be told, but for the pixels. */
static shd_status begin_image(shd_rendering *r, const shd_output *output,
                              const shd_color_transform **transform, shd_image *image,
                              shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    shd_status status = shd_output_transform(r->engine->color, scene, output, transform, error);
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
        .isa = r->engine->isa,
        .go_on = go_on_encoding,
        .spread = spread_encoding,
        .slots = shd_pool_slots(r->engine->pool),
        .context = r,
        .elsewhere = &r->beside,
    };
    memcpy(image->primaries, info->primaries, sizeof image->primaries);
    return SHD_OK;
}

shd_status shd_output_prepare(shd_rendering *r, shd_film *film, shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    const shd_output *output = &scene->outputs[0];
    if (shd_route_of(scene, output, true).film) return SHD_OK;
    const shd_color_transform *transform;
    shd_image image;
    shd_status status = begin_image(r, output, &transform, &image, error);
    if (status != SHD_OK) return status;
    film->codes = find_codes(r, output, transform);
    if (!film->codes) return SHD_OK;
    film->layout = shd_image_layout(&image, output->format);
    film->samples = shd_arena_alloc(r->arena, (size_t)image.width * (size_t)image.height,
                                    (size_t)film->layout.count * film->layout.bytes);
    return film->samples ? SHD_OK : shd_rendering_full(r, "picture", error);
}

/* The bytes of one picture. The last one is made in the film's own pixels. */
static shd_status size_output(shd_rendering *r, const shd_film *film, size_t index, uint64_t *out,
                              shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    const shd_output *output = &scene->outputs[index];
    const shd_color_transform *transform;
    shd_image image;
    shd_status status = begin_image(r, output, &transform, &image, error);
    if (status != SHD_OK) return status;
    const bool codes = film->codes || find_codes(r, output, transform);
    const bool last = index + 1 == scene->output_count;
    const shd_layout layout = shd_image_layout(&image, output->format);
    const uint64_t pixels = (uint64_t)image.width * (uint64_t)image.height;
    uint64_t floats = codes || last ? 0 : 4;
    shd_image_layer *layers = shd_arena_alloc(r->arena, output->layer_count, sizeof *layers);
    if (!layers) return shd_fail(error, SHD_MEMORY, "/image", "the limit `memory` is reached");
    for (size_t l = 0; l < output->layer_count; l++) {
        layers[l] = describe_layer(&output->layers[l], film);
        if (output->layers[l].kind < SHD_LAYER_NORMAL) floats += 3;
    }
    image.layers = layers;
    image.layer_count = output->layer_count;
    *out = shd_image_scratch(&image, output->format, codes) + pixels * floats * sizeof(float);
    if (codes && !film->codes) *out += pixels * (uint64_t)layout.count * layout.bytes;
    return SHD_OK;
}

shd_status shd_output_size(shd_rendering *r, const shd_film *film, uint64_t *out,
                           shd_error *error) {
    uint64_t most = 0, one = 0;
    for (size_t i = 0; i < r->plan->scene->output_count; i++) {
        shd_status status = size_output(r, film, i, &one, error);
        if (status != SHD_OK) return status;
        if (one > most) most = one;
    }
    *out = most;
    return SHD_OK;
}

/* The picture's colors: samples, or floats for the encoder to pack. */
static shd_status color_image(shd_rendering *r, const shd_film *film, size_t index,
                              shd_image *image, shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    const shd_output *output = &scene->outputs[index];
    const shd_color_transform *transform;
    shd_status status = begin_image(r, output, &transform, image, error);
    if (status != SHD_OK) return status;
    bool made = true;
    if (film->codes) {
        image->samples = film->samples;
    } else {
        const bool flat = shd_output_is_flat(scene, output);
        const shd_color_codes *codes = find_codes(r, output, transform);
        made = codes ? code_film(r, codes, film, flat, output->format, image)
                     : convert_film(r, film, index, transform, flat, image);
    }
    if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    return made ? SHD_OK : shd_rendering_full(r, "picture", error);
}

shd_status shd_output_make(shd_rendering *r, const shd_film *film, size_t index, shd_picture *out,
                           shd_error *error) {
    const shd_output *output = &r->plan->scene->outputs[index];
    const shd_arena_mark mark = shd_arena_mark_here(r->arena);
    shd_stage_begin(r);
    shd_image image;
    shd_status status = color_image(r, film, index, &image, error);
    shd_stage_end(r, &r->times.color);
    if (status != SHD_OK) return status;

    shd_bytes bytes;
    status = shd_image_encode(&image, output->format, r->arena, &bytes, error);
    shd_stage_end(r, &r->times.encode);
    if (status != SHD_OK) return status;
    shd_arena_return(r->arena, mark);
    *out = (shd_picture){output->name, output->format, bytes.data, bytes.size};
    return SHD_OK;
}
