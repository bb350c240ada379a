#include "shade/area_cells.h"

#include <string.h>

#include "shade/gauss.h"

/* Where along a piece: x and y, and their derivatives. */
typedef struct spot {
    double x, y, dx, dy;
} spot;

static spot walk(const shd_seen *s, const shd_piece *p, double t) {
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
        const shd_piece *piece = &s->pieces[i];
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

/* A cell lies between the apex and a part of a piece, in directions: t along the piece, h from the
 * apex (0) to the piece (1). */
typedef struct cell {
    int piece, depth;
    double t[2], h[2];
} cell;

typedef struct fan {
    const shd_seen *seen;
    shd_vec3 apex;
    shd_area_function *f;
    const void *context;
    size_t count;
} fan;

/* The three sums of a cell: by 7 points both ways, and by 3 one way. */
typedef struct sums {
    double fine[SHD_AREA_ROWS_MOST], along[SHD_AREA_ROWS_MOST], up[SHD_AREA_ROWS_MOST];
} sums;

static void add_ray(const fan *g, const cell *c, int i, sums *out) {
    const shd_seen *s = g->seen;
    const double half = (c->t[1] - c->t[0]) / 2;
    const spot at = walk(s, &s->pieces[c->piece], c->t[0] + half * (1 + SHD_NODES_7[i]));
    const shd_vec3 p = shd_seen_at(s, at.x, at.y),
                   step = shd_madd(shd_scale(s->a, at.dx), s->b, at.dy),
                   side = shd_cross(g->apex, p);
    const double squared = shd_dot(side, side), ahead = shd_dot(g->apex, p);
    if (!(squared > 0)) return;
    const double aside = sqrt(squared), reach = atan2(aside, ahead);
    const double turn = half * shd_dot(g->apex, shd_cross(p, step)) / squared;
    const shd_vec3 out_of = shd_scale(shd_madd(p, g->apex, -ahead), 1 / aside);
    const double deep = (c->h[1] - c->h[0]) / 2;
    double values[SHD_AREA_ROWS_MOST];
    for (int j = 0; j < 7; j++) {
        const double angle = reach * (c->h[0] + deep * (1 + SHD_NODES_7[j])), sine = sin(angle);
        const double weight = turn * deep * reach * sine;
        g->f(g->context, shd_madd(shd_scale(g->apex, cos(angle)), out_of, sine), values);
        for (size_t k = 0; k < g->count; k++) {
            const double v = weight * values[k];
            out->fine[k] += SHD_WEIGHTS_7[i] * SHD_WEIGHTS_7[j] * v;
            out->along[k] += SHD_WEIGHTS_G3[i] * SHD_WEIGHTS_7[j] * v;
            out->up[k] += SHD_WEIGHTS_7[i] * SHD_WEIGHTS_G3[j] * v;
        }
    }
}

static void sum_cell(const fan *g, const cell *c, sums *out) {
    memset(out->fine, 0, g->count * sizeof *out->fine);
    memset(out->along, 0, g->count * sizeof *out->along);
    memset(out->up, 0, g->count * sizeof *out->up);
    for (int i = 0; i < 7; i++) add_ray(g, c, i, out);
}

/* How far 3 points are off 7, either way, in the worst row. */
static double judge(const fan *g, const sums *s, double *along, double *up) {
    *along = *up = 0;
    for (size_t k = 0; k < g->count; k++) {
        *along = shd_larger(fabs(s->fine[k] - s->along[k]), *along);
        *up = shd_larger(fabs(s->fine[k] - s->up[k]), *up);
    }
    return *along + *up;
}

enum { CELLS_MOST = 64, WORK_MOST = 400, DEEPEST = 24 };

/* A cell is good whose 3 points are off the 7 by this, of the largest row. 7 points are of twice
 * the order; where f has a kink, they still are off by no more than a part of that. */
static const double CELL_TOLERANCE = 2e-5, GAIN = 0.05;

/* Fills the stack with a cell for each piece, or quarter of a circle. */
static int begin_cells(const shd_seen *s, cell *stack) {
    int count = 0;
    for (int i = 0; i < s->count; i++) {
        const shd_piece *p = &s->pieces[i];
        const int parts = p->arc ? (int)ceil((p->to - p->from) / (SHD_PI / 2) - 1e-9) : 1;
        for (int k = 0; k < parts && count < CELLS_MOST / 2; k++)
            stack[count++] = (cell){i, 0, {(double)k / parts, (double)(k + 1) / parts}, {0, 1}};
    }
    return count;
}

double shd_cells_sum(const shd_seen *seen, shd_vec3 peak, shd_area_function *f, const void *context,
                     size_t count, double *row) {
    fan g = {seen, peak, f, context, count};
    if (!shd_is_in_seen(seen, peak)) {
        double x, y;
        find_middle(seen, &x, &y);
        if (!shd_normalize(shd_seen_at(seen, x, y), &g.apex)) return 0;
    }
    cell stack[CELLS_MOST];
    sums s;
    int left = begin_cells(seen, stack), work = 0;
    double error = 0, most = 0;
    for (int i = 0; i < left; i++) { /* the size of the sums, for the tolerance */
        sum_cell(&g, &stack[i], &s);
        for (size_t k = 0; k < count; k++) most = shd_larger(fabs(s.fine[k]), most);
    }
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
        error += off > CELL_TOLERANCE * most ? off : GAIN * off;
    }
    return error;
}
