/* Numbers as JSON writes them, to doubles. Inside of scene/. Pure, any thread. */
#ifndef SHD_SCENE_NUMBER_H
#define SHD_SCENE_NUMBER_H

/* Reads the number that begins at `text` and ends before `end` at the latest: `out` is the double
 * nearest to it, of two the even one, as strtod finds it in the C locale, in any locale. Returns
 * where it ends; NULL: it is no number of JSON (RFC 8259, section 6), it is beyond a double's
 * range, or memory is short. */
const char *shd_number_read(const char *text, const char *end, double *out);

#endif
