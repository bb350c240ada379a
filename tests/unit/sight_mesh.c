/* Meshes, end to end: a scene's JSON to hits, against every triangle tried in long double. And the
 * pattern of samples. */
#include "property/pieces.h"

#include <pthread.h>
#include <unistd.h>

#include "sight/item.h"
#include "sight/tree.h"

enum { SIDE = 64, ALL = SIDE * SIDE };

/* ---- Scenes of one mesh. ---- */

typedef struct solid {
    size_t vertices, triangles;
    double (*positions)[3];
    uint32_t (*indices)[3];
} solid;

static solid new_solid(size_t vertices, size_t triangles) {
    solid s = {0, 0, calloc(vertices, sizeof *s.positions), calloc(triangles, sizeof *s.indices)};
    assert_true(s.positions && s.indices);
    return s;
}

static void drop_solid(solid *s) {
    free(s->positions);
    free(s->indices);
}

static uint32_t add_vertex(solid *s, double x, double y, double z) {
    double *to = s->positions[s->vertices];
    to[0] = x, to[1] = y, to[2] = z;
    return (uint32_t)s->vertices++;
}

static void add_triangle(solid *s, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *to = s->indices[s->triangles++];
    to[0] = a, to[1] = b, to[2] = c;
}

/* A square in the plane y = height, as two triangles. */
static void add_square(solid *s, double half, double height) {
    const uint32_t a = add_vertex(s, -half, height, -half), b = add_vertex(s, half, height, -half),
                   c = add_vertex(s, half, height, half), d = add_vertex(s, -half, height, half);
    add_triangle(s, a, c, b);
    add_triangle(s, a, d, c);
}

static void add_ball(solid *s, int slices, int stacks, double radius) {
    const uint32_t first = (uint32_t)s->vertices, row = (uint32_t)slices;
    for (int k = 0; k <= stacks; k++)
        for (int i = 0; i < slices; i++) {
            const double theta = SHD_PI * k / stacks, phi = 2 * SHD_PI * i / slices;
            const double ring = k == 0 || k == stacks ? 0 : radius * sin(theta);
            add_vertex(s, ring * cos(phi), radius * cos(theta), ring * sin(phi));
        }
    for (uint32_t k = 0; k < (uint32_t)stacks; k++)
        for (uint32_t i = 0; i < row; i++) {
            const uint32_t a = first + k * row + i, b = first + k * row + (i + 1) % row;
            if (k > 0) add_triangle(s, a, b, b + row);
            if (k + 1 < (uint32_t)stacks) add_triangle(s, a, b + row, a + row);
        }
}

/* The mesh as flat, so that hits name their triangle. */
static char *scene_of(const solid *s, const char *camera, const char *more) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"lights\": [], "
            "\"accuracy\": {\"tier\": \"exact\"}, \"camera\": {%s}, \"objects\": [{\"type\": "
            "\"mesh\", \"interpolation\": \"flat\"%s, \"positions\": [",
            SIDE, SIDE, camera, more);
    for (size_t i = 0; i < 3 * s->vertices; i++)
        fprintf(w.out, "%s%.17g", i ? ", " : "", s->positions[i / 3][i % 3]);
    fputs("], \"indices\": [", w.out);
    for (size_t i = 0; i < 3 * s->triangles; i++)
        fprintf(w.out, "%s%u", i ? ", " : "", s->indices[i / 3][i % 3]);
    fputs("]}]}", w.out);
    return finish(&w);
}

/* ---- What is seen of them. ---- */

typedef struct seen {
    shd_request *request;
    shd_sight *sight;
    shd_hits hits;
} seen;

static seen see(shd_engine *engine, const char *json, shd_isa isa) {
    static int32_t x[ALL], y[ALL];
    static uint8_t sample[ALL];
    const uint32_t object = 0;
    seen s = {.request = read_scene(engine, json)};
    shd_error error = {SHD_OK, "", ""};
    shd_arena *arena = s.request->rendering.arena;
    if (shd_plan_make(s.request->scene, isa, NULL, NULL, arena, &s.request->rendering.plan,
                      &error) ||
        shd_sight_new(s.request->rendering.plan, NULL, arena, &s.sight, &error))
        fail_msg("%s: %s", error.path, error.text);
    s.hits = new_hits(s.request->rendering.plan, ALL, arena);
    for (int i = 0; i < ALL; i++) {
        /* block by block, as bundles of other shapes than rows */
        x[i] = i / 64 % 8 * 8 + i % 8;
        y[i] = i / 512 * 8 + i % 64 / 8;
        sample[i] = 0;
    }
    const shd_shots shots = {ALL, x, y, sample};
    shd_sight_shoot(s.sight, &object, 1, &shots, &s.hits);
    for (size_t i = 0; i < s.hits.count; i++) {
        const uint32_t shot = s.hits.shot[i];
        s.hits.shot[i] = (uint32_t)(y[shot] * SIDE + x[shot]);
    }
    return s;
}

static void drop_seen(seen *s) {
    shd_request_drop(s->request);
}

/* ---- Every triangle, in long double. ---- */

typedef struct vector {
    long double v[3];
} vector;

static vector vector_of(shd_vec3 a) {
    return (vector){{a.x, a.y, a.z}};
}

static long double dot(vector a, vector b) {
    return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2];
}

/* The triangles' corners in the camera's frame: x right, y up, z forward. */
static vector (*corners_of(const seen *s))[3] {
    const shd_item *it = &s->sight->items[0];
    const shd_triangles *tri = &it->triangles;
    const shd_camera *camera = &s->request->scene->camera;
    const vector axes[3] = {vector_of(camera->right), vector_of(camera->up),
                            vector_of(shd_scale(camera->back, -1))};
    vector(*out)[3] = calloc(tri->triangle_count + 1, sizeof *out);
    assert_non_null(out);
    for (size_t i = 0; i < 3 * tri->triangle_count; i++) {
        const double *p = tri->positions + 3 * (size_t)tri->indices[i];
        const vector at = {{p[0], p[1], p[2]}}, origin = vector_of(it->to_world.origin),
                     eye = vector_of(camera->position);
        vector from;
        for (int r = 0; r < 3; r++) {
            const double *row = it->to_world.linear[r];
            from.v[r] = dot((vector){{row[0], row[1], row[2]}}, at) + (origin.v[r] - eye.v[r]);
        }
        for (int c = 0; c < 3; c++) out[i / 3][i % 3].v[c] = dot(axes[c], from);
    }
    return out;
}

/* What the ray through (p, q) of the image plane meets first. */
typedef struct truth {
    long double depth,
        slope;         /* INFINITY: nothing; of the depth across the image, of that triangle */
    long double doubt; /* how far the ray is from being decided otherwise */
} truth;

/* A triangle at which the ray may be on either side of an edge, or two that are equally far, make
 * doubt: a distance at the triangle, and in depth. */
static truth try_every_triangle(vector (*corners)[3], size_t count, bool orthographic,
                                long double p, long double q) {
    truth out = {INFINITY, 0, INFINITY};
    long double second = INFINITY;
    for (size_t i = 0; i < count; i++) {
        long double a[3][2], edge[3], least = INFINITY, area = 0, depth = 0;
        for (int k = 0; k < 3; k++) {
            const vector *c = &corners[i][k];
            const long double w = orthographic ? 1 : c->v[2];
            a[k][0] = c->v[0] - p * w;
            a[k][1] = c->v[1] - q * w;
        }
        for (int k = 0; k < 3; k++) {
            const long double *m = a[(k + 1) % 3], *n = a[(k + 2) % 3];
            edge[k] = m[0] * n[1] - m[1] * n[0];
            area += edge[k];
            depth += edge[k] * corners[i][k].v[2];
        }
        const long double sign = area < 0 ? -1 : 1;
        for (int k = 0; k < 3; k++) {
            const long double *m = a[(k + 1) % 3], *n = a[(k + 2) % 3];
            const long double x = m[0] - n[0], y = m[1] - n[1];
            const long double distance = sign * edge[k] / sqrtl(x * x + y * y);
            if (!(distance >= least)) least = distance;
        }
        depth /= area;
        if (fabsl(least) < out.doubt) out.doubt = fabsl(least);
        if (!(least >= 0) || !(depth > 0)) continue;
        if (depth >= out.depth) {
            if (depth < second) second = depth;
            continue;
        }
        second = out.depth;
        out.depth = depth;
        /* The depth is a linear function of the place across: its extent over the triangle. */
        long double size = 0, reach = 0;
        for (int k = 0; k < 3; k++) {
            size = fmaxl(size, hypotl(a[k][0], a[k][1]));
            reach = fmaxl(reach, fabsl(corners[i][k].v[2] - depth));
        }
        out.slope = reach * size / fabsl(area) + 1;
    }
    if (second - out.depth < out.doubt) out.doubt = second - out.depth;
    return out;
}

static void hold_against(const seen *s, const truth *wanted, long double rounding) {
    const shd_lens lens = s->sight->lens;
    const vector eye = vector_of(lens.camera->position),
                 forward = vector_of(shd_scale(lens.camera->back, -1));
    int32_t hit_of[ALL];
    memset(hit_of, -1, sizeof hit_of);
    for (size_t i = 0; i < s->hits.count; i++) hit_of[s->hits.shot[i]] = (int32_t)i;
    for (int i = 0; i < ALL; i++) {
        if (wanted[i].doubt < rounding) continue;
        if ((hit_of[i] >= 0) != (wanted[i].depth < INFINITY))
            fail_msg("pixel %d, %d: %s", i % SIDE, i / SIDE, hit_of[i] >= 0 ? "hit" : "missed");
        if (hit_of[i] < 0) continue;
        vector to = {{0}};
        for (int c = 0; c < 3; c++)
            to.v[c] = (long double)s->hits.position[c][hit_of[i]] - eye.v[c];
        const long double off = fabsl(dot(to, forward) - wanted[i].depth);
        if (!(off <= rounding * wanted[i].slope))
            fail_msg("pixel %d, %d: depth off by %Lg of %Lg, allowed %Lg", i % SIDE, i / SIDE, off,
                     wanted[i].depth, rounding * wanted[i].slope);
    }
}

/* Holds all pixels against the truth where a doubt is more than rounding of the scene's size.
 * `share`: of pixels that are compared, at least. Returns the hits. */
static size_t check(shd_engine *engine, const char *json, double size, double share) {
    static truth wanted[ALL];
    const long double rounding = 1e-14L * (long double)size;
    size_t hits = 0;
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        seen s = see(engine, json, isa);
        const shd_lens lens = s.sight->lens;
        if (isa == SHD_PORTABLE) {
            vector(*corners)[3] = corners_of(&s);
            int compared = 0;
            for (int i = 0; i < ALL; i++) {
                const long double x = (long double)(i % SIDE) + 0.5L - SIDE / 2,
                                  y = SIDE / 2 - 0.5L - (long double)(i / SIDE);
                wanted[i] = try_every_triangle(corners, s.sight->items[0].triangles.triangle_count,
                                               lens.camera->projection == SHD_ORTHOGRAPHIC,
                                               x / (SIDE / 2) * (long double)lens.half_x,
                                               y / (SIDE / 2) * (long double)lens.half_y);
                compared += wanted[i].doubt >= rounding;
            }
            assert_true(compared >= share * ALL);
            hits = s.hits.count;
            free(corners);
        }
        hold_against(&s, wanted, rounding);
        assert_int_equal(s.hits.count, hits);
        drop_seen(&s);
    }
    return hits;
}

static size_t check_solid(shd_engine *engine, const solid *s, const char *camera, double size,
                          double share) {
    char *json = scene_of(s, camera, "");
    const size_t hits = check(engine, json, size, share);
    free(json);
    return hits;
}

/* ---- Which triangle is seen. ---- */

/* A ball, and in the same mesh ground that is so much larger: in f32 of the mesh's size the ball
 * is lost. */
static void small_parts_of_large_meshes_are_exact(void **state) {
    for (double ratio = 1; ratio < 1e10; ratio *= 100) {
        solid s = new_solid(500, 1000);
        add_ball(&s, 16, 8, 1);
        add_square(&s, ratio, -1.0625);
        /* Corners of the ground make its points exact to their own size. */
        assert_true(check_solid(*state, &s, "\"position\": [1, 2, 3], \"fov\": 50", 4 + ratio,
                                ratio < 1e8 ? 0.95 : 0.2) > 500);
        /* What is seen of the ball is not worse for it. */
        s.triangles -= 2;
        assert_true(check_solid(*state, &s, "\"position\": [1, 2, 3], \"fov\": 50", 4, 0.95) > 500);
        drop_solid(&s);
    }
}

static void the_nearer_of_two_layers_is_seen(void **state) {
    for (double gap = 1e-3; gap > 1e-12; gap /= 100) {
        solid s = new_solid(8, 4);
        add_square(&s, 1, 0);
        add_square(&s, 1, gap);
        check_solid(*state, &s, "\"position\": [0.1, 3, 0.2], \"up\": [0, 0, 1], \"fov\": 50", 4,
                    0.9);
        check_solid(*state, &s, "\"position\": [1, 0.5, 3], \"fov\": 40", 4, 0.8);
        check_solid(*state, &s,
                    "\"type\": \"orthographic\", \"height\": 2, \"position\": [1, 0.5, 3]", 4, 0.8);
        drop_solid(&s);
    }
}

static void edges_are_where_they_are_at_any_zoom(void **state) {
    solid s = new_solid(500, 1000);
    add_ball(&s, 16, 8, 1);
    for (double zoom = 1; zoom < 1e8; zoom *= 100) {
        /* A corner, and the middle of an edge, both on the silhouette. */
        static const char *const targets[] = {"[1, 0, 0]",
                                              "[0.9619397662556434, 0, 0.19134171618254489]"};
        for (int k = 0; k < 2; k++) {
            char *camera = text_of("\"position\": [%.17g, 0.5, 4], \"target\": %s, \"fov\": %.17g",
                                   k ? 0.2 : 1.0, targets[k], 60 / zoom);
            const size_t hits = check_solid(*state, &s, camera, 6, zoom < 1e6 ? 0.99 : 0.9);
            assert_true(hits > 100 && hits < ALL - 100);
            free(camera);
        }
    }
    drop_solid(&s);
}

static void stretched_tori_are_exact(void **state) {
    static const char *const scales[] = {"[1, 0.0001, 1]", "[1, 1, 1000]", "[100, 0.01, 1]"};
    for (int k = 0; k < 3; k++) {
        char *json = text_of(
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"lights\": [], "
            "\"accuracy\": {\"tier\": \"exact\"}, \"camera\": {\"position\": [1, 2, 3]}, "
            "\"objects\": [{\"type\": \"torus\", \"interpolation\": \"flat\", \"segments\": 16, "
            "\"transform\": {\"scale\": %s, \"rotate\": [10, 20, 30]}}]}",
            SIDE, SIDE, scales[k]);
        assert_true(check(*state, json, 2000, 0.5) > 100);
        free(json);
    }
}

static void meshes_far_away_tiny_and_huge_are_exact(void **state) {
    static const double sizes[] = {1, 1e-23, 1e20, 1e-140, 1e140};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
        for (double far = 5; far < 1e8; far *= 1e3) {
            solid s = new_solid(500, 1000);
            add_ball(&s, 16, 8, sizes[k]);
            const double away = far * sizes[k];
            char *camera = text_of("\"position\": [%.17g, %.17g, %.17g], \"fov\": %.17g", away / 7,
                                   away / 5, away, 120 / far);
            assert_true(check_solid(*state, &s, camera, 10 * away, 0.9) > 500);
            free(camera);
            drop_solid(&s);
        }
}

/* ---- No ray slips through. ---- */

/* Orthographic rays at whole multiples of 1/32 through a grid whose vertices are there, too: all of
 * them meet corners, and in a turned frame they do so to within rounding. */
static void no_ray_slips_through_corners_and_edges(void **state) {
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        uint64_t random = 3;
        for (int turn = 0; turn < 40; turn++) {
            const shd_affine r = turn ? random_rotation(&random)
                                      : (shd_affine){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
            const int n = 67; /* vertices a side */
            solid s = new_solid((size_t)(n * n), (size_t)(2 * n * n));
            for (int i = 0; i < n * n; i++) {
                const shd_vec3 at = shd_linear(
                    &r, (shd_vec3){(i % n - 33) / 32.0 + 1 / 64.0, (i / n - 33) / 32.0 + 1 / 64.0,
                                   turn % 2 ? 0 : uniform(&random, -0.1, 0.1)});
                add_vertex(&s, at.x, at.y, at.z);
            }
            for (int i = 0; i < n * n; i++) {
                if (i % n == n - 1 || i / n == n - 1) continue;
                const uint32_t a = (uint32_t)i, under = a + (uint32_t)n;
                if (below(&random, 2)) {
                    add_triangle(&s, a, a + 1, under + 1);
                    add_triangle(&s, a, under + 1, under);
                } else {
                    add_triangle(&s, a, a + 1, under);
                    add_triangle(&s, under, a + 1, under + 1);
                }
            }
            const shd_vec3 eye = shd_linear(&r, (shd_vec3){0, 0, 5}),
                           up = shd_linear(&r, (shd_vec3){0, 1, 0});
            char *camera = text_of("\"type\": \"orthographic\", \"height\": 2, \"position\": "
                                   "[%.17g, %.17g, %.17g], \"up\": [%.17g, %.17g, %.17g]",
                                   eye.x, eye.y, eye.z, up.x, up.y, up.z);
            char *json = scene_of(&s, camera, "");
            seen all = see(*state, json, isa);
            assert_int_equal(all.hits.count, ALL);
            drop_seen(&all);
            free(json);
            free(camera);
            drop_solid(&s);
        }
    }
}

static void from_inside_a_closed_mesh_every_ray_meets_it(void **state) {
    uint64_t random = 5;
    for (int k = 0; k < 30; k++) {
        solid s = new_solid(2000, 4000);
        add_ball(&s, 3 + below(&random, 40), 2 + below(&random, 40), 1);
        const shd_vec3 at =
            shd_scale(random_direction(&random), k % 3 ? uniform(&random, 0, .2) : 0);
        char *camera = text_of("\"position\": [%.17g, %.17g, %.17g], \"target\": [%d, %d, %d], "
                               "\"up\": [0.3, 0.9, 0.2], \"fov\": %d",
                               at.x, at.y, at.z, 1 - below(&random, 3), below(&random, 2), 1,
                               30 + below(&random, 140));
        char *json = scene_of(&s, camera, "");
        seen all = see(*state, json, shd_cpu_best());
        assert_int_equal(all.hits.count, ALL);
        drop_seen(&all);
        free(json);
        free(camera);
        drop_solid(&s);
    }
}

/* An eye in the plane of a square, and one whose rays lie in it. */
static void nothing_is_seen_of_a_triangle_from_its_edge(void **state) {
    static const char *const cameras[] = {
        "\"position\": [0, 0, 4]", "\"position\": [1.25, 0, 3.5], \"target\": [0, 0.5, 0]",
        ("\"type\": \"orthographic\", \"height\": 3.046875, \"position\": [0, 0.0234375, 4], "
         "\"target\": [0, 0.0234375, 0]")};
    for (int k = 0; k < 3; k++) {
        solid s = new_solid(4, 2);
        add_square(&s, 1, 0);
        char *json = scene_of(&s, cameras[k], "");
        seen none = see(*state, json, shd_cpu_best());
        assert_int_equal(none.hits.count, 0);
        drop_seen(&none);
        free(json);
        drop_solid(&s);
    }
}

/* ---- Repeated triangles. ---- */

static void of_equal_triangles_the_first_is_seen(void **state) {
    static const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                     {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    static const int copies[] = {2, 7, 1000};
    for (int k = 0; k < 3; k++) {
        solid s = new_solid(500, 1000 * 600);
        add_ball(&s, 16, 12, 1);
        const size_t once = s.triangles;
        for (int n = 1; n < copies[k]; n++)
            for (size_t i = 0; i < once; i++) {
                const uint32_t *c = s.indices[i];
                const int *o = orders[((size_t)n + i) % 6];
                add_triangle(&s, c[o[0]], c[o[1]], c[o[2]]);
            }
        char *json = scene_of(&s, "\"position\": [1, 2, 3], \"fov\": 40", "");
        seen all = see(*state, json, shd_cpu_best());
        assert_true(all.hits.count > 1000);
        for (size_t i = 0; i < all.hits.count; i++) assert_true(all.hits.triangle[i] < once);
        /* Where there are many, rays do not try them all. */
        if (k == 2) assert_int_equal(all.sight->items[0].view.tree->leaf_count, once);
        drop_seen(&all);
        free(json);
        drop_solid(&s);
    }
}

/* ---- Trees. ---- */

/* Every triangle is in one leaf, in all boxes above it, and paths are not longer than told. */
static size_t walk_tree(const shd_mesh_tree *tree, const shd_triangles *t, uint32_t at, int depth,
                        uint8_t *found) {
    const shd_branch *b = &tree->branches[at];
    assert_true(depth <= SHD_TREE_DEPTH);
    if (!b->count) {
        for (uint32_t child = b->first; child < b->first + 2; child++)
            for (int c = 0; c < 3; c++) {
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
            for (int c = 0; c < 3; c++) {
                const double x = t->positions[3 * (size_t)corner + (size_t)c] * tree->scale;
                assert_true(x >= b->low[c] && x <= b->high[c] && fabs(x) <= 1);
            }
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
    shd_error error = {SHD_OK, "", ""};
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

static void a_hundred_thousand_equal_triangles_are_one(void **state) {
    (void)state;
    solid s = new_solid(3, 100000);
    add_vertex(&s, 0, 0, 0), add_vertex(&s, 1, 0, 0), add_vertex(&s, 0, 1, 0);
    for (int i = 0; i < 100000; i++) add_triangle(&s, 0, 1, 2);
    check_tree(&s, 1);
    drop_solid(&s);
}

static void triangles_without_an_area_are_not_met(void **state) {
    solid s = new_solid(100, 100);
    add_square(&s, 1, 0);
    add_vertex(&s, 0, 0, 0), add_vertex(&s, 0.5, 0, 0), add_vertex(&s, 1, 0, 0);
    for (uint32_t i = 0; i < 4; i++) add_triangle(&s, i, i, 3 - i), add_triangle(&s, 4, 5, 6);
    check_tree(&s, 2);
    assert_true(check_solid(*state, &s, "\"position\": [0, 2, 2]", 4, 0.9) > 500);
    drop_solid(&s);
    char *json = text_of("{\"image\": {\"width\": %d, \"height\": %d}, \"accuracy\": {\"tier\": "
                         "\"exact\"}, \"objects\": [{\"type\": \"torus\", \"interpolation\": "
                         "\"flat\", \"tube\": 1e-12}]}",
                         SIDE, SIDE);
    seen none = see(*state, json, shd_cpu_best());
    assert_int_equal(none.sight->items[0].triangles.triangle_count, 0);
    assert_int_equal(none.hits.count, 0);
    drop_seen(&none);
    free(json);
}

/* ---- Numbers at their ends. ---- */

static void what_overflows_misses(void **state) {
    for (double far = 1e100; far < 1e300; far *= 1e20)
        for (double size = 1e-300; size < 1e300; size *= 1e50) {
            solid s = new_solid(500, 1000);
            add_ball(&s, 12, 6, size);
            char *camera = text_of("\"position\": [%.17g, %.17g, %.17g]", far, far / 3, far / 2);
            char *json = scene_of(&s, camera, "");
            seen some = see(*state, json, shd_cpu_best());
            for (size_t i = 0; i < some.hits.count; i++)
                for (int c = 0; c < 3; c++) {
                    assert_true(isfinite(some.hits.position[c][i]));
                    assert_true(isfinite(some.hits.normal[c][i]));
                }
            drop_seen(&some);
            free(json);
            free(camera);
            drop_solid(&s);
        }
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
        shd_error error = {SHD_OK, "", ""};
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

/* ---- The pattern. ---- */

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_parts_of_large_meshes_are_exact),
        cmocka_unit_test(the_nearer_of_two_layers_is_seen),
        cmocka_unit_test(edges_are_where_they_are_at_any_zoom),
        cmocka_unit_test(stretched_tori_are_exact),
        cmocka_unit_test(meshes_far_away_tiny_and_huge_are_exact),
        cmocka_unit_test(no_ray_slips_through_corners_and_edges),
        cmocka_unit_test(from_inside_a_closed_mesh_every_ray_meets_it),
        cmocka_unit_test(nothing_is_seen_of_a_triangle_from_its_edge),
        cmocka_unit_test(of_equal_triangles_the_first_is_seen),
        cmocka_unit_test(every_triangle_with_an_area_is_in_one_leaf),
        cmocka_unit_test(a_hundred_thousand_equal_triangles_are_one),
        cmocka_unit_test(triangles_without_an_area_are_not_met),
        cmocka_unit_test(what_overflows_misses),
        cmocka_unit_test(a_mesh_with_too_many_triangles_is_refused),
        cmocka_unit_test(a_build_ends_when_it_is_cancelled),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
