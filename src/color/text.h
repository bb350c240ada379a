/* Names and descriptions of the operator's file, which end up in JSON. */
#pragma once

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Whether a text is UTF-8 (base/utf8.h) without control characters other than white space. */
bool shd_color_is_text(const char *text);

#ifdef __cplusplus
}
#endif
