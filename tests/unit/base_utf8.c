/* UTF-8 is what RFC 3629 says it is: all that is a sequence, and nothing else. */
#include "base/utf8.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include <cmocka.h>

/* A code point in the form of `length` bytes, whether or not that is the form which it must have.
 */
static void encode(uint32_t point, size_t length, char text[5]) {
    static const unsigned char lead[] = {0, 0, 0xc0, 0xe0, 0xf0};
    memset(text, 0, 5);
    for (size_t i = length; i-- > 1; point >>= 6) text[i] = (char)(0x80 | (point & 0x3f));
    text[0] = (char)(lead[length] | point);
}

/* Every value in the form of every length: of those that the form has room for, the ones that have
 * no shorter form and are characters. */
static void each_character_has_one_form(void **state) {
    (void)state;
    static const uint32_t room[] = {0, 0x80, 0x800, 0x10000, 0x200000};
    for (size_t length = 1; length <= 4; length++)
        for (uint32_t point = 0; point < room[length]; point++) {
            const bool is_surrogate = point >= 0xd800 && point <= 0xdfff;
            const bool is_right = point >= room[length - 1] && !is_surrogate && point <= 0x10ffff;
            char text[5];
            uint32_t decoded = 0;
            encode(point, length, text);
            const size_t taken = shd_utf8_decode(text, &decoded);
            if (taken != (is_right ? length : 0) || (taken && decoded != point))
                fail_msg("U+%04X in %zu bytes: %zu, U+%04X", point, length, taken, decoded);
        }
}

static void what_does_not_go_on_is_none(void **state) {
    (void)state;
    static const char *const whole[] = {"\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80"};
    for (size_t i = 0; i < 3; i++)
        for (size_t at = 1; at < i + 2; at++)
            for (int byte = 0; byte < 256; byte++) {
                char text[5];
                uint32_t point;
                memcpy(text, whole[i], i + 3);
                text[at] = (char)byte;
                if ((byte & 0xc0) != 0x80) assert_int_equal(shd_utf8_decode(text, &point), 0);
            }
}

static void what_cannot_begin_is_none(void **state) {
    (void)state;
    for (int lead = 0x80; lead < 0x100; lead++) {
        const char text[] = {(char)lead, (char)0x90, (char)0x80, (char)0x80, 0};
        uint32_t point;
        if (lead < 0xc2 || lead > 0xf4) assert_int_equal(shd_utf8_decode(text, &point), 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_character_has_one_form),
        cmocka_unit_test(what_does_not_go_on_is_none),
        cmocka_unit_test(what_cannot_begin_is_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
