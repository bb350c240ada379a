/* UTF-8 as in RFC 3629. Pure function, any thread. */
#pragma once

#include <stddef.h>
#include <stdint.h>

/* The length, 1 to 4 bytes, of the sequence that `text` begins with, and its code point. 0: it is
 * none, as overlong forms and surrogates are. `text` ends with a 0, which is a sequence itself. */
size_t shd_utf8_decode(const char *text, uint32_t *point);
