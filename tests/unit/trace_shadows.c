/* How much of a light with a shape arrives: what stands before half of it takes half. */
#include "bound/light/extended.h"
#include "bound/light/weights.h"
#include "see.h"
#include "trace/shadows.h"

/* The surface point and a light of the plan, which a test gives a shape. */
typedef struct place {
    seen s;
    shd_plan plan;
    shd_plan_light light;
    shd_light shape;
    shd_shadows shadows;
    shd_surface at;
} place;

static void make_place(shd_engine *engine, const char *objects, shd_light shape, place *p) {
    char *json =
        text_of("{\"image\": {\"width\": 64, \"height\": 64}, \"trace\": {\"shadows\": "
                "true, \"shadowSamples\": 1024}, \"lights\": [{\"type\": \"point\", "
                "\"position\": [%.17g, %.17g, %.17g]}], \"objects\": [{\"type\": \"plane\"}%s]}",
                shape.position.x, shape.position.y, shape.position.z, objects);
    p->s = see(engine, json, SHD_PORTABLE);
    free(json);
    p->plan = *p->s.request->rendering.plan;
    assert_int_equal(p->plan.light_count, 1);
    p->shape = shape;
    p->light = p->plan.lights[0];
    p->light.shape = &p->shape;
    p->plan.lights = &p->light;
    shd_arena *arena = p->s.request->rendering.arena;
    const shd_caster *caster = shd_caster_new(p->s.sight, arena);
    assert_non_null(caster);
    assert_true(shd_shadows_make(&p->plan, caster, arena, &p->shadows));
    p->at = (shd_surface){.position = {0, 0, 0},
                          .normal = {0, 1, 0},
                          .view = {0, 1, 0},
                          .mirror = {0, 1, 0},
                          .material = &p->plan.materials[p->plan.objects[0].material]};
}

static double share_of(shd_engine *engine, const char *objects, shd_light shape) {
    place p;
    double share[3];
    make_place(engine, objects, shape, &p);
    p.shadows.share(p.shadows.context, &p.light, &p.at, share);
    assert_true(share[0] == share[1] && share[1] == share[2]);
    drop_seen(&p.s);
    return share[0];
}

/* A wall over x < 0 between the floor and the light; its rim is above the origin. */
#define HALF                                                                                       \
    ", {\"type\": \"box\", \"size\": [20, 0.1, 20], \"transform\": {\"translate\": [-10, 2, 0]}}"
#define ROOF   ", {\"type\": \"disc\", \"radius\": 9, \"transform\": {\"translate\": [0, 2, 0]}}"
#define BALL   ", {\"type\": \"sphere\", \"transform\": {\"translate\": [4, 1.5, 0]}}"
#define BESIDE ", {\"type\": \"sphere\", \"transform\": {\"translate\": [40, 2, 0]}}"

static void half_of_a_light_is_hidden_by_what_is_before_half_of_it(void **state) {
    const shd_light rect = {.type = SHD_LIGHT_RECT,
                            .position = {0, 4, 0},
                            .direction = {0, -1, 0},
                            .across = {1, 0, 0},
                            .up = {0, 0, 1},
                            .size = {2, 1}},
                    disc = {.type = SHD_LIGHT_DISC,
                            .position = {0, 4, 0},
                            .direction = {0, -1, 0},
                            .radius = 1},
                    ball = {.type = SHD_LIGHT_SPHERE, .position = {0, 4, 0}, .radius = 1};
    const shd_light lights[] = {rect, disc, ball};
    for (size_t k = 0; k < 3; k++) {
        assert_true(share_of(*state, "", lights[k]) == 1);
        assert_true(share_of(*state, BESIDE, lights[k]) == 1);
        assert_true(share_of(*state, ROOF, lights[k]) == 0);
        /* 1024 points in a square that a line halves: it errs by the length of the rim over their
         * distance at most, some 1/32. */
        assert_true(fabs(share_of(*state, HALF, lights[k]) - 0.5) < 0.02);
    }
}

/* In the shadow of a disc of half a round light's radius, half way to it, the light is a ring
 * around the part of it that is hidden. The weights are cosine^2 / distance^2, so that the share is
 * 1 - F(hidden) / F(all) with F = sin^2 of the half-angle. */
static void a_disc_before_the_middle_leaves_a_ring(void **state) {
    const shd_light disc = {
        .type = SHD_LIGHT_DISC, .position = {0, 4, 0}, .direction = {0, -1, 0}, .radius = 2};
    const double hidden = 1.0 / (1 + 16.0), all = 4.0 / (4 + 16.0); /* tan is 1/4, and 1/2 */
    const double share = share_of(*state,
                                  ", {\"type\": \"disc\", \"radius\": 0.5, \"transform\": "
                                  "{\"translate\": [0, 2, 0]}}",
                                  disc);
    assert_true(fabs(share - (1 - hidden / all)) < 0.002); /* one point is 0.001 */
}

/* ---- Many points. ---- */

/* Points of the floor in a square, or of the second object, a unit sphere, around its top. */
static void make_crowd(const place *p, bool ball, double x, double side, shd_crowd *crowd) {
    crowd->count = SHD_CROWD;
    crowd->seconds = NULL;
    for (size_t i = 0; i < SHD_CROWD; i++) {
        shd_surface *at = &crowd->at[i];
        *at = p->at;
        at->position.x = x + side * ((double)(i % 8) / 7 - 0.5);
        at->position.z = side * ((double)(i / 8) / 7 - 0.5);
        if (!ball) continue;
        at->object = 1;
        at->material = &p->plan.materials[p->plan.objects[1].material];
        shd_normalize((shd_vec3){at->position.x, 0.5, at->position.z}, &at->normal);
        at->position = shd_add(p->plan.objects[1].center, at->normal);
    }
    p->shadows.gather(p->shadows.context, crowd);
}

/* Whether the crowd's shares are those of its points, to the bit. Adds up what is not 1. */
static void check_crowd(const place *p, const shd_crowd *crowd, int *hidden, int *open) {
    uint8_t which[SHD_CROWD];
    double shares[SHD_CROWD][3], alone[3];
    size_t n = 0;
    for (size_t i = 0; i < SHD_CROWD; i++)
        if (i % 5) which[n++] = (uint8_t)i;
    p->shadows.shares(p->shadows.context, &p->light, crowd, which, n, shares[0]);
    for (size_t i = 0; i < n; i++) {
        p->shadows.share(p->shadows.context, &p->light, &crowd->at[which[i]], alone);
        for (int c = 0; c < 3; c++) assert_true(shares[i][c] == alone[c]);
        *(alone[0] < 1 ? hidden : open) += 1;
    }
}

static void crowds_have_the_shares_of_their_points(void **state) {
    static const char *const objects[] = {BALL, BALL HALF, BALL ROOF, BALL BESIDE};
    const shd_light lights[] = {
        {.type = SHD_LIGHT_DISC, .position = {0, 4, 0}, .direction = {0, -1, 0}, .radius = 1},
        {.type = SHD_LIGHT_SPHERE, .position = {3, 1, 0}, .radius = 0.9},
        {.type = SHD_LIGHT_POINT, .position = {0.5, 4, 0.2}}};
    int hidden = 0, open = 0;
    for (size_t k = 0; k < 4; k++)
        for (size_t l = 0; l < 3; l++) {
            place p;
            shd_crowd crowd;
            make_place(*state, objects[k], lights[l], &p);
            if (lights[l].type == SHD_LIGHT_POINT) p.light.shape = NULL;
            for (int at = -6; at < 6; at++) {
                make_crowd(&p, false, at, at % 2 ? 0.3 : 2, &crowd);
                assert_true(crowd.outward == 0); /* a plane is no body */
                check_crowd(&p, &crowd, &hidden, &open);
            }
            make_crowd(&p, true, 0, 1, &crowd);
            assert_true(crowd.outward == UINT64_MAX);
            check_crowd(&p, &crowd, &hidden, &open);
            for (size_t i = 0; i < SHD_CROWD; i++) /* as an eye within sees it */
                crowd.at[i].normal = shd_scale(crowd.at[i].normal, -1);
            p.shadows.gather(p.shadows.context, &crowd);
            assert_true(crowd.outward == 0);
            check_crowd(&p, &crowd, &hidden, &open);
            drop_seen(&p.s);
        }
    assert_true(hidden > 500 && open > 500);
}

/* ---- Near the light's horizon. ---- */

typedef struct exact3 {
    long double x, y, z;
} exact3;

static exact3 exact_of(shd_vec3 v) {
    return (exact3){(long double)v.x, (long double)v.y, (long double)v.z};
}

static exact3 along(exact3 a, exact3 d, long double t) {
    return (exact3){a.x + t * d.x, a.y + t * d.y, a.z + t * d.z};
}

static long double dot_of(exact3 a, exact3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static exact3 unit_of(exact3 v) {
    return along((exact3){0, 0, 0}, v, 1 / sqrtl(dot_of(v, v)));
}

static exact3 across_of(exact3 a, exact3 b) {
    return (exact3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* A frame around n as docs/model.md's points are laid out in. */
static void frame_of(exact3 n, exact3 *a, exact3 *b) {
    const exact3 x = {1, 0, 0}, y = {0, 1, 0};
    *a = unit_of(across_of(fabsl(n.x) < 0.5L ? x : y, n));
    *b = across_of(n, *a);
}

/* The way to a point of the light, and its weight but for N.L. */
static long double way_to(const shd_light *l, long double u, long double v, exact3 from,
                          exact3 *way) {
    const long double turn = 2 * M_PIl * v, r = (long double)l->radius;
    const exact3 middle = exact_of(l->position), path = along(middle, from, -1);
    exact3 a = exact_of(l->across), b = exact_of(l->up), point;
    if (l->type == SHD_LIGHT_SPHERE) {
        const long double sine2 = r * r / dot_of(path, path), down = u * (1 - sqrtl(1 - sine2)),
                          aside = sqrtl(down * (2 - down));
        frame_of(unit_of(path), &a, &b);
        *way =
            along(along(along((exact3){0, 0, 0}, unit_of(path), 1 - down), a, aside * cosl(turn)),
                  b, aside * sinl(turn));
        return 1;
    }
    if (l->type == SHD_LIGHT_RECT) {
        point = along(along(middle, a, (u - 0.5L) * (long double)l->size[0]), b,
                      (v - 0.5L) * (long double)l->size[1]);
    } else {
        frame_of(exact_of(l->direction), &a, &b);
        point = along(along(middle, a, r * sqrtl(u) * cosl(turn)), b, r * sqrtl(u) * sinl(turn));
    }
    const exact3 to = along(point, from, -1);
    *way = unit_of(to);
    return fmaxl(0, -dot_of(*way, exact_of(l->direction))) / dot_of(to, to);
}

/* The share that a disc of radius `wide`, `high` over a floor, leaves at a point of that, and the
 * mean of (N.L)+ l; negative: a ray passes the disc's rim, or the horizon, to within rounding. */
static long double exact_share(const shd_light *l, exact3 from, long double high, long double wide,
                               long double *mean) {
    long double all = 0, sum = 0, square = 0;
    for (unsigned i = 0; i < 1024; i++) {
        long double v = 0.5L / 1024, bit = 0.5L;
        for (unsigned k = i; k; k >>= 1, bit /= 2) v += k & 1 ? bit : 0;
        exact3 way;
        const long double weight = way_to(l, (i + 0.5L) / 1024, v, from, &way),
                          w = weight * fmaxl(way.y, 0);
        /* 1 / d^2 is the weight without the light's cosine. */
        square += l->type == SHD_LIGHT_SPHERE || !(weight > 0)
                      ? weight
                      : weight / -dot_of(way, exact_of(l->direction));
        if (!(w > 0)) continue;
        const exact3 at = along(from, way, high / way.y);
        const long double off = sqrtl(at.x * at.x + at.z * at.z) / wide;
        if (fabsl(off - 1) < 1e-9L) return -1;
        all += w;
        sum += off > 1 ? w : 0;
    }
    *mean = square > 0 ? all / square : 0;
    return all > 0 ? sum / all : 1;
}

/* A light that dips into the floor or stands edge on, behind a disc: what is told of the share
 * holds wherever the mean is above 1e-4, and is some 1e-11 there. */
static void shares_near_the_horizon_err_by_what_is_told(void **state) {
    static const double heights[] = {1e-3, 0.05, 0.5, 1};
    uint64_t random = 5;
    double worst = 0;
    int counted = 0;
    for (int k = 0; k < 12; k++) {
        const double high = heights[k / 3];
        shd_light light = {.type = (shd_light_type)(SHD_LIGHT_RECT + k % 3),
                           .position = {3, high, 0.5},
                           .direction = {-1, 0, 0},
                           .across = {0, 0, 1},
                           .up = {0, 1, 0},
                           .size = {2, 2},
                           .radius = 1};
        place p;
        char *disc = text_of(", {\"type\": \"disc\", \"radius\": 0.25, \"transform\": "
                             "{\"translate\": [0, %.17g, 0]}}",
                             high / 4);
        make_place(*state, disc, light, &p);
        free(disc);
        for (int i = 0; i < 150; i++) {
            const double away = i % 3 ? 1 : pow(10, uniform(&random, -12, 0));
            p.at.position = (shd_vec3){i % 3 ? uniform(&random, -3, 2.9) : 3 - away, 0,
                                       uniform(&random, -2, 2)};
            long double mean;
            double share[3];
            const shd_vec3 path = shd_sub(light.position, p.at.position);
            if (light.type == SHD_LIGHT_SPHERE && !(shd_length(path) > light.radius)) continue;
            const long double wanted =
                exact_share(&light, exact_of(p.at.position), (long double)high / 4, 0.25L, &mean);
            if (wanted < 0 || !(mean >= 1e-4L)) continue;
            p.shadows.share(p.shadows.context, &p.light, &p.at, share);
            const double off = fabs(share[0] - (double)wanted),
                         nearest = light.type == SHD_LIGHT_SPHERE ? shd_length(path) - light.radius
                                                                  : fmax(away, 1e-12),
                         told = 2e4 * (4 * SHD_WEIGHT_DIRECTION + 40 * 0x1p-53 / nearest);
            counted++;
            worst = fmax(worst, off / told);
            if (!(off <= told))
                fail_msg("%d, %d: %.17g, not %.17Lg: told %g, mean %Lg", k, i, share[0], wanted,
                         told, mean);
        }
        drop_seen(&p.s);
    }
    print_message("%d shares: at most %.2g of what is told\n", counted, worst);
    assert_true(counted > 600);
}

/* ---- Which shadows are bounded. ---- */

static shd_light any_light(uint64_t *random) {
    shd_light l = {.type = (shd_light_type)(SHD_LIGHT_RECT + below(random, 3)),
                   .size = {1, 0.5},
                   .radius = uniform(random, 0.05, 0.8)};
    l.position = shd_scale(random_direction(random), uniform(random, 1.5, 5));
    assert_true(shd_normalize(
        shd_madd(random_direction(random), l.position, -uniform(random, 0, 2)), &l.direction));
    exact3 a, b;
    frame_of(exact_of(l.direction), &a, &b);
    l.across = (shd_vec3){(double)a.x, (double)a.y, (double)a.z};
    l.up = (shd_vec3){(double)b.x, (double)b.y, (double)b.z};
    return l;
}

/* The mean of (N.L)+ l at what is seen of object 1; 1 where no point of the light sends any. */
static double least_mean(const place *p) {
    double least = 1;
    for (size_t i = 0; i < p->s.hits.count; i += 13) {
        if (p->s.hits.object[i] != 1) continue;
        const double *const *at = (const double *const *)p->s.hits.position,
                            *const *n = (const double *const *)p->s.hits.normal;
        const exact3 from = {at[0][i], at[1][i], at[2][i]}, normal = {n[0][i], n[1][i], n[2][i]};
        long double sum = 0, all = 0;
        for (int k = 0; k < 64; k++) {
            exact3 way;
            const long double weight =
                way_to(&p->shape, (k % 8 + 0.5L) / 8, (k / 8 + 0.5L) / 8, from, &way);
            const long double l =
                p->shape.type == SHD_LIGHT_SPHERE ? 1 : -dot_of(way, exact_of(p->shape.direction));
            sum += weight > 0 ? fmaxl(dot_of(normal, way), 0) * weight : 0;
            all += weight > 0 ? weight / l : 0;
        }
        if (sum > 0) least = fmin(least, (double)(sum / all));
    }
    return least;
}

static void shadows_are_bounded_where_no_light_is_at_the_horizon(void **state) {
    static const char *const shapes[] = {"disc", "box", "sphere", "cylinder", "cone", "torus"};
    uint64_t random = 77;
    int known = 0, open = 0;
    for (int k = 0; k < 120; k++) {
        const shd_light light = any_light(&random);
        char *object = text_of(", {\"type\": \"%s\", \"transform\": {\"scale\": %.17g, \"rotate\": "
                               "[%.17g, %.17g, 0]}}",
                               shapes[k % 6], uniform(&random, 0.1, 0.6), uniform(&random, 0, 360),
                               uniform(&random, 0, 360));
        place p;
        make_place(*state, object, light, &p);
        free(object);
        const double least = least_mean(&p);
        const bool bounded = shd_share_has_bound(&p.plan, 1, &p.light);
        if (bounded && !(least >= 1e-4)) fail_msg("%d: bounded, with a mean of %g", k, least);
        known += bounded;
        open += !bounded;
        /* All of the light is before a disc, or behind it, but for few. */
        if (k % 6 == 0 && least > 0.2 && least < 1 && light.type == SHD_LIGHT_SPHERE)
            assert_true(bounded);
        drop_seen(&p.s);
    }
    print_message("%d bounded, %d not\n", known, open);
    assert_true(known > 15 && open > 40);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_of_a_light_is_hidden_by_what_is_before_half_of_it),
        cmocka_unit_test(a_disc_before_the_middle_leaves_a_ring),
        cmocka_unit_test(crowds_have_the_shares_of_their_points),
        cmocka_unit_test(shares_near_the_horizon_err_by_what_is_told),
        cmocka_unit_test(shadows_are_bounded_where_no_light_is_at_the_horizon),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
