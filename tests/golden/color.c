/* The spaces of config/shaded.ocio against their published definitions, in double precision. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "color/color.h"

#define COUNT(a) (sizeof(a) / sizeof *(a))

static shd_color_config *config;
static shd_color_lease *lease; /* of all transforms */

static int load(void **state) {
    (void)state;
    return shd_color_config_load(NULL, &config, NULL) != SHD_OK;
}

static int drop(void **state) {
    (void)state;
    shd_color_lease_drop(lease);
    shd_color_config_drop(config);
    return 0;
}

/* `rgb` converted from one space to another. */
static void to_space(const char *from, const char *to, const float rgb[3], float out[4]) {
    const shd_color_transform *transform;
    assert_int_equal(shd_color_to_space(config, from, to, &lease, &transform, NULL), SHD_OK);
    memcpy(out, rgb, 3 * sizeof *rgb);
    out[3] = 1;
    shd_color_apply(transform, out, 1);
}

static void to_view(const char *display, const char *view, const float rgb[3], float out[4]) {
    const shd_color_transform *transform;
    assert_int_equal(
        shd_color_to_view(config, "lin_rec709", display, view, &lease, &transform, NULL), SHD_OK);
    memcpy(out, rgb, 3 * sizeof *rgb);
    out[3] = 1;
    shd_color_apply(transform, out, 1);
}

static void close_to(const float got[3], const double want[3], double relative, double absolute) {
    for (int i = 0; i < 3; i++)
        if (!(fabs((double)got[i] - want[i]) <= absolute + relative * fabs(want[i])))
            fail_msg("channel %d is %.9g, not %.9g", i, (double)got[i], want[i]);
}

/* IEC 61966-2-1:1999, section 5.2; below 0 the linear segment goes on. */
static double iec_srgb(double x) {
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

static double iec_linear(double v) {
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static const float colors[][3] = {
    {1, 0, 0},   {0, 1, 0},           {0, 0, 1},       {1, 1, 0},         {0, 1, 1},
    {1, 0, 1},   {0.18f, .18f, .18f}, {1, 1, 1},       {.5f, .25f, 1},    {.001f, .002f, .003f},
    {3, 1, .2f}, {.2f, 12, 100},      {1e-6f, 1, .5f}, {.9f, .91f, .92f},
};

static void srgb_is_the_iec_curve(void **state) {
    (void)state;
    /* Six roundings of a float. */
    for (double x = 1e-30; x < 1e5; x *= 1.001) {
        const float in[3] = {(float)x, (float)x, (float)x};
        float out[4], same[4];
        to_view("sRGB", "Standard", in, out);
        double want = iec_srgb((double)in[0]);
        close_to(out, (double[3]){want, want, want}, 3.6e-7, 0);
        to_space("lin_rec709", "sRGB", in, same);
        assert_memory_equal(out, same, sizeof out);
    }
}

static void srgb_s_pieces_meet_where_iec_says(void **state) {
    (void)state;
    /* Every float around the two breaks, OpenColorIO's (0.0030399) and IEC's. At the latter IEC's
     * pieces leave a gap of 2.9e-8, which a curve that rises has to close on one side. */
    static float pixels[1 << 20];
    size_t count = 0;
    for (float x = 0.003f; x < 0.0032f; x = nextafterf(x, 1)) {
        assert_true(count < COUNT(pixels));
        pixels[count++] = x;
    }
    count -= count % 4;
    const shd_color_transform *srgb;
    assert_int_equal(shd_color_to_space(config, "lin_rec709", "sRGB", &lease, &srgb, NULL), SHD_OK);
    shd_color_apply(srgb, pixels, count / 4);
    float x = 0.003f, before = 0;
    for (size_t i = 0; i < count; i++, x = nextafterf(x, 1)) {
        if (i % 4 == 3) continue; /* alpha */
        double want = iec_srgb((double)x);
        bool gap = x > 0.0031307f && x < 0.003131f;
        if (!(fabs((double)pixels[i] - want) <= 3.6e-7 * want + (gap ? 2.9e-8 : 0)))
            fail_msg("%.9g becomes %.9g, not %.9g", (double)x, (double)pixels[i], want);
        assert_true(pixels[i] >= before);
        before = pixels[i];
    }
}

static void srgb_comes_back_by_the_iec_curve(void **state) {
    (void)state;
    /* The power doubles what the roundings before it leave. */
    for (double v = 1e-30; v < 120; v *= 1.001) {
        const float in[3] = {(float)v, (float)-v, (float)v};
        float out[4];
        to_space("sRGB", "lin_rec709", in, out);
        double want = iec_linear((double)in[0]);
        close_to(out, (double[3]){want, (double)in[1] / 12.92, want}, 8e-7, 0);
    }
}

static void srgb_codes_are_the_iec_curve_s(void **state) {
    (void)state;
    /* All 16-bit linear values at 8 bits: another code only where the exact value lies between
     * two codes to within the error above. */
    for (int i = 0; i < 65536; i++) {
        const float in[3] = {(float)i / 65535, (float)i / 65535, (float)i / 65535};
        float out[4];
        to_space("lin_rec709", "sRGB", in, out);
        double want = iec_srgb((double)in[0]) * 255 + 0.5, got = (double)out[0] * 255 + 0.5;
        if (floor(want) != floor(got)) assert_true(fabs(want - round(want)) < 255 * 3.6e-7);
    }
}

static void negative_light_follows_the_linear_segment(void **state) {
    (void)state;
    for (double x = 1e-30; x < 1e30; x *= 1.1) {
        const float in[3] = {(float)-x, (float)-x, (float)(-x / 3)};
        float out[4];
        to_space("lin_rec709", "sRGB", in, out);
        const double want[3] = {12.92 * (double)in[0], 12.92 * (double)in[1],
                                12.92 * (double)in[2]};
        close_to(out, want, 2e-7, 0);
    }
}

static void rec1886_is_gamma_2_4_and_mirrors(void **state) {
    (void)state;
    for (size_t i = 0; i < COUNT(colors); i++) {
        float out[4];
        double want[3];
        for (int c = 0; c < 3; c++) want[c] = pow((double)colors[i][c], 1 / 2.4);
        to_view("Rec.1886", "Standard", colors[i], out);
        close_to(out, want, 4e-7, 0);
        const float negative[3] = {-colors[i][0], -colors[i][1], -colors[i][2]};
        for (int c = 0; c < 3; c++) want[c] = -want[c];
        to_view("Rec.1886", "Standard", negative, out);
        close_to(out, want, 4e-7, 0);
    }
}

static void display_p3_is_the_published_matrix_and_the_srgb_curve(void **state) {
    (void)state;
    /* CSS Color Module Level 4, sample code: lin_sRGB_to_XYZ, then XYZ_to_lin_P3, multiplied. */
    static const double m[3][3] = {{0.82246197, 0.17753803, 0},
                                   {0.03319420, 0.96680580, 0},
                                   {0.01708263, 0.07239744, 0.91051993}};
    for (size_t i = 0; i < COUNT(colors); i++) {
        float out[4];
        double want[3];
        for (int r = 0; r < 3; r++)
            want[r] = iec_srgb(m[r][0] * (double)colors[i][0] + m[r][1] * (double)colors[i][1] +
                               m[r][2] * (double)colors[i][2]);
        to_view("Display P3", "Standard", colors[i], out);
        close_to(out, want, 3e-7, 1e-7);
    }
}

/* [space][row][column] to linear Rec.709. AP1: Academy TB-2014-012 gives the primaries, the
 * Bradford-adapted matrix is the one of ACES' CTL; AP1 to AP0: Academy S-2014-004, section 4. */
static const double ap1_to_rec709[3][3] = {{1.7050509927, -0.6217921207, -0.0832588720},
                                           {-0.1302564175, 1.1408047366, -0.0105483191},
                                           {-0.0240033568, -0.1289689761, 1.1529723329}};
static const double ap1_to_ap0[3][3] = {{0.6954522414, 0.1406786965, 0.1638690622},
                                        {0.0447945634, 0.8596711185, 0.0955343182},
                                        {-0.0055258826, 0.0040252103, 1.0015006723}};

static void matrix_matches(const char *from, const char *to, const double m[3][3]) {
    for (size_t i = 0; i < COUNT(colors); i++) {
        float out[4];
        double want[3], size = 0;
        for (int r = 0; r < 3; r++) {
            want[r] = m[r][0] * (double)colors[i][0] + m[r][1] * (double)colors[i][1] +
                      m[r][2] * (double)colors[i][2];
            size = fmax(size, (double)colors[i][r]);
        }
        to_space(from, to, colors[i], out);
        close_to(out, want, 0, 4e-7 * size);
    }
}

static void aces_matrices_are_the_published_ones(void **state) {
    (void)state;
    matrix_matches("ACEScg", "lin_rec709", ap1_to_rec709);
    matrix_matches("ACEScg", "ACES2065-1", ap1_to_ap0);
}

static void aces_sdr_puts_middle_grey_where_aces_says(void **state) {
    (void)state;
    /* The ACES 1 tone scale takes 0.18 to 4.8 of 48 cd/m2, black being 0.02; the dim surround
     * raises to 0.9811; the display is gamma 2.4 (ACES CTL, SDR video output transform). */
    double grey = pow((4.8 - 0.02) / (48 - 0.02), 0.9811);
    double want[3] = {pow(grey, 1 / 2.4), pow(grey, 1 / 2.4), pow(grey, 1 / 2.4)};
    float out[4];
    to_view("Rec.1886", "ACES 1.0 - SDR Video", (const float[3]){.18f, .18f, .18f}, out);
    close_to(out, want, 1e-4, 0);
    for (int c = 0; c < 3; c++) want[c] = iec_srgb(grey);
    to_view("sRGB", "ACES 1.0 - SDR Video", (const float[3]){.18f, .18f, .18f}, out);
    close_to(out, want, 1e-4, 0);
    to_view("Display P3", "ACES 1.0 - SDR Video", (const float[3]){.18f, .18f, .18f}, out);
    close_to(out, want, 1e-4, 0);
}

static void displays_have_the_iec_curve_in_the_dark(void **state) {
    (void)state;
    /* The same tone scale on three displays: Rec.1886 undone gives the light that sRGB encodes,
     * and greys are the same in P3. Powers there and back, and the matrices before them. */
    for (float x = 1e-4f; x < 0.3f; x *= 1.01f) {
        const float in[3] = {x, x, x};
        float video[4], out[4];
        double want[3];
        to_view("Rec.1886", "ACES 1.0 - SDR Video", in, video);
        for (int c = 0; c < 3; c++) want[c] = iec_srgb(pow((double)video[c], 2.4));
        to_view("sRGB", "ACES 1.0 - SDR Video", in, out);
        close_to(out, want, 2e-6, 0);
        to_view("Display P3", "ACES 1.0 - SDR Video", in, out);
        close_to(out, want, 1e-5, 0);
    }
}

/* The model's matrix (NTSC's, rounded to two digits). */
static void yiq(const double in[3], double out[3]) {
    static const double m[3][3] = {{.30, .59, .11}, {.60, -.28, -.32}, {.21, -.52, .31}};
    for (int r = 0; r < 3; r++) out[r] = m[r][0] * in[0] + m[r][1] * in[1] + m[r][2] * in[2];
}

/* Hexcone model, A. R. Smith, "Color Gamut Transform Pairs", SIGGRAPH 1978; negatives are 0. */
static void hsv(const double in[3], double out[3]) {
    double r = fmax(in[0], 0), g = fmax(in[1], 0), b = fmax(in[2], 0);
    double high = fmax(r, fmax(g, b)), chroma = high - fmin(r, fmin(g, b)), hue = 0;
    if (chroma > 0) {
        hue = r == high   ? (g - b) / chroma
              : g == high ? (b - r) / chroma + 2
                          : (r - g) / chroma + 4;
        if (hue < 0) hue += 6;
    }
    out[0] = hue / 6;
    out[1] = high > 0 ? chroma / high : 0;
    out[2] = high;
}

static const float signed_colors[][3] = {
    {-1, -2, -3}, {-.1f, .5f, 2}, {1, -1, .5f}, {.25f, .25f, -4}, {-1e-6f, 1e-3f, 0}};

static void check_encoded(const char *space, void (*convert)(const double[3], double[3]),
                          double (*curve)(double), const float rgb[3]) {
    double encoded[3], want[3], size = 1;
    for (int c = 0; c < 3; c++) {
        encoded[c] = curve ? curve((double)rgb[c]) : (double)rgb[c];
        size = fmax(size, fabs(encoded[c]));
    }
    convert(encoded, want);
    float out[4];
    to_space("lin_rec709", space, rgb, out);
    close_to(out, want, 0, 6e-7 * size);
}

static void yiq_and_hsv_are_the_definitions(void **state) {
    (void)state;
    for (size_t i = 0; i < COUNT(colors) + COUNT(signed_colors); i++) {
        const float *rgb = i < COUNT(colors) ? colors[i] : signed_colors[i - COUNT(colors)];
        check_encoded("YIQ", yiq, iec_srgb, rgb);
        check_encoded("YIQ linear", yiq, NULL, rgb);
        /* The hue of nearly grey colors magnifies the curve's rounding. */
        if (rgb[0] == .9f) continue;
        check_encoded("HSV", hsv, iec_srgb, rgb);
        check_encoded("HSV linear", hsv, NULL, rgb);
    }
}

static void primaries_and_secondaries_have_the_hues_of_the_hexcone(void **state) {
    (void)state;
    static const double hues[] = {0, 2. / 6, 4. / 6, 1. / 6, 3. / 6, 5. / 6};
    for (int i = 0; i < 6; i++)
        for (int encoded = 0; encoded < 2; encoded++) {
            float out[4];
            to_space("lin_rec709", encoded ? "HSV" : "HSV linear", colors[i], out);
            close_to(out, (const double[3]){hues[i], 1, 1}, 0, 1.2e-7);
        }
}

static void greys_have_no_hue_and_no_saturation(void **state) {
    (void)state;
    for (double x = 1e-9; x < 1e9; x *= 1.07) {
        const float grey[3] = {(float)x, (float)x, (float)x};
        float out[4];
        for (int encoded = 0; encoded < 2; encoded++) {
            to_space("lin_rec709", encoded ? "HSV" : "HSV linear", grey, out);
            assert_true(out[0] == 0 && out[1] == 0 && out[2] > 0);
            /* The rows of I and Q sum to 0; as floats, to a few roundings of 0.6. */
            to_space("lin_rec709", encoded ? "YIQ" : "YIQ linear", grey, out);
            assert_true(fabsf(out[1]) <= 1.2e-7f * out[0] && fabsf(out[2]) <= 1.2e-7f * out[0]);
        }
    }
}

/* White is (1,1,1) in both spaces, but float matrices leave a grey's channels some ulps apart. */
static void greys_of_other_working_spaces_have_no_hue(void **state) {
    (void)state;
    static const char *const from[] = {"ACEScg", "ACES2065-1"};
    for (size_t i = 0; i < 2 * COUNT(from); i++) {
        for (int step = 1; step < 500; step++) {
            float x = (float)step / 400, grey[3] = {x, x, x}, out[4];
            to_space(from[i / 2], i % 2 ? "HSV" : "HSV linear", grey, out);
            assert_true(out[0] == 0 && out[1] == 0);
        }
    }
}

static void black_is_zero_and_negatives_are_black_in_hsv(void **state) {
    (void)state;
    static const char *const spaces[] = {"HSV",      "HSV linear", "YIQ",    "YIQ linear", "sRGB",
                                         "Rec.1886", "Display P3", "ACEScg", "ACES2065-1"};
    for (size_t i = 0; i < COUNT(spaces); i++) {
        float out[4];
        to_space("lin_rec709", spaces[i], (const float[3]){0, 0, 0}, out);
        assert_true(out[0] == 0 && out[1] == 0 && out[2] == 0);
    }
    for (int encoded = 0; encoded < 2; encoded++) {
        float out[4];
        to_space("lin_rec709", encoded ? "HSV" : "HSV linear", (const float[3]){-1, -.5f, -2}, out);
        assert_true(out[0] == 0 && out[1] == 0 && out[2] == 0);
    }
}

static void values_above_one_survive(void **state) {
    (void)state;
    float out[4];
    to_space("lin_rec709", "HSV linear", (const float[3]){8, 4, 2}, out);
    close_to(out, (const double[3]){2. / 6 / 6, 0.75, 8}, 2e-7, 0);
    to_view("sRGB", "Standard", (const float[3]){1000, 10, 2}, out);
    assert_true(out[0] > 18 && out[1] > 2 && out[2] > 1);
}

static void hues_stay_below_one(void **state) {
    (void)state;
    for (int exponent = 1; exponent < 30; exponent++) {
        float out[4];
        to_space("lin_rec709", "HSV linear", (const float[3]){1, 0, ldexpf(1, -exponent)}, out);
        assert_true(out[0] > 0.8f && out[0] < 1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(srgb_is_the_iec_curve),
        cmocka_unit_test(srgb_s_pieces_meet_where_iec_says),
        cmocka_unit_test(srgb_comes_back_by_the_iec_curve),
        cmocka_unit_test(srgb_codes_are_the_iec_curve_s),
        cmocka_unit_test(negative_light_follows_the_linear_segment),
        cmocka_unit_test(rec1886_is_gamma_2_4_and_mirrors),
        cmocka_unit_test(display_p3_is_the_published_matrix_and_the_srgb_curve),
        cmocka_unit_test(aces_matrices_are_the_published_ones),
        cmocka_unit_test(aces_sdr_puts_middle_grey_where_aces_says),
        cmocka_unit_test(displays_have_the_iec_curve_in_the_dark),
        cmocka_unit_test(yiq_and_hsv_are_the_definitions),
        cmocka_unit_test(primaries_and_secondaries_have_the_hues_of_the_hexcone),
        cmocka_unit_test(greys_have_no_hue_and_no_saturation),
        cmocka_unit_test(greys_of_other_working_spaces_have_no_hue),
        cmocka_unit_test(black_is_zero_and_negatives_are_black_in_hsv),
        cmocka_unit_test(values_above_one_survive),
        cmocka_unit_test(hues_stay_below_one),
    };
    return cmocka_run_group_tests(tests, load, drop);
}
