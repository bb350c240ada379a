/* What caches are made of: the order of last use, and the index. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/lru.h"

typedef struct thing {
    shd_use use;
    shd_key key;
    char name[8];
} thing;

static void assert_order(const shd_lru *lru, const char *names) {
    const shd_use *newer = NULL;
    size_t count = 0, bytes = 0;
    for (const shd_use *u = lru->newest; u; newer = u, u = u->older) {
        assert_ptr_equal(u->newer, newer);
        assert_int_equal(((const thing *)u)->name[0], names[count++]);
        bytes += u->bytes;
    }
    assert_ptr_equal(lru->oldest, newer);
    assert_int_equal(names[count], 0);
    assert_int_equal(lru->count, count);
    assert_int_equal(lru->bytes, bytes);
}

static void the_order_is_that_of_last_use(void **state) {
    (void)state;
    thing a = {{.bytes = 1}, .name = "a"}, b = {{.bytes = 20}, .name = "b"},
          c = {{.bytes = 300}, .name = "c"};
    shd_lru lru = {0}, other = {0};
    assert_null(shd_lru_pop(&lru));
    shd_lru_put(&lru, &a.use);
    shd_lru_touch(&lru, &a.use);
    assert_order(&lru, "a");
    shd_lru_put(&lru, &b.use);
    shd_lru_put(&lru, &c.use);
    assert_order(&lru, "cba");
    shd_lru_touch(&lru, &b.use);
    assert_order(&lru, "bca");
    shd_lru_touch(&lru, &a.use);
    assert_order(&lru, "abc");
    shd_lru_take(&lru, &b.use);
    shd_lru_put(&other, &b.use);
    assert_order(&lru, "ac");
    assert_order(&other, "b");
    assert_ptr_equal(shd_lru_pop(&lru), &c.use);
    assert_ptr_equal(shd_lru_pop(&lru), &a.use);
    assert_order(&lru, "");
}

static void *find(const shd_index *index, uint64_t kind, const char *name, size_t size) {
    const shd_key key = shd_index_key(index, kind, name, size);
    return shd_index_find(index, &key);
}

/* In indexes in which all, some and none share a bucket. */
static void a_thing_is_found_by_its_kind_and_all_its_bytes(void **state) {
    (void)state;
    for (size_t things = 0; things < 4096; things = 8 * things + 1) {
        shd_index index;
        shd_error error;
        assert_int_equal(shd_index_new(things, &index, &error), SHD_OK);
        thing all[200];
        for (unsigned i = 0; i < 200; i++) {
            /* Each name stands twice, in two kinds; one is the beginning of another. */
            memset(all[i].name, 'x', sizeof all[i].name);
            all[i].name[7] = (char)(i / 16);
            all[i].key = shd_index_key(&index, i % 2, all[i].name, i / 2 % 8 + i / 16 % 2);
            if (!shd_index_find(&index, &all[i].key)) shd_index_put(&index, &all[i].key, &all[i]);
        }
        assert_null(find(&index, 2, all[0].name, 0));
        assert_ptr_equal(find(&index, 0, NULL, 0), &all[0]);
        assert_ptr_equal(find(&index, 1, "", 0), &all[1]);
        assert_ptr_equal(find(&index, 0, "xx", 2), &all[4]);
        assert_null(find(&index, 0, "xy", 2));
        shd_index_take(&index, &all[4].key);
        assert_null(find(&index, 0, "xx", 2));
        assert_ptr_equal(find(&index, 1, "xx", 2), &all[5]);
        assert_ptr_equal(find(&index, 0, "xxx", 3), &all[6]);
        shd_index_put(&index, &all[4].key, &all[4]);
        assert_ptr_equal(find(&index, 0, "xx", 2), &all[4]);
        shd_index_drop(&index);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_order_is_that_of_last_use),
        cmocka_unit_test(a_thing_is_found_by_its_kind_and_all_its_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
