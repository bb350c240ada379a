/* The trees over triangles. */
#include <pthread.h>
#include <unistd.h>

#include "sight/mesh.h"
#include "sight/tree.h"
#include "solid.h"

/* A point's coordinates in a branch's box. Of turned ones, the box has to be larger than what is
 * rounded here. */
static shd_vec3 place_in(const shd_mesh_tree *tree, const shd_branch *b, shd_vec3 p) {
    p = shd_sub(p, tree->middle);
    if (!b->turn) return p;
    assert_true(b->turn < tree->turn_count);
    const shd_vec3 *axis = tree->turns[b->turn].axis;
    return (shd_vec3){shd_dot(axis[0], p), shd_dot(axis[1], p), shd_dot(axis[2], p)};
}

/* Every corner of every triangle is in the box. */
static void check_inside(const shd_mesh_tree *tree, const shd_triangles *t, const shd_branch *box,
                         const shd_branch *b) {
    if (!b->count) {
        check_inside(tree, t, box, &tree->branches[b->first]);
        check_inside(tree, t, box, &tree->branches[b->first + 1]);
        return;
    }
    for (uint32_t i = b->first; i < b->first + b->count; i++)
        for (int k = 0; k < 3; k++) {
            const shd_vec3 at =
                shd_scale(shd_vec3_at(t->positions, tree->leaves[i].corner[k]), tree->scale);
            const shd_vec3 in = place_in(tree, box, at);
            assert_true(in.x >= (double)box->low[0] && in.x <= (double)box->high[0]);
            assert_true(in.y >= (double)box->low[1] && in.y <= (double)box->high[1]);
            assert_true(in.z >= (double)box->low[2] && in.z <= (double)box->high[2]);
        }
}

/* Every triangle is in one leaf, in all boxes above it, and paths are not longer than told. */
static size_t walk_tree(const shd_mesh_tree *tree, const shd_triangles *t, uint32_t at, int depth,
                        uint8_t *found) {
    const shd_branch *b = &tree->branches[at];
    assert_true(depth <= SHD_TREE_DEPTH);
    check_inside(tree, t, b, b);
    if (!b->count) {
        for (uint32_t child = b->first; child < b->first + 2; child++)
            for (int c = 0; c < 3 && tree->branches[child].turn == b->turn; c++) {
                assert_true(tree->branches[child].low[c] >= b->low[c]);
                assert_true(tree->branches[child].high[c] <= b->high[c]);
            }
        return walk_tree(tree, t, b->first, depth + 1, found) +
               walk_tree(tree, t, b->first + 1, depth + 1, found);
    }
    for (uint32_t i = b->first; i < b->first + b->count; i++) {
        const shd_leaf *leaf = &tree->leaves[i];
        const uint32_t triangle = leaf->name / 16, first = leaf->name / 4 % 4,
                       second = leaf->name % 4;
        const uint32_t place[3] = {first, second, 3 - first - second};
        assert_false(found[triangle]++);
        for (int k = 0; k < 3; k++) {
            const uint32_t corner = t->indices[3 * triangle + (uint32_t)k];
            assert_int_equal(leaf->corner[place[k]], corner);
            for (int c = 0; c < 3; c++)
                assert_true(fabs(t->positions[3 * (size_t)corner + (size_t)c] * tree->scale) <= 1);
        }
    }
    return b->count;
}

static void check_tree(const solid *s, size_t wanted) {
    shd_arena *arena = shd_arena_new((size_t)1 << 30);
    const shd_triangles t = {s->vertices, s->triangles, s->positions[0], NULL, s->indices[0], NULL};
    const shd_mesh_tree *tree = NULL;
    shd_error error;
    assert_int_equal(shd_mesh_tree_new(&t, NULL, arena, &tree, &error), SHD_OK);
    uint8_t *found = calloc(s->triangles, 1);
    assert_non_null(found);
    if (tree->leaf_count) assert_int_equal(walk_tree(tree, &t, 0, 1, found), tree->leaf_count);
    if (wanted != SIZE_MAX) assert_int_equal(tree->leaf_count, wanted);
    free(found);
    shd_arena_drop(arena);
}

/* A leaf's name would not hold the numbers of its triangles. */
static void a_mesh_with_too_many_triangles_is_refused(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new((size_t)1 << 20);
    const shd_triangles t = {.triangle_count = (size_t)SHD_TREE_TRIANGLES + 1};
    const shd_mesh_tree *tree = NULL;
    shd_error error = {.status = SHD_OK};
    assert_int_equal(shd_mesh_tree_new(&t, NULL, arena, &tree, &error), SHD_MEMORY);
    assert_string_equal(error.text, "a mesh has more than 134217728 triangles");
    assert_null(tree);
    shd_arena_drop(arena);
}

static void every_triangle_with_an_area_is_in_one_leaf(void **state) {
    (void)state;
    uint64_t random = 9;
    for (int k = 0; k < 40; k++) {
        solid s = new_solid(3 * 5000, 5000);
        const size_t count = (size_t)(k < 10 ? k + 1 : 1 + below(&random, 5000));
        /* Spread evenly, over many powers of ten, along a line, or all with the same middle. */
        for (size_t i = 0; i < count; i++) {
            const double size = k % 4 == 1 ? pow(10, -uniform(&random, 0, 300)) : 1;
            const double x = uniform(&random, -1, 1), d = uniform(&random, 0.1, 1) * size;
            const shd_vec3 at = k % 4 < 2    ? shd_scale(random_direction(&random), size)
                                : k % 4 == 2 ? (shd_vec3){x, 0, 0}
                                             : (shd_vec3){0, 0, 0};
            const uint32_t a = add_vertex(&s, at.x - d, at.y - d, at.z),
                           b = add_vertex(&s, at.x + d, at.y - d, at.z),
                           c = add_vertex(&s, at.x, at.y + d, at.z);
            add_triangle(&s, a, b, c);
        }
        check_tree(&s, k % 4 == 1 ? SIZE_MAX /* areas vanish */ : count);
        drop_solid(&s);
    }
}

/* ... though boxes are in f32. */
static void boxes_tell_triangles_apart_far_from_the_origin(void **state) {
    (void)state;
    enum { SIDE = 30 };
    solid s = new_solid(3 * SIDE * SIDE, SIDE * SIDE);
    for (int i = 0; i < SIDE * SIDE; i++) {
        const double x = 1e9 + i % SIDE, y = 1e9 + i / SIDE;
        const uint32_t a = add_vertex(&s, x, y, 1e9), b = add_vertex(&s, x + 1, y, 1e9),
                       c = add_vertex(&s, x, y + 1, 1e9);
        add_triangle(&s, a, b, c);
    }
    shd_arena *arena = shd_arena_new((size_t)1 << 30);
    const shd_triangles t = {s.vertices, s.triangles, s.positions[0], NULL, s.indices[0], NULL};
    const shd_mesh_tree *tree = NULL;
    shd_error error;
    assert_int_equal(shd_mesh_tree_new(&t, NULL, arena, &tree, &error), SHD_OK);
    for (uint32_t i = 2; i < tree->branch_count; i++) {
        const shd_branch *b = &tree->branches[i];
        for (int c = 0; c < 2 && b->count; c++)
            assert_true((double)(b->high[c] - b->low[c]) < 4.01 * tree->scale);
    }
    shd_arena_drop(arena);
    drop_solid(&s);
}

static void a_hundred_thousand_equal_triangles_are_one(void **state) {
    (void)state;
    solid s = new_solid(3, 100000);
    add_vertex(&s, 0, 0, 0), add_vertex(&s, 1, 0, 0), add_vertex(&s, 0, 1, 0);
    for (int i = 0; i < 100000; i++) add_triangle(&s, 0, 1, 2);
    check_tree(&s, 1);
    drop_solid(&s);
}

static void triangles_without_an_area_are_in_none(void **state) {
    (void)state;
    solid s = new_solid(100, 100);
    add_square(&s, 1, 0);
    add_vertex(&s, 0, 0, 0), add_vertex(&s, 0.5, 0, 0), add_vertex(&s, 1, 0, 0);
    for (uint32_t i = 0; i < 4; i++) add_triangle(&s, i, i, 3 - i), add_triangle(&s, 4, 5, 6);
    check_tree(&s, 2);
    drop_solid(&s);
}

/* ---- Cancelling. ---- */

typedef struct canceller {
    atomic_bool flag;
    useconds_t pause;
} canceller;

static void *cancel_later(void *context) {
    canceller *c = context;
    usleep(c->pause);
    atomic_store(&c->flag, true);
    return NULL;
}

static void a_build_ends_when_it_is_cancelled(void **state) {
    (void)state;
    srand(4);
    shd_arena *torus = shd_arena_new((size_t)1 << 28);
    shd_triangles t;
    assert_true(shd_tessellate(SHD_TORUS, 0.4, 400, torus, &t));
    assert_true(t.triangle_count > 300000);
    for (int round = 0; round < 8; round++) {
        /* At once, then wherever the build is by then, it may be over; in the end not at all. */
        canceller c = {.pause = (useconds_t)(rand() % 200000)};
        atomic_init(&c.flag, round == 1);
        pthread_t thread;
        const bool amid = round > 1 && round < 7;
        if (amid) assert_int_equal(pthread_create(&thread, NULL, cancel_later, &c), 0);
        shd_arena *arena = shd_arena_new((size_t)1 << 28);
        shd_error error = {.status = SHD_OK};
        const shd_mesh_tree *tree = NULL;
        const shd_status status = shd_mesh_tree_new(&t, &c.flag, arena, &tree, &error);
        if (amid) pthread_join(thread, NULL);
        if (round == 1) assert_int_equal(status, SHD_CANCELLED);
        if (!round || round == 7) assert_int_equal(status, SHD_OK);
        assert_int_equal(tree == NULL, status != SHD_OK);
        if (status) assert_int_equal(error.status, SHD_CANCELLED);
        shd_arena_drop(arena);
    }
    shd_arena_drop(torus);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mesh_with_too_many_triangles_is_refused),
        cmocka_unit_test(every_triangle_with_an_area_is_in_one_leaf),
        cmocka_unit_test(boxes_tell_triangles_apart_far_from_the_origin),
        cmocka_unit_test(a_hundred_thousand_equal_triangles_are_one),
        cmocka_unit_test(triangles_without_an_area_are_in_none),
        cmocka_unit_test(a_build_ends_when_it_is_cancelled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
