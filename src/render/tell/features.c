#include "render/tell/features.h"

#include <string.h>

#include "assets/store.h"
#include "base/cpu.h"
#include "base/scope.h"
#include "scene/scene.h"
#include "shaded.h"

/* What every build of this version has, if it is not told to keep nothing. Of each:
 * tests/e2e/features_test.py asks for it. */
/* clang-format off */
static const char *const names[] = {
    "analyze",
    "assets",
    "batch",
    "bound-layer",
    "brdf",
    "budget",
    "codec-budget",
    "compare",
    "css-colors",
    "diff",
    "explain",
    "fit",
    "fresnel-patterns",
    "gloss-patterns",
    "layers",
    "links",
    "meshes",
    "normal-maps",
    "normal-patterns",
    "opacity",
    "outputs",
    "patterns",
    "preview",
    "region",
    "scenes",
    "shared-meshes",
    "sheet",
    "spectral",
    "specular-antialiasing",
    "sweep",
    "textures",
    "trace",
    "turntable",
};
/* clang-format on */

/* Whether it has nowhere to keep what the feature stands for. */
static bool is_off(const shd_engine *engine, const char *name) {
    if (shd_store_load_of(engine->store).cap) return false;
    return !strcmp(name, "meshes") || (!strcmp(name, "scenes") && !engine->scenes_elsewhere) ||
           ((!strcmp(name, "assets") || !strcmp(name, "textures") ||
             !strcmp(name, "normal-maps")) &&
            !engine->assets);
}

static void tell_group(json_t *list, const char *group, const char *const *members) {
    for (; *members; members++) json_array_append_new(list, json_sprintf("%s.%s", group, *members));
}

/* "ocio.2.1" of "OpenColorIO 2.1.2|OpenImageIO ...": what its own transforms depend on. */
static void tell_ocio(json_t *list) {
    const char *name = "OpenColorIO ", *found = strstr(SHADED_LIBRARIES, name);
    const char *version = found ? found + strlen(name) : "";
    size_t length = strcspn(version, ".");
    if (version[length] == '.') length += 1 + strspn(version + length + 1, "0123456789");
    if (length > 2) json_array_append_new(list, json_sprintf("ocio.%.*s", (int)length, version));
}

json_t *shd_tell_features(const shd_engine *engine) {
    json_t *list = json_array();
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!is_off(engine, names[i])) json_array_append_new(list, json_string(names[i]));
    for (int f = 0; f < SHD_FORMAT_COUNT; f++)
        if (shd_writes((shd_format)f))
            json_array_append_new(list,
                                  json_sprintf("format.%s", shd_format_get((shd_format)f)->name));
    for (int isa = 0; isa < SHD_ISA_COUNT; isa++)
        if (shd_cpu_has((shd_isa)isa))
            json_array_append_new(list, json_sprintf("kernel.%s", shd_isa_name((shd_isa)isa)));
    tell_group(list, "light", shd_light_names);
    tell_group(list, "model", shd_model_names);
    for (int s = 1; s < SHD_SCOPE_COUNT; s++)
        json_array_append_new(list, json_sprintf("scope.%s", shd_scope_names[s]));
    tell_ocio(list);
    return list;
}
