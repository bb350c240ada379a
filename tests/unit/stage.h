/* One object before a camera, drawn at random, for what is told of a block of pixels. */
#pragma once

#include "sight/bend.h"
#include "sight/item.h"

static inline double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

static inline double decades(uint64_t *random, double low, double high) {
    return low * pow(high / low, uniform(random, 0, 1));
}

static inline shd_vec3 any_direction(uint64_t *random) {
    shd_vec3 v;
    do {
        v = (shd_vec3){uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    } while (!(shd_dot(v, v) < 1 && shd_dot(v, v) > 1e-3));
    return shd_scale(v, 1 / shd_length(v));
}

enum { MOST_LIGHTS = 3, MOST_LOBES = 2 };

/* One object before a camera, and a plan of no more than what the bound reads. */
typedef struct stage {
    shd_camera camera;
    shd_item item;         /* of the plane */
    const shd_item *shown; /* that, or NULL */
    shd_seen_object seen;
    shd_sight sight;
    shd_block block;
    uint32_t candidate;
    shd_survey survey;
    shd_plan_light lights[MOST_LIGHTS];
    uint32_t list[MOST_LIGHTS];
    shd_plan_lobe lobes[MOST_LOBES];
    shd_plan_material material;
    shd_plan_object object;
    shd_plan_group group;
    shd_plan plan;
    shd_vec3 center, up; /* of the ball; of the plane, a point and the normal */
    double radius;
    int samples;
} stage;

static inline void set_camera(stage *s, uint64_t *random) {
    enum { WIDTH = 64, HEIGHT = 48 };
    shd_camera *c = &s->camera;
    const double size = s->seen.is_ball ? s->radius : 1,
                 away = size * (1 + decades(random, 1e-3, uniform(random, 0, 1) < 0.1 ? 1e3 : 10));
    const shd_vec3 from = any_direction(random), side = any_direction(random);
    c->position = shd_madd(s->center, from, away);
    shd_vec3 aim = shd_madd(s->center, any_direction(random), 0.9 * size);
    shd_normalize(shd_sub(c->position, aim), &c->back);
    shd_normalize(shd_cross(side, c->back), &c->right);
    c->up = shd_cross(c->back, c->right);
    c->projection = uniform(random, 0, 1) < 0.3 ? SHD_ORTHOGRAPHIC : SHD_PERSPECTIVE;
    /* From a pixel of a thousandth of what is seen to one of a tenth. */
    const double span = size / decades(random, 10, 1000),
                 step = c->projection == SHD_ORTHOGRAPHIC ? span
                                                          : fmin(span / (away - 0.9 * size), 0.05);
    s->sight.lens = (shd_lens){.camera = c,
                               .width = WIDTH,
                               .height = HEIGHT,
                               .middle_x = WIDTH / 2,
                               .middle_y = HEIGHT / 2,
                               .step_x = step,
                               .step_y = step};
    s->survey = (shd_survey){.across = 4,
                             .down = 4,
                             .rect = {uniform(random, 0, 1) < 0.5 ? 32 : 0,
                                      uniform(random, 0, 1) < 0.5 ? 32 : 0, 32, 32},
                             .blocks = &s->block,
                             .candidates = &s->candidate,
                             .candidate_count = 1};
    s->block = (shd_block){0, 1, 1};
    /* The block of index 0 is anywhere. */
    s->survey.rect.x += (int)uniform(random, -8, 24);
    s->survey.rect.y += (int)uniform(random, -8, 16);
}

static inline void set_object(stage *s, uint64_t *random) {
    const bool ball = uniform(random, 0, 1) < 0.7;
    s->radius = decades(random, 1e-3, 1e3);
    s->center = shd_scale(any_direction(random), uniform(random, 0, 5) * s->radius);
    s->up = any_direction(random);
    s->seen = (shd_seen_object){.is_ball = ball, .ball.size = s->radius};
    s->item = (shd_item){.shape = SHD_PLANE};
    s->item.to_world.origin = s->center;
    for (int r = 0; r < 3; r++) s->item.normal_map.linear[r][1] = ((double *)&s->up)[r] * 3;
    set_camera(s, random);
    s->seen.ball.eye = shd_scale(shd_sub(s->camera.position, s->center), 1 / s->radius);
    s->shown = ball ? NULL : &s->item;
    s->sight.items = &s->shown;
    s->sight.seen = &s->seen;
    s->object.center = s->center;
    s->plan.objects = &s->object;
    s->sight.plan = &s->plan;
    s->sight.count = 1;
}

/* What is seen at a place of the picture. False: nothing. */
static inline bool hit_at(const stage *s, double x, double y, shd_vec3 *point, shd_vec3 *normal,
                          shd_vec3 *view) {
    const shd_lens *lens = &s->sight.lens;
    const shd_camera *c = &s->camera;
    const shd_vec3 aside = shd_madd(shd_scale(c->right, (x - lens->middle_x) * lens->step_x), c->up,
                                    (lens->middle_y - y) * lens->step_y);
    shd_vec3 from = c->position, way = shd_scale(c->back, -1);
    if (c->projection == SHD_ORTHOGRAPHIC)
        from = shd_add(from, aside);
    else
        shd_normalize(shd_add(way, aside), &way);
    const shd_vec3 o = shd_sub(from, s->center);
    double t;
    if (s->seen.is_ball) {
        const double along = shd_dot(o, way);
        const shd_vec3 foot = shd_madd(o, way, -along);
        const double inside = s->radius * s->radius - shd_dot(foot, foot);
        if (!(inside > 0)) return false;
        t = -along - sqrt(inside);
        *normal = shd_scale(shd_madd(foot, way, -sqrt(inside)), 1 / s->radius);
    } else {
        t = -shd_dot(o, s->up) / shd_dot(way, s->up);
        *normal = shd_dot(way, s->up) > 0 ? shd_scale(s->up, -1) : s->up;
    }
    *point = shd_madd(from, way, t);
    *view = shd_scale(way, -1);
    return t > 0 && isfinite(t);
}
