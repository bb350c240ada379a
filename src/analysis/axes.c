#include "analysis/axes.h"

#include <math.h>

void shd_yiq_of(const float rgb[3], double yiq[3]) {
    static const double matrix[3][3] = {{.30, .59, .11}, {.60, -.28, -.32}, {.21, -.52, .31}};
    for (int row = 0; row < 3; row++)
        yiq[row] = matrix[row][0] * (double)rgb[0] + matrix[row][1] * (double)rgb[1] +
                   matrix[row][2] * (double)rgb[2];
}

void shd_hsv_of(const float rgb[3], double hsv[3]) {
    const double r = fmax((double)rgb[0], 0), g = fmax((double)rgb[1], 0),
                 b = fmax((double)rgb[2], 0), most = fmax(r, fmax(g, b)),
                 chroma = most - fmin(r, fmin(g, b));
    double hue = 0;
    if (chroma > 0) {
        if (most == r)
            hue = (g - b) / chroma;
        else if (most == g)
            hue = 2 + (b - r) / chroma;
        else
            hue = 4 + (r - g) / chroma;
    }
    hue = hue < 0 ? hue / 6 + 1 : hue / 6;
    hsv[0] = hue < 1 ? hue : 0;
    hsv[1] = most > 0 ? chroma / most : 0;
    hsv[2] = most;
}
