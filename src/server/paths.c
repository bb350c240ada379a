#include "paths.h"

#include <stdbool.h>
#include <string.h>

enum { READ = SHD_GET | SHD_HEAD | SHD_OPTIONS, WRITE = SHD_POST | SHD_OPTIONS };

const struct shd_path shd_paths[SHD_ROUTE_COUNT] = {
    [SHD_ROUTE_INDEX] = {"/", READ},
    [SHD_ROUTE_RENDER] = {"/v1/render", WRITE},
    [SHD_ROUTE_PREVIEW] = {"/v1/preview/{material}", READ},
    [SHD_ROUTE_SCENE] = {"/v1/scene/{document}.{format}", READ},
    [SHD_ROUTE_SCENES] = {"/v1/scenes", SHD_PUT | SHD_OPTIONS},
    [SHD_ROUTE_KEPT] = {"/v1/scenes/{digest}.{format}", READ},
    [SHD_ROUTE_EXPLAIN] = {"/v1/explain", WRITE},
    [SHD_ROUTE_COMPARE] = {"/v1/compare", WRITE},
    [SHD_ROUTE_ANALYZE] = {"/v1/analyze", WRITE},
    [SHD_ROUTE_BRDF] = {"/v1/brdf", WRITE},
    [SHD_ROUTE_DIFF] = {"/v1/diff", WRITE},
    [SHD_ROUTE_FIT] = {"/v1/fit", WRITE},
    [SHD_ROUTE_BATCH] = {"/v1/batch", WRITE},
    [SHD_ROUTE_MESHES] = {"/v1/meshes/{sha256}", SHD_PUT | SHD_OPTIONS},
    [SHD_ROUTE_ASSETS] = {"/v1/assets/{sha256}", SHD_PUT | SHD_OPTIONS},
    [SHD_ROUTE_MATERIALS] = {"/v1/materials", READ},
    [SHD_ROUTE_SHAPES] = {"/v1/shapes", READ},
    [SHD_ROUTE_COLORSPACES] = {"/v1/colorspaces", READ},
    [SHD_ROUTE_VERSION] = {"/v1/version", READ},
    [SHD_ROUTE_OPENAPI] = {"/openapi.yaml", READ},
    [SHD_ROUTE_OPENAPI_JSON] = {"/openapi.json", READ},
    [SHD_ROUTE_SCHEMA] = {"/scene.schema.json", READ},
    [SHD_ROUTE_ELEMENT] = {"/shaded-preview.js", READ},
    [SHD_ROUTE_STUDIO] = {"/studio/{file}", READ},
    [SHD_ROUTE_DOCS] = {"/docs", READ},
    [SHD_ROUTE_PAGE] = {"/docs/{page}", READ},
    [SHD_ROUTE_OTHER] = {"other", 0},
};

const char *const shd_method_names[SHD_METHODS] = {"GET", "HEAD", "POST", "PUT", "OPTIONS"};

shd_method shd_method_find(const char *name) {
    for (size_t i = 0; i < SHD_METHODS; i++)
        if (!strcmp(name, shd_method_names[i])) return (shd_method)(1 << i);
    return SHD_NO_METHOD;
}

void shd_methods_list(unsigned methods, char out[SHD_METHODS_SIZE]) {
    *out = 0;
    for (size_t i = 0; i < SHD_METHODS; i++) {
        if (!(methods & 1 << i)) continue;
        if (*out) strcat(out, ", ");
        strcat(out, shd_method_names[i]);
    }
}

size_t shd_path_fixed(shd_route route) {
    return strcspn(shd_paths[route].path, "{");
}

static bool is_path_of(shd_route route, const char *path) {
    const size_t fixed = shd_path_fixed(route);
    if (!shd_paths[route].path[fixed]) return !strcmp(shd_paths[route].path, path);
    /* "/docs/" is "/docs". */
    const bool is_named = path[0] && strncmp(shd_paths[route].path, path, fixed) == 0 &&
                          (path[fixed] || route == SHD_ROUTE_PAGE);
    return is_named && !strchr(path + fixed, '/');
}

shd_route shd_path_find(const char *path) {
    shd_route route = 0;
    while (route < SHD_ROUTE_OTHER && !is_path_of(route, path)) route++;
    return route;
}
