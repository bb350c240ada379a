/* Memory for what is kept: pieces that do not overlap, under a cap, with pages made ahead. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include <cmocka.h>

#include "base/poison.h"
#include "base/stock.h"

enum { UNIT = SHD_STOCK_UNIT };

static void pieces_do_not_overlap_and_stay_within_the_cap(void **state) {
    (void)state;
    enum { CAP = 150 * UNIT, TRIES = 20000, MOST = 40 };
    struct {
        unsigned char *memory;
        size_t size;
    } held[MOST] = {{NULL, 0}};
    shd_stock *stock = shd_stock_new(CAP + UNIT - 1, NULL);
    size_t used = 0, refused = 0;
    srand(1);
    for (int i = 0; i < TRIES; i++) {
        const int k = rand() % MOST;
        if (i % 7 == 0) shd_stock_touch(stock);
        if (held[k].memory) {
            for (size_t at = 0; at < held[k].size; at += 512)
                assert_int_equal(held[k].memory[at], k);
            shd_stock_give(stock, held[k].memory, held[k].size);
            used -= held[k].size;
        }
        held[k].size = (size_t)(1 + rand() % 12) * UNIT;
        held[k].memory = shd_stock_take(stock, held[k].size);
        if (held[k].memory) {
            used += held[k].size;
            assert_int_equal((uintptr_t)held[k].memory % UNIT, 0);
            memset(held[k].memory, k, held[k].size);
        } else {
            refused++;
        }
        assert_true(used <= CAP);
    }
    assert_in_range(refused, 100, TRIES / 2);
    shd_stock_drop(stock);
}

static void what_was_given_back_makes_whole_slabs_again(void **state) {
    (void)state;
    shd_stock *stock = shd_stock_new(4 << 20, NULL);
    unsigned char *small[128];
    for (int i = 0; i < 128; i++) assert_non_null(small[i] = shd_stock_take(stock, UNIT));
    assert_null(shd_stock_take(stock, UNIT));
    for (int i = 0; i < 128; i++) shd_stock_give(stock, small[i], UNIT);
    for (int i = 0; i < 4; i++) assert_non_null(shd_stock_take(stock, SHD_STOCK_MOST));
    assert_null(shd_stock_take(stock, UNIT));
    shd_stock_drop(stock);
}

static long faults(void) {
    struct rusage usage;
    assert_int_equal(getrusage(RUSAGE_SELF, &usage), 0);
    return usage.ru_minflt;
}

static void what_was_touched_ahead_has_its_pages(void **state) {
    (void)state;
#ifdef SHD_ASAN
    skip(); /* its shadow has pages of its own */
#endif
    shd_stock *stock = shd_stock_new((size_t)256 << 20, NULL);
    size_t steps = 0;
    while (shd_stock_touch(stock)) steps++;
    assert_true(steps > 16); /* none is long */
    assert_false(shd_stock_touch(stock));
    const long before = faults();
    for (size_t taken = 0; taken < SHD_STOCK_AHEAD; taken += SHD_STOCK_MOST)
        memset(shd_stock_take(stock, SHD_STOCK_MOST), 1, SHD_STOCK_MOST);
    assert_true(faults() - before < 16);
    assert_true(shd_stock_touch(stock)); /* the next ones */
    shd_stock_drop(stock);
}

static void no_more_is_touched_than_the_cap_allows(void **state) {
    (void)state;
    shd_stock *stock = shd_stock_new(3 << 20, NULL), *none = shd_stock_new(UNIT - 1, NULL);
    size_t steps = 0;
    while (shd_stock_touch(stock)) steps++;
    assert_in_range(steps, 1, 3 * 32);
    assert_false(shd_stock_touch(none));
    assert_null(shd_stock_take(none, UNIT));
    shd_stock_drop(stock);
    shd_stock_drop(none);
    shd_stock_drop(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pieces_do_not_overlap_and_stay_within_the_cap),
        cmocka_unit_test(what_was_given_back_makes_whole_slabs_again),
        cmocka_unit_test(what_was_touched_ahead_has_its_pages),
        cmocka_unit_test(no_more_is_touched_than_the_cap_allows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
