#include "base/status.h"

#include <stdarg.h>
#include <stdio.h>

const char *const shd_limit_names[SHD_LIMIT_COUNT] = {
    [SHD_LIMIT_NONE] = "none",
    [SHD_LIMIT_BODY] = "body",
    [SHD_LIMIT_PIXELS] = "pixels",
    [SHD_LIMIT_SAMPLES] = "samples",
    [SHD_LIMIT_LIGHTS] = "lights",
    [SHD_LIMIT_OBJECTS] = "objects",
    [SHD_LIMIT_TRIANGLES] = "triangles",
    [SHD_LIMIT_LIGHT_SAMPLES] = "light-samples",
    [SHD_LIMIT_OBJECT_LIGHTS] = "object-lights",
    [SHD_LIMIT_WORK] = "work",
    [SHD_LIMIT_MEMORY] = "memory",
    [SHD_LIMIT_QUEUE] = "queue",
    [SHD_LIMIT_TIMEOUT] = "timeout",
    [SHD_LIMIT_CONNECTIONS_EACH] = "connections-each",
    [SHD_LIMIT_MESH_STORE] = "mesh-store",
    [SHD_LIMIT_RATE] = "rate",
};

shd_status shd_fail(shd_error *error, shd_status status, const char *path, const char *format,
                    ...) {
    if (!error) return status;
    error->status = status;
    error->limit = status == SHD_MEMORY ? SHD_LIMIT_MEMORY : SHD_LIMIT_NONE;
    snprintf(error->path, sizeof error->path, "%s", path ? path : "");
    va_list args;
    va_start(args, format);
    vsnprintf(error->text, sizeof error->text, format, args);
    va_end(args);
    return status;
}

shd_status shd_fail_limit(shd_error *error, shd_limit limit) {
    if (error) error->limit = limit;
    return SHD_LIMIT;
}
