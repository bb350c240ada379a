/* What the ray through the middle of a block, or of a part of one, meets. How much that changes
 * around it is told by plan/moves.c. */
#include "sight/bend.h"
#include "sight/item.h"

/* More than rounding does. */
static const double SLACK = 1e-9;

/* Eyes farther away, in radii, and cosines below are left to all samples. */
static const double FARTHEST = 1e5, LEAST_COSINE = 1e-2;

/* The ray through a block's middle. */
typedef struct beam {
    bool orthographic;
    shd_vec3 origin, way; /* from the camera's position; unit */
    double pace;          /* what a pixel moves the direction by, or the origin */
    shd_vec3 right, down; /* the same, but for what is along the direction */
} beam;

static beam beam_of(const shd_lens *lens, const shd_middle *at) {
    const shd_camera *camera = lens->camera;
    const double p = (at->x - lens->middle_x) * lens->step_x,
                 q = (lens->middle_y - at->y) * lens->step_y,
                 step = fmax(lens->step_x, lens->step_y) * (1 + SLACK);
    const shd_vec3 in_plane = shd_madd(shd_scale(camera->right, p), camera->up, q),
                   right = shd_scale(camera->right, lens->step_x),
                   down = shd_scale(camera->up, -lens->step_y);
    if (camera->projection == SHD_ORTHOGRAPHIC)
        return (beam){true, in_plane, shd_scale(camera->back, -1), step, right, down};
    const shd_vec3 w = shd_sub(in_plane, camera->back);
    const double length = shd_length(w);
    return (beam){false,
                  {0, 0, 0},
                  shd_scale(w, 1 / length),
                  step / length,
                  shd_scale(right, 1 / length),
                  shd_scale(down, 1 / length)};
}

static bool meet_ball(const shd_sight *sight, uint32_t object, const beam *b, shd_strike *m,
                      shd_analytic *out) {
    const shd_seen_ball *ball = &sight->seen[object].ball;
    const shd_vec3 eye = shd_madd(ball->eye, b->origin, 1 / ball->size);
    const double along = shd_dot(eye, b->way), away = shd_length(eye);
    const shd_vec3 foot = shd_madd(eye, b->way, -along);
    const double beside = shd_length(foot), square = 1 - beside * beside;
    if (!(away > 1 + 1e-3) || !(away < FARTHEST) || !(square > LEAST_COSINE * LEAST_COSINE))
        return false;
    *m = (shd_strike){.ball = true,
                      .size = ball->size,
                      .t = -along - sqrt(square),
                      .along = -along,
                      .beside = beside};
    out->normal = shd_madd(foot, b->way, -sqrt(square));
    out->point = shd_madd(sight->plan->objects[object].center, out->normal, ball->size);
    return m->t > 1e-3;
}

static bool meet_plane(const shd_sight *sight, const shd_item *it, const beam *b, shd_strike *m,
                       shd_analytic *out) {
    const shd_vec3 eye = shd_sub(shd_add(sight->lens.camera->position, b->origin),
                                 it->to_world.origin),
                   up = {it->normal_map.linear[0][1], it->normal_map.linear[1][1],
                         it->normal_map.linear[2][1]};
    if (!shd_normalize(up, &out->normal)) return false;
    double height = shd_dot(eye, out->normal);
    if (height < 0) {
        if (it->front_only) return false; /* it is not turned */
        height = -height;
        out->normal = shd_scale(out->normal, -1);
    }
    const double cosine = shd_smaller(-shd_dot(out->normal, b->way), 1);
    if (!(cosine > LEAST_COSINE) || !(height > 1e-6 * shd_length(eye))) return false;
    *m = (shd_strike){.size = height, .t = 1 / cosine, .cosine = cosine}; /* heights are units */
    out->point = shd_madd(shd_add(it->to_world.origin, eye), b->way, height / cosine);
    return true;
}

/* The middle of a part of a block. */
static shd_middle middle_of(const shd_survey *survey, size_t block, int part) {
    static const double HALF = 0.5 * SHD_BLOCK_SIDE;
    const size_t across = (size_t)survey->across;
    const double aside = part == SHD_WHOLE ? 0 : HALF / 2;
    shd_middle out = {.x = survey->rect.x + (double)(block % across) * SHD_BLOCK_SIDE + HALF,
                      .y = survey->rect.y + (double)(block / across) * SHD_BLOCK_SIDE + HALF};
    out.x += part & 1 ? aside : -aside;
    out.y += part & 2 ? aside : -aside;
    return out;
}

/* What moves of a ray move the point by: along the ray, too, so that it stays on the surface. */
static shd_vec3 point_moves(const shd_analytic *a, const beam *b, shd_vec3 move) {
    const shd_vec3 aside = b->orthographic ? move : shd_scale(move, a->strike.size * a->strike.t);
    return shd_madd(aside, b->way, -shd_dot(aside, a->normal) / shd_dot(b->way, a->normal));
}

/* Tells of an object, if all rays hit it before the depth `beyond`. */
static bool expand_object(const shd_sight *sight, uint32_t object, const shd_middle *middle,
                          double side, double beyond, shd_analytic *out) {
    static const double ROOT2 = 1.4142135624;
    const shd_item *it = sight->items[object]; /* NULL: a ball */
    if (it && it->shape != SHD_PLANE) return false;
    const shd_camera *camera = sight->lens.camera;
    const beam b = beam_of(&sight->lens, middle);
    out->object = object;
    out->view = shd_scale(b.way, -1);
    out->side = (int)side;
    out->centers = (side - 1) / 2 * ROOT2;
    shd_strike *m = &out->strike;
    if (!(it ? meet_plane(sight, it, &b, m, out) : meet_ball(sight, object, &b, m, out)))
        return false;
    const shd_vec3 from = shd_sub(out->point, camera->position);
    const double depth = -shd_dot(from, camera->back) + SLACK * shd_length(from);
    if (!(depth < beyond)) return false;
    m->orthographic = b.orthographic;
    m->pace = b.pace;
    out->right = point_moves(out, &b, b.right);
    out->down = point_moves(out, &b, b.down);
    return shd_move(m, side / 2 * ROOT2, &out->near) &&
           depth + out->near.point < beyond * (1 - SLACK) &&
           shd_move(m, out->centers + SHD_BESIDE, &out->around) &&
           shd_worst_strike(m, out->centers, &out->worst);
}

bool shd_sight_expand(const shd_sight *sight, const shd_survey *survey, size_t block, int part,
                      shd_analytic *out) {
    const shd_block *at = &survey->blocks[block];
    const double side = part == SHD_WHOLE ? SHD_BLOCK_SIDE : SHD_BLOCK_SIDE / 2;
    const shd_middle middle = middle_of(survey, block, part);
    if (at->count == 1 && at->next >= survey->candidate_count)
        return expand_object(sight, survey->candidates[at->first], &middle, side, INFINITY, out);
    shd_seen seen[SHD_SEEN_MOST];
    const size_t count = shd_sight_seen(sight, survey, block, part, seen);
    for (size_t i = 0; count != SHD_SEEN_MANY && i < count; i++) {
        double beyond = INFINITY;
        for (size_t k = 0; k < count; k++)
            if (k != i) beyond = shd_smaller(beyond, seen[k].nearest);
        if (expand_object(sight, seen[i].object, &middle, side, beyond, out)) return true;
    }
    return false;
}
