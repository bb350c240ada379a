#include "base/status.h"

#include <stdarg.h>
#include <stdio.h>

shd_status shd_fail(shd_error *error, shd_status status, const char *path, const char *format,
                    ...) {
    if (!error) return status;
    error->status = status;
    snprintf(error->path, sizeof error->path, "%s", path ? path : "");
    va_list args;
    va_start(args, format);
    vsnprintf(error->text, sizeof error->text, format, args);
    va_end(args);
    return status;
}
