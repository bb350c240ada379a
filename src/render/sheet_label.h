/* The lines of a cell's label. Pure functions, any thread. */
#pragma once

#include <stddef.h>

enum { SHD_LABEL_LINES = 4, SHD_LABEL_SIZE = 160 }; /* lines at most, and bytes of one */

/* Breaks a text, which may have line feeds, at its blanks into lines that are no wider than `width`
 * pixels in a font of `size`. What does not fit is cut, and ends in three points. Returns how many
 * lines there are. */
size_t shd_label_break(const char *text, double size, double width,
                       char lines[SHD_LABEL_LINES][SHD_LABEL_SIZE]);
