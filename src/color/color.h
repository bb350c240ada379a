/* Color through OpenColorIO: configurations, transforms, metadata. The C++ behind this is in
 * ocio*.cpp; every entry catches all exceptions.
 *
 * A configuration is loaded once and shared by threads. Transforms are made on first use and kept
 * for a while. Any number of threads may apply one at once. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/budget.h"
#include "base/catalog.h"
#include "base/cpu.h"
#include "base/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shd_color_config shd_color_config;
typedef struct shd_color_transform shd_color_transform;
typedef struct shd_color_codes shd_color_codes;
typedef bool shd_color_go_on(const void *context);

/* Loads `path`, or the embedded config/shaded.ocio if it is NULL. A path "ocio://NAME" and archives
 * (.ocioz) are OpenColorIO's to read. Checks, of a path, that the role scene_linear
 * is there, and that every space, display and view can be built. SHD_CONFIG, with the file's name
 * as path and OpenColorIO's own words, if not. Definitions that run in circles and files that are
 * not regular are refused too. Transforms of the embedded one are made on their first use: most in
 * less than a millisecond, the tables of PQ and ACES in up to 40.
 *
 * The first call removes OCIO and OCIO_* from the process's environment, because they would change
 * colors, and silences OpenColorIO. Make it before other threads read the environment. */
shd_status shd_color_config_load(const char *path, shd_color_config **out, shd_error *error);
void shd_color_config_drop(shd_color_config *config);

const shd_catalog *shd_color_catalog(const shd_color_config *config);

/* A hash of OpenColorIO's version, the configuration and the files that it uses: 32 hexadecimal
 * digits. */
const char *shd_color_config_digest(const shd_color_config *config);

/* The space that the configuration's rules for files give to a name, which need not be that of a
 * file that there is. NULL: it is none that documents may name. *is_default: no rule but the
 * default matches. Any thread. */
const shd_space_info *shd_color_rule(const shd_color_config *config, const char *name,
                                     bool *is_default);

/* Tables of transforms may be large, and transforms are as many as clients think of. So whoever
 * uses one holds it by a lease, and the last ones that were asked for are kept for others. *lease
 * is NULL at first; it is made as needed, and its drop gives back all that it holds. One thread at
 * a time. */
typedef struct shd_color_lease shd_color_lease;
void shd_color_lease_drop(shd_color_lease *lease); /* NULL is fine */

/* From here on transforms, and the files that the configuration refers to, count in `budget` (NULL:
 * no one's), and a sixteenth of it, 64 MB at most, may be kept of transforms that nobody holds;
 * before, none are. `first`, unless it is NULL, has joined before, lives longer, and keeps those of
 * both. SHD_CONFIG: there is no room for the files, or for what loading made. Call it once, before
 * other threads ask. */
shd_status shd_color_config_join(shd_color_config *config, shd_budget *budget,
                                 const shd_color_config *first, shd_error *error);

/* Gives up `bytes` of what is kept, if there is as much, and returns how many. Any thread, with any
 * locks. */
size_t shd_color_trim(shd_color_config *config, size_t bytes);

/* The transform from a space to another one or, of a scene-linear space, to a display's view; *out
 * is good until the lease ends. Names are those of the catalog; for another name SHD_SCENE.
 * SHD_CROWDED: the budget has no room for it. Any thread. */
shd_status shd_color_to_space(shd_color_config *config, const char *from, const char *to,
                              shd_color_lease **lease, const shd_color_transform **out,
                              shd_error *error);
shd_status shd_color_to_view(shd_color_config *config, const char *from, const char *display,
                             const char *view, shd_color_lease **lease,
                             const shd_color_transform **out, shd_error *error);

/* The transform to a space (`view` NULL) or a display's view, adjusted, in the same way. What is
 * data must not be adjusted. Looks that are unknown are SHD_SCENE, too. */
shd_status shd_color_adjusted(shd_color_config *config, const char *from, const char *space,
                              const char *display, const char *view, const shd_adjust *adjust,
                              shd_color_lease **lease, const shd_color_transform **out,
                              shd_error *error);

/* What a transform's output is, for file metadata. The transfer and the primaries are found by
 * conversion to CIE XYZ, which takes the roles aces_interchange and cie_xyz_d65_interchange. Of
 * data they are those that the values came with. */
typedef struct shd_color_info {
    shd_channels channels;
    shd_transfer transfer;
    bool data;  /* values without a meaning as color */
    bool looks; /* there is a look on the way, which may do anything */
    bool has_primaries;
    double primaries[8]; /* CIE 1931 xy of red, green, blue, white */
    const char *name;    /* of the space or "display / view", for people */
    const char *about;   /* what the channels are, if they are not R, G and B; or NULL */
} shd_color_info;

const shd_color_info *shd_color_describe(const shd_color_transform *transform);

/* Converts `count` RGBA pixels in place. Alpha is untouched, and colors must not be premultiplied.
 * Values must be finite; a result is not if a value near the largest float overflows. Negative
 * values and values above 1 are kept if the space has a meaning for them. (HSV clamps negatives to
 * 0 first; its hue is in [0,1). The hue and the saturation of greys are 0.) A pixel's result does
 * not depend on the pixels beside it, bit for bit. Any thread. */
void shd_color_apply(const shd_color_transform *transform, float *rgba, size_t count);

/* Whether OpenColorIO knows that channels mix. False proves nothing. */
bool shd_color_mixes(const shd_color_transform *transform);

/* The transform straight to integer codes 0..max (255 or 65535). NULL if it has to go through
 * floats, because its channels mix, its curves do not only rise, or there are no tables yet.
 * `pixels` is how many the caller is about to convert: tables are made once the pixels asked for
 * would have cost as much. One caller makes them, while go_on(context) is true (NULL: always), and
 * the others do not wait for it; what was not finished is begun anew by a later one. Borrowed; kept
 * with the transform. Any thread. */
const shd_color_codes *shd_color_codes_of(const shd_color_transform *transform, unsigned max,
                                          size_t pixels, shd_color_go_on *go_on,
                                          const void *context);

typedef struct shd_encoded {
    uint64_t beyond;  /* of the 3 x count converted values: not finite */
    uint64_t clipped; /* color samples whose value is more than half a code beyond 0..max */
} shd_encoded;

/* Writes the samples of `count` RGBA pixels. `out` is [count][samples], of uint8_t, or of uint16_t
 * if the codes' max is 65535. Sample s holds channel source[s]: 0..2 are converted, 3 is alpha as
 * it is. The codes are those of shd_color_apply's floats, for every finite input and with every
 * variant `isa`; not-a-number and values beyond 0..1 are held as in base/sample.h. Any thread. */
shd_encoded shd_color_encode(const shd_color_codes *codes, shd_isa isa, const float *rgba,
                             size_t count, const int source[], int samples, void *out);

/* The same from planes: rgb is [3][count], alpha is [count], or NULL if all is opaque. The pixels
 * go to `out` in rows of `width` > 0 pixels, whose first ones are `pitch` >= width pixels apart.
 * Nothing else is written, so that threads may fill a picture together. */
shd_encoded shd_color_encode_planes(const shd_color_codes *codes, shd_isa isa,
                                    const float *const rgb[3], const float *alpha, size_t count,
                                    const int source[], int samples, size_t width, size_t pitch,
                                    void *out);

#ifdef __cplusplus
}
#endif
