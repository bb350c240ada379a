/* An operator's configuration that is wrong stops the start with a reason; it never hangs or
 * crashes. */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/primaries.h"
#include "color/color.h"
#include "color/file.h"
#include "color/text.h"

extern const unsigned char shd_embedded_ocio[];
extern const unsigned long shd_embedded_ocio_size;

static char folder[] = "/tmp/shaded_color_XXXXXX";

static int make_folder(void **state) {
    (void)state;
    return !mkdtemp(folder);
}

static int drop_folder(void **state) {
    (void)state;
    return rmdir(folder);
}

/* Stands before the C library's: the next reads fail with these, up to a 0. */
static int failures[4];

ssize_t read(int file, void *to, size_t size) {
    const int failure = failures[0];
    if (!failure) return syscall(SYS_read, file, to, size);
    memmove(failures, failures + 1, sizeof failures - sizeof failures[0]);
    errno = failure;
    return -1;
}

static const char *path_of(const char *name) {
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_file(const char *name, const char *data, size_t size) {
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
}

/* The embedded configuration with `old` replaced once and `more` at its end. */
static void write_config(const char *name, const char *old, const char *new, const char *more) {
    const char *text = (const char *)shd_embedded_ocio, *at = strstr(text, old);
    assert_non_null(at);
    size_t size = shd_embedded_ocio_size + strlen(new) + strlen(more) + 1;
    char *edited = malloc(size);
    assert_non_null(edited);
    int length =
        snprintf(edited, size, "%.*s%s%s%s", (int)(at - text), text, new, at + strlen(old), more);
    write_file(name, edited, (size_t)length);
    free(edited);
}

/* The file `name` is refused with a text that has `reason` in it. It is removed. */
static void refused(const char *name, const char *reason) {
    shd_color_config *config = NULL;
    shd_error error = {0};
    assert_int_equal(shd_color_config_load(path_of(name), &config, &error), SHD_CONFIG);
    assert_null(config);
    assert_int_equal(error.status, SHD_CONFIG);
    assert_string_equal(error.path, path_of(name));
    if (!strstr(error.text, reason)) fail_msg("'%s' is not in '%s'", reason, error.text);
    assert_null(strchr(error.text, '\n'));
    size_t length = strlen(error.text);
    assert_true(length && error.text[length - 1] != '.');
    remove(path_of(name));
}

static void files_that_are_none_are_refused(void **state) {
    (void)state;
    refused("missing", "No such file");
    assert_int_equal(mkdir(path_of("directory"), 0700), 0);
    refused("directory", "not a regular file");
    assert_int_equal(mkfifo(path_of("fifo"), 0600), 0);
    refused("fifo", "not a regular file");
    write_file("huge", "", 0);
    assert_int_equal(truncate(path_of("huge"), 1L << 30), 0);
    refused("huge", "larger than");
}

static void archives_and_names_reach_opencolorio(void **state) {
    (void)state;
    shd_color_config *config = NULL;
    shd_error error;
    /* 2.1 knows no names, and says so. */
    assert_int_equal(shd_color_config_load("ocio://no-such", &config, &error), SHD_CONFIG);
    assert_non_null(strstr(error.text, "ocio://no-such"));
    assert_null(strstr(error.text, "No such file"));
    write_file("noise.ocioz", "noise", 5);
    refused("noise.ocioz", path_of("noise.ocioz"));
    assert_int_equal(mkfifo(path_of("fifo.ocioz"), 0600), 0);
    refused("fifo.ocioz", "not a regular file");
}

static void garbage_is_refused(void **state) {
    (void)state;
    write_file("empty", "", 0);
    refused("empty", "Loading the OCIO profile failed");
    char noise[4096];
    for (size_t i = 0; i < sizeof noise; i++) noise[i] = (char)(i * i >> 3);
    write_file("noise", noise, sizeof noise);
    refused("noise", "Loading the OCIO profile failed");
    static char deep[1 << 20];
    memset(deep, '[', sizeof deep);
    write_file("deep", deep, sizeof deep);
    refused("deep", "Loading the OCIO profile failed");
    write_file("half", (const char *)shd_embedded_ocio, shd_embedded_ocio_size / 2);
    refused("half", "");
}

static void missing_pieces_are_named(void **state) {
    (void)state;
    write_config("role", "  scene_linear: lin_rec709\n", "", "");
    refused("role", "the role scene_linear is missing");
    write_config("data", "scene_linear: lin_rec709", "scene_linear: raw", "");
    refused("data", "data space");
    write_config("builtin", "{style: ACEScct_to_ACES2065-1}", "{style: No such}", "");
    refused("builtin", "invalid built-in transform style 'No such'");
    write_config("version", "ocio_profile_version: 2.1", "ocio_profile_version: 9.9", "");
    refused("version", "9");
    write_config("reference", "", "",
                 "\n  - !<ColorSpace>\n    name: x\n    from_scene_reference: "
                 "!<ColorSpaceTransform> {src: lin_rec709, dst: nowhere}\n");
    refused("reference", "'nowhere'");
    write_config("name", "name: HSV linear", "name: HSV \xff\xfe", "");
    refused("name", "");
}

static void circles_are_found_before_they_are_followed(void **state) {
    (void)state;
    write_config("self", "", "",
                 "\n  - !<ColorSpace>\n    name: loop\n    from_scene_reference: "
                 "!<ColorSpaceTransform> {src: lin_rec709, dst: loop}\n");
    refused("self", "circular definition: color space 'loop' -> color space 'loop'");
    write_config("pair", "", "",
                 "\n  - !<ColorSpace>\n    name: a\n    from_scene_reference: "
                 "!<ColorSpaceTransform> {src: lin_rec709, dst: b}\n"
                 "  - !<ColorSpace>\n    name: b\n    from_scene_reference: !<GroupTransform>\n"
                 "      children:\n        - !<ColorSpaceTransform> {src: A, dst: lin_rec709}\n");
    refused("pair", "'a' -> color space 'b' -> color space 'a'");
    write_config("look", "looks:\n",
                 "looks:\n  - !<Look>\n    name: film\n    process_space: x\n"
                 "    transform: !<MatrixTransform> {}\n\n",
                 "\n  - !<ColorSpace>\n    name: x\n    from_scene_reference: "
                 "!<LookTransform> {src: lin_rec709, dst: sRGB, looks: +film}\n");
    refused("look", "circular definition");
    write_config("view", "", "",
                 "\n  - !<ColorSpace>\n    name: x\n    from_scene_reference: "
                 "!<DisplayViewTransform> {src: x, display: sRGB, view: Standard}\n");
    refused("view", "circular definition");

    /* 1,000 spaces, each defined by the next one. */
    char *chain = malloc(200000);
    assert_non_null(chain);
    size_t length = 0;
    for (int i = 0; i < 1000; i++)
        length += (size_t)snprintf(chain + length, 200000 - length,
                                   "\n  - !<ColorSpace>\n    name: c%d\n    from_scene_reference: "
                                   "!<ColorSpaceTransform> {src: lin_rec709, dst: c%d}\n",
                                   i, i + 1);
    strcpy(chain + length, "\n  - !<ColorSpace>\n    name: c1000\n");
    write_config("chain", "", "", chain);
    refused("chain", "nested too deeply");
    free(chain);
}

static void files_of_a_configuration_are_looked_at_first(void **state) {
    (void)state;
    static const char use[] = "\n  - !<ColorSpace>\n    name: x\n    from_scene_reference: "
                              "!<FileTransform> {src: x.spi1d}\n";
    write_config("absent", "search_path: \"\"", "search_path: .", use);
    refused("absent", "x.spi1d");
    assert_int_equal(mkfifo(path_of("x.spi1d"), 0600), 0);
    write_config("hang", "search_path: \"\"", "search_path: .", use);
    refused("hang", "not a regular file");
    remove(path_of("x.spi1d"));

    /* A relative path is relative to the configuration, and its content counts for the digest. */
    static const char table[] = "Version 1\nFrom 0 1\nLength 2\nComponents 1\n{\n0\n0.5\n}\n";
    write_file("x.spi1d", table, sizeof table - 1);
    write_config("good", "search_path: \"\"", "search_path: .", use);
    shd_color_config *first, *second;
    shd_error error = {0};
    if (shd_color_config_load(path_of("good"), &first, &error)) fail_msg("%s", error.text);
    double rgb[3] = {0.5, 0.5, 0.5};
    const shd_catalog *catalog = shd_color_catalog(first);
    assert_int_equal(catalog->convert(catalog->self, "lin_rec709", "x", rgb, NULL), SHD_OK);
    assert_true(rgb[0] > 0.2499 && rgb[0] < 0.2501);
    char *longer = strdup(table);
    assert_non_null(longer);
    memcpy(strstr(longer, "0.5"), "0.6", 3);
    write_file("x.spi1d", longer, strlen(longer));
    free(longer);
    assert_int_equal(shd_color_config_load(path_of("good"), &second, NULL), SHD_OK);
    assert_string_not_equal(shd_color_config_digest(first), shd_color_config_digest(second));
    shd_color_config_drop(first);
    shd_color_config_drop(second);
    remove(path_of("x.spi1d"));
    remove(path_of("good"));
}

static void a_copy_of_the_own_configuration_is_accepted(void **state) {
    (void)state;
    write_config("copy", "", "", "");
    shd_color_config *config, *own;
    assert_int_equal(shd_color_config_load(path_of("copy"), &config, NULL), SHD_OK);
    assert_int_equal(shd_color_config_load(NULL, &own, NULL), SHD_OK);
    assert_string_equal(shd_color_config_digest(config), shd_color_config_digest(own));
    shd_color_config_drop(config);
    shd_color_config_drop(own);
    remove(path_of("copy"));
}

/* Another house's names and reference, and nothing of ours. */
static const char foreign[] =
    "ocio_profile_version: 2.1\n"
    "environment: {}\n"
    "strictparsing: true\n"
    "roles: {scene_linear: light, aces_interchange: AP0%s}\n"
    "file_rules: [!<Rule> {name: Default, colorspace: light}]\n"
    "displays: {Screen: [!<View> {name: Plain, colorspace: screen}]}\n"
    "inactive_colorspaces: [AP0]\n"
    "colorspaces:\n"
    "  - !<ColorSpace> {name: light, aliases: [Glow], encoding: scene-linear}\n"
    "  - !<ColorSpace>\n"
    "    name: screen\n"
    "    from_scene_reference: !<ExponentTransform> {value: [2, 2, 2, 1], direction: inverse}\n"
    "  - !<ColorSpace>\n"
    "    name: AP0\n"
    "    to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: "
    "inverse}\n%s";

static shd_color_config *load_foreign(const char *roles, const char *more) {
    char text[4096];
    shd_color_config *config;
    shd_error error;
    int length = snprintf(text, sizeof text, foreign, roles, more);
    write_file("foreign", text, (size_t)length);
    if (shd_color_config_load(path_of("foreign"), &config, &error)) fail_msg("%s", error.text);
    remove(path_of("foreign"));
    return config;
}

/* `name` is a space, and means `canonical`. */
static void means(const shd_color_config *config, const char *name, const char *canonical) {
    const shd_space_info *space = shd_catalog_space(shd_color_catalog(config), name);
    if (!space || strcmp(space->name, canonical)) fail_msg("%s is not %s", name, canonical);
}

static void converts(const shd_color_config *config, const char *from, const double value[3],
                     const char *to, const double wanted[3], double tolerance) {
    const shd_catalog *catalog = shd_color_catalog(config);
    double rgb[3] = {value[0], value[1], value[2]};
    assert_int_equal(catalog->convert(catalog->self, from, to, rgb, NULL), SHD_OK);
    for (int c = 0; c < 3; c++)
        if (!(fabs(rgb[c] - wanted[c]) <= tolerance))
            fail_msg("%s to %s: channel %d is %g, not %g", from, to, c, rgb[c], wanted[c]);
}

static void aliases_and_roles_are_names(void **state) {
    (void)state;
    shd_color_config *config = load_foreign("", "");
    means(config, "glow", "light");
    means(config, "SCENE_LINEAR", "light");
    means(config, "aces_interchange", "AP0"); /* inactive, but named by a role */
    assert_null(shd_catalog_space(shd_color_catalog(config), "color_picking"));
    const shd_color_transform *by_alias, *by_name;
    shd_color_lease *lease = NULL;
    assert_int_equal(
        shd_color_to_space(config, "Glow", "aces_interchange", &lease, &by_alias, NULL), 0);
    assert_int_equal(shd_color_to_space(config, "light", "AP0", &lease, &by_name, NULL), 0);
    assert_ptr_equal(by_alias, by_name);
    shd_color_lease_drop(lease);
    shd_color_config_drop(config);

    assert_int_equal(shd_color_config_load(NULL, &config, NULL), SHD_OK);
    means(config, "acescg", "ACEScg");
    means(config, "ACES - ACEScg", "ACEScg");
    means(config, "lin_srgb", "lin_rec709");
    means(config, "lin_rec709_srgb", "lin_rec709");
    means(config, "srgb_tx", "sRGB");
    means(config, "color_picking", "sRGB");
    means(config, "color_timing", "ACEScct");
    means(config, "cie_xyz_d65_interchange", "CIE-XYZ-D65");
    shd_color_config_drop(config);
}

static void hex_colors_find_srgb(void **state) {
    (void)state;
    static const struct {
        const char *roles, *more, *css;
    } cases[] = {
        {", color_picking: screen", "  - !<ColorSpace> {name: S, aliases: [srgb_tx]}\n", "S"},
        {", color_picking: screen", "", "screen"},
        {", color_picking: none", "  - !<ColorSpace> {name: none, isdata: true}\n", "sRGB"},
        {"", "", "sRGB"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_color_config *config = load_foreign(cases[i].roles, cases[i].more);
        assert_string_equal(shd_color_catalog(config)->css->name, cases[i].css);
        assert_string_equal(shd_color_catalog(config)->rec709->name, "lin_rec709");
        shd_color_config_drop(config);
    }
    /* Rec.709 red in AP1, by Bradford adaptation of D65 to the white of ACES. */
    shd_color_config *config = load_foreign("", "");
    converts(config, "sRGB", (const double[]){1, 0, 0}, "light",
             (const double[]){0.6130974, 0.0701937, 0.0206156}, 2e-6);
    converts(config, "lin_rec709", (const double[]){0.5, 0.5, 0.5}, "light",
             (const double[]){0.5, 0.5, 0.5}, 1e-6);
    assert_string_equal(shd_color_catalog(config)->colors->name, "lin_rec709");
    shd_color_config_drop(config);
}

static void yiq_and_hsv_are_lent(void **state) {
    (void)state;
    shd_color_config *config = load_foreign("", "");
    static const double red[3] = {1, 0, 0};
    converts(config, "sRGB", red, "YIQ", (const double[]){.30, .60, .21}, 2e-6);
    converts(config, "lin_rec709", red, "YIQ linear", (const double[]){.30, .60, .21}, 2e-6);
    converts(config, "sRGB", (const double[]){0, .5, 0}, "HSV", (const double[]){1 / 3.0, 1, .5},
             2e-6);
    converts(config, "YIQ", (const double[]){.30, .60, .21}, "lin_rec709", red, 5e-6);
    const shd_space_info *space = shd_catalog_space(shd_color_catalog(config), "HSV linear");
    assert_int_equal(space->channels, SHD_HSV);
    shd_color_config_drop(config);

    /* An operator's own space stays what it is; without the role nothing is lent. */
    config = load_foreign("", "  - !<ColorSpace> {name: hsv, description: own}\n");
    assert_string_equal(shd_catalog_space(shd_color_catalog(config), "HSV")->description, "own");
    shd_color_config_drop(config);
    write_config("alone", "  aces_interchange: ACES2065-1\n", "", "");
    assert_int_equal(shd_color_config_load(path_of("alone"), &config, NULL), SHD_OK);
    remove(path_of("alone"));
    shd_color_config_drop(config);
}

static void encodings_are_measured(void **state) {
    (void)state;
    static const struct {
        const char *name, *curve;
        shd_transfer transfer;
        const double *xy; /* NULL: not known */
    } cases[] = {
        {"a", "!<ExponentTransform> {value: [2.2, 2.2, 2.2, 1], direction: inverse}",
         SHD_TRANSFER_GAMMA22, shd_acescg},
        {"b",
         "!<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], "
         "offset: [0.055, 0.055, 0.055, 0], direction: inverse}",
         SHD_TRANSFER_SRGB, shd_acescg},
        {"c",
         "!<GroupTransform> {children: [!<BuiltinTransform> {style: "
         "UTILITY - ACES-AP1_to_CIE-XYZ-D65_BFD}, !<BuiltinTransform> {style: "
         "DISPLAY - CIE-XYZ-D65_to_REC.2100-PQ}]}",
         SHD_TRANSFER_PQ, shd_rec2020},
        {"d",
         "!<GroupTransform> {children: [!<BuiltinTransform> {style: "
         "UTILITY - ACES-AP1_to_CIE-XYZ-D65_BFD}, !<BuiltinTransform> {style: "
         "DISPLAY - CIE-XYZ-D65_to_REC.2100-HLG-1000nit}]}",
         SHD_TRANSFER_HLG, shd_rec2020},
        {"e",
         "!<GroupTransform> {children: [!<BuiltinTransform> {style: "
         "UTILITY - ACES-AP1_to_CIE-XYZ-D65_BFD}, !<BuiltinTransform> {style: "
         "DISPLAY - CIE-XYZ-D65_to_G2.6-P3-DCI-BFD}]}",
         SHD_TRANSFER_GAMMA26, shd_p3_dci},
        {"f", "!<ExponentTransform> {value: [1.5, 1.5, 1.5, 1], direction: inverse}",
         SHD_TRANSFER_UNKNOWN, NULL},
        {"g", "!<ExponentTransform> {value: [2.2, 2.4, 2.2, 1], direction: inverse}",
         SHD_TRANSFER_UNKNOWN, NULL},
        {"h", "!<FixedFunctionTransform> {style: RGB_TO_HSV}", SHD_TRANSFER_UNKNOWN, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char space[512];
        snprintf(space, sizeof space,
                 "  - !<ColorSpace>\n    name: %s\n    from_scene_reference: %s\n", cases[i].name,
                 cases[i].curve);
        shd_color_config *config = load_foreign("", space);
        const shd_color_transform *made;
        shd_color_lease *lease = NULL;
        assert_int_equal(shd_color_to_space(config, "light", cases[i].name, &lease, &made, NULL),
                         SHD_OK);
        const shd_color_info *info = shd_color_describe(made);
        if (info->transfer != cases[i].transfer)
            fail_msg("%s: transfer %d", cases[i].name, (int)info->transfer);
        assert_int_equal(info->has_primaries, cases[i].xy != NULL);
        if (cases[i].xy) assert_memory_equal(info->primaries, cases[i].xy, sizeof info->primaries);
        shd_color_lease_drop(lease);
        shd_color_config_drop(config);
    }
}

static void interrupted_reads_go_on_and_others_are_told(void **state) {
    (void)state;
    char *data = NULL;
    size_t size = 0;
    shd_error error = {0};
    write_file("read", "abc", 3);
    failures[0] = failures[1] = EINTR;
    assert_int_equal(shd_color_read_file(path_of("read"), 3, &data, &size, &error), SHD_OK);
    assert_int_equal(size, 3);
    assert_memory_equal(data, "abc", 3);
    assert_int_equal(failures[0], 0);
    free(data);
    failures[0] = EIO;
    assert_int_equal(shd_color_read_file(path_of("read"), 3, &data, &size, &error), SHD_CONFIG);
    assert_string_equal(error.text, strerror(EIO));
    remove(path_of("read"));
}

static void text_is_utf_8_without_controls(void **state) {
    (void)state;
    static const char *const texts[] =
        {"",         "plain\ttext\r\n", "\xc3\xa4", "\xe2\x82\xac 5", "\xf0\x9f\x8e\xa8",
         "\xc2\x80", "\xf4\x8f\xbf\xbf"},
                             *const others[] = {"\x01",
                                                "\x7f",
                                                "\x80",
                                                "\xc3",
                                                "\xc3(",
                                                "\xe2\x82",
                                                "\xe2(\xac",
                                                "\xc0\xaf",
                                                "\xe0\x80\xaf",
                                                "\xed\xa0\x80",
                                                "\xf4\x90\x80\x80",
                                                "\xf8\x88\x80\x80\x80"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        if (!shd_color_is_text(texts[i])) fail_msg("%s is none", texts[i]);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (shd_color_is_text(others[i])) fail_msg("%zu is one", i);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(files_that_are_none_are_refused),
        cmocka_unit_test(archives_and_names_reach_opencolorio),
        cmocka_unit_test(garbage_is_refused),
        cmocka_unit_test(interrupted_reads_go_on_and_others_are_told),
        cmocka_unit_test(text_is_utf_8_without_controls),
        cmocka_unit_test(missing_pieces_are_named),
        cmocka_unit_test(circles_are_found_before_they_are_followed),
        cmocka_unit_test(files_of_a_configuration_are_looked_at_first),
        cmocka_unit_test(a_copy_of_the_own_configuration_is_accepted),
        cmocka_unit_test(aliases_and_roles_are_names),
        cmocka_unit_test(hex_colors_find_srgb),
        cmocka_unit_test(yiq_and_hsv_are_lent),
        cmocka_unit_test(encodings_are_measured),
    };
    return cmocka_run_group_tests(tests, make_folder, drop_folder);
}
