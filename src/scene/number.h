/* Numbers as JSON writes them, to doubles. Only for scene/. Pure function, any thread. */
#pragma once

/* Reads the number that begins at `text` and ends before `end` at the latest. `out` is the nearest
 * double, and the even one of two that are equally near: strtod finds the same in the C locale,
 * this function in any locale. Returns where the number ends. NULL: the text is no number of JSON
 * (RFC 8259, section 6), it is beyond a double's range, or memory is short. */
const char *shd_number_read(const char *text, const char *end, double *out);

/* The same of the most common numbers, fast: with no more than seven digits before the point, some
 * fifteen in all, and no exponent. NULL: it is another one, or none, or the end is near. */
const char *shd_number_read_plain(const char *text, const char *end, double *out);
