/* Names of a foreign file as names of a scene: short, plain, and each there once. Pure, any thread.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>

enum { SHD_NAME_ROOM = 64 };

typedef struct shd_raw_name {
    const char *text; /* [length], any bytes */
    size_t length;
} shd_raw_name;

typedef struct shd_plain_name {
    char text[SHD_NAME_ROOM];
} shd_plain_name;

/* Fills `out` [count]. A name that is empty becomes `usual`; of equal ones all but the first get
 * "#" and their index, which no other name has. False: out of memory. */
bool shd_plain_names(const shd_raw_name *raw, size_t count, const char *usual, shd_plain_name *out);
