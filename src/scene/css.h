/* Colors as CSS writes them: CSS Color Module Level 4 (https://www.w3.org/TR/css-color-4/), the
 * text of 2026. Pure functions, any thread.
 *
 * Taken: the 148 names and `transparent`, hexadecimal notation, rgb() and rgba(), hsl() and hsla(),
 * hwb(), lab(), lch(), oklab(), oklch(), and color() with its predefined spaces. Letters count in
 * any case. A missing component (`none`) is 0. Comments may stand where white space may.
 *
 * Not taken, because they depend on more than the text or are of another module: currentcolor and
 * system colors, calc() and the like, color-mix(), relative colors, light-dark(), device-cmyk().
 *
 * CSS holds many components in their ranges: rgb(300 0 0) at 255, a lightness at 100 %. Here they
 * stay what is written, as all numbers of a scene do: an intensity or a color out of gamut. What
 * CSS would hold, and means nothing beyond its range, is refused: an alpha outside of 0 to 1, a
 * negative chroma, a negative saturation. A function that is not closed is refused as well, and
 * names have no escapes. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What components of CSS may be of. */
typedef enum shd_css_space {
    SHD_CSS_SRGB,
    SHD_CSS_SRGB_LINEAR,
    SHD_CSS_DISPLAY_P3,
    SHD_CSS_DISPLAY_P3_LINEAR,
    SHD_CSS_A98_RGB,
    SHD_CSS_PROPHOTO_RGB,
    SHD_CSS_REC2020,
    SHD_CSS_XYZ_D65,
    SHD_CSS_XYZ_D50,
    SHD_CSS_LAB,
    SHD_CSS_OKLAB
} shd_css_space;

typedef struct shd_css_color {
    /* Whether `rgb` is linear: light of the primaries and the white of sRGB, 1 being white, in any
     * range. Otherwise it is encoded as sRGB is, and no component is negative. */
    bool linear;
    double rgb[3]; /* finite */
    double alpha;  /* 0 to 1, 1 if the text has none */
} shd_css_color;

/* Why a text is no color. */
typedef struct shd_css_wrong {
    char text[240]; /* what is wrong with it; "": it is like no color */
    char name[40];  /* "", or the word that is the name of no color */
} shd_css_wrong;

/* Reads a whole text. False: it is no color, and only `wrong` is written. */
bool shd_css_read(const char *text, shd_css_color *out, shd_css_wrong *wrong);

/* Components of a space to what shd_css_color has, by "Sample code for Color Conversions" of that
 * text. SHD_CSS_SRGB stays encoded, unless a component is negative. Results are
 * not finite if they overflow. */
void shd_css_convert(shd_css_space space, const double components[3], shd_css_color *out);

typedef struct shd_css_named {
    const char *name;
    uint32_t rgb; /* 0xrrggbb */
} shd_css_named;

enum { SHD_CSS_NAMES = 148 };

extern const shd_css_named shd_css_names[SHD_CSS_NAMES]; /* in the order of their names */

/* In any case. NULL: there is none of this name. */
const shd_css_named *shd_css_find_name(const char *name);
