/* Numbers against strtod, and documents whose long arrays are read past jansson against those that
 * it reads itself. */
#include <errno.h>
#include <float.h>
#include <inttypes.h>
#include <jansson.h>
#include <math.h>

#include "scene/number.h"
#include "unit/scene_support.h"

/* ---- Numbers ---- */

static uint64_t random_state = 88172645463325252u;

/* xorshift64*: Vigna, "An experimental exploration of Marsaglia's xorshift generators" (2016). */
static uint64_t random_bits(void) {
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return random_state * 2685821657736338717u;
}

static int random_below(int n) {
    return (int)(random_bits() % (uint64_t)n);
}

static int read_fast; /* numbers that were */

static void check_number(const char *text) {
    const size_t length = strlen(text);
    double read = -1, wanted;
    errno = 0;
    wanted = strtod(text, NULL);
    const char *end = shd_number_read(text, text + length, &read);
    const bool beyond = fabs(wanted) == HUGE_VAL;
    if (beyond ? end != NULL : end != text + length || memcmp(&read, &wanted, sizeof read) != 0)
        fail_msg("%s: %a instead of %a", text, read, wanted);
    /* The fast way tells the same, or nothing. */
    char more[1300];
    const size_t size = (size_t)snprintf(more, sizeof more, "%s, ]%32s", text, "");
    double fast = -1;
    size_t count;
    const char *fast_end = shd_number_read_row(more, more + size, &fast, 1, &count);
    read_fast += (int)count;
    if (fast_end != more + (count ? length + 2 : 0) ||
        (count && memcmp(&fast, &wanted, sizeof fast) != 0))
        fail_msg("%s: %a instead of %a, fast", text, fast, wanted);
}

static double random_double(void) {
    for (;;) {
        const uint64_t bits = random_bits();
        double out;
        memcpy(&out, &bits, sizeof out);
        if (isfinite(out)) return out;
    }
}

/* Digits, a point somewhere among them or none, an exponent or none. */
static void write_random(char *out, int digits_most, int exponent_most) {
    const int digits = 1 + random_below(digits_most), point = random_below(digits + 4);
    char *c = out;
    if (random_below(4) == 0) *c++ = '-';
    if (point == 0) c += sprintf(c, "0.%.*s", random_below(6), "000000");
    for (int i = 0; i < digits; i++) {
        *c++ = (char)((i || !point ? '0' : '1') + random_below(i || !point ? 10 : 9));
        if (i + 1 == point && i + 1 < digits) *c++ = '.';
    }
    if (random_below(2))
        c += sprintf(c, "%c%s%d", random_below(2) ? 'e' : 'E', random_below(3) ? "" : "+",
                     random_below(exponent_most));
    else if (random_below(2))
        c += sprintf(c, "e-%d", random_below(exponent_most));
    *c = '\0';
}

static void numbers_are_those_of_strtod(void **state) {
    (void)state;
    char text[1200];
    for (int i = 0; i < 1000000; i++) {
        write_random(text, 20, 30);
        check_number(text);
    }
    for (int i = 0; i < 200000; i++) {
        write_random(text, 40, 330);
        check_number(text);
    }
    for (int i = 0; i < 300000; i++) {
        snprintf(text, sizeof text, "%.17g", random_double());
        check_number(text);
        /* what modellers write: near 1, and single precision told as double */
        const double near = (double)(int64_t)random_bits() * 0x1p-63;
        snprintf(text, sizeof text, "%.*g", 1 + random_below(19), near);
        check_number(text);
        snprintf(text, sizeof text, "%.17g", (double)(float)near);
        check_number(text);
        snprintf(text, sizeof text, "%.*f", random_below(9), 1e4 * near);
        check_number(text);
        snprintf(text, sizeof text, "%d", random_below(1 << 24));
        check_number(text);
    }
    assert_in_range(read_fast, 800000, 2500000); /* most that modellers write */
}

/* The middle of two neighbors, to the last of its digits, and a bit more and less. */
static void halfway_cases_are_those_of_strtod(void **state) {
    (void)state;
    char text[1200];
    for (int i = 0; i < 300000; i++) {
        /* 2^53 + 1 + 2 k: whole numbers of up to 19 digits that are no doubles */
        const uint64_t odd = (UINT64_C(1) << 53) + 1 + 2 * (random_bits() >> 12);
        snprintf(text, sizeof text, "%" PRIu64, odd);
        check_number(text);
        snprintf(text, sizeof text, "%" PRIu64 ".0", odd);
        check_number(text);
        snprintf(text, sizeof text, "%" PRIu64 "e%d", odd, random_below(28));
        check_number(text);
        snprintf(text, sizeof text, "%" PRIu64 "e-%d", odd, random_below(28));
        check_number(text);
        /* (2 m + 1) / 2^k = (2 m + 1) 5^k / 10^k, of 54 bits: m of 54 - 2.33 k */
        const int k = 1 + random_below(8);
        uint64_t digits = (UINT64_C(1) << 53) + 1 + 2 * (random_bits() >> 12), five = 1;
        for (int n = 0; n < k; n++) five *= 5;
        if (digits > UINT64_MAX / five / 4) digits = (digits >> (3 * k)) | 1;
        snprintf(text, sizeof text, "%" PRIu64 "e-%d", digits * five, k);
        check_number(text);
    }
    for (int i = 0; i < 20000; i++) { /* any double's upper middle, in all its digits */
        const double low = fabs(random_double()), high = nextafter(low, HUGE_VAL);
        if (!isfinite(high)) continue;
        const long double middle = ((long double)low + (long double)high) / 2;
        snprintf(text, sizeof text, "%.1100Lg", middle);
        check_number(text);
        if (strlen(text) < 1100 && !strchr(text, 'e')) {
            strcat(text, strchr(text, '.') ? "1" : ".1");
            check_number(text);
        }
    }
}

static void ends_of_the_range_are_those_of_strtod(void **state) {
    (void)state;
    static const char *const texts[] = {
        "0",
        "-0",
        "0.0",
        "0e0",
        "-0e99999999999",
        "0.000e-400",
        "1",
        "-1",
        "9007199254740993",
        "9007199254740992",
        "9223372036854775807",
        "9223372036854775808",
        "18446744073709551615",
        "18446744073709551616",
        "9999999999999999999",
        "10000000000000000000",
        "1e22",
        "1e23",
        "1e27",
        "1e28",
        "1e-27",
        "1e-28",
        "9999999999999999999e27",
        "9999999999999999999e-27",
        "1e-27",
        "0.000000000000000000000000001",
        "1e308",
        "1.7976931348623157e308",
        "1.7976931348623158e308",
        "1.7976931348623159e308",
        "1.797693134862315807e308",
        "1e309",
        "-1e309",
        "1e99999",
        "1e-99999",
        "1e999999999999",
        "1e-999999999999",
        "2.2250738585072014e-308",
        "2.2250738585072011e-308",
        "2.225073858507201136057409796709131975934819546351645648023426109724822222021076945516529"
        "523908135087914149158913039621106870086438694594645527657207407820621743379988141063267329"
        "253552286881372149012981122451451889849057222307285255133155755015914397476397983411801999"
        "323962548289017107081850690630666655994938275772572015763062690663332647565300009245888316"
        "433037779791869612049497390377829704905051080609940730262937128958950003583799967207254304"
        "360284078895771796150945516748243471030702609144621572289880258182545180325707018860872113"
        "128079512233426288368622321503775666622503982534335974568884423900265498198385487948292206"
        "894721689831099698365846814022854243330660339850886445804001034933970427567186443383770486"
        "037861622771738545623065874679014086723327636718751234567890123456789012345678901e-308",
        "4.9406564584124654e-324",
        "2.4703282292062327e-324",
        "2.4703282292062328e-324",
        "5e-324",
        "3e-324",
        "2e-324",
        "1e-400",
        "123456789012345678901234567890",
        "0.1",
        "0.2",
        "0.3",
        "3.4028234663852886e38",
        "1.1754943508222875e-38"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) check_number(texts[i]);
}

static void what_is_no_number_of_json_is_refused(void **state) {
    (void)state;
    static const char *const none[] = {"",    "-",  "+1",  ".5",  "-.5",  "1.",  "1.e1",     "1e",
                                       "1e+", "e1", "nan", "inf", "-inf", "NaN", "Infinity", "1.-"};
    double value = 7;
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        assert_null(shd_number_read(none[i], none[i] + strlen(none[i]), &value));
        assert_float_equal(value, 7, 0);
    }
    /* Where the next thing begins; what follows the end is not looked at. */
    static const struct {
        const char *text;
        int length, read;
    } some[] = {{"01", 2, 1},   {"1,2", 3, 1},  {"0x10", 4, 1}, {"12", 1, 1},
                {"1.25", 3, 3}, {"1e55", 3, 3}, {"1 2", 3, 1},  {"-0]", 3, 2}};
    for (size_t i = 0; i < sizeof some / sizeof some[0]; i++)
        assert_ptr_equal(shd_number_read(some[i].text, some[i].text + some[i].length, &value),
                         some[i].text + some[i].read);
    static const char nothing[] = "1.5";
    assert_null(shd_number_read(nothing, nothing, &value));
}

/* ---- Documents ---- */

enum { VERTICES = 60 };

/* A mesh of many numbers. `name` spells the key of its positions, `space` goes between items,
 * `last` takes the place of the last position, `end` of the document's end. */
static char *document(const char *name, const char *space, const char *last, const char *end) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    fprintf(out, "{\"objects\": [{\"type\": \"mesh\", \"%s\":%s[", name, space);
    for (int i = 0; i < 3 * VERTICES - 1; i++)
        fprintf(out, "%s%.17g%s,", space, sin(i) * pow(10, i % 7 - 3), space);
    fprintf(out, "%s], \"normals\" :[1e0", last);
    for (int i = 1; i < 3 * VERTICES; i++) fprintf(out, ", %d.5", i);
    fputs("], \"indices\": [0", out);
    for (int i = 1; i < 3 * VERTICES; i++) fprintf(out, ",%d", i % VERTICES);
    fprintf(out, "]}]%s", end);
    fclose(out);
    return text;
}

static reading read_document(const char *name, const char *space, const char *last,
                             const char *end) {
    char *text = document(name, space, last, end);
    const reading out = read_bytes(text, strlen(text), &scene_limits);
    free(text);
    return out;
}

/* Jansson alone reads a document that has an escape in a key. */
static const char plain[] = "positions", escaped[] = "\\u0070ositions";

static void long_arrays_are_read_as_jansson_reads_them(void **state) {
    (void)state;
    static const char *const spaces[] = {"", " ", "\n", "\r\n\t "};
    reading slow = read_document(escaped, "", "-1.5e-3", "}");
    assert_int_equal(slow.status, SHD_OK);
    for (size_t i = 0; i < 4; i++) {
        reading fast = read_document(plain, spaces[i], "-1.5e-3", "}");
        assert_int_equal(fast.status, SHD_OK);
        const shd_mesh *a = fast.scene->objects[0].mesh, *b = slow.scene->objects[0].mesh;
        assert_int_equal(a->vertex_count, VERTICES);
        assert_int_equal(a->triangle_count, VERTICES);
        assert_memory_equal(a->positions, b->positions, 3 * VERTICES * sizeof *a->positions);
        assert_memory_equal(a->normals, b->normals, 3 * VERTICES * sizeof *a->normals);
        assert_memory_equal(a->indices, b->indices, 3 * VERTICES * sizeof *a->indices);
        assert_string_equal(fast.scene->digest, slow.scene->digest);
        drop(&fast);
    }
    drop(&slow);
}

static void assert_same_problems(const reading *a, const reading *b) {
    assert_int_equal(a->status, b->status);
    assert_int_equal(a->report.error_count, b->report.error_count);
    for (size_t i = 0; i < shd_report_errors_kept(&a->report); i++) {
        assert_string_equal(a->report.errors[i].pointer, b->report.errors[i].pointer);
        assert_string_equal(a->report.errors[i].detail, b->report.errors[i].detail);
    }
}

static void mistakes_are_told_as_jansson_tells_them(void **state) {
    (void)state;
    static const char *const lasts[] = {"1",    "1e999", "01",   "1.",   "",      "[1]",
                                        "null", "\"1\"", "1, 2", "true", "{}",    "-",
                                        "+1",   ".5",    "1e",   "nan",  "1 // ", "\"]\""};
    static const char *const ends[] = {"}",  "",    ", \"objects\": []}",   ", \"a\": [1, 2}",
                                       "}]", "} x", ", \"na\\u0000me\": 1}"};
    for (size_t i = 0; i < sizeof lasts / sizeof lasts[0]; i++)
        for (size_t k = 0; k < sizeof ends / sizeof ends[0]; k++) {
            const char *space = k % 2 ? "\n" : " ";
            reading fast = read_document(plain, space, lasts[i], ends[k]);
            char *text = document(plain, space, lasts[i], ends[k]);
            json_error_t error;
            json_t *tree = json_loadb(text, strlen(text),
                                      JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL, &error);
            if (tree) {
                reading slow = read_document(escaped, space, lasts[i], ends[k]);
                assert_same_problems(&fast, &slow);
                drop(&slow);
            } else {
                assert_int_equal(fast.status, SHD_SYNTAX);
                assert_int_equal(fast.report.line, error.line);
                assert_int_equal(fast.report.column, error.column);
                if (json_error_code(&error) == json_error_invalid_syntax ||
                    json_error_code(&error) == json_error_premature_end_of_input)
                    assert_non_null(strstr(fast.report.errors[0].detail, error.text));
            }
            json_decref(tree);
            free(text);
            drop(&fast);
        }
}

/* Numbers that look as a packed array does in the copy of the document. */
static void digits_are_only_numbers(void **state) {
    (void)state;
    char digits[2 * 33 + 1] = "", text[1000];
    for (int i = 0; i < 33; i++) strcat(digits, i ? ",0" : "1");
    for (int e = 0; e < 2; e++) {
        snprintf(text, sizeof text,
                 "{'objects': [{'type': 'mesh', '%s': [%s], 'indices': [0,1,2]},"
                 "{'type': 'mesh', 'positions': [%s]}]}",
                 e ? escaped : plain, digits, "0,0,0, 1,0,0, 0,1,0");
        reading r = read_scene(text);
        assert_int_equal(r.scene->objects[0].mesh->vertex_count, 11);
        assert_float_equal(r.scene->objects[0].mesh->positions[0], 1, 0);
        assert_int_equal(r.scene->objects[1].mesh->vertex_count, 3);
        drop(&r);
    }
    /* Exactly as many as the mark has: no multiple of three. */
    digits[2 * 32 - 1] = '\0';
    for (int e = 0; e < 2; e++) {
        snprintf(text, sizeof text, "{\"objects\": [{\"type\": \"mesh\", \"%s\": [%s]}]}",
                 e ? escaped : plain, digits);
        reading r = read_bytes(text, strlen(text), &scene_limits);
        assert_true(has_error(&r, "/objects/0/positions", "in threes, got 32 numbers"));
        drop(&r);
    }
}

static void arrays_elsewhere_are_no_numbers_of_a_mesh(void **state) {
    (void)state;
    char digits[2 * 40 + 1] = "", text[1000];
    for (int i = 0; i < 40; i++) strcat(digits, i ? ",0" : "1");
    static const char *const where[] = {
        "{\"positions\": [%s], \"objects\": []}",
        "{\"materials\": {\"positions\": [%s]}, \"objects\": []}",
        "{\"objects\": [{\"type\": \"sphere\", \"normals\": [%s]}]}"};
    static const char *const what[] = {"positions", "an array", "normals"};
    for (size_t i = 0; i < 3; i++) {
        snprintf(text, sizeof text, where[i], digits);
        reading r = read_bytes(text, strlen(text), &scene_limits);
        assert_int_equal(r.status, SHD_SCENE);
        assert_int_equal(r.report.error_count, 1);
        assert_non_null(strstr(r.report.errors[0].detail, what[i]));
        drop(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_those_of_strtod),
        cmocka_unit_test(halfway_cases_are_those_of_strtod),
        cmocka_unit_test(ends_of_the_range_are_those_of_strtod),
        cmocka_unit_test(what_is_no_number_of_json_is_refused),
        cmocka_unit_test(long_arrays_are_read_as_jansson_reads_them),
        cmocka_unit_test(mistakes_are_told_as_jansson_tells_them),
        cmocka_unit_test(digits_are_only_numbers),
        cmocka_unit_test(arrays_elsewhere_are_no_numbers_of_a_mesh),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
