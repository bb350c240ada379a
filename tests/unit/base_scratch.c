/* Scratch memory: what is counted is what is handed out. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/scratch.h"

typedef struct thing {
    uint64_t *many;
    unsigned char *few, *none;
} thing;

static void lay_out_thing(size_t count, shd_scratch *memory, thing *out) {
    out->many = shd_scratch_take(memory, count, sizeof *out->many);
    out->few = shd_scratch_take(memory, 3, sizeof *out->few);
    out->none = shd_scratch_take(memory, 0, sizeof *out->none);
}

static void what_is_counted_is_what_is_handed_out(void **state) {
    (void)state;
    thing t;
    shd_scratch counted = {.arena = NULL};
    lay_out_thing(1000, &counted, &t);
    assert_true(!t.many && !t.few && !t.none && !counted.full);
    assert_int_equal(counted.bytes, 8000 + 64 + 64);

    shd_arena *arena = shd_arena_new(1 << 20);
    shd_scratch handed = {.arena = arena};
    lay_out_thing(1000, &handed, &t);
    assert_true(t.many && t.few && t.none && !handed.full);
    assert_int_equal(handed.bytes, counted.bytes);
    assert_int_equal((unsigned char *)t.none - (unsigned char *)t.many, 8000 + 64);
    shd_arena_drop(arena);
}

static void an_arena_that_is_full_once_gives_no_more(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 20);
    shd_scratch handed = {.arena = arena};
    thing t;
    lay_out_thing(1 << 20, &handed, &t);
    assert_true(handed.full && !t.many && !t.few && !t.none);
    shd_arena_drop(arena);
}

static void more_than_there_can_be_is_counted_as_the_most(void **state) {
    (void)state;
    shd_scratch counted = {.arena = NULL};
    shd_scratch_take(&counted, SIZE_MAX / 4, 8);
    assert_true(counted.bytes == UINT64_MAX);
    shd_scratch_take(&counted, 1, 1);
    assert_true(counted.bytes == UINT64_MAX);
    counted = (shd_scratch){.arena = NULL};
    shd_scratch_take(&counted, SIZE_MAX / 2, 1);
    shd_scratch_take(&counted, SIZE_MAX / 2, 1);
    shd_scratch_take(&counted, SIZE_MAX / 2, 1);
    assert_true(counted.bytes == UINT64_MAX);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_counted_is_what_is_handed_out),
        cmocka_unit_test(an_arena_that_is_full_once_gives_no_more),
        cmocka_unit_test(more_than_there_can_be_is_counted_as_the_most),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
