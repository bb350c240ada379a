#include "shade/area_cells.h"

#include <string.h>

#include "shade/gauss.h"

/* Where along a piece: x and y, and their derivatives. */
typedef struct spot {
    double x, y, dx, dy;
} spot;

static spot walk(const shd_seen *s, const shd_stretch *p, double t) {
    if (!p->arc)
        return (spot){p->x[0] + t * (p->x[1] - p->x[0]), p->y[0] + t * (p->y[1] - p->y[0]),
                      p->x[1] - p->x[0], p->y[1] - p->y[0]};
    const double span = p->to - p->from, angle = p->from + t * span;
    const double x = s->radius * cos(angle), y = s->radius * sin(angle);
    return (spot){x, y, -y * span, x * span};
}

/* A point inside: the mean of points of the boundary. */
static void find_middle(const shd_seen *s, double *x, double *y) {
    *x = *y = 0;
    for (int i = 0; i < s->count; i++)
        for (int k = 0; k < 3; k++) {
            const spot at = walk(s, &s->pieces[i], k / 3.0);
            *x += at.x / (3 * s->count);
            *y += at.y / (3 * s->count);
        }
}

void shd_cells_small(const shd_seen *s, shd_area_function *f, const void *context, size_t count,
                     double *row) {
    double mx, my, values[SHD_AREA_ROWS_MOST];
    find_middle(s, &mx, &my);
    for (int i = 0; i < s->count; i++) {
        const shd_stretch *piece = &s->pieces[i];
        const int parts = piece->arc ? (int)ceil((piece->to - piece->from) / (SHD_PI / 2)) : 1;
        for (int k = 0; k < 7 * parts; k++) {
            const spot at = walk(s, piece, (k / 7 + (1 + SHD_NODES_7[k % 7]) / 2) / parts);
            const double ex = at.x - mx, ey = at.y - my,
                         wide = SHD_WEIGHTS_7[k % 7] / 2 / parts * (ex * at.dy - ey * at.dx);
            for (int j = 1; j < 7; j += 2) {
                const double t = (1 + SHD_NODES_7[j]) / 2;
                const shd_vec3 p = shd_seen_at(s, mx + t * ex, my + t * ey);
                const double squared = shd_dot(p, p), length = sqrt(squared);
                const double weight =
                    wide * SHD_WEIGHTS_G3[j] / 2 * t * s->height / (squared * length);
                f(context, shd_scale(p, 1 / length), values);
                for (size_t c = 0; c < count; c++) row[c] += weight * values[c];
            }
        }
    }
}

/* The cosine between a direction and a place on the boundary. */
static double nearness(const shd_seen *s, const shd_stretch *p, double t, shd_vec3 to,
                       shd_vec3 *out) {
    const spot at = walk(s, p, t);
    if (!shd_normalize(shd_seen_at(s, at.x, at.y), out)) return -2;
    return shd_dot(*out, to);
}

/* Where a piece is nearest to a direction, about: from the best of some places, in ever smaller
 * steps. */
static double find_nearest(const shd_seen *s, const shd_stretch *p, shd_vec3 to, double *most,
                           shd_vec3 *out) {
    enum { PLACES = 8, STEPS = 12 };
    double t = 0, step = 1.0 / PLACES;
    shd_vec3 at;
    *most = -3;
    for (int k = 0; k <= PLACES; k++) {
        const double z = nearness(s, p, k * step, to, &at);
        if (!(z > *most)) continue;
        *most = z;
        *out = at;
        t = k * step;
    }
    for (int k = 0; k < STEPS; k++) {
        step *= 0.55;
        const double here = t;
        for (int side = -1; side <= 1; side += 2) {
            const double other = shd_larger(shd_smaller(here + side * step, 1), 0);
            const double z = nearness(s, p, other, to, &at);
            if (!(z > *most)) continue;
            *most = z;
            *out = at;
            t = other;
        }
    }
    return t;
}

/* How a piece is walked, so that the angle around the apex and the distance from it both change
 * slowly: t = foot + near sinh(from + s (to - from)) for s from 0 to 1. */
typedef struct pacing {
    double foot, near, from, to;
} pacing;

static pacing pace(const shd_seen *s, const shd_stretch *p, shd_vec3 apex) {
    double most;
    shd_vec3 at;
    pacing out = {.foot = find_nearest(s, p, apex, &most, &at)};
    const spot here = walk(s, p, out.foot);
    const shd_vec3 place = shd_seen_at(s, here.x, here.y);
    const double length = sqrt(here.dx * here.dx + here.dy * here.dy),
                 away = shd_length(shd_sub(at, apex)) * shd_length(place);
    out.near = shd_larger(away / length, 1e-5);
    out.from = asinh(-out.foot / out.near);
    out.to = asinh((1 - out.foot) / out.near);
    return out;
}

/* A cell lies between the apex and a part of a piece, in directions: t along the piece's pacing, h
 * from the apex (0) to the piece (1). */
typedef struct cell {
    int piece, depth;
    double t[2], h[2];
} cell;

typedef struct fan {
    const shd_seen *seen;
    shd_vec3 apex;
    const shd_area_model *model;
    pacing strides[SHD_STRETCHES_MOST]; /* of each piece */
} fan;

/* The sums of a cell: by 7 points both ways, by 3 one way, and by 3 both ways. */
typedef struct sums {
    double fine[SHD_AREA_ROWS_MOST], along[SHD_AREA_ROWS_MOST], up[SHD_AREA_ROWS_MOST],
        rough[SHD_AREA_ROWS_MOST];
} sums;

/* Adds node i along the piece, with all nodes from the apex, or every second one. */
static void add_ray(const fan *g, const cell *c, int i, int first, int every, sums *out) {
    const shd_seen *s = g->seen;
    const double half = (c->t[1] - c->t[0]) / 2;
    const pacing *pace = &g->strides[c->piece];
    const double span = pace->to - pace->from,
                 x = pace->from + span * (c->t[0] + half * (1 + SHD_NODES_7[i]));
    const spot at = walk(s, &s->pieces[c->piece], pace->foot + pace->near * sinh(x));
    const double quick = span * pace->near * cosh(x);
    const shd_vec3 p = shd_seen_at(s, at.x, at.y),
                   step = shd_madd(shd_scale(s->a, at.dx), s->b, at.dy),
                   side = shd_cross(g->apex, p);
    const double squared = shd_dot(side, side), ahead = shd_dot(g->apex, p);
    if (!(squared > 0)) return;
    const double aside = sqrt(squared), reach = atan2(aside, ahead);
    const double turn = half * quick * shd_dot(g->apex, shd_cross(p, step)) / squared;
    const shd_vec3 out_of = shd_scale(shd_madd(p, g->apex, -ahead), 1 / aside);
    const double deep = (c->h[1] - c->h[0]) / 2;
    double values[SHD_AREA_ROWS_MOST];
    for (int j = first; j < 7; j += every) {
        const double angle = reach * (c->h[0] + deep * (1 + SHD_NODES_7[j])), sine = sin(angle);
        const double weight = turn * deep * reach * sine;
        g->model->weigh(g->model->context, shd_madd(shd_scale(g->apex, cos(angle)), out_of, sine),
                        values);
        for (size_t k = 0; k < g->model->count; k++) {
            const double v = weight * values[k];
            out->fine[k] += SHD_WEIGHTS_7[i] * SHD_WEIGHTS_7[j] * v;
            out->along[k] += SHD_WEIGHTS_G3[i] * SHD_WEIGHTS_7[j] * v;
            out->up[k] += SHD_WEIGHTS_7[i] * SHD_WEIGHTS_G3[j] * v;
            out->rough[k] += SHD_WEIGHTS_G3[i] * SHD_WEIGHTS_G3[j] * v;
        }
    }
}

static void sum_cell(const fan *g, const cell *c, sums *out) {
    memset(out->fine, 0, g->model->count * sizeof *out->fine);
    memset(out->along, 0, g->model->count * sizeof *out->along);
    memset(out->up, 0, g->model->count * sizeof *out->up);
    for (int i = 0; i < 7; i++) add_ray(g, c, i, 0, 1, out);
}

/* How far 3 points are off 7, either way, in the worst row. */
static double judge(const fan *g, const sums *s, double *along, double *up) {
    *along = *up = 0;
    for (size_t k = 0; k < g->model->count; k++) {
        *along = shd_larger(fabs(s->fine[k] - s->along[k]), *along);
        *up = shd_larger(fabs(s->fine[k] - s->up[k]), *up);
    }
    return *along + *up;
}

enum { CELLS_MOST = 128, WORK_MOST = 400, DEEPEST = 24 };

/* A cell is good whose 3 points are off the 7 by this, of the largest row. 7 points are of twice
 * the order, and are off by far less. Cells that were halved more often than smooth ones are likely
 * to have a kink, where 7 points are not better than that. */
static const double CELL_TOLERANCE = 1e-5, GAIN = 0.2;
enum { SMOOTH = 6 };

/* Fills the stack with cells for each piece, or quarter of a circle: near the apex, where the peak
 * is, some of the lobe's width, and then ever larger ones, so that no peak lies between points. */
static int begin_cells(const fan *g, cell *stack) {
    const double width = 3 / sqrt(g->model->sharpness + 1);
    const shd_seen *s = g->seen;
    int count = 0;
    for (int i = 0; i < s->count; i++) {
        const shd_stretch *p = &s->pieces[i];
        const int parts = p->arc ? (int)ceil((p->to - p->from) / (SHD_PI / 2) - 1e-9) : 2;
        for (int k = 0; k < parts && count < CELLS_MOST / 2; k++) {
            const double from = (double)k / parts, to = (double)(k + 1) / parts;
            double low = 0;
            for (double h = width; h < 0.6 && count < CELLS_MOST / 2; h *= 4) {
                stack[count++] = (cell){i, 0, {from, to}, {low, h}};
                low = h;
            }
            stack[count++] = (cell){i, 0, {from, to}, {low, 1}};
        }
    }
    return count;
}

double shd_cells_sum(const shd_seen *seen, shd_vec3 peak, const shd_area_model *model,
                     double *row) {
    const size_t count = model->count;
    fan g = {.seen = seen, .apex = peak, .model = model};
    double nearest = -3, most = 0, error = 0;
    if (!shd_is_in_seen(seen, peak))
        for (int i = 0; i < seen->count; i++) {
            double here;
            shd_vec3 at = seen->away;
            find_nearest(seen, &seen->pieces[i], peak, &here, &at);
            if (here > nearest) nearest = here, g.apex = at;
        }
    for (int i = 0; i < seen->count; i++) g.strides[i] = pace(seen, &seen->pieces[i], g.apex);
    cell stack[CELLS_MOST];
    sums s;
    int left = begin_cells(&g, stack), work = 0;
    memset(s.rough, 0, count * sizeof *s.rough);
    for (int i = 0; i < left; i++) /* about the size of the sums, for the tolerance */
        for (int k = 1; k < 7; k += 2) add_ray(&g, &stack[i], k, 1, 2, &s);
    for (size_t k = 0; k < count; k++) most = shd_larger(fabs(s.rough[k]), most);
    while (left) {
        const cell c = stack[--left];
        double along, up;
        sum_cell(&g, &c, &s);
        const double off = judge(&g, &s, &along, &up);
        for (size_t k = 0; k < count; k++) most = shd_larger(fabs(row[k]), most);
        if (off > CELL_TOLERANCE * most && left + 2 <= CELLS_MOST && c.depth < DEEPEST &&
            ++work < WORK_MOST) {
            cell halves[2] = {c, c};
            double *split[2] = {along > up ? halves[0].t : halves[0].h,
                                along > up ? halves[1].t : halves[1].h};
            split[0][1] = split[1][0] = (split[0][0] + split[0][1]) / 2;
            halves[0].depth = halves[1].depth = c.depth + 1;
            stack[left++] = halves[0];
            stack[left++] = halves[1];
            continue;
        }
        for (size_t k = 0; k < count; k++) row[k] += s.fine[k];
        error += off > CELL_TOLERANCE * most || c.depth > SMOOTH ? off : GAIN * off;
    }
    return error;
}
