#include "shade/area_cells.h"

#include <string.h>

#include "shade/gauss.h"
#include "shade/ways.h"

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

static void sum_ways(const shd_area_model *model, const shd_ways *ways,
                     double (*out)[SHD_WAY_SUMS]) {
    double values[SHD_AREA_ROWS_MOST];
    if (model->sum) {
        model->sum(model->context, ways, out);
        return;
    }
    for (size_t i = 0; i < ways->points; i++) {
        const shd_vec3 toward = {ways->toward[0][i], ways->toward[1][i], ways->toward[2][i]};
        model->weigh(model->context, toward, values);
        for (size_t k = 0; k < model->count; k++)
            for (int j = 0; j < ways->sums; j++) out[k][j] += ways->weight[j][i] * values[k];
    }
}

void shd_sum_row(const shd_area_model *model, shd_ways *ways, double *row) {
    double out[SHD_AREA_ROWS_MOST][SHD_WAY_SUMS];
    const size_t last = ways->points - 1, steps = last / SHD_WAYS_STEP + 1;
    const shd_vec3 toward = {ways->toward[0][last], ways->toward[1][last], ways->toward[2][last]};
    ways->sums = 1;
    ways->count = steps * SHD_WAYS_STEP;
    while (ways->points < ways->count) shd_add_way(ways, toward, 0);
    ways->points = last + 1;
    for (size_t k = 0; k < model->count; k++) out[k][0] = row[k];
    sum_ways(model, ways, out);
    for (size_t k = 0; k < model->count; k++) row[k] = out[k][0];
    ways->points = 0;
}

void shd_cells_small(const shd_seen *s, const shd_area_model *model, double *row) {
    double mx, my;
    shd_ways ways;
    ways.points = 0;
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
                shd_add_way(&ways, shd_scale(p, 1 / length),
                            wide * SHD_WEIGHTS_G3[j] / 2 * t * s->height / (squared * length));
            }
            if (k % 7 == 6) shd_sum_row(model, &ways, row);
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

/* What is known of the place of a piece that is nearest to a direction. */
typedef struct nearest {
    double t, cosine;
    shd_vec3 at;
} nearest;

static void try_place(const shd_seen *s, const shd_stretch *p, double t, shd_vec3 to,
                      nearest *best) {
    shd_vec3 at;
    const double z = nearness(s, p, t, to, &at);
    if (z > best->cosine) *best = (nearest){t, z, at};
}

/* On a segment, the cosine (a + b t) / |p + d t| has one extremum. */
static nearest nearest_of_segment(const shd_seen *s, const shd_stretch *p, shd_vec3 to) {
    nearest best = {0, -3, s->away};
    const shd_vec3 from = shd_seen_at(s, p->x[0], p->y[0]),
                   step = shd_sub(shd_seen_at(s, p->x[1], p->y[1]), from);
    const double a = shd_dot(to, from), b = shd_dot(to, step), mixed = shd_dot(from, step);
    const double t = (a * mixed - b * shd_dot(from, from)) / (b * mixed - a * shd_dot(step, step));
    for (int k = 0; k < 2; k++) try_place(s, p, k, to, &best);
    if (t > 0 && t < 1) try_place(s, p, t, to, &best);
    return best;
}

/* Where a piece is nearest to a direction; of an arc about: from the best of some places, in ever
 * smaller steps. */
static nearest find_nearest(const shd_seen *s, const shd_stretch *p, shd_vec3 to) {
    enum { PLACES = 8, STEPS = 12 };
    if (!p->arc) return nearest_of_segment(s, p, to);
    double step = 1.0 / PLACES;
    nearest best = {0, -3, s->away};
    for (int k = 0; k <= PLACES; k++) try_place(s, p, k * step, to, &best);
    for (int k = 0; k < STEPS; k++) {
        step *= 0.55;
        const double here = best.t;
        for (int side = -1; side <= 1; side += 2)
            try_place(s, p, shd_larger(shd_smaller(here + side * step, 1), 0), to, &best);
    }
    return best;
}

/* A piece is walked so that the angle around the apex and the distance from it both change slowly.
 */
static shd_fan spread_fan(const shd_seen *s, const shd_stretch *p, shd_vec3 apex) {
    const nearest best = find_nearest(s, p, apex);
    const spot here = walk(s, p, best.t);
    const shd_vec3 place = shd_seen_at(s, here.x, here.y);
    const double length = sqrt(here.dx * here.dx + here.dy * here.dy),
                 away = shd_length(shd_sub(best.at, apex)) * shd_length(place);
    shd_fan out = {.seen = s, .piece = p, .apex = apex, .foot = best.t};
    out.near = shd_larger(away / length, 1e-5);
    out.from = asinh(-out.foot / out.near);
    out.to = asinh((1 - out.foot) / out.near);
    return out;
}

/* A cell lies between the apex and a part of a piece. */
typedef struct cell {
    int piece, depth;
    double t[2], h[2]; /* of shd_fan_ways, which has t for s */
} cell;

/* The sums of a cell in each row: by 7 points both ways, by 3 along the piece, by 3 from the apex.
 */
typedef struct sums {
    double row[SHD_AREA_ROWS_MOST][SHD_WAY_SUMS];
} sums;

typedef struct fans {
    const shd_seen *seen;
    const shd_area_model *model;
    shd_fan of[SHD_STRETCHES_MOST]; /* each piece */
    shd_ways ways;
} fans;

/* Adds a cell's sums; a rough one has but the first. */
static void add_cell(fans *g, const cell *c, bool rough, sums *out) {
    static shd_fan_ways_function *const fan_ways[SHD_ISA_COUNT] = SHD_VARIANTS(shd_fan_ways);
    fan_ways[g->model->isa](&g->of[c->piece], c->t, c->h, rough, &g->ways);
    g->ways.points = g->ways.count;
    sum_ways(g->model, &g->ways, out->row);
}

/* How far 3 points are off 7, either way, in the worst row. */
static double judge(const fans *g, const sums *s, double *along, double *up) {
    *along = *up = 0;
    for (size_t k = 0; k < g->model->count; k++) {
        const double *row = s->row[k];
        *along = shd_larger(fabs(row[0] - row[1]), *along);
        *up = shd_larger(fabs(row[0] - row[2]), *up);
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
static int begin_cells(const fans *g, cell *stack) {
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
    fans g = {.seen = seen, .model = model};
    shd_vec3 apex = peak;
    double most = 0, error = 0, closest = -3;
    if (!shd_is_in_seen(seen, peak))
        for (int i = 0; i < seen->count; i++) {
            const nearest here = find_nearest(seen, &seen->pieces[i], peak);
            if (here.cosine > closest) closest = here.cosine, apex = here.at;
        }
    for (int i = 0; i < seen->count; i++) g.of[i] = spread_fan(seen, &seen->pieces[i], apex);
    cell stack[CELLS_MOST];
    sums s;
    int left = begin_cells(&g, stack), work = 0;
    memset(s.row, 0, count * sizeof *s.row);
    for (int i = 0; i < left; i++) /* about the size of the sums, for the tolerance */
        add_cell(&g, &stack[i], true, &s);
    for (size_t k = 0; k < count; k++) most = shd_larger(fabs(s.row[k][0]), most);
    while (left) {
        const cell c = stack[--left];
        double along, up;
        memset(s.row, 0, count * sizeof *s.row);
        add_cell(&g, &c, false, &s);
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
        for (size_t k = 0; k < count; k++) row[k] += s.row[k][0];
        error += off > CELL_TOLERANCE * most || c.depth > SMOOTH ? off : GAIN * off;
    }
    return error;
}
