/* Color through OpenColorIO: configurations, transforms, metadata. The only C++ behind this is
 * ocio.cpp; every entry catches all exceptions.
 *
 * A configuration is loaded once and shared by threads; transforms are made on first use, kept
 * for the configuration's life, and may be applied by any number of threads at once. */
#ifndef SHD_COLOR_COLOR_H
#define SHD_COLOR_COLOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/catalog.h"
#include "base/cpu.h"
#include "base/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shd_color_config shd_color_config;
typedef struct shd_color_transform shd_color_transform;
typedef struct shd_color_codes shd_color_codes;

/* Loads `path`, or the embedded config/shaded.ocio where it is NULL. Checks that the role
 * scene_linear is there, that every space, display and view can be built. SHD_CONFIG with the
 * file's name as path and OpenColorIO's own words where not; definitions that run in circles and
 * files that are not regular are refused too.
 *
 * The first call removes OCIO and OCIO_* from the process's environment, which would change
 * colors, and silences OpenColorIO: make it before other threads read the environment. */
shd_status shd_color_config_load(const char *path, shd_color_config **out, shd_error *error);
void shd_color_config_drop(shd_color_config *config);

const shd_catalog *shd_color_catalog(const shd_color_config *config);

/* A hash of OpenColorIO's version, the configuration and the files it uses: 32 hexadecimal
 * digits. */
const char *shd_color_config_digest(const shd_color_config *config);

/* From a scene-linear space to another space, or to a display's view. Borrowed. Names are the
 * catalog's, exactly; another one is SHD_SCENE. Any thread. */
shd_status shd_color_to_space(shd_color_config *config, const char *from, const char *to,
                              const shd_color_transform **out, shd_error *error);
shd_status shd_color_to_view(shd_color_config *config, const char *from, const char *display,
                             const char *view, const shd_color_transform **out, shd_error *error);

/* What a transform's output is, for file metadata and for packing. Transfer and primaries are
 * known by name, for the spaces and displays of config/shaded.ocio and their ACES equivalents. */
typedef struct shd_color_info {
    shd_channels channels;
    shd_transfer transfer;
    bool has_primaries;
    double primaries[8]; /* CIE 1931 xy of red, green, blue, white */
    const char *name;    /* of the space or "display / view", for people */
} shd_color_info;

const shd_color_info *shd_color_describe(const shd_color_transform *transform);

/* Converts `count` RGBA pixels in place; alpha is untouched and colors must not be
 * premultiplied. Values must be finite; results are not, where a value near the largest float
 * overflows. Negative values and values above 1 are kept where the space has a meaning for them
 * (HSV clamps negatives to 0 first; its hue is in [0,1), and 0 like the saturation for greys). A
 * pixel's result does not depend on the pixels beside it, bit for bit. Any thread. */
void shd_color_apply(const shd_color_transform *transform, float *rgba, size_t count);

/* The transform straight to integer codes 0..max (255 or 65535), or NULL where it has to go
 * through floats: its channels mix, or its curves do not only rise, or the tables do not pay yet.
 * `pixels` is how many the caller is about to convert: tables are made once as many were asked
 * for as cost the same. Borrowed: kept with the transform. Any thread. */
const shd_color_codes *shd_color_codes_of(const shd_color_transform *transform, unsigned max,
                                          size_t pixels);

/* The samples of `count` RGBA pixels: out is [count][samples], of uint8_t or, where the codes' max
 * is 65535, of uint16_t. Sample s holds channel source[s], 0..2 converted, 3 alpha as it is.
 * The codes are those of shd_color_apply's floats, not-a-number and what lies beyond 0..1 held as
 * in base/sample.h, for every finite input, with every variant `isa`. Returns how many of the
 * 3 x count converted values are not finite. Any thread. */
uint64_t shd_color_encode(const shd_color_codes *codes, shd_isa isa, const float *rgba,
                          size_t count, const int source[], int samples, void *out);

/* The same from planes: rgb is [3][count], alpha [count], or NULL where all is opaque. They go
 * to out in rows of `width` > 0 pixels whose first ones are `pitch` >= width pixels apart. Nothing
 * else is written, so that threads may fill a picture together. */
uint64_t shd_color_encode_planes(const shd_color_codes *codes, shd_isa isa,
                                 const float *const rgb[3], const float *alpha, size_t count,
                                 const int source[], int samples, size_t width, size_t pitch,
                                 void *out);

#ifdef __cplusplus
}
#endif
#endif
