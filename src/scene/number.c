#include "scene/number.h"

#include <endian.h>
#include <jansson.h>
#include <stdbool.h>
#include <string.h>

#include "base/bits.h"

__extension__ typedef unsigned __int128 wide;

/* Numbers of up to 19 digits times 10^-27 to 10^27 are a whole number of 128 bits, or a quotient of
 * two such numbers. Their double takes one exact division and one rounding. */
enum { DIGITS = 19, POWERS = 28 };

/* x times 5^0 to 5^3 */
#define FOUR_POWERS(x) UINT64_C(x), 5 * UINT64_C(x), 25 * UINT64_C(x), 125 * UINT64_C(x)

static const uint64_t power_of_five[POWERS] = {FOUR_POWERS(1),
                                               FOUR_POWERS(625),
                                               FOUR_POWERS(390625),
                                               FOUR_POWERS(244140625),
                                               FOUR_POWERS(152587890625),
                                               FOUR_POWERS(95367431640625),
                                               FOUR_POWERS(59604644775390625)};

/* A power of two within doubles' normal range. */
static double power_of_two(int exponent) {
    return shd_double_of((uint64_t)(1023 + exponent) << 52);
}

/* Powers of ten that are doubles. */
static const double power_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                      1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                      1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/* digits * 10^power, with at most 19 digits, not 0, and -POWERS < power < POWERS. */
static double convert_digits(uint64_t digits, int power) {
    /* Both are doubles, and their quotient is rounded once (W. D. Clinger, "How to read floating
     * point numbers accurately", 1990). */
    if (power <= 0 && power >= -22 && digits <= UINT64_C(1) << 53)
        return (double)(int64_t)digits / power_of_ten[-power];
    if (power >= 0) return (double)((wide)digits * power_of_five[power]) * power_of_two(power);
    /* The quotient has at least 63 bits. The remainder only tells whether the number lies above the
     * middle of two doubles: if it is not 0, the quotient's last bit is made odd. */
    const int shift = 63 + __builtin_clzll(digits);
    const wide above = (wide)digits << shift, below = power_of_five[-power];
    const wide quotient = above / below;
    return (double)(quotient | (quotient * below != above)) * power_of_two(power - shift);
}

static bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

static bool is_digit(const char *at, const char *end) {
    return at < end && *at >= '0' && *at <= '9';
}

static const char *read_digits(const char *at, const char *end, uint64_t *digits) {
    for (; is_digit(at, end); at++) *digits = 10 * *digits + (uint64_t)(*at - '0');
    return at;
}

/* Whether at most 19 digits lie between the leading zeros and the end. */
static bool is_short(const char *text, const char *end) {
    if (end - text <= DIGITS) return true;
    while (text < end && (*text == '0' || *text == '.')) text++;
    return end - text - (memchr(text, '.', (size_t)(end - text)) != NULL) <= DIGITS;
}

static const char *read_exponent(const char *at, const char *end, int *power) {
    enum { MOST = 100000 }; /* far beyond all numbers that are read here */
    const bool negative = at < end && *at == '-';
    if (at < end && (*at == '-' || *at == '+')) at++;
    if (!is_digit(at, end)) return NULL;
    int exponent = 0;
    for (; is_digit(at, end); at++)
        if (exponent < MOST) exponent = 10 * exponent + (*at - '0');
    *power += negative ? -exponent : exponent;
    return at;
}

/* Reads all other numbers as jansson does, by strtod. */
static bool read_slowly(const char *text, size_t length, double *out) {
    json_t *number = json_loadb(text, length, JSON_DECODE_ANY | JSON_DECODE_INT_AS_REAL, NULL);
    if (number) *out = json_real_value(number);
    json_decref(number);
    return number;
}

/* Reads the digits from `at` on, up to eight, whose bytes are there. Returns how many there are.
 * All are told and put together at once: pairs, then fours, then all. */
static inline int read_eight(const char *at, uint64_t *value) {
    uint64_t bytes;
    memcpy(&bytes, at, sizeof bytes);
    uint64_t x = le64toh(bytes) ^ UINT64_C(0x3030303030303030);
    /* A byte above 9 sets its highest bit; what it carries only reaches bytes behind it. */
    const uint64_t others = ((x + UINT64_C(0x7676767676767676)) | x) & UINT64_C(0x8080808080808080);
    const int count = others ? __builtin_ctzll(others) >> 3 : 8;
    if (!count) return 0;
    x <<= 8 * (8 - count);
    x = (x * 10 + (x >> 8)) & UINT64_C(0x00ff00ff00ff00ff);
    x = (x * 100 + (x >> 16)) & UINT64_C(0x0000ffff0000ffff);
    *value = (x * 10000 + (x >> 32)) & UINT64_C(0xffffffff);
    return count;
}

/* Reads the number at `at`, behind which there are ROOM bytes at least. Returns its end, or NULL if
 * it is none of the most common ones. */
static inline const char *read_plain(const char *at, double *out) {
    static const uint64_t powers[] = {1,      10,      100,      1000,     10000,
                                      100000, 1000000, 10000000, 100000000};
    const bool negative = *at == '-';
    at += negative;
    uint64_t digits = 0, part = 0;
    const int whole = read_eight(at, &digits);
    if (whole == 0 || whole == 8 || (*at == '0' && whole > 1)) return NULL;
    at += whole;
    int places = 0;
    if (*at == '.') {
        places = read_eight(++at, &part);
        if (!places) return NULL;
        digits = digits * powers[places] + part;
        if (places == 8) {
            const int more = read_eight(at + 8, &part);
            if (more == 8 || whole + places + more > DIGITS) return NULL;
            if (more) digits = digits * powers[more] + part;
            places += more;
            if (digits > UINT64_C(1) << 53) return NULL;
        }
        at += places;
    }
    double value = (double)(int64_t)digits;
    if (places) value /= power_of_ten[places];
    *out = negative ? -value : value;
    return at;
}

const char *shd_number_read_row(const char *text, const char *end, double *out, size_t count,
                                size_t *read) {
    enum { ROOM = 1 + 8 + 1 + 8 + 8 + 2 }; /* bytes that may be looked at */
    const char *at = text;
    size_t i = 0;
    while (i < count && end - at >= ROOM) {
        const char *past = read_plain(at, &out[i]);
        if (!past || *past != ',') break;
        i++;
        at = past + 1;
        if (*at > ' ') continue; /* mostly there is none */
        while (at < end && is_space(*at)) at++;
    }
    *read = i;
    return at;
}

const char *shd_number_read(const char *text, const char *end, double *out) {
    const bool negative = text < end && *text == '-';
    const char *const first = text + negative, *at = first;
    uint64_t digits = 0;
    int power = 0;
    if (!is_digit(at, end)) return NULL;
    at = *at == '0' ? at + 1 : read_digits(at, end, &digits);
    if (at < end && *at == '.') {
        const char *fraction = at + 1;
        at = read_digits(fraction, end, &digits);
        if (at == fraction) return NULL;
        power = at - fraction < POWERS ? (int)(fraction - at) : -POWERS;
    }
    const bool quick = is_short(first, at);
    if (at < end && (*at | 0x20) == 'e') at = read_exponent(at + 1, end, &power);
    if (!at) return NULL;
    double value = 0;
    if (!quick || power <= -POWERS || power >= POWERS) {
        if (!read_slowly(first, (size_t)(at - first), &value)) return NULL;
    } else if (digits) {
        value = convert_digits(digits, power);
    }
    *out = negative ? -value : value;
    return at;
}
