/* A region is the crop of the whole picture, and a sample does not know its neighbours: bit for
 * bit, whatever the pattern, the shapes, the materials and the layers. */
#include <libdeflate.h>

#include "property/pieces.h"

enum { WIDTH = 64, HEIGHT = 48 };

typedef struct region {
    int x, y, w, h;
} region;

static const region whole = {0, 0, WIDTH, HEIGHT};
static const region regions[] = {{0, 0, 1, 1},   {63, 47, 1, 1}, {31, 23, 1, 1},  {13, 7, 17, 3},
                                 {5, 11, 3, 29}, {0, 0, 64, 48}, {1, 1, 63, 47},  {20, 0, 33, 48},
                                 {0, 19, 64, 1}, {47, 31, 9, 8}, {30, 22, 16, 16}};
enum { REGIONS = sizeof regions / sizeof regions[0] };

typedef struct setting {
    const char *tier;
    int samples;
    const char *interpolation; /* of the whole scene */
    bool transparent, layers, equal_materials;
} setting;

/* Nine objects of all kinds over each other with five materials. */
static void write_objects(FILE *out, bool faceted, bool equal) {
    static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus", "disc"};
    fputs("\"materials\": {", out);
    for (int i = 0; i < 5; i++)
        fprintf(out,
                "%s\"m%d\": {\"emissive\": 0.0%d, \"diffuse\": [0.%d, 0.4, 0.3], \"specular\": 0.3,"
                " \"shininess\": %d}",
                i ? ", " : "", i, equal ? 1 : i, equal ? 5 : i + 2, equal ? 50 : 5 + 40 * i);
    fputs("}, \"objects\": [", out);
    uint64_t random = 5;
    for (int i = 0; i < 6; i++)
        fprintf(out,
                "{\"type\": \"%s\", \"material\": \"m%d\", \"transform\": {\"scale\": 0.6, "
                "\"rotate\": [%g, %g, %g], \"translate\": [%g, %g, %g]}}, ",
                shapes[i], i % 5, uniform(&random, 0, 360), uniform(&random, 0, 360),
                uniform(&random, 0, 360), uniform(&random, -1.5, 1.5), uniform(&random, -1, 1),
                uniform(&random, -1, 1));
    for (int normals = 0; normals < 2; normals++) {
        fputs("{\"type\": \"mesh\", ", out);
        write_ball(out, 16, 8, normals);
        fprintf(out,
                ", \"material\": \"m%d\", \"transform\": {\"scale\": 0.5, \"translate\": [%g, 0.3,"
                " 0.8]}}%s",
                normals + 3, normals - 0.6, normals ? "" : ", ");
    }
    if (!faceted)
        fputs(", {\"type\": \"plane\", \"material\": \"m2\", \"transform\": {\"translate\": "
              "[0, -1, 0]}}",
              out);
    fputs("]", out);
}

static char *scene(const setting *s, region r) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d, \"region\": [%d, %d, %d,"
            " %d]}, \"accuracy\": {\"tier\": \"%s\"}, \"interpolation\": \"%s\", \"background\": "
            "%s, \"ambient\": 0.3, \"lights\": [{\"type\": \"point\"}, {\"type\": \"spot\", "
            "\"attenuation\": [0, 0.3, 0.1], \"direction\": [0.1, -1, 0]}, {\"type\": "
            "\"directional\", \"color\": [0.2, 0.3, 0.4]}], ",
            WIDTH, HEIGHT, s->samples, r.x, r.y, r.w, r.h, s->tier, s->interpolation,
            s->transparent ? "null" : "[0.1, 0.2, 0.3]");
    write_objects(w.out, strcmp(s->interpolation, "phong") != 0, s->equal_materials);
    if (s->layers)
        fputs(", \"output\": {\"format\": \"exr\", \"bitDepth\": \"float\", \"layers\": "
              "[\"emissive\", \"ambient\", \"diffuse\", \"specular\", \"light.0\", \"light.1\", "
              "\"light.2\", \"normal\", \"position\", \"depth\", \"object\"]}",
              w.out);
    fputs("}", w.out);
    return finish(&w);
}

static drawn draw(void **state, const setting *s, region r) {
    char *json = scene(s, r);
    drawn d = film_of(*state, json);
    free(json);
    assert_int_equal(d.film.width, r.w);
    assert_int_equal(d.film.height, r.h);
    return d;
}

/* Whether `part`, of region r, is that part of `all`; both [height][width][channels]. */
static bool is_crop(const float *part, const float *all, region r, size_t channels) {
    if (!part || !all) return !part && !all;
    for (int y = 0; y < r.h; y++) {
        size_t from = ((size_t)(r.y + y) * WIDTH + (size_t)r.x) * channels;
        size_t row = (size_t)r.w * channels;
        if (memcmp(part + (size_t)y * row, all + from, row * sizeof *all)) return false;
    }
    return true;
}

static void check_regions(void **state, const setting *s) {
    drawn all = draw(state, s, whole);
    const size_t planes = all.request->rendering.plan->plane_count;
    assert_int_equal(planes, s->layers ? 8 : 1);
    for (int k = 0; k < REGIONS; k++) {
        drawn part = draw(state, s, regions[k]);
        const shd_film *a = &part.film, *b = &all.film;
        assert_true(is_crop(a->rgba, b->rgba, regions[k], 4));
        for (size_t p = 1; p < planes; p++)
            assert_true(is_crop(a->planes[p], b->planes[p], regions[k], 3));
        assert_true(is_crop(a->normal, b->normal, regions[k], 3));
        assert_true(is_crop(a->position, b->position, regions[k], 3));
        assert_true(is_crop(a->depth, b->depth, regions[k], 1));
        assert_true(is_crop(a->object, b->object, regions[k], 1));
        drop_drawn(&part);
    }
    drop_drawn(&all);
}

static void regions_are_crops_at_any_number_of_samples(void **state) {
    static const int samples[] = {1, 4, 7, 16};
    for (int i = 0; i < 4; i++) {
        check_regions(state, &(setting){.tier = "standard",
                                        .samples = samples[i],
                                        .interpolation = "phong",
                                        .transparent = i % 2});
        check_regions(state, &(setting){.tier = "exact",
                                        .samples = samples[i],
                                        .interpolation = "phong",
                                        .transparent = !(i % 2)});
    }
    check_regions(state, &(setting){.tier = "draft", .samples = 4, .interpolation = "phong"});
}

static void regions_are_crops_with_facets(void **state) {
    check_regions(state, &(setting){.tier = "standard", .samples = 4, .interpolation = "flat"});
    check_regions(state, &(setting){.tier = "standard",
                                    .samples = 7,
                                    .interpolation = "gouraud",
                                    .transparent = true});
    check_regions(state, &(setting){.tier = "exact", .samples = 1, .interpolation = "gouraud"});
}

static void regions_are_crops_in_every_layer(void **state) {
    check_regions(
        state,
        &(setting){.tier = "standard", .samples = 4, .interpolation = "phong", .layers = true});
    check_regions(state, &(setting){.tier = "exact",
                                    .samples = 7,
                                    .interpolation = "gouraud",
                                    .transparent = true,
                                    .layers = true});
}

/* A disc under cones that each light some pixels of it. */
static drawn draw_cones(void **state, region r) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1, \"region\": [%d, %d, %d,"
            " %d]}, \"objects\": [{\"type\": \"disc\", \"radius\": 9, \"transform\": {\"rotate\": "
            "[90, 0, 0]}, \"material\": {\"specular\": 0.3}}], \"lights\": [",
            WIDTH, HEIGHT, r.x, r.y, r.w, r.h);
    for (int i = 0; i < 16; i++)
        fprintf(w.out,
                "%s{\"type\": \"spot\", \"position\": [%g, %g, 5], \"direction\": [0, 0, -1], "
                "\"angle\": 3, \"penumbra\": 0}",
                i ? ", " : "", 0.9 * (i % 4) - 1.3, 0.7 * (i / 4) - 1);
    fputs("]}", w.out);
    char *json = finish(&w);
    drawn d = film_of(*state, json);
    free(json);
    return d;
}

/* Lights are left out where they miss all of the points that are lit at once, however few. */
static void few_points_have_their_own_lights(void **state) {
    drawn all = draw_cones(state, whole);
    size_t lit = 0;
    for (int k = 0; k < 200; k++) {
        const region r = {k * 37 % (WIDTH - 3), k * 29 % HEIGHT, 1 + k % 3, 1};
        drawn part = draw_cones(state, r);
        assert_true(is_crop(part.film.rgba, all.film.rgba, r, 4));
        lit += part.film.rgba[0] > 0;
        shd_request_drop(part.request);
    }
    assert_true(lit > 20 && lit < 180);
    shd_request_drop(all.request);
}

static void asking_for_layers_changes_no_pixel(void **state) {
    static const char *const kinds[] = {"phong", "flat", "gouraud"};
    for (int i = 0; i < 6; i++) {
        setting s = {i < 3 ? "standard" : "exact", 4, kinds[i % 3], .transparent = i % 2};
        drawn without = draw(state, &s, whole);
        s.layers = true;
        drawn with = draw(state, &s, whole);
        assert_true(same_film(&without, &with));
        drop_drawn(&without);
        drop_drawn(&with);
    }
}

static void one_material_under_two_names_is_the_same_picture(void **state) {
    /* Samples are shaded in blocks of one material: five equal ones cut other blocks than one
     * would. The objects name m0..m4, or all name m0. */
    for (int i = 0; i < 2; i++) {
        setting s = {i ? "exact" : "standard", 7, "phong", .equal_materials = true};
        char *many = scene(&s, whole), *one = scene(&s, whole);
        for (char *at = one; (at = strstr(at, "\"material\": \"m")); at++) at[14] = '0';
        drawn a = film_of(*state, many), b = film_of(*state, one);
        assert_true(a.request->scene->material_count > b.request->scene->material_count);
        assert_true(same_film(&a, &b));
        drop_drawn(&a);
        drop_drawn(&b);
        free(many);
        free(one);
    }
}

/* ---- Files. ---- */

static uint32_t read32(const unsigned char *at) {
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

/* Rows of an 8-bit RGB or RGBA file; the five filters of the PNG specification, section 9. */
static unsigned char *decode(file png, int width, int height, size_t *channels) {
    unsigned char *packed = malloc(png.size);
    size_t packed_size = 0;
    for (size_t at = 8; at + 12 <= png.size; at += 12 + read32(png.data + at)) {
        const unsigned char *chunk = png.data + at;
        if (!memcmp(chunk + 4, "IHDR", 4)) {
            assert_int_equal(read32(chunk + 8), width);
            assert_int_equal(read32(chunk + 12), height);
            assert_int_equal(chunk[16], 8);
            assert_true(chunk[17] == 2 || chunk[17] == 6);
            *channels = chunk[17] == 2 ? 3 : 4;
        }
        if (memcmp(chunk + 4, "IDAT", 4)) continue;
        memcpy(packed + packed_size, chunk + 8, read32(chunk));
        packed_size += read32(chunk);
    }
    size_t row = (size_t)width * *channels, size = (row + 1) * (size_t)height, got;
    unsigned char *raw = malloc(size), *out = malloc(row * (size_t)height);
    struct libdeflate_decompressor *d = libdeflate_alloc_decompressor();
    assert_int_equal(libdeflate_zlib_decompress(d, packed, packed_size, raw, size, &got), 0);
    assert_int_equal(got, size);
    libdeflate_free_decompressor(d);
    for (size_t y = 0; y < (size_t)height; y++)
        for (size_t x = 0; x < row; x++) {
            int left = x >= *channels ? out[y * row + x - *channels] : 0;
            int up = y ? out[(y - 1) * row + x] : 0;
            int corner = y && x >= *channels ? out[(y - 1) * row + x - *channels] : 0;
            int p = left + up - corner;
            int a = abs(p - left), b = abs(p - up), c = abs(p - corner);
            int paeth = a <= b && a <= c ? left : b <= c ? up : corner;
            const int guess[] = {0, left, up, (left + up) / 2, paeth};
            unsigned char filter = raw[y * (row + 1)];
            assert_true(filter < 5);
            out[y * row + x] = (unsigned char)(raw[y * (row + 1) + 1 + x] + guess[filter]);
        }
    free(packed);
    free(raw);
    return out;
}

static unsigned char *rows_of(void **state, const setting *s, region r, size_t *channels) {
    char *json = scene(s, r);
    file png = png_of(*state, json);
    unsigned char *rows = decode(png, r.w, r.h, channels);
    free(png.data);
    free(json);
    return rows;
}

static void files_of_regions_hold_the_codes_of_the_whole(void **state) {
    for (int i = 0; i < 2; i++) {
        setting s = {"standard", 4, i ? "gouraud" : "phong", .transparent = i};
        size_t channels;
        unsigned char *all = rows_of(state, &s, whole, &channels);
        assert_int_equal(channels, i ? 4 : 3);
        for (int k = 0; k < REGIONS; k++) {
            region r = regions[k];
            size_t part_channels;
            unsigned char *part = rows_of(state, &s, r, &part_channels);
            assert_int_equal(part_channels, channels);
            size_t row = (size_t)r.w * channels;
            for (int y = 0; y < r.h; y++)
                assert_memory_equal(part + (size_t)y * row,
                                    all + ((size_t)(r.y + y) * WIDTH + (size_t)r.x) * channels,
                                    row);
            free(part);
        }
        free(all);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(regions_are_crops_at_any_number_of_samples),
        cmocka_unit_test(regions_are_crops_with_facets),
        cmocka_unit_test(regions_are_crops_in_every_layer),
        cmocka_unit_test(few_points_have_their_own_lights),
        cmocka_unit_test(asking_for_layers_changes_no_pixel),
        cmocka_unit_test(one_material_under_two_names_is_the_same_picture),
        cmocka_unit_test(files_of_regions_hold_the_codes_of_the_whole),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
