#include "attack/facets.h"

#include <stdlib.h>

/* A sheet of quadrilaterals: rows run down, columns around the axis, seen from outside. `side`: 0
 * that of the shape, 1 the lower cap, 2 the upper one; of a box one of six. */
typedef struct grid {
    const solid *s;
    int side, rows, columns;
} grid;

static void place_corner(const grid *h, int row, int column, point *p, point *n) {
    const solid *s = h->s;
    const real a = (real)row / h->rows,
               turn = degrees(360 * (real)(column % h->columns) / h->columns);
    const point around = {SINE(turn), 0, COSINE(turn)}, up = {0, 1, 0};
    const real R = s->radius, half = s->height / 2;
    if (s->form == BOX) {
        static const point across[6] = {{1, 0, 0}, {-1, 0, 0}, {0, 0, -1},
                                        {0, 0, 1}, {1, 0, 0},  {1, 0, 0}},
                           tall[6] = {{0, 1, 0}, {0, 1, 0},  {0, 1, 0},
                                      {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
        *n = cross(across[h->side], tall[h->side]);
        const point c =
            add(*n, add(times(across[h->side], 2 * column - 1), times(tall[h->side], 1 - 2 * row)));
        *p = (point){c.x * s->size.x / 2, c.y * s->size.y / 2, c.z * s->size.z / 2};
    } else if (s->form == SPHERE) {
        const bool pole = row == 0 || row == h->rows;
        const real y = row == h->rows ? -1 : COSINE(degrees(180 * a));
        *n = add(times(around, pole ? 0 : SINE(degrees(180 * a))), times(up, y));
        *p = times(*n, R);
    } else if (s->form == TORUS) {
        /* From the top around the tube, or from the axis to the axis. */
        const real k = s->tube / R;
        const real quarter = degrees(90), inner = k > 1 ? quarter - ARC(1 / k) : quarter,
                   start = k > 1 ? -inner : 0,
                   at = start +
                        (2 * quarter + 2 * inner) * (k > 1 ? a : (real)(row % h->rows) / h->rows);
        *n = add(times(around, SINE(at)), times(up, COSINE(at)));
        *p = add(times(around, R), times(*n, s->tube));
    } else if (s->form == DISC || h->side > 0) {
        const bool lower = h->side == 1;
        *p = add(times(around, R * (lower ? 1 - a : a)), times(up, s->form == DISC ? 0
                                                                   : lower         ? -half
                                                                                   : half));
        *n = times(up, lower ? -1 : 1);
    } else if (s->form == CYLINDER) {
        *p = add(times(around, R), times(up, half - a * s->height));
        *n = around;
    } else {
        *p = add(times(around, R * a), times(up, half - a * s->height));
        *n = add(times(around, s->height), times(up, R));
    }
}

static void put_triangle(thing *t, const grid *h, size_t first, size_t polygon,
                         const int at[3][2]) {
    point p[3], n[3];
    for (int k = 0; k < 3; k++) place_corner(h, at[k][0], at[k][1], &p[k], &n[k]);
    const real least = (real)1e-9 * (t->solid.radius + most_of(t->solid.size));
    for (int k = 0; k < 3; k++)
        if (length(sub(p[k], p[(k + 1) % 3])) < least) return;
    for (int k = 0; k < 3; k++) {
        const size_t c = 3 * t->triangles + (size_t)k;
        t->corners[c] = p[k];
        t->placed[c] = place(t, p[k]);
        t->normals[c] = n[k];
        t->vertices[c] = first + (size_t)(at[k][0] * (h->columns + 1) + at[k][1]);
    }
    t->polygons[t->triangles++] = polygon;
}

bool facets_cut(thing *t, int slices) {
    static const int sides[FORMS] = {
        [SPHERE] = 1, [DISC] = 1, [BOX] = 6, [CYLINDER] = 3, [CONE] = 2, [TORUS] = 1};
    const solid s = t->solid;
    const int columns = s.form == BOX ? 1 : slices, rows = s.form == TORUS ? slices
                                                           : s.form == SPHERE
                                                               ? (slices < 4 ? 2 : slices / 2)
                                                               : 1;
    const size_t most = 6 * (size_t)(sides[s.form] * rows * columns);
    if (!most) return false;
    t->corners = calloc(most, sizeof *t->corners);
    t->placed = calloc(most, sizeof *t->placed);
    t->normals = calloc(most, sizeof *t->normals);
    t->vertices = calloc(most, sizeof *t->vertices);
    t->polygons = calloc(most, sizeof *t->polygons);
    if (!t->corners || !t->placed || !t->normals || !t->vertices || !t->polygons) return false;
    size_t first = 0, polygon = 0;
    for (int side = 0; side < sides[s.form]; side++) {
        const grid h = {&s, side, rows, columns};
        for (int r = 0; r < rows; r++)
            for (int c = 0; c < columns; c++, polygon++) {
                put_triangle(t, &h, first, polygon,
                             (const int[3][2]){{r, c}, {r + 1, c}, {r + 1, c + 1}});
                put_triangle(t, &h, first, polygon,
                             (const int[3][2]){{r, c}, {r + 1, c + 1}, {r, c + 1}});
            }
        first += (size_t)((rows + 1) * (columns + 1));
    }
    t->solid.form = MESH;
    return true;
}
