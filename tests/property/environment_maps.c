/* Spheres in environments that are pictures, against sums over all texels of the same map, cut into
 * smaller ones until these sums are stable. */
#include "property/film_of.h"

#include "image/image.h"
#include "scene/surroundings.h"
#include "shade/backdrop.h"

enum { ROWS = 64, COLUMNS = 2 * ROWS, WIDE = 16, HIGH = 12 };

typedef enum map_kind { SUN, HALF, STARS } map_kind;

static const char *const kind_names[] = {"one texel a sun", "one half black", "many stars"};

static double value_at(map_kind kind, int x, int y, int c, uint64_t *random) {
    switch (kind) {
    case SUN:
        return x == 97 && y == 20 ? 1 : 0.002 + 0.001 * c;
    case HALF: /* and the other one of squares */
        return x < COLUMNS / 2 ? 0 : (x / 5 + y / 7) % 2 ? 0.01 : 0.002 * (c + 1);
    default:
        return pow(uniform(random, 0, 1), 40);
    }
}

/* A PNG of 16 bits, put under its digest, which is written to `name`. */
static void put_samples(shd_engine *engine, int width, int height, const void *samples,
                        char name[80]) {
    const shd_image image = {.width = width,
                             .height = height,
                             .channel = -1,
                             .alpha = true,
                             .depth = SHD_U16,
                             .samples = samples,
                             .slots = 1};
    shd_arena *arena = shd_arena_new(64 << 20);
    shd_bytes png;
    shd_error error;
    shd_request *request;
    bool known;
    assert_int_equal(shd_image_encode(&image, SHD_PNG, arena, &png, &error), SHD_OK);
    const shd_digest digest = shd_digest_of(png.data, png.size);
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    assert_int_equal(shd_request_keep_asset(request, png.data, png.size, &digest, "", &known),
                     SHD_OK);
    strcpy(name, "sha256-");
    shd_digest_write(&digest, name + 7);
    shd_request_drop(request);
    shd_arena_drop(arena);
    free(png.data);
}

static void put_map(shd_engine *engine, map_kind kind, char name[80]) {
    static uint16_t samples[ROWS][COLUMNS][4];
    uint64_t random = 7;
    for (int y = 0; y < ROWS; y++)
        for (int x = 0; x < COLUMNS; x++) {
            for (int c = 0; c < 3; c++) {
                const double v = value_at(kind, x, y, c, &random);
                samples[y][x][c] =
                    (uint16_t)(65535 *
                               (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055));
            }
            samples[y][x][3] = 65535;
        }
    put_samples(engine, COLUMNS, ROWS, samples, name);
}

static const double diffuse[3] = {0.3, 0.2, 0.5}, specular[3] = {0.9, 0.7, 0.3};

static char *scene_in(const char *map, const char *tier) {
    return text_of("{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"accuracy\": "
                   "{\"tier\": \"%s\"}, \"lights\": [{\"type\": \"environment\", \"map\": \"%s\", "
                   "\"rotate\": 40, \"intensity\": 150}], \"objects\": [{\"type\": \"sphere\", "
                   "\"material\": {\"diffuse\": [%g, %g, %g], \"specular\": [%g, %g, %g], "
                   "\"shininess\": 24}}]}",
                   WIDE, HIGH, tier, map, diffuse[0], diffuse[1], diffuse[2], specular[0],
                   specular[1], specular[2]);
}

/* Parts of texels, as lights from their middles. */
typedef struct part {
    shd_vec3 from;
    double rgb[3]; /* times the solid angle, over pi */
} part;

static part *cut_map(const shd_surroundings *map, int cut) {
    const int rows = map->height * cut, columns = map->width * cut;
    part *parts = malloc((size_t)rows * (size_t)columns * sizeof *parts), *p = parts;
    for (int j = 0; j < rows; j++) {
        const double down = SHD_PI * (j + 0.5) / rows,
                     angle = 2 * (cos(SHD_PI * j / rows) - cos(SHD_PI * (j + 1) / rows)) / columns;
        for (int i = 0; i < columns; i++, p++) {
            const double turn = 2 * SHD_PI * ((i + 0.5) / columns - 0.5);
            p->from = (shd_vec3){sin(down) * sin(turn), cos(down), -sin(down) * cos(turn)};
            shd_surroundings_at(map, p->from, p->rgb);
            for (int c = 0; c < 3; c++) p->rgb[c] *= angle;
        }
    }
    return parts;
}

/* Phong's sum at a pixel's middle; false: the sphere is not there. */
static bool sum_parts(const shd_light *light, const part *parts, int cut, int x, int y,
                      double out[3]) {
    const double step = tan(20 * SHD_PI / 180) / (HIGH / 2.0);
    shd_vec3 way = {(x + 0.5 - WIDE / 2.0) * step, (HIGH / 2.0 - y - 0.5) * step, -1};
    shd_normalize(way, &way);
    const double along = -4 * way.z, under = along * along - 15;
    if (under < 0) return false;
    const shd_vec3 n = shd_madd((shd_vec3){0, 0, 4}, way, along - sqrt(under)),
                   w = shd_sub(way, shd_scale(n, 2 * shd_dot(n, way))),
                   normal = shd_to_map(light, n), mirrored = shd_to_map(light, w);
    const size_t count = 2 * (size_t)(light->map->height * cut * light->map->height * cut);
    for (int c = 0; c < 3; c++) out[c] = 0;
    for (size_t k = 0; k < count; k++) {
        const double height = shd_dot(parts[k].from, normal),
                     near = fmax(shd_dot(parts[k].from, mirrored), 0);
        if (!(height > 0)) continue;
        const double x2 = near * near, x4 = x2 * x2, x8 = x4 * x4, lobe = x8 * x8 * x8;
        for (int c = 0; c < 3; c++)
            out[c] += parts[k].rgb[c] * (diffuse[c] * height + specular[c] * lobe);
    }
    for (int c = 0; c < 3; c++) out[c] *= light->color[0];
    return true;
}

static double code_of(double v) {
    v = fmin(fmax(v, 0), 1);
    return round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055));
}

static void check_map(shd_engine *engine, map_kind kind) {
    char name[80];
    put_map(engine, kind, name);
    char *texts[2] = {scene_in(name, "standard"), scene_in(name, "exact")};
    drawn tabled = shown_film_of(engine, texts[0]), exact = shown_film_of(engine, texts[1]);
    const shd_light *light = &tabled.request->scene->lights[0];
    assert_int_equal(light->map->height, ROWS);
    part *coarse = cut_map(light->map, 4), *fine = cut_map(light->map, 8);
    const double told[2] = {tabled.request->rendering.plan->bound.linear,
                            exact.request->rendering.plan->bound.linear};
    double worst[2] = {0, 0}, unstable = 0, codes[2] = {0, 0};
    size_t seen = 0;
    for (int y = 0; y < HIGH; y++)
        for (int x = 0; x < WIDE; x++) {
            double a[3], b[3];
            if (!sum_parts(light, coarse, 4, x, y, a)) continue;
            sum_parts(light, fine, 8, x, y, b);
            seen++;
            for (int c = 0; c < 3; c++) {
                const size_t at = 4 * (size_t)(y * WIDE + x) + (size_t)c;
                const double found[2] = {(double)tabled.film.rgba[at], (double)exact.film.rgba[at]},
                             itself = fabs(a[c] - b[c]);
                unstable = fmax(unstable, itself);
                for (int t = 0; t < 2; t++) {
                    const double off = fabs(found[t] - b[c]);
                    worst[t] = fmax(worst[t], off);
                    codes[t] = fmax(codes[t], fabs(code_of(found[t]) - code_of(b[c])));
                    assert_true(off <= told[t] + itself);
                }
            }
        }
    print_message("%s: tables off %.1e of %.1e, %g codes; quadrature %.1e of %.1e, %g; sums "
                  "themselves %.1e\n",
                  kind_names[kind], worst[0], told[0], codes[0], worst[1], told[1], codes[1],
                  unstable);
    assert_true(seen > 30 && codes[0] <= 1 && codes[1] <= 1);
    free(fine);
    free(coarse);
    drop_drawn(&exact);
    drop_drawn(&tabled);
    free(texts[1]);
    free(texts[0]);
}

static void a_sun_is_as_all_texels(void **state) {
    check_map(*state, SUN);
}

static void a_black_half_is_as_all_texels(void **state) {
    check_map(*state, HALF);
}

static void stars_are_as_all_texels(void **state) {
    check_map(*state, STARS);
}

static drawn draw_behind(shd_engine *engine, const char *map, int width, const char *camera) {
    char *json =
        text_of("{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"camera\": {%s}, "
                "\"lights\": [{\"type\": \"environment\", \"map\": \"%s\", \"visible\": true}], "
                "\"objects\": [{\"type\": \"sphere\", \"radius\": 0.1}]}",
                width, width / 2, camera, map);
    drawn d = shown_film_of(engine, json);
    free(json);
    return d;
}

/* Behind objects a map has about as many texels as pixels: light is made of fewer. Squares of one
 * texel are seen where pixels are as fine, and are their mean where pixels are coarser. */
static void what_is_seen_has_as_many_texels_as_pixels(void **state) {
    enum { H = 640, W = 2 * H };
    static uint16_t samples[H][W][4];
    char name[80];
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            const uint16_t code = (x + y) % 2 ? 65535 : 0;
            memcpy(samples[y][x], (uint16_t[]){code, code, code, 65535}, sizeof samples[y][x]);
        }
    put_samples(*state, W, H, samples, name);
    static const struct {
        const char *camera;
        int width, rows;
        bool seen;
    } views[] = {{"\"fov\": 40", 64, SHD_SURROUNDINGS_MOST, false},
                 {"\"fov\": 40", 128, 384, false},
                 {"\"fov\": 4", 64, H, true},
                 {"\"type\": \"orthographic\", \"height\": 3", 64, SHD_SURROUNDINGS_MOST, false}};
    for (size_t k = 0; k < sizeof views / sizeof *views; k++) {
        drawn d = draw_behind(*state, name, views[k].width, views[k].camera);
        const shd_light *light = &d.request->scene->lights[0];
        assert_int_equal(light->map->height, SHD_SURROUNDINGS_MOST);
        assert_int_equal(light->seen->height, views[k].rows);
        if (views[k].rows == SHD_SURROUNDINGS_MOST) assert_ptr_equal(light->seen, light->map);
        float low = 1, high = 0;
        for (int y = 0; y < 4; y++)
            for (int x = 0; x < views[k].width; x++) {
                const float value = d.film.rgba[4 * (y * views[k].width + x) + 1];
                low = fminf(low, value);
                high = fmaxf(high, value);
            }
        print_message("%s, %d: %.2g to %.2g\n", views[k].camera, views[k].width, (double)low,
                      (double)high);
        assert_true(views[k].seen ? low < 0.1F && high > 0.9F : low > 0.4F && high < 0.6F);
        drop_drawn(&d);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sun_is_as_all_texels),
        cmocka_unit_test(a_black_half_is_as_all_texels),
        cmocka_unit_test(stars_are_as_all_texels),
        cmocka_unit_test(what_is_seen_has_as_many_texels_as_pixels),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
