/* Threads share the work and leave no trace in the picture. */
#include <pthread.h>
#include <sched.h>

#include "property/pieces.h"

/* Scene `kind` of several that share nothing but the engine: meshes, facets, layers' planes,
 * many tiles. */
static char *scene(int kind) {
    static const char *const interpolations[] = {"phong", "gouraud", "flat", "phong"};
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 61, \"height\": 47, \"samples\": %d}, \"interpolation\": "
            "\"%s\", \"accuracy\": {\"tier\": \"%s\"}, \"background\": %s, \"lights\": [{\"type\":"
            " \"point\"}, {\"type\": \"spot\"}, {\"type\": \"directional\"}], \"objects\": "
            "[{\"type\": \"sphere\", \"material\": {\"diffuse\": 0.%d, \"specular\": 0.5}}, "
            "{\"type\": \"torus\", \"material\": {\"diffuse\": 0.4, \"specular\": 0.1}}, "
            "{\"type\": \"mesh\", ",
            9 + kind, interpolations[kind % 4], kind % 2 ? "exact" : "standard",
            kind % 3 ? "0.1" : "null", kind + 1);
    write_ball(w.out, 12 + kind, 8, kind % 2);
    fputs(", \"transform\": {\"scale\": 0.7, \"translate\": [0.6, 0.6, 0.6]}}]}", w.out);
    return finish(&w);
}

static void any_number_of_threads_gives_the_same_bytes(void **state) {
    (void)state;
    static const unsigned threads[] = {1, 2, 5};
    for (int kind = 0; kind < 4; kind++) {
        char *json = scene(kind);
        file first = {NULL, 0};
        for (int k = 0; k < 3; k++) {
            shd_engine *engine = new_engine(threads[k]);
            file png = png_of(engine, json);
            shd_engine_drop(engine);
            if (k) {
                assert_true(same_file(first, png));
                free(png.data);
            } else {
                first = png;
            }
        }
        free(first.data);
        free(json);
    }
}

static void any_number_of_threads_gives_the_same_floats(void **state) {
    (void)state;
    char *json = scene(0);
    shd_engine *one = new_engine(1), *many = new_engine(5);
    drawn a = film_of(one, json), b = film_of(many, json);
    assert_true(same_film(&a, &b));
    drop_drawn(&a);
    drop_drawn(&b);
    shd_engine_drop(one);
    shd_engine_drop(many);
    free(json);
}

static void rendering_again_gives_the_same_bytes(void **state) {
    for (int kind = 0; kind < 4; kind++)
        for (int again = 0; again < 3; again++)
            assert_true(same_png(*state, scene(kind), scene(kind)));
}

/* One client of several; asserts are the main thread's, so it only counts. */
enum { CLIENTS = 8, ROUNDS = 2 };

typedef struct client {
    pthread_t thread;
    shd_engine *engine;
    char *json;
    file alone;
    int right;
} client;

static void *ask(void *context) {
    client *c = context;
    for (int i = 0; i < ROUNDS; i++) {
        file png;
        if (try_png_of(c->engine, c->json, &png) == SHD_OK && same_file(png, c->alone)) c->right++;
        free(png.data);
    }
    return NULL;
}

static void requests_side_by_side_do_not_see_each_other(void **state) {
    client clients[CLIENTS];
    /* A fresh engine: the first meshes and color transforms come at the same time too. */
    shd_engine *engine = new_engine(3);
    for (int i = 0; i < CLIENTS; i++) {
        clients[i] = (client){.engine = engine, .json = scene(i)};
        clients[i].alone = png_of(*state, clients[i].json);
    }
    for (int i = 0; i < CLIENTS; i++)
        assert_int_equal(pthread_create(&clients[i].thread, NULL, ask, &clients[i]), 0);
    for (int i = 0; i < CLIENTS; i++) pthread_join(clients[i].thread, NULL);
    shd_engine_drop(engine);
    for (int i = 0; i < CLIENTS; i++) {
        assert_int_equal(clients[i].right, ROUNDS);
        free(clients[i].alone.data);
        free(clients[i].json);
    }
}

static void ask_on_a_worker(void *context) {
    ask(context);
}

static void jobs_of_the_engine_give_the_same_bytes(void **state) {
    client clients[CLIENTS];
    shd_engine *engine = new_engine(2);
    for (int i = 0; i < CLIENTS; i++) {
        clients[i] = (client){.engine = engine, .json = scene(i)};
        clients[i].alone = png_of(*state, clients[i].json);
        assert_true(shd_engine_submit(engine, ask_on_a_worker, &clients[i]));
    }
    shd_engine_drop(engine); /* finishes them first */
    for (int i = 0; i < CLIENTS; i++) {
        assert_int_equal(clients[i].right, ROUNDS);
        free(clients[i].alone.data);
        free(clients[i].json);
    }
}

/* ---- Progress and cancelling. ---- */

/* An engine whose only worker is held, so that the caller renders every tile: progress is then
 * sure to be called. */
typedef struct held_engine {
    shd_engine *engine;
    atomic_bool release;
} held_engine;

static void hold(void *context) {
    held_engine *h = context;
    while (!atomic_load(&h->release)) sched_yield();
}

static void new_held_engine(held_engine *h) {
    h->engine = new_engine(1);
    atomic_init(&h->release, false);
    assert_true(shd_engine_submit(h->engine, hold, h));
    while (!shd_engine_load(h->engine).busy) sched_yield();
}

static void drop_held_engine(held_engine *h) {
    atomic_store(&h->release, true);
    shd_engine_drop(h->engine);
}

static void cancel_now(void *context, double share) {
    (void)share;
    shd_request_cancel(context);
}

static void a_cancelled_render_says_so_and_gives_nothing(void **state) {
    (void)state;
    held_engine held;
    new_held_engine(&held);
    char *json = scene(0);
    for (int during = 0; during < 2; during++) {
        shd_request *request = read_scene(held.engine, json);
        if (!during) shd_request_cancel(request);
        shd_render_options options = {cancel_now, request};
        shd_error error;
        assert_int_equal(shd_request_render(request, &options, &error), SHD_CANCELLED);
        assert_int_equal(error.status, SHD_CANCELLED);
        size_t count = 42;
        shd_request_pictures(request, &count);
        assert_int_equal(count, 0);
        shd_request_drop(request);
    }
    assert_true(same_png(held.engine, scene(0), scene(0))); /* the engine goes on */
    free(json);
    drop_held_engine(&held);
}

static void *cancel_from_thread(void *context) {
    shd_request_cancel(context);
    return NULL;
}

static void any_thread_may_cancel(void **state) {
    char *json = scene(1);
    for (int i = 0; i < 10; i++) {
        shd_request *request = read_scene(*state, json);
        pthread_t thread;
        assert_int_equal(pthread_create(&thread, NULL, cancel_from_thread, request), 0);
        shd_error error;
        shd_status status = shd_request_render(request, NULL, &error);
        pthread_join(thread, NULL);
        assert_true(status == SHD_CANCELLED || status == SHD_OK); /* whoever was first */
        shd_request_drop(request);
    }
    free(json);
}

typedef struct progress {
    pthread_t caller;
    double last;
    int calls, wrong;
} progress;

static void note_share(void *context, double share) {
    progress *p = context;
    p->wrong += share < p->last || share > 1 || !pthread_equal(p->caller, pthread_self());
    p->last = share;
    p->calls++;
}

static void progress_grows_to_one_on_the_callers_thread(void **state) {
    (void)state;
    held_engine held;
    new_held_engine(&held);
    char *json = scene(0);
    shd_request *request = read_scene(held.engine, json);
    progress p = {.caller = pthread_self()};
    shd_render_options options = {note_share, &p};
    shd_error error;
    assert_int_equal(shd_request_render(request, &options, &error), SHD_OK);
    assert_true(p.calls > 1 && !p.wrong && p.last == 1);
    shd_request_drop(request);
    free(json);
    drop_held_engine(&held);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_threads_gives_the_same_bytes),
        cmocka_unit_test(any_number_of_threads_gives_the_same_floats),
        cmocka_unit_test(rendering_again_gives_the_same_bytes),
        cmocka_unit_test(requests_side_by_side_do_not_see_each_other),
        cmocka_unit_test(jobs_of_the_engine_give_the_same_bytes),
        cmocka_unit_test(a_cancelled_render_says_so_and_gives_nothing),
        cmocka_unit_test(any_thread_may_cancel),
        cmocka_unit_test(progress_grows_to_one_on_the_callers_thread),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
