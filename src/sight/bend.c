/* With d a ray's unit direction, c = N.V = -N.d and ' the derivative along any unit step of pixels:
 *
 * Perspective. d is w / |w| of a w that is linear in the pixel, |w'| <= s. So d' is at right angles
 * to d, |d'| <= s / |w|, and the part of d'' at right angles to d is -2 (d.w') w'_ / |w|^2 (w'_
 * that part of w'), which is no longer than (s / |w|)^2; its part along d is -|d'|^2 d.
 *
 * A sphere of radius 1 around the origin. N = eye + t d. From N.N' = 0, N' is t d' moved along d
 * into the tangent plane, which stretches what is at right angles to d by 1 / c at most:
 *     |N'| <= t |d'| / c,    |t'| = |t d'.N| / c <= t |d'| sqrt(1 - c^2) / c
 * From N.N'' = -|N'|^2, N'' is 2 t' d' and t times d'' in the same way, and |N'|^2 / c of d:
 *     |N''| <= (2 |t'| |d'| + t |d''|) / c + |N'|^2 / c
 *
 * An ellipsoid. It is such a sphere in the frame in which rays are w / |w| of F w. With n = F^T u,
 * u the sphere's normal, and g = |F| / |n|, N is n / |n|, and as |n'| <= |F| |u'|, |N'| <= g |u'|,
 * |N''| <= g |u''| + 3 (g |u'|)^2
 *
 * A plane. N' = 0, and P = eye + t d stays in it: the same without the last term.
 *
 * Orthographic. d' = 0, and the ray's origin moves by s at right angles to d: as t d' above, and
 * t d'' is 0.
 *
 * All of it grows with t and falls with c, whose extremes in the block follow from the angle
 * between its rays and the one through its middle. */
#include "sight/bend.h"

#include "sight/item.h"

/* More than rounding does, of lengths and of angles. */
static const double SLACK = 1e-9;

/* Eyes farther away, in radii, and cosines below are left to all samples. */
static const double FARTHEST = 1e5, LEAST_COSINE = 1e-2;

/* Of a block's side; more than that of 2. */
static const double HALF = 0.5 * SHD_BLOCK_SIDE, ROOT2 = 1.4142135624;

shd_pattern_spread shd_spread_of(int samples) {
    double xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < samples; i++) {
        double x, y;
        shd_sample_offset(i, samples, &x, &y);
        x -= 0.5;
        y -= 0.5;
        xx += x * x / samples;
        xy += x * y / samples;
        yy += y * y / samples;
    }
    const double half = (xx - yy) / 2;
    return (shd_pattern_spread){(xx + yy) * (1 + SLACK),
                                ((xx + yy) / 2 + sqrt(half * half + xy * xy)) * (1 + SLACK)};
}

/* The rays of a block: the one through its middle, and how far the others are from it. */
typedef struct beam {
    bool orthographic;
    shd_vec3 origin, way; /* of the middle ray: from the camera's position; unit */
    double aside;         /* orthographic: no ray's origin is farther from the middle's */
    double sine, cosine;  /* of the largest angle between their directions */
    double step, turn;    /* |origin'|, |d'| */
    double inverse;       /* 1 / |w| of the middle ray */
} beam;

static beam beam_of(const shd_lens *lens, double x, double y, double reach) {
    const shd_camera *camera = lens->camera;
    const double p = (x - lens->middle_x) * lens->step_x, q = (lens->middle_y - y) * lens->step_y,
                 step = fmax(lens->step_x, lens->step_y), aside = reach * step * (1 + SLACK);
    const shd_vec3 in_plane = shd_madd(shd_scale(camera->right, p), camera->up, q);
    if (camera->projection == SHD_ORTHOGRAPHIC)
        return (beam){true, in_plane, shd_scale(camera->back, -1), aside, 0, 1, step, 0, 1};
    const shd_vec3 w = shd_sub(in_plane, camera->back);
    const double length = shd_length(w), sine = fmin(1, aside / length + SLACK);
    return (beam){false,
                  {0, 0, 0},
                  shd_scale(w, 1 / length),
                  0,
                  sine,
                  sqrt(1 - sine * sine),
                  0,
                  step / fmax(1, length - aside),
                  1 / length};
}

/* The rays, which meet the middle's point after `t` units; the beam is in a frame of its own, or
 * `from_world` is NULL. */
static void set_rays(const shd_lens *lens, const beam *b, const shd_affine *from_world, double t,
                     double cosine, double size, bool curved, shd_block_rays *out) {
    const shd_camera *camera = lens->camera;
    shd_vec3 right = shd_scale(camera->right, lens->step_x),
             down = shd_scale(camera->up, -lens->step_y);
    if (from_world) {
        right = shd_linear(from_world, right);
        down = shd_linear(from_world, down);
    }
    *out = (shd_block_rays){
        .curved = curved, .size = size, .cosine = cosine, .way = b->way, .blocks = 1};
    if (b->orthographic) {
        out->at_x = shd_scale(right, 1 / size);
        out->at_y = shd_scale(down, 1 / size);
        return;
    }
    out->way_x = shd_scale(right, b->inverse);
    out->way_y = shd_scale(down, b->inverse);
    out->at_x = shd_scale(out->way_x, t);
    out->at_y = shd_scale(out->way_y, t);
}

/* Fills the slopes from the extremes: `size` is a unit's length in the world, `curve` is 1 on a
 * sphere and 0 on a plane. */
static void set_slopes(const beam *b, double t, double cosine, double size, double curve,
                       shd_bend *out) {
    const double off = b->orthographic ? b->step / size : t * b->turn, first = off / cosine,
                 sine = sqrt(1 - fmin(1, cosine * cosine)),
                 moved = b->orthographic ? 0 : 2 * first * sine * b->turn + off * b->turn,
                 second = (moved + curve * first * first) / cosine;
    out->points = (shd_slopes){size * first, size * second};
    out->normals = (shd_slopes){curve * first, curve * second};
    out->views = (shd_slopes){b->turn, 1.5 * b->turn * b->turn};
}

/* Where rays meet a ball of radius 1. */
typedef struct strike {
    shd_vec3 normal; /* at the middle, which is met after `t`; no other is met after `farthest` */
    double t, farthest, cosine;
} strike;

/* In units of the radius, around the center; `size` is one of the beam's. */
static bool strike_ball(shd_vec3 eye, const beam *b, double size, strike *out) {
    const double along = shd_dot(eye, b->way), away = shd_length(eye);
    const shd_vec3 foot = shd_madd(eye, b->way, -along);
    const double beside = shd_length(foot);
    if (!(away > 1 + 1e-3) || !(away < FARTHEST) || !(along < 0)) return false;
    /* How far the rays' lines are from the center at most, and the eye from their feet. */
    double outer, ahead;
    if (b->orthographic) {
        outer = beside + b->aside / size;
        ahead = -along;
    } else {
        outer = beside * b->cosine - along * b->sine;
        ahead = -along * b->cosine - beside * b->sine;
        if (!(ahead > 0)) return false;
    }
    outer += SLACK * away;
    const double cosine = outer < 1 ? sqrt(1 - outer * outer) : 0;
    if (!(cosine > LEAST_COSINE)) return false;
    if (b->orthographic && !(ahead > 1 + 1e-3)) return false;
    const double half = sqrt(1 - beside * beside);
    *out = (strike){shd_madd(foot, b->way, -half), -along - half, ahead - cosine + SLACK * away,
                    cosine};
    return true;
}

static bool bend_ball(const shd_sight *sight, uint32_t object, const beam *b, shd_bend *out,
                      shd_block_rays *rays) {
    const shd_seen_ball *ball = &sight->seen[object].ball;
    strike s;
    if (!strike_ball(shd_madd(ball->eye, b->origin, 1 / ball->size), b, ball->size, &s))
        return false;
    out->normal = s.normal;
    out->point = shd_madd(sight->plan->objects[object].center, out->normal, ball->size);
    set_slopes(b, s.farthest, s.cosine, ball->size, 1, out);
    set_rays(&sight->lens, b, NULL, s.t, s.cosine, ball->size, true, rays);
    rays->middle = s.normal;
    return true;
}

/* The beam in a frame that lengths are `wide` times as long in at most. False: its rays may go
 * anywhere there. */
static bool carry_beam(const shd_lens *lens, const beam *b, const shd_affine *from_world,
                       double wide, beam *out) {
    const shd_vec3 way = shd_linear(from_world, b->way), origin = shd_linear(from_world, b->origin);
    const double length = shd_length(way), step = wide * fmax(lens->step_x, lens->step_y),
                 inverse = b->inverse / length, sine = wide * b->sine / length + SLACK;
    const shd_vec3 unit = shd_scale(way, 1 / length);
    if (b->orthographic) {
        *out = (beam){true, origin, unit, wide * b->aside, 0, 1, step, 0, 1};
        return length > 0;
    }
    if (!(sine < 0.5)) return false;
    *out =
        (beam){false,  origin, unit, 0, sine, sqrt(1 - sine * sine), 0, step * inverse / (1 - sine),
               inverse};
    return true;
}

/* A ball in a frame of its own. */
static bool bend_ellipsoid(const shd_lens *lens, const shd_item *it, const beam *b, shd_bend *out,
                           shd_block_rays *rays) {
    const double wide = it->widest, stretch = it->longest;
    beam own;
    strike s;
    if (!carry_beam(lens, b, &it->from_world, wide, &own) ||
        !strike_ball(shd_add(it->eye, own.origin), &own, 1, &s))
        return false;
    set_slopes(&own, s.farthest, s.cosine, 1, 1, out);
    const double(*f)[3] = it->from_world.linear;
    const shd_vec3 u = s.normal, n = {f[0][0] * u.x + f[1][0] * u.y + f[2][0] * u.z,
                                      f[0][1] * u.x + f[1][1] * u.y + f[2][1] * u.z,
                                      f[0][2] * u.x + f[1][2] * u.y + f[2][2] * u.z};
    const double length = shd_length(n), turned = wide * out->normals.first * out->reach;
    if (!(4 * turned < length)) return false;
    const double g = wide / (length - turned), first = g * out->normals.first;
    out->normal = shd_scale(n, 1 / length);
    out->point = shd_add(it->to_world.origin, shd_linear(&it->to_world, u));
    out->points = (shd_slopes){stretch * out->points.first, stretch * out->points.second};
    out->normals = (shd_slopes){first, g * out->normals.second + 3 * first * first};
    out->views = (shd_slopes){b->turn, 1.5 * b->turn * b->turn};
    set_rays(lens, &own, &it->from_world, s.t, s.cosine, 1, true, rays);
    rays->to_world = &it->to_world;
    rays->from_world = &it->from_world;
    rays->middle = u;
    rays->to_normal = 1 / length;
    rays->stretch = wide / length;
    return true;
}

static bool bend_plane(const shd_sight *sight, const shd_item *it, const beam *b, shd_bend *out,
                       shd_block_rays *rays) {
    const shd_vec3 eye = shd_sub(shd_add(sight->lens.camera->position, b->origin),
                                 it->to_world.origin),
                   up = {it->normal_map.linear[0][1], it->normal_map.linear[1][1],
                         it->normal_map.linear[2][1]};
    shd_vec3 normal;
    if (!shd_normalize(up, &normal)) return false;
    double height = shd_dot(eye, normal);
    if (height < 0) {
        if (it->front_only) return false; /* it is not turned */
        height = -height;
        normal = shd_scale(normal, -1);
    }
    const double straight = -shd_dot(normal, b->way);
    if (!(straight > LEAST_COSINE) || !(height > 1e-6 * shd_length(eye) + 2 * b->aside))
        return false;
    const double cosine =
        straight * b->cosine - sqrt(1 - fmin(1, straight * straight)) * b->sine - SLACK;
    if (!(cosine > LEAST_COSINE)) return false;
    out->normal = normal;
    out->point = shd_madd(shd_add(it->to_world.origin, eye), b->way, height / straight);
    set_slopes(b, (height + b->aside) / cosine, cosine, 1, 0, out);
    set_rays(&sight->lens, b, NULL, height / straight, cosine, 1, false, rays);
    rays->middle = normal;
    return true;
}

/* ---- Blocks. ---- */

static shd_middle middle_of(const shd_survey *survey, size_t block, int blocks, uint32_t object) {
    const size_t across = (size_t)survey->across;
    return (shd_middle){object,
                        survey->rect.x + (double)(block % across) * SHD_BLOCK_SIDE + blocks * HALF,
                        survey->rect.y + (double)(block / across) * SHD_BLOCK_SIDE + blocks * HALF};
}

/* Whether one thing alone may be seen through a block. */
static bool is_of_one(const shd_survey *survey, const shd_block *at) {
    return at->count == 1 && at->next >= survey->candidate_count;
}

/* Whether it is the same one through all of these. */
static bool are_of_one(const shd_survey *survey, size_t block, int blocks) {
    const uint32_t object = survey->candidates[survey->blocks[block].first];
    for (int k = 0; k < blocks * blocks; k++) {
        const shd_block *at =
            &survey->blocks[block + (size_t)(k / blocks * survey->across + k % blocks)];
        if (!is_of_one(survey, at) || survey->candidates[at->first] != object) return false;
    }
    return true;
}

/* Tells of the item that all rays, none of which is farther than out->reach from the middle, meet.
 */
static bool bend_item(const shd_sight *sight, const shd_middle *middle, shd_bend *out,
                      shd_block_rays *rays) {
    const shd_item *it = sight->items[middle->object]; /* NULL: a ball */
    if (it && it->shape != SHD_SPHERE && it->shape != SHD_PLANE) return false;
    const beam b = beam_of(&sight->lens, middle->x, middle->y, out->reach);
    out->object = middle->object;
    out->view = shd_scale(b.way, -1);
    return !it                      ? bend_ball(sight, middle->object, &b, out, rays)
           : it->shape == SHD_PLANE ? bend_plane(sight, it, &b, out, rays)
                                    : bend_ellipsoid(&sight->lens, it, &b, out, rays);
}

/* Tells of the only item that may be seen, or of one that is met before all others. */
static bool bend_first(const shd_sight *sight, const shd_survey *survey, size_t block, int blocks,
                       shd_bend *out, shd_block_rays *rays) {
    const shd_block *at = &survey->blocks[block];
    const shd_camera *camera = sight->lens.camera;
    out->reach = blocks * HALF * ROOT2;
    if (is_of_one(survey, at)) {
        const shd_middle middle = middle_of(survey, block, blocks, survey->candidates[at->first]);
        return bend_item(sight, &middle, out, rays);
    }
    shd_seen seen[SHD_SEEN_MOST];
    const size_t count = shd_sight_seen(sight, survey, block, SHD_WHOLE, seen);
    for (size_t i = 0; count != SHD_SEEN_MANY && i < count; i++) {
        const shd_middle middle = middle_of(survey, block, 1, seen[i].object);
        double beyond = INFINITY;
        for (size_t k = 0; k < count; k++)
            if (k != i) beyond = shd_smaller(beyond, seen[k].nearest);
        if (!((double)sight->seen[middle.object].nearest < beyond) ||
            !bend_item(sight, &middle, out, rays))
            continue;
        const shd_vec3 from = shd_sub(out->point, camera->position);
        const double depth = -shd_dot(from, camera->back) + out->points.first * out->reach;
        if (depth + SLACK * (shd_length(from) + fabs(depth)) < beyond) return true;
    }
    return false;
}

bool shd_sight_bend(const shd_sight *sight, const shd_survey *survey, size_t block, int blocks,
                    shd_bend *out, shd_block_rays *rays) {
    if ((blocks > 1 && !are_of_one(survey, block, blocks)) ||
        !bend_first(sight, survey, block, blocks, out, rays))
        return false;
    rays->blocks = blocks;
    return true;
}

/* (N.w)^2 = (e.w)^2 - |w|^2 (|e|^2 - 1) of rays w from the eye e. With e = foot - t way, at right
 * angles, no large terms cancel. Rays that are parallel begin beside the foot instead. */
static void set_squares(const shd_block_rays *rays, bool parallel, shd_vec3 foot, double t,
                        shd_rim *out) {
    const double beyond = shd_dot(foot, foot) - 1;
    const shd_vec3 x = parallel ? rays->at_x : rays->way_x, y = parallel ? rays->at_y : rays->way_y;
    double *d = out->square;
    d[0] = -beyond;
    if (parallel) {
        d[1] = -2 * shd_dot(foot, x);
        d[2] = -2 * shd_dot(foot, y);
        d[3] = -shd_dot(x, x);
        d[4] = -2 * shd_dot(x, y);
        d[5] = -shd_dot(y, y);
    } else {
        const double fx = shd_dot(foot, x), fy = shd_dot(foot, y), wx = shd_dot(rays->way, x),
                     wy = shd_dot(rays->way, y), far = beyond + t * t, gx = fx - t * wx,
                     gy = fy - t * wy;
        d[1] = -2 * (t * fx + beyond * wx);
        d[2] = -2 * (t * fy + beyond * wy);
        d[3] = gx * gx - far * shd_dot(x, x);
        d[4] = 2 * (gx * gy - far * shd_dot(x, y));
        d[5] = gy * gy - far * shd_dot(y, y);
    }
    const double most = HALF - 0.5;
    out->least = fabs(beyond);
    out->rest =
        most * (fabs(d[1]) + fabs(d[2])) + most * most * (fabs(d[3]) + fabs(d[4]) + fabs(d[5]));
}

bool shd_sight_rim(const shd_sight *sight, const shd_survey *survey, size_t block, shd_rim *out,
                   shd_block_rays *rays) {
    const shd_block *at = &survey->blocks[block];
    if (!is_of_one(survey, at)) return false;
    const shd_middle middle = middle_of(survey, block, 1, survey->candidates[at->first]);
    if (sight->items[middle.object]) return false; /* no ball */
    const shd_seen_ball *ball = &sight->seen[middle.object].ball;
    const double size = ball->size;
    const beam b = beam_of(&sight->lens, middle.x, middle.y, HALF * ROOT2);
    const shd_vec3 eye = shd_madd(ball->eye, b.origin, 1 / size);
    const double t = -shd_dot(eye, b.way), away = shd_length(eye);
    const shd_vec3 foot = shd_madd(eye, b.way, t);
    const double beside = shd_length(foot);
    /* All of the ball is before the camera. */
    if (!(away > 1 + 1e-3) || !(away < FARTHEST) ||
        !(b.orthographic ? t > 1 + 1e-3 : t * b.cosine - beside * b.sine > 0))
        return false;
    set_rays(&sight->lens, &b, NULL, t, 0, size, true, rays);
    rays->middle = foot;
    out->object = middle.object;
    out->point = shd_madd(sight->plan->objects[middle.object].center, foot, size);
    set_squares(rays, b.orthographic, foot, t, out);
    /* A ray's place there is rounded as its way from the eye is. */
    out->off = 0x1p-46 * (1 + beside) * (1 + away);
    /* The place where the ray is nearest to the center is off by |foot.w + o.w| / |w|. */
    const double reach = HALF * ROOT2,
                 beside_it = reach * sqrt(fmax(shd_dot(rays->at_x, rays->at_x),
                                               shd_dot(rays->at_y, rays->at_y))),
                 turned = reach * sqrt(fmax(shd_dot(rays->way_x, rays->way_x),
                                            shd_dot(rays->way_y, rays->way_y)));
    if (!(turned < 0.1)) return false;
    const double length = 1 - turned, root = sqrt(out->least + out->rest);
    out->moved = size * (2 * beside_it + (beside * turned + root) / length);
    out->cosine = root / length;
    out->turned = turned / length;
    return true;
}

/* Its rays are (side - 1) / 2 sqrt(2) pixels and more from the middle, and one pixel moves them by
 * no less than where the ball is nearest: that alone is more than LOW c. */
static bool is_small_ball(const shd_sight *sight, uint32_t object) {
    const shd_lens *lens = &sight->lens;
    const shd_seen_object *seen = &sight->seen[object];
    const double depth = lens->camera->projection == SHD_ORTHOGRAPHIC ? 1 : seen->nearest;
    const double aside =
        (SHD_BLOCK_SIDE - 1) * 0.5 * ROOT2 * fmin(lens->step_x, lens->step_y) * depth;
    return seen->is_ball && aside > SHD_SKETCH_LOW * seen->ball.size * (1 + SLACK);
}

bool shd_sight_has_small_balls(const shd_sight *sight, const shd_survey *survey, size_t block) {
    const shd_block *at = &survey->blocks[block];
    if (at->next < survey->candidate_count) return false;
    for (uint32_t i = 0; i < at->count; i++)
        if (!is_small_ball(sight, survey->candidates[at->first + i])) return false;
    return true;
}

bool shd_sight_misses(const shd_sight *sight, const shd_survey *survey, size_t block) {
    const shd_block *at = &survey->blocks[block];
    if (!is_of_one(survey, at)) return false;
    const shd_middle middle = middle_of(survey, block, 1, survey->candidates[at->first]);
    const shd_item *it = sight->items[middle.object];
    if (!it || it->shape != SHD_SPHERE) return false;
    const beam b = beam_of(&sight->lens, middle.x, middle.y, HALF * ROOT2);
    beam own;
    if (!carry_beam(&sight->lens, &b, &it->from_world, it->widest, &own)) return false;
    const shd_vec3 eye = shd_add(it->eye, own.origin);
    const double along = shd_dot(eye, own.way), away = shd_length(eye),
                 beside = shd_length(shd_madd(eye, own.way, -along)),
                 inner = b.orthographic ? beside - own.aside
                                        : beside * own.cosine + fmin(along, 0) * own.sine;
    return away < FARTHEST && inner > 1 + SLACK * (1 + away);
}
