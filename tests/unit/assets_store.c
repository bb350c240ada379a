/* The store: who loses what for lack of room, and what stays while it is held. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <pthread.h>
#include <stdatomic.h>

#include "assets/store.h"

enum { UNIT = 4096 };

static shd_store *store_of(size_t cap) {
    shd_store *store = NULL;
    shd_error error;
    assert_int_equal(shd_store_new(cap, NULL, &store, &error), SHD_OK);
    return store;
}

static shd_digest digest_of(int number) {
    return shd_digest_of(&number, sizeof number);
}

/* A thing of `units`, its head included, all of whose bytes are `number`. */
static shd_stored *thing_of(shd_store *store, int number, size_t units) {
    const shd_digest digest = digest_of(number);
    shd_stored *empty, *thing;
    shd_error error;
    assert_int_equal(shd_stored_new(store, SHD_THING_MESH, &digest, 0, &empty, &error), SHD_OK);
    const size_t bytes = units * UNIT - shd_stored_size(empty);
    shd_stored_drop(empty);
    assert_int_equal(shd_stored_new(store, SHD_THING_MESH, &digest, bytes, &thing, &error), SHD_OK);
    assert_int_equal(shd_stored_size(thing), units * UNIT);
    assert_int_equal((uintptr_t)shd_stored_bytes(thing) % 64, 0);
    memset(shd_stored_bytes(thing), number, bytes);
    return thing;
}

static bool put(shd_store *store, const char *client, int number, size_t units) {
    shd_stored *thing = thing_of(store, number, units);
    bool known = true;
    shd_error error;
    assert_int_equal(shd_store_put(store, thing, client, &known, &error), SHD_OK);
    shd_stored_drop(thing);
    return !known;
}

static bool has(shd_store *store, int number) {
    const shd_digest digest = digest_of(number);
    shd_stored *thing = shd_store_find(store, SHD_THING_MESH, &digest);
    if (thing) assert_int_equal(*(unsigned char *)shd_stored_bytes(thing), number);
    shd_stored_drop(thing);
    return thing;
}

static void what_was_put_is_found_and_put_once(void **state) {
    (void)state;
    shd_store *store = store_of(64 * UNIT);
    assert_false(has(store, 1));
    assert_true(put(store, "a", 1, 1));
    assert_true(has(store, 1));
    assert_false(put(store, "b", 1, 1));
    const shd_store_load load = shd_store_load_of(store);
    assert_int_equal(load.bytes, UNIT);
    assert_int_equal(load.things, 1);
    assert_int_equal(load.held, 0);
    assert_int_equal(load.hits, 1);
    assert_int_equal(load.misses, 1);
    assert_int_equal(load.evictions, 0);
    shd_store_drop(store);
}

static void a_client_loses_what_it_used_the_longest_ago(void **state) {
    (void)state;
    shd_store *store = store_of(4 * UNIT);
    for (int i = 1; i <= 4; i++) put(store, "a", i, 1);
    assert_true(has(store, 1)); /* used again */
    put(store, "a", 5, 1);
    assert_false(has(store, 2));
    for (int i = 1; i <= 5; i++) assert_true(i == 2 || has(store, i));
    assert_int_equal(shd_store_load_of(store).evictions, 1);
    shd_store_drop(store);
}

static void the_client_that_has_most_loses_first(void **state) {
    (void)state;
    shd_store *store = store_of(8 * UNIT);
    put(store, "small", 1, 1);
    put(store, "small", 2, 1);
    /* However much another one puts, and however recently. */
    for (int i = 10; i < 40; i++) put(store, "large", i, 2);
    assert_true(has(store, 1));
    assert_true(has(store, 2));
    for (int i = 10; i < 40; i++) assert_int_equal(has(store, i), i >= 37);
    assert_int_equal(shd_store_load_of(store).bytes, 8 * UNIT);
    shd_store_drop(store);
}

/* Else a put would be answered by its own loss. */
static void what_was_put_last_stays(void **state) {
    (void)state;
    shd_store *store = store_of(8 * UNIT);
    for (int i = 1; i <= 3; i++) put(store, "b", i, 1);
    for (int i = 4; i <= 6; i++) put(store, "c", i, 1);
    put(store, "a", 7, 4);
    assert_true(has(store, 7));
    assert_int_equal(shd_store_load_of(store).bytes, 8 * UNIT);
    shd_store_drop(store);
}

static void half_of_the_cap_is_the_most(void **state) {
    (void)state;
    shd_store *store = store_of(8 * UNIT);
    shd_stored *thing = thing_of(store, 1, 5);
    bool known;
    shd_error error;
    assert_int_equal(shd_store_put(store, thing, "a", &known, &error), SHD_LIMIT);
    assert_non_null(strstr(error.text, "`mesh-store`"));
    shd_stored_drop(thing);
    assert_true(put(store, "a", 2, 4));
    shd_store_drop(store);
    store = store_of(0);
    thing = thing_of(store, 1, 1);
    assert_int_equal(shd_store_put(store, thing, "a", &known, &error), SHD_LIMIT);
    shd_stored_drop(thing);
    shd_store_drop(store);
}

static void what_is_held_outlives_its_place(void **state) {
    (void)state;
    shd_store *store = store_of(4 * UNIT);
    const shd_digest digest = digest_of(1);
    put(store, "a", 1, 2);
    shd_stored *held = shd_store_find(store, SHD_THING_MESH, &digest),
               *again = shd_store_find(store, SHD_THING_MESH, &digest);
    for (int i = 2; i < 6; i++) put(store, "a", i, 2);
    assert_false(has(store, 1));
    assert_int_equal(shd_store_load_of(store).bytes, 4 * UNIT);
    assert_int_equal(shd_store_load_of(store).held, 2 * UNIT);
    /* Brought again, it is another one. */
    put(store, "a", 1, 2);
    assert_true(has(store, 1));
    shd_stored_drop(held);
    assert_int_equal(shd_store_load_of(store).held, 2 * UNIT);
    assert_int_equal(((unsigned char *)shd_stored_bytes(again))[100], 1);
    shd_stored_drop(again);
    assert_int_equal(shd_store_load_of(store).held, 0);
    shd_store_shrink(store, 2 * UNIT);
    assert_int_equal(shd_store_load_of(store).bytes, 2 * UNIT);
    assert_true(has(store, 1));
    shd_store_shrink(store, 0);
    assert_int_equal(shd_store_load_of(store).bytes, 0);
    assert_int_equal(shd_store_load_of(store).things, 0);
    shd_store_drop(store);
}

static size_t give_way(void *store, size_t bytes) {
    const size_t kept = shd_store_load_of(store).bytes;
    return shd_store_shrink(store, kept > bytes ? kept - bytes : 0);
}

static void all_bytes_are_of_the_budget(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(6 * UNIT);
    assert_non_null(budget);
    shd_store *store = NULL;
    shd_error error;
    assert_int_equal(shd_store_new(8 * UNIT, budget, &store, &error), SHD_OK);
    for (int i = 1; i <= 3; i++) put(store, "a", i, 2);
    assert_int_equal(shd_budget_load_of(budget).used, 6 * UNIT);
    const shd_digest digest = digest_of(4), first = digest_of(1);
    shd_stored *thing, *held = shd_store_find(store, SHD_THING_MESH, &first);
    assert_int_equal(shd_stored_new(store, SHD_THING_MESH, &digest, 100, &thing, &error),
                     SHD_CROWDED);
    /* What is kept gives way, but for what is held. */
    shd_budget_yield(budget, SHD_RANK_MESHES, give_way, store);
    assert_true(shd_budget_take(budget, 3 * UNIT));
    assert_int_equal(shd_store_load_of(store).things, 1);
    assert_false(shd_budget_take(budget, 3 * UNIT));
    assert_int_equal(shd_store_load_of(store).bytes, 0);
    assert_int_equal(shd_store_load_of(store).held, 2 * UNIT);
    shd_budget_give(budget, 3 * UNIT);
    assert_int_equal(shd_budget_load_of(budget).used, 2 * UNIT);
    shd_stored_drop(held);
    assert_int_equal(shd_budget_load_of(budget).used, 0);
    shd_store_drop(store);
    shd_budget_drop(budget);
}

/* ---- Threads ---- */

typedef struct worker {
    shd_store *store;
    char client[4];
    atomic_int *kept;
} worker;

static void *work(void *context) {
    const worker *w = context;
    for (int i = 0; i < 400; i++) {
        const int number = i * 7 % 23;
        if (put(w->store, w->client, number, 1 + (size_t)number % 3)) (*w->kept)++;
        has(w->store, (number + 5) % 23);
        if (i % 50 == 0) shd_store_shrink(w->store, 3 * UNIT);
    }
    return NULL;
}

static void threads_share_it(void **state) {
    (void)state;
    shd_store *store = store_of(16 * UNIT);
    atomic_int kept = 0;
    worker workers[4];
    pthread_t threads[4];
    for (int i = 0; i < 4; i++) {
        workers[i] = (worker){store, {(char)('a' + i % 3)}, &kept};
        assert_int_equal(pthread_create(&threads[i], NULL, work, &workers[i]), 0);
    }
    for (int i = 0; i < 4; i++) pthread_join(threads[i], NULL);
    const shd_store_load load = shd_store_load_of(store);
    assert_true(load.bytes <= 16 * UNIT);
    assert_int_equal(load.held, 0);
    assert_int_equal(load.things + load.evictions, atomic_load(&kept));
    shd_store_drop(store);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_put_is_found_and_put_once),
        cmocka_unit_test(a_client_loses_what_it_used_the_longest_ago),
        cmocka_unit_test(the_client_that_has_most_loses_first),
        cmocka_unit_test(what_was_put_last_stays),
        cmocka_unit_test(half_of_the_cap_is_the_most),
        cmocka_unit_test(what_is_held_outlives_its_place),
        cmocka_unit_test(all_bytes_are_of_the_budget),
        cmocka_unit_test(threads_share_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
