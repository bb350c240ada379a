#include "attack/pictures.h"

#include <stdlib.h>
#include <string.h>

#include "attack/knobs.h"
#include "attack/scenes.h"
#include "image/image.h"

enum { USES = 3, MOST_TEXELS = 64 * 64 };

typedef struct texel {
    uint8_t r, g, b, a;
} texel;

typedef texel painter(int x, int y, uint64_t *random);

static uint8_t code(uint64_t *random, int low, int high) {
    return (uint8_t)(low + one_of(random, high - low + 1));
}

static texel noise(int x, int y, uint64_t *random) {
    (void)x, (void)y;
    return (texel){code(random, 0, 255), code(random, 0, 255), code(random, 0, 255),
                   code(random, 0, 255)};
}

static texel checks(int x, int y, uint64_t *random) {
    (void)random;
    const uint8_t v = (x / 8 + y / 8) % 2 ? 255 : 0;
    return (texel){v, v, v, 255};
}

static texel ramp(int x, int y, uint64_t *random) {
    (void)y, (void)random;
    const uint8_t v = (uint8_t)(x * 17);
    return (texel){v, v, v, (uint8_t)(255 - v)};
}

static texel bumps(int x, int y, uint64_t *random) {
    (void)x, (void)y;
    return (texel){code(random, 100, 155), code(random, 100, 155), code(random, 220, 255), 255};
}

static texel slopes(int x, int y, uint64_t *random) {
    (void)random;
    return (texel){(x + y) % 2 ? 20 : 235, 128, 190, 255};
}

static texel lamp(int x, int y, uint64_t *random) {
    (void)random;
    const uint8_t v = x == 21 && y == 5 ? 255 : 1;
    return (texel){v, v, v, 255};
}

/* A single texel and a row, whose mean is all that smaller sizes have, are among them. */
static const struct {
    picture_use use;
    int width, height;
    painter *paint;
} plans[] = {{FOR_COLORS, 33, 20, noise}, {FOR_COLORS, 32, 32, checks}, {FOR_COLORS, 16, 1, ramp},
             {FOR_COLORS, 1, 1, noise},   {FOR_NORMALS, 16, 16, bumps}, {FOR_NORMALS, 9, 7, noise},
             {FOR_NORMALS, 2, 2, slopes}, {FOR_SKIES, 24, 12, noise},   {FOR_SKIES, 64, 32, lamp}};
enum { COUNT = sizeof plans / sizeof plans[0] };

static struct {
    shd_bytes png;
    shd_digest digest;
    char name[80];
} made[COUNT];

static bool make(int k, shd_error *error) {
    static texel texels[MOST_TEXELS];
    uint64_t random = (uint64_t)k + 1;
    shd_arena *arena = shd_arena_new(16 << 20);
    if (!arena) return false;
    for (int y = 0; y < plans[k].height; y++)
        for (int x = 0; x < plans[k].width; x++)
            texels[y * plans[k].width + x] = plans[k].paint(x, y, &random);
    const shd_image image = {.width = plans[k].width,
                             .height = plans[k].height,
                             .channel = -1,
                             .alpha = true,
                             .depth = SHD_U8,
                             .samples = texels,
                             .slots = 1};
    const bool good = shd_image_encode(&image, SHD_PNG, arena, &made[k].png, error) == SHD_OK;
    if (good) {
        made[k].digest = shd_digest_of(made[k].png.data, made[k].png.size);
        memcpy(made[k].name, "sha256-", 7);
        shd_digest_write(&made[k].digest, made[k].name + 7);
    }
    shd_arena_drop(arena);
    return good;
}

const char *picture_name(picture_use use, uint64_t *random) {
    int of[COUNT], count = 0;
    for (int k = 0; k < COUNT; k++)
        if (plans[k].use == use) of[count++] = k;
    return made[of[knob_of(random, count)]].name;
}

bool pictures_put(shd_engine *engine, shd_error *error) {
    bool good = true, known;
    for (int k = 0; k < COUNT && good; k++) {
        shd_request *request = NULL;
        good = (*made[k].name || make(k, error)) && !shd_request_new(engine, &request, error) &&
               !shd_request_keep_asset(request, made[k].png.data, made[k].png.size, &made[k].digest,
                                       "attack", &known);
        shd_request_drop(request);
    }
    return good;
}
