/* What documents may name: the spaces and displays of the color configuration, and the materials of
 * the library, for the scene reader and for clients. Owned by the color configuration, constant,
 * shared by threads. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/transfer.h"

/* What the three channels of a space are called. */
typedef enum shd_channels { SHD_RGB, SHD_XYZ, SHD_YIQ, SHD_HSV, SHD_LAB, SHD_LCH } shd_channels;

/* What the values of a space or a view are. */
typedef enum shd_holds { SHD_HOLDS_CODES, SHD_HOLDS_LIGHT, SHD_HOLDS_DATA } shd_holds;

typedef struct shd_space_info shd_space_info;
struct shd_space_info {
    const char *name;
    const char *description; /* one line, may be "" */
    shd_channels channels;
    bool scene_linear;          /* whether colors may be shaded in it */
    const char *const *aliases; /* [alias_count]: other names of it, roles among them */
    size_t alias_count;
    shd_holds holds;
    const shd_space_info *file; /* what integers store of it, "NAME file"; NULL: itself */
};

typedef struct shd_display_info {
    const char *name;
    const char *const *views;
    size_t view_count;
    const shd_holds *holds; /* [view_count] */
} shd_display_info;

typedef struct shd_look_info {
    const char *name;
    const char *description; /* one line, may be "" */
} shd_look_info;

/* What is done to light beside converting it. */
typedef struct shd_adjust {
    double exposure;   /* stops, in linear light before looks and the conversion */
    const char *looks; /* NULL: what a view has; else names with newlines between, "" is none */
    double gamma;      /* > 0: converted values are raised to 1/gamma */
} shd_adjust;

static inline bool shd_adjusts(const shd_adjust *adjust) {
    return adjust->exposure != 0 || adjust->looks || adjust->gamma != 1;
}

typedef struct shd_catalog {
    const shd_space_info *spaces;
    size_t space_count;
    const shd_look_info *looks;
    size_t look_count;
    const shd_display_info *displays; /* the first is the default, as is its first view */
    size_t display_count;
    const shd_space_info *scene_linear; /* the role's space: the default working space */
    const shd_space_info *colors; /* the default of `colorSpace`: lin_rec709, or scene_linear */
    const shd_space_info *css;    /* the space of "#rrggbb"; NULL if there is none */
    const shd_space_info *rec709; /* linear Rec.709, of CSS's other colors; NULL: none */

    /* Gives the materials that documents may name (scene/scene.h), which others own, and reads them
     * if they were not asked for before. NULL: memory is short. Any thread. `library` NULL: there
     * are none. */
    const struct shd_library *(*library)(const struct shd_catalog *catalog);

    /* Converts one color in place between two spaces by name, to f32 accuracy: bit for bit if the
     * spaces are the same, and from sRGB to linear Rec.709 by IEC 61966-2-1 in f64. `self` is the
     * first argument. Any thread. */
    shd_status (*convert)(const void *self, const char *from, const char *to, double rgb[3],
                          shd_error *error);
    const void *self;
} shd_catalog;

/* By name or, if none is that, by alias; in any case, as in OpenColorIO. NULL: unknown. */
SHD_C const shd_space_info *shd_catalog_space(const shd_catalog *catalog, const char *name);

/* By exact name; NULL if it is unknown. */
SHD_C const shd_display_info *shd_catalog_display(const shd_catalog *catalog, const char *name);

/* The names of the three channels: "R", "Y", "H", ... */
const char *const *shd_channel_names(shd_channels channels);
