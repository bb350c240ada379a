/* What well-known color spaces and displays are, by name. OpenColorIO knows how to convert, but not
 * which chromaticities and curve a file should declare. Constant; any thread. */
#pragma once

#include "base/catalog.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shd_encoding {
    const char *name;
    shd_transfer transfer;
    const double *primaries; /* [8] CIE 1931 xy of red, green, blue, white */
} shd_encoding;

/* By exact name, for the spaces and displays of config/shaded.ocio and of the ACES configurations.
 * NULL: not known. */
const shd_encoding *shd_encoding_of_space(const char *name);
const shd_encoding *shd_encoding_of_display(const char *name);

#ifdef __cplusplus
}
#endif
