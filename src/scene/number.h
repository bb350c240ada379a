/* Numbers as JSON writes them, to doubles. Only for scene/. Pure function, any thread. */
#pragma once

#include <stddef.h>

/* Reads the number that begins at `text` and ends before `end` at the latest. `out` is the nearest
 * double, and the even one of two that are equally near: strtod finds the same in the C locale,
 * this function in any locale. Returns where the number ends. NULL: the text is no number of JSON
 * (RFC 8259, section 6), it is beyond a double's range, or memory is short. */
const char *shd_number_read(const char *text, const char *end, double *out);

/* Reads a row of the most common numbers, each of which a comma follows, fast: those with no more
 * than seven digits before the point, some fifteen in all, and no exponent. Space may follow the
 * commas. `read` is how many of `count` were read, and the end of the row is returned: past the
 * last one's comma, where something else begins, or the text's end is near. */
const char *shd_number_read_row(const char *text, const char *end, double *out, size_t count,
                                size_t *read);
