/* Pictures that dressed scenes name: made of nothing but numbers, the same in every run. */
#ifndef SHD_ATTACK_PICTURES_H
#define SHD_ATTACK_PICTURES_H

#include <stdbool.h>
#include <stdint.h>

#include "shaded.h"

typedef enum picture_use {
    FOR_COLORS,  /* noise, checks, a ramp of grey, one texel */
    FOR_NORMALS, /* gentle bumps, any direction at all, two slopes that alternate */
    FOR_SKIES    /* twice as wide as high: noise, one light in the dark */
} picture_use;

/* One of them: "sha256-" and its digits. After the first pictures_put(); any thread. */
const char *picture_name(picture_use use, uint64_t *random);

/* Puts all of them into an engine's store. False: `error` tells why. The first call, which makes
 * the files, is alone. */
bool pictures_put(shd_engine *engine, shd_error *error);

#endif
