/* Maps of normals that tests make and put. */
#ifndef SHD_TEST_PUT_NORMALS_H
#define SHD_TEST_PUT_NORMALS_H

#include "property/put_picture.h"

typedef struct code {
    uint8_t x, y, z;
} code;

/* The texels go on in the order of the list, row by row. */
static inline put_name put_normals(shd_engine *engine, int width, int height, const code *list,
                                   size_t count) {
    uint8_t *samples = malloc((size_t)(4 * width * height));
    for (int i = 0; i < width * height; i++) {
        const code c = list[(size_t)i % count];
        memcpy(samples + 4 * i, (uint8_t[]){c.x, c.y, c.z, 255}, 4);
    }
    const put_name name = put_picture(engine, width, height, samples);
    free(samples);
    return name;
}

static inline shd_vec3 vector_of(code c, double scale) {
    shd_vec3 n = {scale * (2.0 * c.x / 255 - 1), scale * (2.0 * c.y / 255 - 1),
                  2.0 * c.z / 255 - 1};
    shd_normalize(n, &n);
    return n;
}

#endif
