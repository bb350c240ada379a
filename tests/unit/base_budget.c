/* The budget: what is taken is under its cap, and who gives way does so in order. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/arena.h"
#include "base/budget.h"
#include "base/spares.h"
#include "base/stock.h"

enum { CAP = 1000 };

typedef struct giver {
    shd_budget *budget;
    size_t has, asked;
    size_t order; /* when it was asked last */
} giver;

static size_t asked_so_far;

static size_t give(void *context, size_t bytes) {
    giver *g = context;
    g->asked = bytes;
    g->order = ++asked_so_far;
    const size_t given = bytes < g->has ? bytes : g->has;
    g->has -= given;
    shd_budget_give(g->budget, given);
    return given;
}

static void what_is_taken_is_under_the_cap(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(CAP);
    shd_budget_fix(budget, 100);
    assert_int_equal(shd_budget_most(budget), 900);
    assert_true(shd_budget_take(budget, 600));
    assert_false(shd_budget_try(budget, 301));
    assert_false(shd_budget_take(budget, 301));
    assert_int_equal(shd_budget_load_of(budget).refused, 1); /* who tries is not refused */
    assert_true(shd_budget_try(budget, 300));
    assert_int_equal(shd_budget_load_of(budget).used, CAP);
    shd_budget_count(budget, 50); /* what is there in any case */
    assert_false(shd_budget_take(budget, 1));
    shd_budget_give(budget, 51);
    assert_true(shd_budget_take(budget, 1));
    assert_false(shd_budget_wait(budget, SIZE_MAX, 1e9)); /* not for what never fits */
    shd_budget_drop(budget);
}

static void no_budget_is_endless(void **state) {
    (void)state;
    assert_true(shd_budget_take(NULL, SIZE_MAX));
    shd_budget_give(NULL, SIZE_MAX);
    assert_true(shd_budget_most(NULL) == UINT64_MAX);
    shd_budget_drop(NULL);
}

static void ranks_give_way_in_their_order_as_far_as_needed(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(CAP);
    giver spare = {budget, 100, 0, 0}, answers = {budget, 200, 0, 0}, kept = {budget, 300, 0, 0};
    shd_budget_yield(budget, SHD_RANK_PICTURES, give, &kept);
    shd_budget_yield(budget, SHD_RANK_SPARE, give, &spare);
    shd_budget_yield(budget, SHD_RANK_ANSWERS, give, &answers);
    assert_true(shd_budget_take(budget, CAP));
    assert_true(shd_budget_take(budget, 150));
    assert_int_equal(spare.asked, 150);
    assert_int_equal(answers.asked, 50);
    assert_true(spare.order < answers.order);
    assert_int_equal(kept.asked, 0);
    assert_true(shd_budget_take(budget, 400));
    assert_int_equal(kept.asked, 250);
    assert_false(shd_budget_take(budget, 100)); /* 50 are had */
    assert_int_equal(shd_budget_load_of(budget).used, CAP - 50);
    shd_budget_drop(budget);
}

static size_t promise(void *context, size_t bytes) {
    (void)context;
    return bytes;
}

static void *give_later(void *budget) {
    shd_budget_give(budget, 500);
    return NULL;
}

static void what_was_promised_is_waited_for(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(CAP);
    giver kept = {budget, 300, 0, 0};
    shd_budget_yield(budget, SHD_RANK_ANSWERS, promise, NULL);
    shd_budget_yield(budget, SHD_RANK_PICTURES, give, &kept);
    assert_true(shd_budget_take(budget, CAP));
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, give_later, budget), 0);
    assert_true(shd_budget_wait(budget, 400, 1e6));
    assert_int_equal(kept.asked, 0); /* enough was promised */
    pthread_join(thread, NULL);
    assert_true(shd_budget_take(budget, 200)); /* who does not wait asks on */
    assert_int_equal(kept.asked, 100);
    shd_budget_drop(budget);
}

/* Blocks, what is borrowed, reserved or kept, and slabs: all of it is counted, once. */
static void arenas_and_what_is_kept_are_counted(void **state) {
    (void)state;
    const size_t block = 64 << 10;
    shd_budget *budget = shd_budget_new(16 << 20);
    shd_spares *spares = shd_spares_new(4 << 20, budget);
    shd_arena *arena = shd_arena_new_from(spares, SIZE_MAX / 4);
    assert_true(shd_arena_reserve(arena, 8 << 20));
    assert_int_equal(shd_budget_load_of(budget).used, 8 << 20);
    assert_non_null(shd_arena_alloc(arena, block, 50));
    assert_int_equal(shd_budget_load_of(budget).used, 8 << 20); /* of what was reserved */
    assert_true(shd_arena_borrow(arena, 6 << 20));
    const size_t all = shd_budget_load_of(budget).used;
    assert_in_range(all, 9 << 20, 10 << 20);
    assert_null(shd_arena_alloc(arena, block, 200));
    assert_true(shd_arena_crowded(arena) && !shd_arena_full(arena));
    shd_arena_repay(arena, 6 << 20);
    assert_int_equal(shd_budget_load_of(budget).used, all - (6 << 20));
    shd_arena_drop(arena);
    assert_int_equal(shd_budget_load_of(budget).used, shd_spares_kept(spares));

    /* What is kept is not counted twice when it is used again, and goes when it is asked to. */
    const size_t kept = shd_spares_kept(spares);
    arena = shd_arena_new_from(spares, SIZE_MAX / 4);
    assert_non_null(shd_arena_alloc(arena, block, 50));
    assert_int_equal(shd_budget_load_of(budget).used, kept);
    shd_arena_drop(arena);
    assert_int_equal(shd_spares_trim(spares, 1), kept);
    assert_int_equal(shd_budget_load_of(budget).used, 0);

    shd_stock *stock = shd_stock_new(64 << 20, budget);
    void *piece = NULL, *pieces[16];
    size_t count = 0;
    while (count < 16 && (piece = shd_stock_take(stock, SHD_STOCK_MOST))) pieces[count++] = piece;
    assert_int_equal(count, 16);
    assert_null(shd_stock_take(stock, SHD_STOCK_UNIT)); /* the budget ends before the cap */
    assert_int_equal(shd_stock_trim(stock, SIZE_MAX), 0);
    for (size_t i = 0; i < 4; i++) shd_stock_give(stock, pieces[i], SHD_STOCK_MOST);
    assert_int_equal(shd_stock_trim(stock, SIZE_MAX), 4 << 20);
    assert_int_equal(shd_budget_load_of(budget).used, 12 << 20);
    assert_non_null(shd_stock_take(stock, SHD_STOCK_UNIT)); /* in the place of what was trimmed */
    shd_stock_drop(stock);
    shd_spares_drop(spares);
    assert_int_equal(shd_budget_load_of(budget).used, 0);
    shd_budget_drop(budget);
}

static void what_nobody_asks_for_goes(void **state) {
    (void)state;
    const size_t size = 128 << 10;
    shd_spares *spares = shd_spares_new(8 << 20, NULL);
    for (int i = 0; i < 8; i++) shd_spares_give(spares, shd_spares_make(size), size);
    shd_spares_rest(spares, size);
    assert_int_equal(shd_spares_kept(spares), 8 * size); /* it was given back since the last call */
    void *used = shd_spares_find(spares, size);
    shd_spares_give(spares, used, size);
    shd_spares_rest(spares, 0);
    assert_int_equal(shd_spares_kept(spares), size); /* that one was used meanwhile */
    shd_spares_rest(spares, size);
    assert_int_equal(shd_spares_kept(spares), size);
    shd_spares_rest(spares, 0);
    assert_int_equal(shd_spares_kept(spares), 0);
    shd_spares_drop(spares);
}

static void an_arena_returns_to_its_mark(void **state) {
    (void)state;
    shd_spares *spares = shd_spares_new(64 << 20, NULL);
    shd_arena *arena = shd_arena_new_from(spares, 64 << 20);
    const shd_arena_mark start = shd_arena_mark_here(arena);
    char *before = shd_arena_strdup(arena, "stays");
    const shd_arena_mark mark = shd_arena_mark_here(arena);
    const size_t used = shd_arena_used(arena);
    for (int round = 0; round < 3; round++) {
        for (size_t size = 1; size < 4 << 20; size *= 3)
            memset(shd_arena_alloc(arena, size, 1), 1, size);
        assert_true(shd_arena_used(arena) > used);
        shd_arena_return(arena, mark);
        assert_int_equal(shd_arena_used(arena), used);
        assert_string_equal(before, "stays");
    }
    assert_true(shd_arena_peak(arena) > 2 << 20);
    shd_arena_return(arena, start);
    assert_int_equal(shd_arena_used(arena), 0);
    assert_non_null(shd_arena_alloc(arena, 100, 1));
    shd_arena_drop(arena);
    shd_spares_drop(spares);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_taken_is_under_the_cap),
        cmocka_unit_test(no_budget_is_endless),
        cmocka_unit_test(ranks_give_way_in_their_order_as_far_as_needed),
        cmocka_unit_test(what_was_promised_is_waited_for),
        cmocka_unit_test(arenas_and_what_is_kept_are_counted),
        cmocka_unit_test(what_nobody_asks_for_goes),
        cmocka_unit_test(an_arena_returns_to_its_mark),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
