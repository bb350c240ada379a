/* The sample pattern. */
#ifndef SHD_BASE_PATTERN_H
#define SHD_BASE_PATTERN_H

/* Where the sample pattern's ray i of n goes through the pixel, in [0,1)^2 from its top left:
 * the Hammersley set x = (i + 1/2)/n, y = van der Corput in base 2 of i, plus half of its
 * spacing. One sample goes through the centre, four are a rotated grid. */
void shd_sample_offset(int i, int n, double *x, double *y);

#endif
