/* Colors as CSS writes them. scene_css_test.py compares more of them with arithmetic of its own. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>

#include <cmocka.h>

#include "base/transfer.h"
#include "scene/css.h"

/* Components as sRGB encodes them, beyond [0,1] too. */
static shd_css_color encoded(const char *text) {
    shd_css_color out;
    shd_css_wrong wrong;
    if (!shd_css_read(text, &out, &wrong)) fail_msg("%s: %s%s", text, wrong.text, wrong.name);
    for (int c = 0; c < 3 && out.linear; c++)
        out.rgb[c] = shd_curve_encode(SHD_TRANSFER_SRGB, out.rgb[c]);
    return out;
}

static void assert_color(const char *text, double r, double g, double b, double alpha,
                         double tolerance) {
    const shd_css_color color = encoded(text);
    const double wanted[3] = {r, g, b};
    for (int c = 0; c < 3; c++)
        if (!(fabs(color.rgb[c] - wanted[c]) <= tolerance))
            fail_msg("%s: component %d is %.9g, not %.9g", text, c, color.rgb[c], wanted[c]);
    assert_float_equal(color.alpha, alpha, 0);
}

static void assert_same(const char *text, const char *hex) {
    const shd_css_color color = encoded(text), wanted = encoded(hex);
    if (color.linear || memcmp(color.rgb, wanted.rgb, sizeof color.rgb) ||
        color.alpha != wanted.alpha)
        fail_msg("%s is not %s but %.17g %.17g %.17g / %.17g", text, hex, color.rgb[0],
                 color.rgb[1], color.rgb[2], color.alpha);
}

/* 8-bit sRGB in any spelling is one color, to the bit. */
static void spellings_of_a_color_are_the_same(void **state) {
    (void)state;
    assert_same("#abc", "#aabbcc");
    assert_same("#AbCd", "#aabbccdd");
    assert_same("red", "#f00");
    assert_same("RebeccaPurple", "#663399");
    assert_same(" \t\n\r\f red /**/ ", "#f00");
    assert_same("transparent", "#0000");
    assert_same("rgb(255,0,0)", "#f00");
    assert_same("rgba(18, 52, 86, 1)", "#123456");
    assert_same("RGB(18 52 86)", "#123456");
    assert_same("rgb( 18 52 86 / 100% )", "#123456");
    assert_same("rgb(18 52 86/1)", "#123456");
    assert_same("rgb(20% 40% 60%)", "#369");
    assert_same("rgb(20%,40%,60%,.2)", "#33669933");
    assert_same("rgb(20% 102 60%)", "#369");
    assert_same("rgb(none 102 none / none)", "#00660000");
    assert_same("rgb(+1.8e1 5.2E+1 860e-1)", "#123456");
    assert_same("rgb(018 052 086)", "#123456");
    assert_same("rgb(18/* a */52/**/86)", "#123456");
    assert_same("color(srgb 1 0 0.2)", "#f03");
    assert_same("color(srgb 100% none 20%)", "#f03");
    assert_same("hsl(0 100% 50%)", "#f00");
    assert_same("hsl(0 100 50)", "#f00");
    assert_same("hsla(120deg, 100%, 50%, 100%)", "#0f0");
    assert_same("hsl(none none none)", "#000");
    assert_same("hwb(0 0% 0%)", "#f00");
    assert_same("hwb(77 100 0)", "#fff");
}

/* Numbers need no space between them where a sign or a point begins the next one. */
static void numbers_are_those_of_css(void **state) {
    (void)state;
    assert_color("rgb(.51.255.1)", .51 / 255, .255 / 255, .1 / 255, 1, 0);
    assert_color("rgb(51+51-51)", .2, .2, -.2, 1, 1e-15);
    assert_color("rgb(10%20%30%/40%)", .1, .2, .3, .4, 1e-16);
    assert_color("rgb(1e2 1E-2 0)", 100 / 255.0, .01 / 255, 0, 1, 1e-17);
}

/* What Web Platform Tests call green, rounded to as many digits as are written (5e-5 of what
 * each component spans). */
static void greens_of_all_spaces_are_green(void **state) {
    (void)state;
    static const char *const greens[] = {
        "green",
        "hsl(120 100% 25.098%)",
        "hsl(120deg 100% 25.098%)",
        "hsl(133.3333333grad 100% 25.098%)",
        "hsl(2.0943951rad 100% 25.098%)",
        "hsl(0.33333333turn 100% 25.098%)",
        "hsl(-240 100% 25.098%)",
        "hsl(480 100% 25.098%)",
        "hwb(120 0% 49.8039%)",
        "lab(46.2775% -47.5621 48.5837)",
        "lab(46.2775 -38.04968% 38.86696%)",
        "lch(46.2775% 67.9892 134.3912)",
        "oklab(51.975% -0.1403 0.10768)",
        "oklab(0.51975 -35.075% 26.92%)",
        "oklch(51.975% 0.17686 142.495)",
        "oklch(51.975% 44.215% 142.495deg)",
        "color(srgb 0 0.50196 0)",
        "color(srgb-linear 0 0.21586 0)",
        "color(display-p3 0.21604 0.49418 0.13151)",
        "color(a98-rgb 0.281363 0.498012 0.116746)",
        "color(prophoto-rgb 0.230479 0.395789 0.129968)",
        "color(xyz 0.07719 0.15438 0.02573)",
        "color(xyz-d65 0.07719 0.15438 0.02573)",
        "color(XYZ-D50 0.08312 0.15475 0.02096)",
    };
    for (size_t i = 0; i < sizeof greens / sizeof *greens; i++)
        assert_color(greens[i], 0, 128 / 255.0, 0, 1, 1.5e-3);
}

static void white_is_white_in_all_spaces(void **state) {
    (void)state;
    static const char *const whites[] = {
        "lab(100 0 0)",
        "lch(100% 0 77)",
        "color(display-p3 1 1 1)",
        "color(display-p3-linear 1 1 1)",
        "color(a98-rgb 1 1 1)",
        "color(prophoto-rgb 1 1 1)",
        "color(rec2020 1 1 1)",
        "color(srgb-linear 1 1 1)",
        "hwb(0 100% 0%)",
    };
    for (size_t i = 0; i < sizeof whites / sizeof *whites; i++)
        assert_color(whites[i], 1, 1, 1, 1, 1e-13);
    assert_color("oklab(1 0 0)", 1, 1, 1, 1, 1e-7); /* its matrices have 1e-8 of their own */
}

static void colors_beyond_the_range_stay_what_they_are(void **state) {
    (void)state;
    assert_color("rgb(510 -51 0)", 2, -.2, 0, 1, 1e-15);
    assert_color("rgb(200%, 0%, -100%)", 2, 0, -1, 1, 1e-15);
    assert_color("color(srgb -0.5 1.5 0)", -.5, 1.5, 0, 1, 1e-15);
    assert_color("color(srgb-linear -0.5 0 0)", shd_curve_encode(SHD_TRANSFER_SRGB, -.5), 0, 0, 1,
                 1e-15);
    assert_color("hsl(0 100% 200%)", 1, 3, 3, 1, 1e-15); /* 2 + (2 - 1) (-1, 1, 1) */
    assert_color("hwb(0 60% 60%)", .5, .5, .5, 1, 1e-15);
    /* Display P3's red in sRGB, by matrices of primaries: 1.2249, -0.0421, -0.0196 of light. */
    const shd_css_color p3 = encoded("color(display-p3 1 0 0)");
    assert_true(p3.linear && p3.rgb[0] > 1.09 && p3.rgb[1] < -.22 && p3.rgb[2] < -.14);
}

static void wrong_colors_say_why(void **state) {
    (void)state;
    static const struct {
        const char *text, *why;
    } cases[] = {
        {"", ""},
        {" ", ""},
        {"12", ""},
        {"bl\xc3\xa4u", ""},
        {"nosuch", ""},
        {"red blue", "something stands behind"},
        {"red;", "something stands behind"},
        {"#", "3, 4, 6 or 8 digits"},
        {"#12", "3, 4, 6 or 8 digits"},
        {"#12345", "3, 4, 6 or 8 digits"},
        {"#123456789", "3, 4, 6 or 8 digits"},
        {"#12g", "from a to f"},
        {"# fff", "3, 4, 6 or 8 digits"},
        {"rgb()", "takes three components, got 0"},
        {"rgb(1 2)", "takes three components, got 2"},
        {"hsl(1 2%)", "hsl() takes three components, got 2"},
        {"rgb(1 2 3 4)", "an alpha behind a slash"},
        {"rgb(1,2,3/4)", "an alpha behind a comma"},
        {"rgb(1,2,3,)", "alpha of rgb() is missing"},
        {"rgb(1 2 3 / )", "alpha of rgb() is missing"},
        {"rgb(,1,2)", "red of rgb() is missing"},
        {"rgb(1 2,3)", "between all components, or between none"},
        {"rgb(1,2 3)", "between all components, or between none"},
        {"rgb(1,2%,3)", "all are percentages"},
        {"rgb(1,none,3)", "`none` does not go with commas"},
        {"rgb(1,2,3,none)", "`none` does not go with commas"},
        {"hsl(1,2,3)", "are percentages"},
        {"hwb(1,2%,3%)", "hwb() takes no commas"},
        {"lab(1,2,3)", "lab() takes no commas"},
        {"color(srgb 1,1,1)", "color() takes no commas"},
        {"color(1 1 1)", "color() begins with srgb"},
        {"color(rgb 1 1 1)", "got \"rgb\""},
        {"color(--mine 1 1 1)", "got \"--mine\""},
        {"color(srgb 1 1)", "takes three components, got 2"},
        {"rgb(1 2 3", "the ) of rgb() is missing"},
        {"rgb(1 2 3 / 1", "the ) of rgb() is missing"},
        {"rgb(1 2", "the ) of rgb() is missing"},
        {"rgb (1 2 3)", ""},
        {"rgb(1 2 3))", "something stands behind"},
        {"rgb(1 2 3) x", "something stands behind"},
        {"rgb(1deg 2 3)", "the red takes no unit, got \"deg\""},
        {"rgb(1. 2 3)", "the green of rgb() is missing"},
        {"rgb(0x1 2 3)", "takes no unit, got \"x1\""},
        {"rgb(nan 2 3)", "the red is a number, got \"nan\""},
        {"rgb(1e999 2 3)", "too long or too large"},
        {"hsl(10% 1% 1%)", "the hue is no percentage"},
        {"hsl(10px 1% 1%)", "\"px\" is no unit of an angle"},
        {"hsl(10 -1% 1%)", "the saturation is negative"},
        {"lch(50 -1 1)", "the chroma is negative"},
        {"oklch(50% -1% 1)", "the chroma is negative"},
        {"rgb(1 2 3 / 1.01)", "the alpha is from 0 to 1, got 1.01"},
        {"rgba(1,2,3,-1%)", "the alpha is from 0 to 1, got -0.01"},
        {"rgb(calc(1) 2 3)", "calc() is not taken"},
        {"rgb(from red r g b)", "relative colors"},
        {"color(from red srgb r g b)", "relative colors"},
        {"color-mix(in srgb, red, blue)", "color-mix() is not taken"},
        {"light-dark(red, blue)", "light-dark() is not taken"},
        {"currentcolor", "the color of a text"},
        {"CanvasText", "whatever system"},
        {"rbg(1 2 3)", "no function \"rbg\""},
        {"lab(1e200 1 1)", "too large"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_css_color color = {.alpha = 7};
        shd_css_wrong wrong;
        if (shd_css_read(cases[i].text, &color, &wrong)) fail_msg("%s is taken", cases[i].text);
        if (!strstr(wrong.text, cases[i].why) || (!cases[i].why[0] && wrong.text[0]))
            fail_msg("%s: %s", cases[i].text, wrong.text);
        assert_float_equal(color.alpha, 7, 0);
    }
}

/* A message holds what it quotes, however long that is. */
static void long_texts_are_cut(void **state) {
    (void)state;
    char text[3000];
    static const char *const frames[][2] = {{"", ""},      {"#", ""},       {"rgb(", " 1 1)"},
                                            {"", "(1)"},   {"color(", ")"}, {"rgb(1", " 1 1)"},
                                            {"rgb(", "("}, {"/*", ""},      {"hsl(1", " 1 1)"}};
    static const char letters[] = {'a', '1', ' ', '\xc3', '-'};
    for (size_t i = 0; i < sizeof frames / sizeof *frames; i++)
        for (size_t k = 0; k < sizeof letters; k++) {
            const size_t before = strlen(frames[i][0]);
            strcpy(text, frames[i][0]);
            memset(text + before, letters[k], 2000);
            strcpy(text + before + 2000, frames[i][1]);
            shd_css_color color;
            shd_css_wrong wrong;
            if (shd_css_read(text, &color, &wrong)) continue;
            assert_non_null(memchr(wrong.text, 0, sizeof wrong.text));
            assert_non_null(memchr(wrong.name, 0, sizeof wrong.name));
        }
}

static void names_are_in_order(void **state) {
    (void)state;
    for (size_t i = 1; i < SHD_CSS_NAMES; i++)
        assert_true(strcmp(shd_css_names[i - 1].name, shd_css_names[i].name) < 0);
    for (size_t i = 0; i < SHD_CSS_NAMES; i++)
        assert_ptr_equal(shd_css_find_name(shd_css_names[i].name), &shd_css_names[i]);
    assert_null(shd_css_find_name("transparent"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spellings_of_a_color_are_the_same),
        cmocka_unit_test(numbers_are_those_of_css),
        cmocka_unit_test(greens_of_all_spaces_are_green),
        cmocka_unit_test(white_is_white_in_all_spaces),
        cmocka_unit_test(colors_beyond_the_range_stay_what_they_are),
        cmocka_unit_test(wrong_colors_say_why),
        cmocka_unit_test(long_texts_are_cut),
        cmocka_unit_test(names_are_in_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
