/* The paths of the public port and the methods that they take. */
#pragma once

#include <stddef.h>

typedef enum shd_method {
    SHD_GET = 1,
    SHD_HEAD = 2,
    SHD_POST = 4,
    SHD_PUT = 8,
    SHD_OPTIONS = 16,
    SHD_NO_METHOD = 0 /* any other */
} shd_method;

typedef enum shd_route {
    SHD_ROUTE_INDEX,
    SHD_ROUTE_RENDER,
    SHD_ROUTE_PREVIEW,
    SHD_ROUTE_SCENE,
    SHD_ROUTE_SCENES,
    SHD_ROUTE_KEPT,
    SHD_ROUTE_EXPLAIN,
    SHD_ROUTE_COMPARE,
    SHD_ROUTE_ANALYZE,
    SHD_ROUTE_BRDF,
    SHD_ROUTE_DIFF,
    SHD_ROUTE_FIT,
    SHD_ROUTE_BATCH,
    SHD_ROUTE_MESHES,
    SHD_ROUTE_ASSETS,
    SHD_ROUTE_MATERIALS,
    SHD_ROUTE_SHAPES,
    SHD_ROUTE_COLORSPACES,
    SHD_ROUTE_VERSION,
    SHD_ROUTE_OPENAPI,
    SHD_ROUTE_OPENAPI_JSON,
    SHD_ROUTE_SCHEMA,
    SHD_ROUTE_ELEMENT,
    SHD_ROUTE_STUDIO,
    SHD_ROUTE_DOCS,
    SHD_ROUTE_PAGE,
    SHD_ROUTE_OTHER, /* there is no such path */
    SHD_ROUTE_COUNT
} shd_route;

enum { SHD_METHODS = 5, SHD_METHODS_SIZE = 40 };

extern const char *const shd_method_names[SHD_METHODS]; /* in the order of their bits */

shd_method shd_method_find(const char *name);

/* "GET, HEAD, OPTIONS". */
void shd_methods_list(unsigned methods, char out[SHD_METHODS_SIZE]);

/* By route, shd_method bits. `path` may end in a segment such as "{material}", which stands for
 * any. That of SHD_ROUTE_OTHER is "other". */
extern const struct shd_path {
    const char *path;
    unsigned methods;
} shd_paths[SHD_ROUTE_COUNT];

shd_route shd_path_find(const char *path);

/* The characters of a route's path before the segment that stands for any. */
size_t shd_path_fixed(shd_route route);
