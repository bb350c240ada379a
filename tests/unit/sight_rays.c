/* Rays from anywhere: shapes against their implicit equations in long double, rays that start on
 * surfaces, and meshes without gaps. */
#include "see.h"
#include "sight/ray_parts.h"
#include "solid.h"

enum { RAYS = 4000, STEPS = 1500, STARTS = 100000 };

typedef struct cast {
    seen s;
    const shd_caster *caster;
} cast;

static uint64_t random_state = 20261123;

/* A scene whose sight is ready. */
static cast cast_in(shd_engine *engine, const char *objects) {
    char *json = text_of(
        "{\"image\": {\"width\": 64, \"height\": 64, \"samples\": 1}, \"lights\": [], "
        "\"trace\": {\"depth\": 1}, \"accuracy\": {\"tier\": \"exact\"}, \"objects\": [%s]}",
        objects);
    cast c = {.s = see(engine, json, SHD_PORTABLE)};
    free(json);
    c.caster = shd_caster_new(c.s.sight, c.s.request->rendering.arena);
    assert_non_null(c.caster);
    return c;
}

/* ---- Shapes by their equations. ---- */

static long double implicit(const shd_item *it, const long double p[3]) {
    const long double ring = sqrtl(p[0] * p[0] + p[2] * p[2]);
    switch (it->shape) {
    case SHD_SPHERE:
        return sqrtl(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1;
    case SHD_BOX:
        return fmaxl(fabsl(p[0]), fmaxl(fabsl(p[1]), fabsl(p[2]))) - 0.5L;
    case SHD_CYLINDER:
        return fmaxl(ring - 1, fabsl(p[1]) - 0.5L);
    case SHD_CONE:
        return fmaxl(ring - (0.5L - p[1]), -0.5L - p[1]);
    default:
        return sqrtl((ring - 1) * (ring - 1) + p[1] * p[1]) - (long double)it->tube;
    }
}

/* A ray in an item's frame. */
typedef struct wide_ray {
    long double o[3], d[3];
} wide_ray;

static wide_ray wide_of(const shd_item *it, shd_vec3 origin, shd_vec3 direction) {
    const long double from[3] = {(long double)origin.x - it->to_world.origin.x,
                                 (long double)origin.y - it->to_world.origin.y,
                                 (long double)origin.z - it->to_world.origin.z},
                      way[3] = {direction.x, direction.y, direction.z};
    wide_ray r = {{0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) {
            r.o[k] += it->from_world.linear[k][c] * from[c];
            r.d[k] += it->from_world.linear[k][c] * way[c];
        }
    return r;
}

static long double height_at(const shd_item *it, const wide_ray *r, long double t) {
    const long double p[3] = {r->o[0] + r->d[0] * t, r->o[1] + r->d[1] * t, r->o[2] + r->d[2] * t};
    return implicit(it, p);
}

/* The first change of sign in (low, high), by small steps and halves. Negative: none. *least is the
 * smallest height that was seen. */
static long double first_crossing(const shd_item *it, const wide_ray *r, long double low,
                                  long double high, long double *least) {
    const bool inside = height_at(it, r, low) < 0;
    *least = INFINITY;
    for (int k = 1; k <= STEPS; k++) {
        const long double t = low + (high - low) * k / STEPS, h = height_at(it, r, t);
        *least = fminl(*least, fabsl(h));
        if ((h < 0) == inside) continue;
        long double a = low + (high - low) * (k - 1) / STEPS, b = t;
        for (int i = 0; i < 80; i++) {
            const long double m = (a + b) / 2;
            *((height_at(it, r, m) < 0) == inside ? &a : &b) = m;
        }
        return (a + b) / 2;
    }
    return -1;
}

static const char *const shapes[] = {"\"sphere\"",
                                     "\"box\"",
                                     "\"cylinder\"",
                                     "\"cone\"",
                                     "\"torus\", \"tube\": 0.35",
                                     "\"torus\", \"tube\": 0.02",
                                     "\"torus\", \"tube\": 1.6"};
static const char *const transforms[] = {
    "{}", "{\"scale\": [1.5, 0.4, 0.9], \"rotate\": [30, 50, -20], \"translate\": [0.3, -0.2, 1]}",
    "{\"scale\": [-1, 1, 0.7], \"rotate\": [0, 45, 10]}",
    "{\"scale\": 1000, \"translate\": [300, -200, 5000]}",
    "{\"scale\": 0.001, \"translate\": [3, -2, 5]}"};

static void for_each_shape(shd_engine *engine, void (*check)(const cast *c, const shd_item *it)) {
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++)
        for (size_t t = 0; t < sizeof transforms / sizeof *transforms; t++) {
            char object[256];
            snprintf(object, sizeof object, "{\"type\": %s, \"transform\": %s}", shapes[s],
                     transforms[t]);
            cast c = cast_in(engine, object);
            shd_item room;
            check(&c, shd_item_of(c.s.sight, 0, &room));
            drop_seen(&c.s);
        }
}

/* A point near an item, in multiples of its size. */
static shd_vec3 point_near(const shd_item *it, double reach) {
    const shd_vec3 p = {uniform(&random_state, -reach, reach),
                        uniform(&random_state, -reach, reach),
                        uniform(&random_state, -reach, reach)};
    return shd_transform(&it->to_world, p);
}

static void check_against_equation(const cast *c, const shd_item *it) {
    int met = 0;
    for (int i = 0; i < RAYS / 30; i++) {
        const shd_vec3 from = point_near(it, 4), to = point_near(it, 1.2);
        shd_ray ray = {from, {0, 0, 0}, INFINITY, {SHD_NOTHING, 0, {0, 0, 0}}};
        shd_meeting m;
        const double length = shd_length(shd_sub(to, from));
        assert_true(shd_normalize(shd_sub(to, from), &ray.direction));
        const wide_ray r = wide_of(it, from, ray.direction);
        long double least;
        const long double t = first_crossing(it, &r, 0, 4 * length, &least);
        const bool hit = shd_cast_ray(c->caster, &ray, NULL, 0, NULL, &m);
        met += hit;
        if (hit && t < 0) { /* between two steps: then it is on the surface all the same */
            assert_true(fabsl(height_at(it, &r, m.t)) < 1e-11L);
            continue;
        }
        if (!hit) {
            assert_true(t < 0);
            continue;
        }
        if (m.t < (double)t - 1e-9 * length) { /* the same */
            assert_true(fabsl(height_at(it, &r, m.t)) < 1e-11L);
            continue;
        }
        /* Where the ray is flat on the surface, t is as far off as the depth over the slope. */
        assert_true(fabsl(height_at(it, &r, m.t)) <
                    1e-13L * (1 + length / shd_length(shd_sub(to, it->to_world.origin))));
        assert_true(fabs(m.t - (double)t) <= 1e-9 * length);
    }
    assert_true(met > 0);
}

static void rays_meet_shapes_where_their_equations_say(void **state) {
    for_each_shape(*state, check_against_equation);
}

/* ---- Rays that start on a surface. ---- */

/* A direction to the side of `own`, from square to it to flat along it. */
static shd_vec3 direction_beside(shd_vec3 own) {
    shd_vec3 way = random_direction(&random_state);
    way = shd_madd(way, own, -shd_dot(way, own));
    const double steep = pow(10, uniform(&random_state, -9, 2));
    way = shd_madd(way, own, steep);
    assert_true(shd_normalize(way, &way));
    return way;
}

/* How far off, in an item's own units, a point is that was rounded in the world's frame. */
static long double near_by(const shd_item *it) {
    const double size = shd_length((shd_vec3){it->to_world.linear[0][0], it->to_world.linear[1][0],
                                              it->to_world.linear[2][0]});
    return 1e-15L * (4 + shd_length(it->to_world.origin) / size);
}

static void check_starts(const cast *c, const shd_item *it) {
    const bool convex = it->shape != SHD_TORUS;
    int started = 0;
    for (int i = 0; i < STARTS / 30; i++) {
        shd_ray ray = {point_near(it, 3), {0, 0, 0}, INFINITY, {SHD_NOTHING, 0, {0, 0, 0}}};
        shd_meeting m;
        if (!shd_normalize(shd_sub(point_near(it, 1), ray.origin), &ray.direction)) continue;
        if (!shd_cast_ray(c->caster, &ray, NULL, 0, NULL, &m)) continue;
        started++;
        const shd_met_at at = shd_met_place(c->caster, &m);
        const shd_vec3 out = direction_beside(at.own);
        const bool turned = i % 2;
        shd_ray leaving = {
            at.position, out, INFINITY, {0, 0, turned ? shd_scale(at.own, -1) : at.own}};
        const bool again = shd_cast_ray(c->caster, &leaving, NULL, 0, NULL, &m);
        if (convex) assert_false(again); /* no acne */
        if (again) {                     /* it was outside until then */
            const wide_ray r = wide_of(it, at.position, out);
            assert_true(height_at(it, &r, 0.5L * m.t) > -near_by(it));
            assert_true(fabsl(height_at(it, &r, m.t)) < 1e3L * near_by(it));
        }
        leaving.direction = shd_scale(out, -1);
        assert_true(shd_cast_ray(c->caster, &leaving, NULL, 0, NULL, &m)); /* no leak */
        const wide_ray in = wide_of(it, at.position, leaving.direction);
        assert_true(height_at(it, &in, 0.5L * m.t) < near_by(it));
        assert_true(fabsl(height_at(it, &in, m.t)) < 1e3L * near_by(it));
    }
    assert_true(started > 30);
}

static void rays_leave_surfaces_once(void **state) {
    for_each_shape(*state, check_starts);
}

/* ---- Meshes. ---- */

static cast cast_in_solid(shd_engine *engine, const solid *s, const char *more) {
    char *json = NULL;
    size_t size;
    FILE *out = open_memstream(&json, &size);
    assert_non_null(out);
    fprintf(out, "{\"type\": \"mesh\"%s, \"positions\": [", more);
    for (size_t i = 0; i < 3 * s->vertices; i++)
        fprintf(out, "%s%.17g", i ? ", " : "", s->positions[i / 3][i % 3]);
    fputs("], \"indices\": [", out);
    for (size_t i = 0; i < 3 * s->triangles; i++)
        fprintf(out, "%s%u", i ? ", " : "", s->indices[i / 3][i % 3]);
    fputs("]}", out);
    fclose(out);
    cast c = cast_in(engine, json);
    free(json);
    return c;
}

static shd_vec3 corner_in_world(const shd_item *it, size_t triangle, int k) {
    return shd_transform(&it->to_world, shd_triangle_corner(&it->triangles, triangle, k));
}

/* A point of a triangle: anywhere, on an edge, or a corner. */
static shd_vec3 point_of_triangle(const shd_item *it, size_t triangle, int kind) {
    const shd_vec3 a = corner_in_world(it, triangle, 0), b = corner_in_world(it, triangle, 1),
                   c = corner_in_world(it, triangle, 2);
    const double u = uniform(&random_state, 0, 1), v = uniform(&random_state, 0, 1 - u);
    if (kind == 0) return shd_madd(shd_madd(a, shd_sub(b, a), u), shd_sub(c, a), v);
    return kind == 1 ? shd_madd(a, shd_sub(b, a), u) : c;
}

static void no_ray_slips_between_triangles(void **state) {
    solid s = new_solid(2000, 4000);
    add_ball(&s, 24, 16, 1);
    for (int t = 0; t < 2; t++) {
        cast c = cast_in_solid(*state, &s,
                               t ? ", \"transform\": {\"scale\": [-3, 0.2, 1], \"rotate\": "
                                   "[20, 30, 40], \"translate\": [5, 7, -9]}"
                                 : "");
        const shd_item *it = c.s.sight->items[0];
        for (int i = 0; i < STARTS; i++) {
            const size_t triangle = (size_t)below(&random_state, (int)s.triangles);
            const shd_vec3 from = point_near(it, 0.4), to = point_of_triangle(it, triangle, i % 3);
            shd_ray ray = {from, {0, 0, 0}, INFINITY, {SHD_NOTHING, 0, {0, 0, 0}}};
            shd_meeting m;
            assert_true(shd_normalize(shd_sub(to, from), &ray.direction));
            assert_true(shd_cast_ray(c.caster, &ray, NULL, 0, NULL, &m));
        }
        drop_seen(&c.s);
    }
    drop_solid(&s);
}

static void rays_leave_triangles_once(void **state) {
    solid s = new_solid(2000, 4000);
    add_ball(&s, 24, 16, 1);
    for (int t = 0; t < 2; t++) {
        cast c = cast_in_solid(*state, &s,
                               t ? ", \"transform\": {\"scale\": [3, 0.2, 1], \"rotate\": [20, "
                                   "30, 40], \"translate\": [5, 7, -9]}"
                                 : "");
        const shd_item *it = c.s.sight->items[0];
        for (int i = 0; i < STARTS; i++) {
            const uint32_t triangle = (uint32_t)below(&random_state, (int)s.triangles);
            shd_vec3 own = shd_own_normal(c.caster, 0, triangle);
            if (shd_length(own) == 0) continue; /* a pole's other half */
            const shd_vec3 at = point_of_triangle(it, triangle, i % 3);
            if (shd_dot(own, shd_sub(at, it->to_world.origin)) < 0) own = shd_scale(own, -1);
            const shd_vec3 out = direction_beside(own);
            shd_ray ray = {at, out, INFINITY, {0, triangle, own}};
            shd_meeting m;
            assert_false(shd_cast_ray(c.caster, &ray, NULL, 0, NULL, &m)); /* it is convex */
            assert_true(shd_normalize(shd_sub(point_near(it, 0.4), at), &ray.direction));
            assert_true(shd_cast_ray(c.caster, &ray, NULL, 0, NULL, &m));
        }
        drop_seen(&c.s);
    }
    drop_solid(&s);
}

/* Turned boxes leave out nothing: every triangle is tried beside. */
static void needles_are_met_as_without_a_tree(void **state) {
    for (int bunches = 1; bunches < 4; bunches++) {
        solid s = new_needles(&random_state, bunches, 0.05);
        cast c = cast_in_solid(
            *state, &s, ", \"transform\": {\"scale\": [3, 0.2, 1], \"rotate\": [20, 30, 40]}");
        shd_item every = *c.s.sight->items[0];
        const shd_item *it = c.s.sight->items[0];
        shd_mesh_tree tree = *it->view.tree;
        shd_branch one = {{-1, -1, -1}, {1, 1, 1}, 0, (uint16_t)tree.leaf_count, 0};
        assert_true((tree.turn_count > 1 || bunches > 1) && tree.leaf_count == 400);
        tree.branches = &one;
        every.view.tree = &tree;
        int hits = 0;
        for (int i = 0; i < RAYS; i++) {
            const size_t triangle = (size_t)below(&random_state, (int)s.triangles);
            const shd_vec3 from = shd_scale(random_direction(&random_state), 3);
            const shd_vec3 to = shd_vec3_at(s.positions[0], 3 * triangle + (size_t)(i % 3)),
                           axis = {i % 5 == 0, i % 5 == 1, i % 5 == 2};
            const shd_local_ray ray = {
                .origin = from, .direction = i % 5 < 3 ? axis : shd_sub(to, from), .far = INFINITY};
            shd_meeting a, b;
            const bool met = shd_meet_mesh(it, &ray, NULL, &a);
            assert_int_equal(met, shd_meet_mesh(&every, &ray, NULL, &b));
            if (!met) continue;
            assert_true(a.t == b.t && a.triangle == b.triangle && a.u == b.u && a.v == b.v);
            hits++;
        }
        assert_true(hits > RAYS / 10);
        drop_seen(&c.s);
        drop_solid(&s);
    }
}

/* Looks along rays from points on the edge, and the end of the edge, of a floor and a wall that
 * meet at an angle: between the two, nothing is met, and the wall hides the directions behind it.
 */
static void look_from_fold(shd_engine *engine, double angle, const char *transform) {
    const double up = sin(angle), along = cos(angle);
    solid s = new_solid(6, 4);
    const uint32_t a = add_vertex(&s, -3, 0, 0), b = add_vertex(&s, 3, 0, 0),
                   c = add_vertex(&s, 3, 0, 2.7), d = add_vertex(&s, -3, 0, 2.7),
                   e = add_vertex(&s, 3, 3.1 * up, 3.1 * along),
                   f = add_vertex(&s, -3, 3.1 * up, 3.1 * along);
    add_triangle(&s, a, c, b); /* the floor */
    add_triangle(&s, a, d, c);
    add_triangle(&s, a, b, e);
    add_triangle(&s, a, e, f);
    cast room = cast_in_solid(engine, &s, transform);
    const shd_item *it = room.s.sight->items[0];
    for (int i = 0; i < STARTS / 20; i++) {
        const bool end = i % 4 == 0;
        const double x = end ? 3 : uniform(&random_state, -2.9, 2.9),
                     aside =
                         end ? uniform(&random_state, -2, 2) : uniform(&random_state, -0.05, 0.05),
                     less = uniform(&random_state, 0.1, 0.9) * angle,
                     more = angle + (SHD_PI - angle) * uniform(&random_state, 0.1, 0.9);
        /* From the end, as from the way to the first triangle's middle: by (-2, 0, 0.9) aside. */
        const double past = 0.9 * up / sin(more - angle) * aside - 2;
        if (end && fabs(past) < 1e-3) continue;
        const shd_vec3 at = shd_transform(&it->to_world, (shd_vec3){x, 0, 0}),
                       behind = {aside, sin(more), cos(more)},
                       before = {aside, sin(less), cos(less)};
        shd_ray ray = {at, {0, 0, 0}, INFINITY, {0, 0, {0, 1, 0}}};
        shd_meeting m;
        assert_true(shd_normalize(shd_linear(&it->to_world, behind), &ray.direction));
        assert_int_equal(shd_cast_ray(room.caster, &ray, NULL, 0, NULL, &m), !end || past < 0);
        assert_true(shd_normalize(shd_linear(&it->to_world, before), &ray.direction));
        assert_false(shd_cast_ray(room.caster, &ray, NULL, 0, NULL, &m));
    }
    drop_seen(&room.s);
    drop_solid(&s);
}

/* However flat the fold is, and wherever: what rounding of the place in the world does is far more
 * than what the edge is told by. */
static void a_fold_hides_what_is_behind_it_from_its_edge(void **state) {
    static const double angles[] = {0.5 * SHD_PI, 0.9 * SHD_PI, SHD_PI - 1e-3, SHD_PI - 1e-6, 0.05};
    static const char *const places[] = {
        ", \"transform\": {\"rotate\": [13, 27, 41], \"translate\": [0.1, 0.7, 0.3]}",
        ", \"transform\": {\"rotate\": [13, 27, 41], \"translate\": [300, -200, 5000]}",
        ", \"transform\": {\"rotate\": [83, 7, -41], \"translate\": [-7e5, 9e4, 5e5]}",
        (", \"transform\": {\"scale\": [1e-3, -2e-3, 1e-3], \"rotate\": [50, 27, 41], "
         "\"translate\": [70, 90, -80]}")};
    for (size_t k = 0; k < sizeof angles / sizeof *angles; k++)
        for (size_t p = 0; p < sizeof places / sizeof *places; p++)
            look_from_fold(*state, angles[k], places[p]);
}

/* ---- Among objects. ---- */

static void the_tree_finds_what_every_object_tells(void **state) {
    char *json = NULL;
    size_t size;
    FILE *out = open_memstream(&json, &size);
    fputs("{\"type\": \"plane\", \"transform\": {\"translate\": [0, -3, 0]}}", out);
    for (int i = 0; i < 7; i++)
        fprintf(out,
                ", {\"type\": %s, \"transform\": {\"scale\": 0.5, \"rotate\": [%d, 0, %d], "
                "\"translate\": [%g, %g, %g]}}",
                shapes[i % 5], 20 * i, 35 * i, 1.1 * (i % 3) - 1, 0.9 * (i / 3) - 1, 0.3 * i - 1);
    fclose(out);
    cast c = cast_in(*state, json);
    free(json);
    const uint32_t all[8] = {7, 6, 5, 4, 3, 2, 1, 0};
    int met = 0;
    for (int i = 0; i < RAYS; i++) {
        shd_ray ray = {shd_scale(random_direction(&random_state), 4),
                       random_direction(&random_state),
                       20,
                       {SHD_NOTHING, 0, {0, 0, 0}}};
        shd_meeting one, other;
        const bool first = shd_cast_ray(c.caster, &ray, NULL, 0, NULL, &one),
                   second = shd_cast_ray(c.caster, &ray, all, 8, NULL, &other);
        assert_true(first == second);
        if (!first) continue;
        met++;
        assert_int_equal(one.object, other.object);
        assert_true(one.t == other.t);
    }
    assert_true(met > RAYS / 10);
    drop_seen(&c.s);
}

static void an_end_on_a_surface_is_not_behind_it(void **state) {
    cast c = cast_in(*state,
                     "{\"type\": \"sphere\"}, {\"type\": \"plane\", \"transform\": {\"translate\": "
                     "[0, -1, 0], \"rotate\": [10, 20, 30]}}");
    for (int i = 0; i < RAYS; i++) {
        const shd_vec3 end = random_direction(&random_state);
        shd_vec3 from = shd_madd(end, random_direction(&random_state), 0.9);
        shd_ray ray = {
            from, {0, 0, 0}, shd_length(shd_sub(end, from)), {SHD_NOTHING, 0, {0, 0, 0}}};
        if (!shd_normalize(shd_sub(end, from), &ray.direction)) continue;
        shd_meeting m;
        const uint32_t ball = 0;
        const bool inside = shd_length(from)<1, facing = shd_dot(from, end)> 1 + 1e-6;
        /* On the side that faces the start, nothing of the ball is before the end. */
        if (inside || facing)
            assert_false(shd_cast_ray(c.caster, &ray, &ball, 1, NULL, &m));
        else if (shd_dot(from, end) < 1 - 1e-6)
            assert_true(shd_cast_ray(c.caster, &ray, &ball, 1, NULL, &m));
    }
    drop_seen(&c.s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_meet_shapes_where_their_equations_say),
        cmocka_unit_test(rays_leave_surfaces_once),
        cmocka_unit_test(no_ray_slips_between_triangles),
        cmocka_unit_test(rays_leave_triangles_once),
        cmocka_unit_test(needles_are_met_as_without_a_tree),
        cmocka_unit_test(a_fold_hides_what_is_behind_it_from_its_edge),
        cmocka_unit_test(the_tree_finds_what_every_object_tells),
        cmocka_unit_test(an_end_on_a_surface_is_not_behind_it),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
