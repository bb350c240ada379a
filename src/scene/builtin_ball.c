/* A ball to judge materials on: a sphere with a groove around it, whose edges are round, and a core
 * in the groove; on a stand that curves both ways. Both are turned on a lathe: profiles of arcs
 * and lines that meet without a bend, which are revolved. */
#include "scene/builtin.h"

enum { SLICES = 96, COLUMNS = SLICES + 1 /* of points */, MOST = 128 /* points of a profile */ };

/* Of radii: the groove's half width, its edges, its corners and the core; the stand's foot, its
 * edge, and its throat. */
static const double WIDTH = 0.16, EDGE = 0.05, CORNER = 0.05, CORE = 0.8;
static const double FOOT = 0.8, ROUND = 0.06, LOW = -1.42, THROAT = 0.24, OUT = 0.62;

/* r, y and the outward normal in that plane. */
typedef struct profile {
    double r[MOST], y[MOST], nr[MOST], ny[MOST];
    int count;
} profile;

/* Where pieces meet, the point is one: roundings would make slivers of it. */
static void add_point(profile *p, double r, double y, double nr, double ny) {
    const int before = p->count - 1;
    if (p->count && fabs(r - p->r[before]) + fabs(y - p->y[before]) < 1e-9) {
        if (nr * p->nr[before] + ny * p->ny[before] > 1 - 1e-9) return;
        r = p->r[before]; /* an edge: two normals at one place */
        y = p->y[before];
    }
    const int i = p->count++;
    p->r[i] = fabs(r) < 1e-12 ? 0 : r;
    p->y[i] = y;
    p->nr[i] = nr;
    p->ny[i] = ny;
}

/* Points around (r, y) from angle `from` to `to`, 0 being upward and a right angle outward. Normals
 * point outward of the circle if `side` is 1, inward if it is -1. */
static void add_arc(profile *p, double r, double y, double radius, double from, double to,
                    int steps, double side) {
    for (int i = 0; i <= steps; i++) {
        const double a = from + (to - from) * i / steps, s = sin(a), c = cos(a);
        add_point(p, r + radius * s, y + radius * c, side * s, side * c);
    }
}

/* From the upper pole to the lower one. */
static void make_sphere(profile *p) {
    const double edge_y = WIDTH + EDGE, edge_r = sqrt((1 - EDGE) * (1 - EDGE) - edge_y * edge_y);
    const double corner_y = WIDTH - CORNER,
                 corner_r = sqrt((CORE + CORNER) * (CORE + CORNER) - corner_y * corner_y);
    const double shoulder = atan2(edge_r, edge_y), inner = atan2(corner_r, corner_y);
    add_arc(p, 0, 0, 1, 0, shoulder, 24, 1);
    add_arc(p, edge_r, edge_y, EDGE, shoulder, SHD_PI, 8, 1);
    add_arc(p, corner_r, corner_y, CORNER, 0, inner - SHD_PI, 8, -1);
    add_arc(p, 0, 0, CORE, inner, SHD_PI / 2, 3, 1);
    for (int i = p->count - 2; i >= 0; i--) /* and the same below the equator */
        add_point(p, p->r[i], -p->y[i], p->nr[i], -p->ny[i]);
}

/* From the middle of its top, which is within the ball, to the middle of its foot. */
static void make_stand(profile *p) {
    const double top = LOW + 2 * ROUND, y = top + THROAT, end = -SHD_PI / 9;
    const double rim_r = OUT + THROAT * sin(end), rim_y = y + THROAT * cos(end);
    add_point(p, 0, rim_y, 0, 1);
    add_point(p, rim_r, rim_y, 0, 1);
    add_arc(p, OUT, y, THROAT, end, -SHD_PI, 24, -1);
    add_arc(p, FOOT - ROUND, LOW + ROUND, ROUND, 0, SHD_PI, 12, 1);
    add_point(p, 0, LOW, 0, -1);
}

/* The way along the profile to each of its points, of the whole, from its last point on. */
static void chart_rows(const profile *p, double v[MOST]) {
    v[p->count - 1] = 0;
    for (int i = p->count - 2; i >= 0; i--)
        v[i] = v[i + 1] + hypot(p->r[i] - p->r[i + 1], p->y[i] - p->y[i + 1]);
    for (int i = p->count - 1; i >= 0; i--) v[i] /= v[0];
}

/* Revolves a profile, and tilts it about z and then about x. Its chart begins and ends at -z, where
 * points are told twice; the last of its columns is the middle one's neighbor. */
static void revolve(const profile *p, double z, double x, shd_pieces *out) {
    enum { HALF = SLICES / 2 };
    const uint32_t first = (uint32_t)out->vertex_count;
    const shd_affine turn = {{{cos(z), -sin(z), 0},
                              {cos(x) * sin(z), cos(x) * cos(z), -sin(x)},
                              {sin(x) * sin(z), sin(x) * cos(z), cos(x)}},
                             {0, 0, 0}};
    double v[MOST];
    chart_rows(p, v);
    for (int i = 0; i < p->count; i++) {
        for (int column = 0; column < COLUMNS; column++) {
            const int k = column > HALF ? column - 1 : column;
            const double s = sin(2 * SHD_PI * k / SLICES), c = cos(2 * SHD_PI * k / SLICES);
            const shd_vec3 at = {p->r[i] * s, p->y[i], p->r[i] * c},
                           normal = {p->nr[i] * s, p->ny[i], p->nr[i] * c};
            shd_pieces_add(out, shd_linear(&turn, at), shd_linear(&turn, normal),
                           (k - (column > HALF ? HALF : -HALF)) / (double)SLICES, v[i]);
        }
    }
    for (uint32_t i = 0; i + 1 < (uint32_t)p->count; i++) {
        for (uint32_t k = 0; k < SLICES; k++) {
            const uint32_t a = first + i * COLUMNS, column = k < HALF ? k : k + 1,
                           next = (column + 1) % COLUMNS;
            shd_pieces_quad(out, (uint32_t[]){a + column, a + next},
                            (uint32_t[]){a + COLUMNS + column, a + COLUMNS + next});
        }
    }
}

bool shd_make_ball(shd_arena *arena, shd_pieces *out) {
    profile sphere = {.count = 0}, stand = {.count = 0};
    make_sphere(&sphere);
    make_stand(&stand);
    const size_t rows = (size_t)(sphere.count + stand.count);
    if (!shd_pieces_new(rows * COLUMNS, 2 * rows * SLICES, arena, out)) return false;
    revolve(&sphere, -0.3, 0.42, out);
    revolve(&stand, 0, 0, out);
    return true;
}
