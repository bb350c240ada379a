/* Names and descriptions that come from the operator's file end up in JSON. */
#ifndef SHD_COLOR_TEXT_H
#define SHD_COLOR_TEXT_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Whether a text is well-formed UTF-8 (RFC 3629: no overlong forms, surrogates, or code points
 * beyond U+10FFFF) without control characters other than white space. */
bool shd_color_is_text(const char *text);

#ifdef __cplusplus
}
#endif
#endif
