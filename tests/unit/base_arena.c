/* The request arena: aligned, capped, and closed to sizes that overflow. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/arena.h"

static void every_allocation_is_aligned_and_its_own(void **state) {
    (void)state;
    enum { COUNT = 500 };
    shd_arena *arena = shd_arena_new(64u << 20);
    unsigned char *at[COUNT];
    size_t size[COUNT];
    uint32_t random = 1;
    for (int i = 0; i < COUNT; i++) {
        random = random * 1664525u + 1013904223u;
        size[i] = (random >> 16) % (i % 50 ? 300 : 100000);
        at[i] = shd_arena_alloc(arena, size[i], 1);
        assert_non_null(at[i]);
        assert_int_equal((uintptr_t)at[i] % 64, 0);
        if (size[i]) memset(at[i], i & 255, size[i]);
    }
    /* Had two of them overlapped, a later one would have painted over an earlier one. */
    for (int i = 0; i < COUNT; i++)
        for (size_t k = 0; k < size[i]; k++) assert_int_equal(at[i][k], i & 255);
    shd_arena_drop(arena);
}

static void zero_items_are_a_place_of_their_own(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 20);
    void *a = shd_arena_alloc(arena, 0, 8), *b = shd_arena_alloc(arena, 8, 0),
         *c = shd_arena_zalloc(arena, 0, 0);
    assert_non_null(a);
    assert_non_null(b);
    assert_non_null(c);
    assert_ptr_not_equal(a, b);
    assert_ptr_not_equal(b, c);
    shd_arena_drop(arena);
}

static void sizes_that_overflow_are_refused(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(SIZE_MAX);
    static const struct {
        size_t count, size;
    } cases[] = {{SIZE_MAX, 1},     {1, SIZE_MAX},         {SIZE_MAX, SIZE_MAX},
                 {SIZE_MAX / 2, 3}, {SIZE_MAX / 8 + 1, 8}, {(size_t)1 << 32, (size_t)1 << 32},
                 {SIZE_MAX - 62, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_null(shd_arena_alloc(arena, cases[i].count, cases[i].size));
        assert_null(shd_arena_zalloc(arena, cases[i].count, cases[i].size));
    }
    assert_int_equal(shd_arena_used(arena), 0);
    assert_non_null(shd_arena_alloc(arena, 16, 16)); /* a refusal harms nothing */
    shd_arena_drop(arena);
}

static void the_cap_holds_for_any_cap(void **state) {
    (void)state;
    for (size_t cap = 0; cap < 400000; cap = cap * 5 / 4 + 37) {
        shd_arena *arena = shd_arena_new(cap);
        assert_non_null(arena);
        size_t given = 0;
        for (size_t size = 1;; size = size * 3 % 1009) {
            unsigned char *at = shd_arena_alloc(arena, size, 3);
            assert_true(shd_arena_used(arena) <= cap);
            if (!at) break;
            memset(at, 1, size * 3);
            given += size * 3;
        }
        assert_true(given <= cap);
        shd_arena_drop(arena);
    }
}

static void the_whole_cap_but_the_headers_can_be_used(void **state) {
    (void)state;
    /* One block's header is one alignment unit; a big request gets a block of its own size. */
    const size_t cap = 10u << 20;
    shd_arena *arena = shd_arena_new(cap);
    assert_null(shd_arena_alloc(arena, cap - 63, 1));
    assert_non_null(shd_arena_alloc(arena, cap - 64, 1));
    assert_int_equal(shd_arena_used(arena), cap);
    assert_null(shd_arena_alloc(arena, 1, 1));
    assert_null(shd_arena_strdup(arena, "text"));
    assert_null(shd_arena_printf(arena, "%d", 1));
    shd_arena_drop(arena);
}

static void zeroed_memory_is_zero_and_texts_are_copies(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 20);
    static const unsigned char zero[1000];
    assert_memory_equal(shd_arena_zalloc(arena, 10, 100), zero, 1000);

    char text[] = "a text";
    char *copy = shd_arena_strdup(arena, text);
    text[0] = 'b';
    assert_string_equal(copy, "a text");
    assert_string_equal(shd_arena_strdup(arena, ""), "");

    assert_string_equal(shd_arena_printf(arena, "%s-%d", "x", 7), "x-7");
    char *wide = shd_arena_printf(arena, "%20000d", 1);
    assert_int_equal(strlen(wide), 20000);
    shd_arena_drop(arena);
}

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/asan_interface.h>

static void bytes_that_nobody_asked_for_are_poisoned(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 20);
    unsigned char *at = shd_arena_alloc(arena, 10, 3);
    for (int i = 0; i < 30; i++) assert_false(__asan_address_is_poisoned(at + i));
    for (int i = 32; i < 64; i++) assert_true(__asan_address_is_poisoned(at + i));
    shd_arena_drop(arena);
}
#endif

static void dropping_nothing_is_fine(void **state) {
    (void)state;
    shd_arena_drop(NULL);
    shd_arena_drop(shd_arena_new(0));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation_is_aligned_and_its_own),
        cmocka_unit_test(zero_items_are_a_place_of_their_own),
        cmocka_unit_test(sizes_that_overflow_are_refused),
        cmocka_unit_test(the_cap_holds_for_any_cap),
        cmocka_unit_test(the_whole_cap_but_the_headers_can_be_used),
        cmocka_unit_test(zeroed_memory_is_zero_and_texts_are_copies),
#ifdef __SANITIZE_ADDRESS__
        cmocka_unit_test(bytes_that_nobody_asked_for_are_poisoned),
#endif
        cmocka_unit_test(dropping_nothing_is_fine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
