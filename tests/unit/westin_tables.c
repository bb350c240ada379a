/* Tables of microgeometries between requests: simulated once, shared, forgotten, given up. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "render/westin_tables.h"

static const shd_microgeometry GROOVES = {.type = SHD_GROOVES, .angle = 0.2},
                               OTHERS = {.type = SHD_GROOVES, .angle = 0.3};
enum { ROOM = 32 << 20 };

static shd_westin_tables *tables_of(size_t cap, shd_budget *budget) {
    shd_westin_tables *tables;
    shd_error error;
    assert_int_equal(shd_westin_tables_new(cap, budget, &tables, &error), SHD_OK);
    return tables;
}

static shd_stored *get(shd_westin_tables *tables, const shd_microgeometry *micro) {
    shd_stored *out = NULL;
    shd_error error;
    assert_int_equal(shd_westin_tables_get(tables, micro, NULL, &out, &error), SHD_OK);
    assert_non_null(out);
    return out;
}

static void a_table_is_simulated_once(void **state) {
    (void)state;
    shd_westin_tables *tables = tables_of(ROOM, NULL);
    shd_stored *first = get(tables, &GROOVES), *other = get(tables, &OTHERS),
               *again = get(tables, &GROOVES);
    assert_ptr_equal(first, again);
    assert_ptr_not_equal(first, other);
    const shd_westin_load load = shd_westin_tables_load_of(tables);
    assert_int_equal(load.simulations, 2);
    assert_int_equal(load.count, 2);
    shd_stored_drop(first);
    shd_stored_drop(again);
    shd_stored_drop(other);
    /* It is kept by its bytes alone, not by who holds it. */
    shd_stored_drop(get(tables, &OTHERS));
    assert_int_equal(shd_westin_tables_load_of(tables).simulations, 2);
    shd_westin_tables_drop(tables);
}

typedef struct asker {
    shd_westin_tables *tables;
    atomic_bool cancelled;
    shd_status status;
    shd_stored *out;
    pthread_t thread;
} asker;

static void *ask(void *context) {
    asker *a = context;
    shd_error error;
    a->status = shd_westin_tables_get(a->tables, &GROOVES, &a->cancelled, &a->out, &error);
    return NULL;
}

static void requests_at_once_simulate_once(void **state) {
    (void)state;
    enum { COUNT = 4 };
    asker askers[COUNT] = {0};
    shd_westin_tables *tables = tables_of(ROOM, NULL);
    for (int i = 0; i < COUNT; i++) {
        askers[i].tables = tables;
        assert_int_equal(pthread_create(&askers[i].thread, NULL, ask, &askers[i]), 0);
    }
    for (int i = 0; i < COUNT; i++) {
        pthread_join(askers[i].thread, NULL);
        assert_int_equal(askers[i].status, SHD_OK);
        assert_ptr_equal(askers[i].out, askers[0].out);
    }
    assert_int_equal(shd_westin_tables_load_of(tables).simulations, 1);
    for (int i = 0; i < COUNT; i++) shd_stored_drop(askers[i].out);
    shd_westin_tables_drop(tables);
}

/* Whoever of the two simulates is cancelled, or waits and is; the other one gets its table. */
static void a_cancelled_simulation_passes_to_another_request(void **state) {
    (void)state;
    asker askers[2] = {0};
    shd_westin_tables *tables = tables_of(ROOM, NULL);
    for (int i = 0; i < 2; i++) {
        askers[i].tables = tables;
        assert_int_equal(pthread_create(&askers[i].thread, NULL, ask, &askers[i]), 0);
    }
    atomic_store(&askers[0].cancelled, true);
    for (int i = 0; i < 2; i++) pthread_join(askers[i].thread, NULL);
    assert_int_equal(askers[1].status, SHD_OK);
    /* It may have been finished before the flag was seen. */
    assert_true(askers[0].status == SHD_CANCELLED || askers[0].status == SHD_OK);
    shd_stored_drop(askers[0].out);
    shd_stored_drop(askers[1].out);
    shd_westin_tables_drop(tables);
}

static void memory_is_counted_and_given_back(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(64 << 20);
    shd_westin_tables *tables = tables_of(ROOM, budget);
    shd_budget_yield(budget, SHD_RANK_TABLES, shd_westin_tables_trim, tables);
    shd_stored_drop(get(tables, &GROOVES));
    const uint64_t used = shd_budget_load_of(budget).used;
    assert_int_equal(used, shd_westin_tables_load_of(tables).bytes);
    assert_true(used >= sizeof(shd_westin));
    /* Other work has it all. */
    assert_true(shd_budget_take(budget, 64 << 20));
    assert_int_equal(shd_westin_tables_load_of(tables).count, 0);
    shd_stored *out = NULL;
    shd_error error;
    assert_int_equal(shd_westin_tables_get(tables, &GROOVES, NULL, &out, &error), SHD_CROWDED);
    assert_null(out);
    shd_budget_give(budget, 64 << 20);
    shd_stored_drop(get(tables, &GROOVES));
    shd_westin_tables_drop(tables);
    assert_int_equal(shd_budget_load_of(budget).used, 0);
    shd_budget_drop(budget);
}

static void what_cannot_be_kept_is_still_given(void **state) {
    (void)state;
    shd_westin_tables *tables = tables_of(1 << 20, NULL);
    shd_stored *out = get(tables, &GROOVES);
    assert_true(((const shd_westin *)shd_stored_bytes(out))->rho[0][0][0] > 0);
    assert_int_equal(shd_westin_tables_load_of(tables).count, 0);
    shd_stored_drop(out);
    shd_westin_tables_drop(tables);
}

static void the_oldest_table_is_forgotten(void **state) {
    (void)state;
    shd_westin_tables *tables = tables_of(5 << 20, NULL); /* two tables */
    shd_microgeometry third = GROOVES;
    third.angle = 0.4;
    shd_stored_drop(get(tables, &GROOVES));
    shd_stored_drop(get(tables, &OTHERS));
    shd_stored_drop(get(tables, &GROOVES));
    shd_stored_drop(get(tables, &third));
    assert_int_equal(shd_westin_tables_load_of(tables).count, 2);
    shd_stored_drop(get(tables, &GROOVES));
    assert_int_equal(shd_westin_tables_load_of(tables).simulations, 3);
    shd_stored_drop(get(tables, &OTHERS));
    assert_int_equal(shd_westin_tables_load_of(tables).simulations, 4);
    shd_westin_tables_drop(tables);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_table_is_simulated_once),
        cmocka_unit_test(requests_at_once_simulate_once),
        cmocka_unit_test(a_cancelled_simulation_passes_to_another_request),
        cmocka_unit_test(memory_is_counted_and_given_back),
        cmocka_unit_test(what_cannot_be_kept_is_still_given),
        cmocka_unit_test(the_oldest_table_is_forgotten),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
