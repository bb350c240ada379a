/* A small color configuration made by hand, so that the reader's tests need no OpenColorIO.
 *
 * "wide" is scene-linear and its numbers are those of lin_rec709 halved; "sRGB" is the square
 * root of lin_rec709: easy to follow by eye, and no conversion is the identity by accident. */
#ifndef SHD_TEST_SCENE_CATALOG_H
#define SHD_TEST_SCENE_CATALOG_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/catalog.h"
#include "scene/scene.h"

static double scene_catalog_decode(const char *space, double v) {
    if (!strcmp(space, "wide")) return v * 2;
    return strcmp(space, "sRGB") ? v : v * v;
}

static double scene_catalog_encode(const char *space, double v) {
    if (!strcmp(space, "wide")) return v / 2;
    return strcmp(space, "sRGB") ? v : sqrt(v);
}

static shd_status scene_catalog_convert(const void *self, const char *from, const char *to,
                                        double rgb[3], shd_error *error) {
    (void)self;
    if (!strcmp(from, "raw"))
        return shd_fail(error, SHD_SCENE, "", "raw has no meaning as a color");
    for (int c = 0; c < 3; c++)
        rgb[c] = (float)scene_catalog_encode(to, scene_catalog_decode(from, rgb[c]));
    return SHD_OK;
}

static const char *const scene_aliases[] = {"lin_wide", "rendering"};

static const shd_space_info scene_spaces[] = {
    {"lin_rec709", "", SHD_RGB, true, NULL, 0, SHD_HOLDS_LIGHT, NULL},
    {"wide", "", SHD_RGB, true, scene_aliases, 2, SHD_HOLDS_LIGHT, NULL},
    {"sRGB", "", SHD_RGB, false, NULL, 0, SHD_HOLDS_CODES, NULL},
    {"raw", "", SHD_RGB, false, NULL, 0, SHD_HOLDS_DATA, NULL},
    {"YIQ", "", SHD_YIQ, false, NULL, 0, SHD_HOLDS_CODES, NULL},
    {"HSV", "", SHD_HSV, false, NULL, 0, SHD_HOLDS_CODES, NULL}};

static const char *const scene_views[] = {"Standard", "ACES 1.0 - SDR Video", "Raw"};

static const shd_holds scene_holds[] = {SHD_HOLDS_CODES, SHD_HOLDS_CODES, SHD_HOLDS_DATA};

static const shd_display_info scene_displays[] = {{"sRGB", scene_views, 3, scene_holds},
                                                  {"Rec.1886", scene_views, 2, scene_holds}};

static shd_catalog scene_catalog = {.spaces = scene_spaces,
                                    .space_count = 6,
                                    .displays = scene_displays,
                                    .display_count = 2,
                                    .scene_linear = &scene_spaces[0],
                                    .colors = &scene_spaces[0],
                                    .css = &scene_spaces[2],
                                    .rec709 = &scene_spaces[0],
                                    .convert = scene_catalog_convert};

static const shd_library *scene_library;

static const shd_library *scene_catalog_library(const shd_catalog *catalog) {
    (void)catalog;
    return scene_library;
}

/* Before main: the library is as const as the rest. */
__attribute__((constructor)) static void scene_catalog_take_library(void) {
    shd_library *library = NULL;
    shd_error error;
    if (shd_library_new(&scene_catalog, &library, &error)) {
        fprintf(stderr, "%s\n", error.text);
        abort();
    }
    scene_library = library;
    scene_catalog.library = scene_catalog_library;
}

#endif
