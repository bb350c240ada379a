/* Meshes, end to end: a scene's JSON to hits, against every triangle tried in long double. */
#include "see.h"
#include "sight/item.h"
#include "sight/tree.h"
#include "solid.h"

/* ---- Scenes of one mesh. ---- */

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
    const shd_item *it = s->sight->items[0];
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
        seen s = see_by_blocks(engine, json, isa);
        const shd_lens lens = s.sight->lens;
        if (isa == SHD_PORTABLE) {
            vector(*corners)[3] = corners_of(&s);
            int compared = 0;
            for (int i = 0; i < ALL; i++) {
                const long double x = (long double)(i % SIDE) + 0.5L - SIDE / 2,
                                  y = SIDE / 2 - 0.5L - (long double)(i / SIDE);
                wanted[i] = try_every_triangle(corners, s.sight->items[0]->triangles.triangle_count,
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

/* The tree's boxes are turned to needles. */
static void needles_are_exact(void **state) {
    static const char *const cameras[] = {
        "\"position\": [1, 2, 6], \"fov\": 50", "\"position\": [0.1, 0.2, 0.3], \"fov\": 90",
        "\"type\": \"orthographic\", \"height\": 5, \"position\": [1, 2, 6]",
        "\"position\": [1000, 2000, 6000], \"fov\": 0.05"};
    uint64_t random = 15;
    for (int k = 0; k < 24; k++) {
        const double width = k % 3 == 0 ? 0.05 : k % 3 == 1 ? 1e-3 : 0.3;
        solid s = new_needles(&random, k < 12 ? 1 : 3, width);
        const size_t hits =
            check_solid(*state, &s, cameras[k / 3 % 4], k / 3 % 4 == 3 ? 2e4 : 20, 0.7);
        assert_true(hits > (k % 3 == 1 ? 1 : 200));
        drop_solid(&s);
    }
}

/* ... or the sight of them would cost what boxes that all overlap do. */
/* One edge of each lies along the camera's axis to the right, and crosses no row of rays. */
static void needles_along_the_horizon_are_exact(void **state) {
    uint64_t random = 16;
    solid s = new_solid(3 * 200, 200);
    for (uint32_t i = 0; i < 200; i++) {
        const shd_vec3 at = random_direction(&random), off = random_direction(&random);
        const double x = 0.2 * at.x, z = at.z, part = 0.45 * off.x;
        add_vertex(&s, x - 1, 0, z - 1);
        add_vertex(&s, x + 1, 0, z + 1);
        add_vertex(&s, x + 2 * part, 0.05 * off.y, z + 2 * part);
        add_triangle(&s, 3 * i, 3 * i + 1, 3 * i + 2);
    }
    assert_true(check_solid(*state, &s, "\"position\": [0, 0, 5], \"fov\": 40", 20, 0.7) > 50);
    assert_true(check_solid(*state, &s,
                            "\"type\": \"orthographic\", \"height\": 3, \"position\": [0, 0, 5]",
                            20, 0.7) > 50);
    drop_solid(&s);
}

static void boxes_are_turned_to_needles(void **state) {
    uint64_t random = 16;
    solid s = new_needles(&random, 1, 0.01);
    char *json = scene_of(&s, "\"position\": [1, 2, 6]", "");
    seen l = see(*state, json, SHD_PORTABLE);
    const shd_mesh_tree *tree = l.sight->items[0]->view.tree;
    assert_true(tree->turn_count > 1 && tree->branches[0].turn == 1);
    for (uint32_t i = 0; i < tree->branch_count; i++) {
        const shd_branch *b = &tree->branches[i];
        if (i == 1) continue; /* it is not used */
        assert_true(b->turn && b->turn < tree->turn_count);
        const float x = b->high[0] - b->low[0];
        if (b->count) assert_true(b->high[1] - b->low[1] < x / 2 || b->high[2] - b->low[2] < x / 2);
    }
    drop_seen(&l);
    free(json);
    drop_solid(&s);
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
            seen all = see_by_blocks(*state, json, isa);
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
        seen all = see_by_blocks(*state, json, shd_cpu_best());
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
        seen none = see_by_blocks(*state, json, shd_cpu_best());
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
        seen all = see_by_blocks(*state, json, shd_cpu_best());
        assert_true(all.hits.count > 1000);
        for (size_t i = 0; i < all.hits.count; i++) assert_true(all.hits.triangle[i] < once);
        /* Where there are many, rays do not try them all. */
        if (k == 2) assert_int_equal(all.sight->items[0]->view.tree->leaf_count, once);
        drop_seen(&all);
        free(json);
        drop_solid(&s);
    }
}

static void triangles_without_an_area_are_not_met(void **state) {
    solid s = new_solid(100, 100);
    add_square(&s, 1, 0);
    add_vertex(&s, 0, 0, 0), add_vertex(&s, 0.5, 0, 0), add_vertex(&s, 1, 0, 0);
    for (uint32_t i = 0; i < 4; i++) add_triangle(&s, i, i, 3 - i), add_triangle(&s, 4, 5, 6);
    assert_true(check_solid(*state, &s, "\"position\": [0, 2, 2]", 4, 0.9) > 500);
    drop_solid(&s);
    char *json = text_of("{\"image\": {\"width\": %d, \"height\": %d}, \"accuracy\": {\"tier\": "
                         "\"exact\"}, \"objects\": [{\"type\": \"torus\", \"interpolation\": "
                         "\"flat\", \"tube\": 1e-12}]}",
                         SIDE, SIDE);
    seen none = see_by_blocks(*state, json, shd_cpu_best());
    assert_int_equal(none.sight->items[0]->triangles.triangle_count, 0);
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
            seen some = see_by_blocks(*state, json, shd_cpu_best());
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_parts_of_large_meshes_are_exact),
        cmocka_unit_test(the_nearer_of_two_layers_is_seen),
        cmocka_unit_test(edges_are_where_they_are_at_any_zoom),
        cmocka_unit_test(stretched_tori_are_exact),
        cmocka_unit_test(needles_are_exact),
        cmocka_unit_test(needles_along_the_horizon_are_exact),
        cmocka_unit_test(boxes_are_turned_to_needles),
        cmocka_unit_test(meshes_far_away_tiny_and_huge_are_exact),
        cmocka_unit_test(no_ray_slips_through_corners_and_edges),
        cmocka_unit_test(from_inside_a_closed_mesh_every_ray_meets_it),
        cmocka_unit_test(nothing_is_seen_of_a_triangle_from_its_edge),
        cmocka_unit_test(of_equal_triangles_the_first_is_seen),
        cmocka_unit_test(triangles_without_an_area_are_not_met),
        cmocka_unit_test(what_overflows_misses),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
