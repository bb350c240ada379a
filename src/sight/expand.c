/* Vectors become complex where places in the picture do: a.b stays the sum of a_i b_i, and |a| is
 * the norm. With w the unit direction of the ray through the block's middle, another one's is along
 * w + e. What of it is along w only makes it longer, so that w.e = 0, and
 *     |e| <= x / (1 - x),  x = s R / |w'|
 * at R pixels from the middle, if the image plane has w' there and s for each pixel. (w + e).(w +
 * e) is 1 + e.e.
 *
 * A sphere of radius 1 around the origin, and an eye E = b w + F with w.F = 0. P = E + t (w + e) is
 * on it if (1 + e.e) t^2 + 2 (b + e.F) t + |E|^2 - 1 = 0. That has the discriminant
 *     D = (b + e.F)^2 - (1 + e.e) (|E|^2 - 1),  |D - D0| <= 2 |b| |F| |e| + max(1, |E|^2 - 1) |e|^2
 * If this is less than D0 = 1 - |F|^2, its root has no branch there, and
 *     |sqrt D - sqrt D0| <= |D - D0| / (sqrt D0 + sqrt(D0 - |D - D0|))
 * t = -(b + e.F + sqrt D) / (1 + e.e) moves P at right angles to what e moves it by. N is P.
 *
 * A plane: t = h / (c - N.e), with the eye's height h and c the middle's N.V.
 *
 * Orthographic: e moves the ray's origin instead of its direction. */
#include "sight/bend.h"
#include "sight/item.h"

/* More than rounding does, of unit vectors, and relative to lengths. */
static const double SLACK = 1e-9;

/* Eyes farther away, in radii, and cosines below are left to all samples. */
static const double FARTHEST = 1e5, LEAST_COSINE = 1e-2;

/* The ray through a block's middle. */
typedef struct beam {
    bool orthographic;
    shd_vec3 origin, way; /* from the camera's position; unit */
    double pace;          /* what a pixel moves the direction by, or the origin */
} beam;

static beam beam_of(const shd_lens *lens, const shd_middle *at) {
    const shd_camera *camera = lens->camera;
    const double p = (at->x - lens->middle_x) * lens->step_x,
                 q = (lens->middle_y - at->y) * lens->step_y,
                 step = fmax(lens->step_x, lens->step_y) * (1 + SLACK);
    const shd_vec3 in_plane = shd_madd(shd_scale(camera->right, p), camera->up, q);
    if (camera->projection == SHD_ORTHOGRAPHIC)
        return (beam){true, in_plane, shd_scale(camera->back, -1), step};
    const shd_vec3 w = shd_sub(in_plane, camera->back);
    const double length = shd_length(w);
    return (beam){false, {0, 0, 0}, shd_scale(w, 1 / length), step / length};
}

/* What the middle ray meets. */
typedef struct meeting {
    bool ball;
    double size;          /* a unit of lengths here, in the world */
    double t;             /* the way to it */
    double along, beside; /* ball: b and |F| */
    double cosine;        /* plane: c */
} meeting;

static double hypotenuse(double a, double b) {
    return sqrt(a * a + b * b);
}

/* How far the unit vector along w + e is from w, |e| < 1. */
static double turn_of(double e) {
    const double shorter = 1 / sqrt(1 - e * e);
    return hypotenuse(e * shorter, shorter - 1);
}

/* How far sqrt D is from sqrt(at) if D is within `by` < at. */
static double root_moves(double at, double by) {
    return by / (sqrt(at) + sqrt(at - by));
}

/* How much t changes with e. Infinite: it may have a branch. */
static double way_moves(const meeting *m, bool orthographic, double e) {
    if (m->ball) {
        const double at = 1 - m->beside * m->beside,
                     far = m->beside * m->beside + m->along * m->along - 1,
                     by = orthographic ? e * (2 * m->beside + e)
                                       : e * (2 * m->along * m->beside + fmax(1, far) * e);
        if (!(by < 0.999 * at)) return INFINITY;
        const double root = root_moves(at, by);
        return orthographic ? root : (m->beside * e + root + m->t * e * e) / (1 - e * e);
    }
    const double aslant = e * sqrt(1 - m->cosine * m->cosine);
    if (orthographic) return aslant / m->cosine;
    return aslant < 0.999 * m->cosine ? m->t * aslant / (m->cosine - aslant) : (double)INFINITY;
}

/* Of places that are `reach` pixels away. False: nothing is known of them. */
static bool move(const meeting *m, const beam *b, double reach, shd_moves *out) {
    const double x = reach * b->pace, e = b->orthographic ? x / m->size : x / (1 - x);
    if (!b->orthographic && !(x < 0.4)) return false;
    const double way = way_moves(m, b->orthographic, e);
    if (!(way < 0.999 * m->t)) return false;
    const double point =
        hypotenuse(way, b->orthographic ? e : (m->t + way) * e) * (1 + SLACK) + SLACK;
    *out = (shd_moves){m->size * point, m->ball ? point : 0, b->orthographic ? 0 : turn_of(e)};
    return true;
}

static bool meet_ball(const shd_item *it, const beam *b, meeting *m, shd_analytic *out) {
    const shd_vec3 eye = shd_madd(it->eye, b->origin, 1 / it->size);
    const double along = shd_dot(eye, b->way), away = shd_length(eye);
    const shd_vec3 foot = shd_madd(eye, b->way, -along);
    const double beside = shd_length(foot), square = 1 - beside * beside;
    if (!(away > 1 + 1e-3) || !(away < FARTHEST) || !(square > LEAST_COSINE * LEAST_COSINE))
        return false;
    *m = (meeting){true, it->size, -along - sqrt(square), -along, beside, 0};
    out->normal = shd_madd(foot, b->way, -sqrt(square));
    out->point = shd_madd(it->to_world.origin, out->normal, it->size);
    return m->t > 1e-3;
}

static bool meet_plane(const shd_sight *sight, const shd_item *it, const beam *b, meeting *m,
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
    *m = (meeting){false, height, 1 / cosine, 0, 0, cosine}; /* heights are units */
    out->point = shd_madd(shd_add(it->to_world.origin, eye), b->way, height / cosine);
    return true;
}

bool shd_sight_expand(const shd_sight *sight, const shd_survey *survey, size_t block,
                      shd_analytic *out) {
    /* Pixels from the block's middle: of their centers, and of their corners. */
    static const double CENTERS = 4.95, CORNERS = 5.657;
    shd_middle middle;
    meeting m;
    const shd_item *it = shd_sight_only(sight, survey, block, &middle);
    if (!it) return false;
    const beam b = beam_of(&sight->lens, &middle);
    out->object = middle.object;
    out->view = shd_scale(b.way, -1);
    if (!(it->ball ? meet_ball(it, &b, &m, out) : meet_plane(sight, it, &b, &m, out)) ||
        !move(&m, &b, CORNERS, &out->near))
        return false;
    double radius = SHD_DISC_LEAST;
    for (out->disc_count = 0; out->disc_count < SHD_DISCS; out->disc_count++) {
        if (!move(&m, &b, CENTERS + radius, &out->discs[out->disc_count])) break;
        radius *= SHD_DISC_STEP;
    }
    return out->disc_count > 0;
}
