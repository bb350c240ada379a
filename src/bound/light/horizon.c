/* Whether a light with a shape is at the horizon of what is seen of an object, or seen from its
 * edge: there nothing bounds the share of it that shadows leave. */
#include "bound/light/extended.h"
#include "bound/light/pieces.h"
#include "bound/light/sums.h"

/* A range of cosines. */
typedef struct range {
    double low, high;
} range;

/* Of directions that are `off` from one that has the cosine `at` to an axis, which itself is within
 * `spread`. */
static range range_of(double at, shd_angle off, shd_angle spread) {
    const shd_angle angle = shd_angle_of(at), all = shd_angle_sum(off, spread);
    return (range){shd_cosine_more(angle, all), shd_cosine_less(angle, all)};
}

/* The same of what is `least` to `most` high over a plane, no farther away than `far`. */
static void narrow_by_height(range *r, double least, double most, double far) {
    if (least > 0) r->low = shd_larger(r->low, least / far);
    if (most < 0) r->high = shd_smaller(r->high, 0);
}

/* Whether the mean of (N.L)+ l over the shape is SHD_LEAST_SHARED or more at all points of the
 * piece, or 0 at all. */
static bool is_off_horizon(const shd_piece *piece, const shd_light *shape) {
    const shd_angle none = {1, 0};
    const shd_vec3 path = shd_sub(shape->position, piece->center);
    const double reach = shd_light_reach(shape), distance = shd_plan_length(path),
                 far = distance + piece->radius + reach;
    if (!(distance > 0 && isfinite(far))) return false;
    const shd_vec3 toward = shd_scale(path, 1 / distance);
    const shd_angle off = shd_seen_from(piece->radius + reach, 1 / distance);
    range facing = range_of(shd_dot(piece->axis, toward), off, piece->spread), sends = {1, 1};
    if (piece->spread.cosine >= 1) {
        const double height = shd_dot(piece->axis, path);
        narrow_by_height(&facing, height - reach, height + reach, far);
    }
    if (shape->type != SHD_LIGHT_SPHERE) {
        const double before = -shd_dot(shape->direction, path);
        sends = range_of(-shd_dot(shape->direction, toward), off, none);
        narrow_by_height(&sends, before - piece->radius, before + piece->radius, far);
    }
    if (facing.high < -SHD_PIECE_MARGIN || sends.high < -SHD_PIECE_MARGIN) return true;
    return facing.low > 0 && sends.low > 0 &&
           facing.low * sends.low > SHD_LEAST_SHARED + 2 * SHD_PIECE_MARGIN;
}

bool shd_share_has_bound(const shd_plan *plan, size_t object, const shd_plan_light *light) {
    enum { FINENESS = 3 };
    if (!light->shape) return true;
    if (plan->scene->trace.depth) return false; /* rays see more of it than the eye */
    shd_piece pieces[SHD_MOST_PIECES];
    const size_t count = shd_plan_pieces(plan->scene, object, &plan->objects[object], FINENESS,
                                         plan->cancelled, pieces);
    for (size_t p = 0; p < count; p++)
        if (!is_off_horizon(&pieces[p], light->shape)) return false;
    return true;
}
