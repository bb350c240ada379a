/* Kept memory: found again, capped, closed to whoever touches it meanwhile. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/arena.h"
#include "base/spares.h"

static void *take_spare(shd_spares *spares, size_t size) {
    void *kept = shd_spares_find(spares, size);
    return kept ? kept : shd_spares_make(size);
}

static void what_was_given_back_is_given_out_again(void **state) {
    (void)state;
    shd_spares *spares = shd_spares_new(64u << 20, NULL);
    for (size_t size = 1; size < 32u << 20; size = size * 9 / 4 + 77) {
        void *a = take_spare(spares, size), *b = take_spare(spares, size);
        assert_non_null(a);
        assert_ptr_not_equal(a, b);
        assert_int_equal((uintptr_t)a % 64, 0);
        assert_int_equal(shd_spares_kept(spares), 0);
        memset(a, 1, size);
        memset(b, 2, size);
        shd_spares_give(spares, a, size);
        shd_spares_give(spares, b, size);
        assert_true(shd_spares_kept(spares) >= 2 * size);
        assert_ptr_equal(take_spare(spares, size), b); /* the warmest first */
        assert_ptr_equal(take_spare(spares, size), a);
        assert_int_equal(shd_spares_kept(spares), 0);
        free(a);
        free(b);
    }
    shd_spares_drop(spares);
}

static void blocks_are_an_eighth_larger_at_most(void **state) {
    (void)state;
    shd_spares *spares = shd_spares_new(SIZE_MAX, NULL);
    for (size_t size = 65536; size < 32u << 20; size = size * 17 / 16 + 1) {
        shd_spares_give(spares, take_spare(spares, size), size);
        size_t block = shd_spares_kept(spares);
        assert_true(block >= size && block - size <= size / 8);
        free(take_spare(spares, block)); /* the same one */
        assert_int_equal(shd_spares_kept(spares), 0);
    }
    shd_spares_drop(spares);
}

static void the_cap_holds_and_the_oldest_go(void **state) {
    (void)state;
    const size_t size = 128 * 1024, cap = 4 * size;
    shd_spares *spares = shd_spares_new(cap, NULL);
    void *blocks[9];
    for (int i = 0; i < 8; i++) blocks[i] = take_spare(spares, size);
    blocks[8] = take_spare(spares, 2 * size);
    for (int i = 0; i < 8; i++) {
        shd_spares_give(spares, blocks[i], size);
        assert_true(shd_spares_kept(spares) <= cap);
    }
    assert_int_equal(shd_spares_kept(spares), cap);
    shd_spares_give(spares, blocks[8], 2 * size);
    assert_int_equal(shd_spares_kept(spares), cap);
    assert_ptr_equal(take_spare(spares, size), blocks[7]);
    assert_ptr_equal(take_spare(spares, size), blocks[6]);
    shd_spares_give(spares, blocks[6], size);
    shd_spares_give(spares, blocks[7], size);

    /* What is larger than everything that may be kept drives nothing out. */
    shd_spares_give(spares, take_spare(spares, cap + 1), cap + 1);
    assert_int_equal(shd_spares_kept(spares), cap);
    shd_spares_drop(spares);
}

static void sizes_without_a_block_are_refused(void **state) {
    (void)state;
    assert_null(take_spare(NULL, SIZE_MAX));
    assert_null(take_spare(NULL, SIZE_MAX / 2 + 1));
    shd_spares_give(NULL, NULL, 1);
    shd_spares_drop(NULL);
    void *alone = take_spare(NULL, 100000);
    assert_non_null(alone);
    shd_spares_give(NULL, alone, 100000);
}

/* The same requests fit and the same are refused, whatever is kept. */
static void an_arenas_cap_does_not_depend_on_what_is_kept(void **state) {
    (void)state;
    shd_spares *spares = shd_spares_new(64u << 20, NULL);
    uint32_t random = 1;
    for (int round = 0; round < 200; round++) {
        random = random * 1664525u + 1013904223u;
        const size_t cap = random % (4u << 20);
        shd_arena *fresh = shd_arena_new(cap), *kept = shd_arena_new_from(spares, cap);
        for (int i = 0; i < 40; i++) {
            random = random * 1664525u + 1013904223u;
            size_t size = (random >> 8) % (i % 8 ? 3000 : 700000);
            unsigned char *a = shd_arena_alloc(fresh, size, 1), *b = shd_arena_alloc(kept, size, 1);
            assert_int_equal(a == NULL, b == NULL);
            assert_int_equal(shd_arena_used(fresh), shd_arena_used(kept));
            assert_int_equal((uintptr_t)b % 64, 0);
            if (b && size) memset(b, 255, size);
        }
        shd_arena_drop(fresh);
        shd_arena_drop(kept);
    }
    shd_spares_drop(spares);
}

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/asan_interface.h>

static void kept_memory_is_poisoned(void **state) {
    (void)state;
    shd_spares *spares = shd_spares_new(1 << 20, NULL);
    shd_arena *arena = shd_arena_new_from(spares, 1 << 20);
    unsigned char *at = shd_arena_alloc(arena, 100, 1);
    shd_arena_drop(arena);
    for (int i = 0; i < 100; i++) assert_true(__asan_address_is_poisoned(at + i));
    arena = shd_arena_new_from(spares, 1 << 20);
    assert_ptr_equal(shd_arena_alloc(arena, 50, 1), at);
    assert_false(__asan_address_is_poisoned(at + 49));
    assert_true(__asan_address_is_poisoned(at + 64));
    shd_arena_drop(arena);
    shd_spares_drop(spares);
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_given_back_is_given_out_again),
        cmocka_unit_test(blocks_are_an_eighth_larger_at_most),
        cmocka_unit_test(the_cap_holds_and_the_oldest_go),
        cmocka_unit_test(sizes_without_a_block_are_refused),
        cmocka_unit_test(an_arenas_cap_does_not_depend_on_what_is_kept),
#ifdef __SANITIZE_ADDRESS__
        cmocka_unit_test(kept_memory_is_poisoned),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
