/* The response cache: what it finds, forgets and leaves to those who still send it. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/answer/cache.h"

enum { KB = 1 << 10 };

static shd_cache *new_cache(size_t cap) {
    shd_cache *cache;
    shd_error error;
    assert_int_equal(shd_cache_new(cap, NULL, &cache, &error), SHD_OK);
    return cache;
}

static void name_tag(char tag[SHD_TAG_SIZE], unsigned number) {
    snprintf(tag, SHD_TAG_SIZE, "%032x", number);
}

/* An answer of `size` bytes that tell its number. */
static shd_reply answer(unsigned number, size_t size) {
    shd_reply reply = {.status = 200};
    unsigned char *body = malloc(size);
    assert_non_null(body);
    memset(body, (int)(number & 0xff), size);
    shd_reply_header(&reply, "Shaded-Plan", "plan %u", number);
    shd_reply_give(&reply, "image/png", body, size);
    return reply;
}

static shd_cached put(shd_cache *cache, unsigned number, size_t size,
                      const shd_question *question) {
    char tag[SHD_TAG_SIZE];
    name_tag(tag, number);
    shd_reply reply = answer(number, size);
    shd_cached cached = shd_cache_put(cache, tag, question, &reply);
    shd_reply_clear(&reply);
    return cached;
}

static void assert_answer(const shd_reply *reply, unsigned number, size_t size) {
    char plan[32];
    snprintf(plan, sizeof plan, "plan %u", number);
    assert_int_equal(reply->status, 200);
    assert_int_equal(reply->header_count, 2);
    assert_string_equal(reply->headers[0].value, plan);
    assert_string_equal(reply->headers[1].value, "image/png");
    assert_int_equal(reply->size, size);
    for (size_t i = 0; i < size; i++)
        assert_int_equal(((const unsigned char *)reply->body)[i], number & 0xff);
}

static bool has(shd_cache *cache, unsigned number, size_t size) {
    char tag[SHD_TAG_SIZE];
    name_tag(tag, number);
    shd_reply reply = {0};
    bool found = shd_cache_find(cache, tag, NULL, &reply) == SHD_CACHE_HIT;
    if (found) assert_answer(&reply, number, size);
    shd_reply_clear(&reply);
    return found;
}

static shd_cached ask(shd_cache *cache, const shd_question *question, unsigned number) {
    char tag[SHD_TAG_SIZE], wanted[SHD_TAG_SIZE];
    shd_reply reply = {0};
    shd_cached cached = shd_cache_ask(cache, question, tag, &reply);
    if (cached == SHD_CACHE_HIT) {
        name_tag(wanted, number);
        assert_string_equal(tag, wanted);
        assert_answer(&reply, number, 100);
    }
    shd_reply_clear(&reply);
    return cached;
}

static shd_question question_of(const char *text) {
    return (shd_question){
        .body = (unsigned char *)(uintptr_t)text, .size = strlen(text), .picture_accepted = true};
}

static void an_answer_is_found_by_its_tag(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    assert_false(has(cache, 1, 100));
    assert_int_equal(put(cache, 1, 100, NULL), SHD_CACHE_STORED);
    assert_true(has(cache, 1, 100));
    assert_false(has(cache, 2, 100));
    shd_cache_load load = shd_cache_load_of(cache);
    assert_int_equal(load.entries, 1);
    assert_true(load.bytes > 100);
    shd_cache_drop(cache);
}

static void an_answer_is_found_by_the_question_that_last_had_it(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    const shd_question first = question_of("{\"objects\": []}"), other = question_of("{ }"),
                       empty = {.picture_accepted = true};
    assert_int_equal(ask(cache, &first, 1), SHD_CACHE_MISS);
    put(cache, 1, 100, &first);
    assert_int_equal(ask(cache, &first, 1), SHD_CACHE_HIT);
    size_t bytes = shd_cache_load_of(cache).bytes;

    char tag[SHD_TAG_SIZE];
    name_tag(tag, 1);
    shd_reply reply = {0};
    assert_int_equal(ask(cache, &other, 1), SHD_CACHE_MISS);
    assert_int_equal(shd_cache_find(cache, tag, &other, &reply), SHD_CACHE_HIT);
    shd_reply_clear(&reply);
    assert_int_equal(ask(cache, &other, 1), SHD_CACHE_HIT);
    assert_int_equal(ask(cache, &first, 1), SHD_CACHE_MISS);
    assert_int_equal(shd_cache_load_of(cache).bytes, bytes - first.size + other.size);

    /* A document of no bytes is one as well. */
    put(cache, 2, 100, &empty);
    assert_int_equal(ask(cache, &empty, 2), SHD_CACHE_HIT);
    shd_cache_drop(cache);
}

static void every_member_of_a_question_counts(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    const shd_question asked = question_of("{\"objects\": []}");
    put(cache, 1, 100, &asked);
    shd_question differs[] = {asked, asked, asked, asked, question_of("{\"objects\": []} ")};
    differs[0].fallback = SHD_WEBP;
    differs[1].picture_accepted = false;
    differs[2].settings = 1;
    differs[3].size--;
    for (size_t i = 0; i < sizeof differs / sizeof differs[0]; i++)
        assert_int_equal(ask(cache, &differs[i], 1), SHD_CACHE_MISS);
    assert_int_equal(ask(cache, &asked, 1), SHD_CACHE_HIT);
    shd_cache_drop(cache);
}

static void long_questions_are_not_kept(void **state) {
    (void)state;
    shd_cache *cache = new_cache(8 << 20);
    char *text = malloc(70 * KB);
    assert_non_null(text);
    memset(text, ' ', 70 * KB);
    shd_question asked = {.body = (unsigned char *)text, .size = 70 * KB};
    assert_int_equal(put(cache, 1, 100, &asked), SHD_CACHE_STORED);
    assert_true(has(cache, 1, 100));
    assert_int_equal(ask(cache, &asked, 1), SHD_CACHE_MISS);
    assert_true(shd_cache_load_of(cache).bytes < 10 * KB);
    free(text);
    shd_cache_drop(cache);
}

static void the_least_recently_used_goes_first(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    unsigned count = 0;
    while (shd_cache_load_of(cache).evictions == 0) {
        assert_int_equal(put(cache, count, 6 * KB, NULL), SHD_CACHE_STORED);
        assert_true(has(cache, 0, 6 * KB)); /* used again and again */
        count++;
        assert_true(shd_cache_load_of(cache).bytes <= 64 * KB);
    }
    assert_true(count > 8);
    assert_int_equal(shd_cache_load_of(cache).entries, count - 1);
    assert_false(has(cache, 1, 6 * KB));
    for (unsigned i = 2; i < count; i++) assert_true(has(cache, i, 6 * KB));
    shd_cache_drop(cache);
}

static void questions_count_and_go_with_their_answers(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    for (unsigned i = 0; i < 100; i++) {
        char text[4 * KB];
        memset(text, 'x', sizeof text);
        snprintf(text, sizeof text, "%u", i);
        const shd_question asked = {.body = (unsigned char *)text, .size = sizeof text};
        put(cache, i, 100, &asked);
        assert_int_equal(ask(cache, &asked, i), SHD_CACHE_HIT);
        assert_true(shd_cache_load_of(cache).bytes <= 64 * KB);
    }
    shd_cache_load load = shd_cache_load_of(cache);
    assert_true(load.entries < 16);
    assert_int_equal(load.entries + load.evictions, 100);
    shd_cache_drop(cache);
}

static void an_answer_above_an_eighth_of_the_cap_is_not_kept(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    put(cache, 1, 100, NULL);
    assert_int_equal(put(cache, 2, 8 * KB, NULL), SHD_CACHE_MISS);
    assert_false(has(cache, 2, 8 * KB));
    assert_int_equal(put(cache, 3, 7 * KB, NULL), SHD_CACHE_STORED);
    assert_true(has(cache, 1, 100));
    shd_cache_drop(cache);
}

static void without_a_cap_nothing_is_kept(void **state) {
    (void)state;
    shd_cache *cache = new_cache(0);
    shd_reply reply = {0};
    const shd_question asked = question_of("{}");
    assert_int_equal(put(cache, 1, 100, &asked), SHD_CACHE_OFF);
    assert_int_equal(ask(cache, &asked, 1), SHD_CACHE_OFF);
    assert_int_equal(shd_cache_find(cache, "", NULL, &reply), SHD_CACHE_OFF);
    assert_int_equal(shd_cache_load_of(cache).entries, 0);
    shd_cache_drop(cache);
}

static void what_is_forgotten_while_it_is_sent_stays_whole(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    put(cache, 1, 6 * KB, NULL);
    char tag[SHD_TAG_SIZE];
    name_tag(tag, 1);
    shd_reply sent = {0};
    assert_int_equal(shd_cache_find(cache, tag, NULL, &sent), SHD_CACHE_HIT);
    for (unsigned i = 2; i < 30; i++) put(cache, i, 6 * KB, NULL);
    assert_false(has(cache, 1, 6 * KB));
    assert_answer(&sent, 1, 6 * KB);
    shd_cache_drop(cache);
    assert_answer(&sent, 1, 6 * KB);
    shd_reply_clear(&sent);
}

static void the_first_of_equal_answers_stays(void **state) {
    (void)state;
    shd_cache *cache = new_cache(64 * KB);
    put(cache, 1, 100, NULL);
    size_t bytes = shd_cache_load_of(cache).bytes;
    assert_int_equal(put(cache, 1, 100, NULL), SHD_CACHE_STORED);
    assert_int_equal(shd_cache_load_of(cache).entries, 1);
    assert_int_equal(shd_cache_load_of(cache).bytes, bytes);
    shd_cache_drop(cache);
}

/* Threads that put, find and ask for the same few answers, in a cache with room for a third. */
enum { THREADS = 4, ROUNDS = 2000, ANSWERS = 24 };

static void *work(void *context) {
    shd_cache *cache = context;
    for (unsigned i = 0; i < ROUNDS; i++) {
        unsigned number = i * 7 % ANSWERS;
        char text[16], tag[SHD_TAG_SIZE];
        snprintf(text, sizeof text, "%u", number);
        const shd_question asked = question_of(text);
        shd_reply reply = {0};
        if (shd_cache_ask(cache, &asked, tag, &reply) == SHD_CACHE_MISS) {
            name_tag(tag, number);
            if (shd_cache_find(cache, tag, &asked, &reply) == SHD_CACHE_MISS) {
                reply = answer(number, 900);
                if (shd_cache_put(cache, tag, i % 2 ? &asked : NULL, &reply) != SHD_CACHE_STORED)
                    abort();
            }
        }
        /* Not cmocka's: its checks belong to one thread. */
        if (reply.size != 900 || ((const unsigned char *)reply.body)[899] != number) abort();
        shd_reply_clear(&reply);
    }
    return NULL;
}

static void any_thread_may_ask_at_any_time(void **state) {
    (void)state;
    shd_cache *cache = new_cache(16 * KB);
    pthread_t threads[THREADS];
    for (int i = 0; i < THREADS; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, work, cache), 0);
    for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
    shd_cache_load load = shd_cache_load_of(cache);
    assert_true(load.bytes <= 16 * KB);
    assert_true(load.entries < ANSWERS);
    assert_true(load.evictions > 0);
    shd_cache_drop(cache);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_answer_is_found_by_its_tag),
        cmocka_unit_test(an_answer_is_found_by_the_question_that_last_had_it),
        cmocka_unit_test(every_member_of_a_question_counts),
        cmocka_unit_test(long_questions_are_not_kept),
        cmocka_unit_test(the_least_recently_used_goes_first),
        cmocka_unit_test(questions_count_and_go_with_their_answers),
        cmocka_unit_test(an_answer_above_an_eighth_of_the_cap_is_not_kept),
        cmocka_unit_test(without_a_cap_nothing_is_kept),
        cmocka_unit_test(what_is_forgotten_while_it_is_sent_stays_whole),
        cmocka_unit_test(the_first_of_equal_answers_stays),
        cmocka_unit_test(any_thread_may_ask_at_any_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
