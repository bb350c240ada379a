/* Writes pictures of a known pattern for image_roundtrip_test.py:
 *
 *     image_writer OUT.png [key=value ...]
 *     image_writer < LINES
 *
 * A line is such a command's words, and its answer a line with the exit status: one process for
 * many pictures, because some formats take long to load.
 *
 * size=WxH depth=8|16|half|float channel=-1..3 alpha=0|1 quality=N transfer=unknown|linear|srgb|
 * rec1886 primaries=none|rec709|p3|acescg|aces space=RGB|YIQ|HSV layers=0|1 repeat=N threads=N.
 * The pattern is fill's below. Exit 1 with the error's text where encoding fails, or where one of
 * `threads` times `repeat` pictures is not as the others. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/image.h"

static const struct {
    const char *name;
    double xy[8];
} primaries[] = {{"rec709", {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290}},
                 {"p3", {0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290}},
                 {"acescg", {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767}},
                 {"aces", {0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767}}};

/* Smooth, different in every channel, exact in f32 where the sides are powers of two. */
static void fill(float *rgba, int width, int height, bool alpha) {
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++, rgba += 4) {
            float u = (float)x / (float)width, v = (float)y / (float)height;
            rgba[0] = u;
            rgba[1] = v;
            rgba[2] = 0.25f + 0.5f * u * v;
            rgba[3] = alpha ? (float)((x + y) % 5) / 4 : 1;
        }
}

static bool is(const char *argument, const char *key, const char **value) {
    size_t length = strlen(key);
    if (strncmp(argument, key, length) || argument[length] != '=') return false;
    *value = argument + length + 1;
    return true;
}

static void set_space(shd_image *image, const char *space) {
    const bool yiq = !strcmp(space, "YIQ"), hsv = !strcmp(space, "HSV");
    image->channel_names = shd_channel_names(yiq ? SHD_YIQ : hsv ? SHD_HSV : SHD_RGB);
    image->about = yiq ? "YIQ: luma, in-phase, quadrature \xc2\xb1" : NULL;
}

static bool set(shd_image *image, const char *argument, int *layers, int *repeat, int *threads) {
    const char *v;
    if (is(argument, "size", &v)) return sscanf(v, "%dx%d", &image->width, &image->height) == 2;
    if (is(argument, "channel", &v)) return sscanf(v, "%d", &image->channel) == 1;
    if (is(argument, "quality", &v)) return sscanf(v, "%d", &image->quality) == 1;
    if (is(argument, "named", &v)) return (image->space = v) != NULL;
    if (is(argument, "layers", &v)) return sscanf(v, "%d", layers) == 1;
    if (is(argument, "repeat", &v)) return sscanf(v, "%d", repeat) == 1;
    if (is(argument, "threads", &v)) return sscanf(v, "%d", threads) == 1;
    if (is(argument, "alpha", &v))
        image->alpha = *v == '1';
    else if (is(argument, "space", &v))
        set_space(image, v);
    else if (is(argument, "depth", &v)) {
        for (unsigned d = SHD_U8; d <= SHD_FLOAT; d <<= 1)
            if (!strcmp(v, shd_depth_name((shd_depth)d))) image->depth = (shd_depth)d;
    } else if (is(argument, "transfer", &v)) {
        image->transfer = !strcmp(v, "linear")    ? SHD_TRANSFER_LINEAR
                          : !strcmp(v, "srgb")    ? SHD_TRANSFER_SRGB
                          : !strcmp(v, "rec1886") ? SHD_TRANSFER_REC1886
                                                  : SHD_TRANSFER_UNKNOWN;
    } else if (is(argument, "primaries", &v)) {
        image->has_primaries = false;
        for (size_t i = 0; i < sizeof primaries / sizeof primaries[0]; i++) {
            if (strcmp(v, primaries[i].name)) continue;
            image->has_primaries = true;
            memcpy(image->primaries, primaries[i].xy, sizeof image->primaries);
        }
    } else
        return false;
    return true;
}

typedef struct work {
    const shd_image *image;
    shd_format format;
    int repeat;
    shd_bytes out;
    shd_error error;
    bool differs;
} work;

static void *encode_all(void *context) {
    work *w = context;
    for (int i = 0; i < w->repeat; i++) {
        shd_arena *scratch = shd_arena_new((size_t)1 << 32);
        shd_bytes out = {0};
        shd_status status = shd_image_encode(w->image, w->format, scratch, &out, &w->error);
        shd_arena_drop(scratch);
        if (status) return w;
        if (w->out.data)
            w->differs = w->differs || out.size != w->out.size ||
                         memcmp(out.data, w->out.data, out.size) != 0;
        free(w->out.data);
        w->out = out;
    }
    return NULL;
}

enum { THREADS_MAX = 16 };

static int run(const shd_image *image, shd_format format, int repeat, int threads,
               const char *path) {
    work works[THREADS_MAX];
    pthread_t ids[THREADS_MAX];
    int failed = 0;
    for (int i = 0; i < threads; i++) {
        works[i] = (work){.image = image, .format = format, .repeat = repeat};
        if (pthread_create(&ids[i], NULL, encode_all, &works[i])) return 2;
    }
    for (int i = 0; i < threads; i++) {
        void *bad;
        pthread_join(ids[i], &bad);
        if (bad) fprintf(stderr, "%s\n", works[i].error.text);
        failed |= bad != NULL;
    }
    for (int i = 0; i < threads && !failed; i++)
        if (works[i].differs || works[i].out.size != works[0].out.size ||
            memcmp(works[i].out.data, works[0].out.data, works[0].out.size)) {
            fprintf(stderr, "equal pictures differ\n");
            failed = 1;
        }
    FILE *file = failed ? NULL : fopen(path, "wb");
    if (file) {
        failed = fwrite(works[0].out.data, 1, works[0].out.size, file) != works[0].out.size;
        failed |= fclose(file) != 0;
    }
    for (int i = 0; i < threads; i++) free(works[i].out.data);
    return failed || !file;
}

/* The exit status of a command; words[0] is the file. */
static int write_picture(int count, char **words) {
    shd_image image = {.width = 32,
                       .height = 16,
                       .channel = -1,
                       .depth = SHD_U8,
                       .quality = 90,
                       .transfer = SHD_TRANSFER_SRGB,
                       .has_primaries = true};
    memcpy(image.primaries, primaries[0].xy, sizeof image.primaries);
    set_space(&image, "RGB");
    int layers = 0, repeat = 1, threads = 1;
    shd_format format;
    const char *dot = count ? strrchr(words[0], '.') : NULL;
    if (!dot || !shd_format_find(dot + 1, &format)) return 2;
    image.depth = shd_format_get(format)->depth;
    for (int i = 1; i < count; i++)
        if (!set(&image, words[i], &layers, &repeat, &threads)) return 2;
    if (threads < 1 || threads > THREADS_MAX || image.width < 1 || image.height < 1) return 2;

    size_t pixels = (size_t)image.width * (size_t)image.height;
    float *rgba = malloc(pixels * 4 * sizeof *rgba), *depth = malloc(pixels * sizeof *depth);
    if (!rgba || !depth) return 2;
    fill(rgba, image.width, image.height, image.alpha);
    for (size_t i = 0; i < pixels; i++) depth[i] = 1e6f + (float)i;
    image.rgba = rgba;

    /* The beauty's own values once more as a layer, and one that half cannot hold. */
    static const char *const rgba_names[] = {"R", "G", "B", "A"}, *const z_names[] = {"Z"};
    shd_image_layer all[] = {{"diffuse", rgba_names, 4, false, rgba},
                             {"depth", z_names, 1, true, depth},
                             {"light.0", z_names, 1, false, depth}};
    image.layers = all;
    image.layer_count = layers ? 3 : 0;
    int failed = run(&image, format, repeat, threads, words[0]);
    free(rgba);
    free(depth);
    return failed;
}

int main(int argc, char **argv) {
    enum { WORDS = 32 };
    if (argc > 1) return write_picture(argc - 1, argv + 1);
    char *line = NULL;
    size_t room = 0;
    while (getline(&line, &room, stdin) > 0) {
        char *words[WORDS], *rest;
        int count = 0;
        for (char *word = strtok_r(line, " \n", &rest); word && count < WORDS;
             word = strtok_r(NULL, " \n", &rest))
            words[count++] = word;
        printf("%d\n", write_picture(count, words));
        fflush(stdout);
    }
    free(line);
    return 0;
}
