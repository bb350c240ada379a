/* Reading a Westin table: a product of quadratic B-splines over both directions. */
#include "shade/westin.h"

#include <math.h>

#include "shade/westin_table.h"

/* ---- The splines of a direction. ---- */

typedef struct taps {
    int way[9];
    double weight[9];
} taps;

static int split(double u, double weight[3]) {
    const double near = floor(u + 0.5), f = u - near;
    weight[0] = 0.5 * (0.5 - f) * (0.5 - f);
    weight[1] = 0.75 - f * f;
    weight[2] = 0.5 * (0.5 + f) * (0.5 + f);
    return (int)near;
}

/* The nodes before the pole are those across it; at the horizon the last ones repeat. */
static taps taps_at(double rise, double turn) {
    double by_rise[3], by_turn[3];
    int r = split(rise * (SHD_WESTIN_RISES / (SHD_PI / 2)) - 0.5, by_rise);
    if (r >= SHD_WESTIN_RISES) { /* on the horizon itself */
        r = SHD_WESTIN_RISES - 1;
        by_rise[0] = 0;
        by_rise[1] = by_rise[2] = 0.5;
    }
    const int t = split(turn * (SHD_WESTIN_TURNS / (2 * SHD_PI)) - 0.5, by_turn);
    taps out;
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            int at = r + a - 1, around = t + b - 1;
            if (at < 0) {
                at = -1 - at;
                around += SHD_WESTIN_TURNS / 2;
            }
            if (at >= SHD_WESTIN_RISES) at = SHD_WESTIN_RISES - 1;
            out.way[3 * a + b] = at * SHD_WESTIN_TURNS + (around & (SHD_WESTIN_TURNS - 1));
            out.weight[3 * a + b] = by_rise[a] * by_turn[b];
        }
    return out;
}

/* ---- Reflectance. ---- */

static void add_terms(const shd_westin *table, const taps *view, const taps *light,
                      double terms[SHD_WESTIN_BOUNCES]) {
    for (int n = 0; n < SHD_WESTIN_BOUNCES; n++) terms[n] = 0;
    for (int a = 0; a < 9; a++)
        for (int b = 0; b < 9; b++) {
            const float *rho = shd_westin_at(table, view->way[a], light->way[b]);
            const double weight = view->weight[a] * light->weight[b];
            for (int n = 0; n < SHD_WESTIN_BOUNCES; n++) terms[n] += weight * (double)rho[n];
        }
}

static double rise_of(shd_vec3 way) {
    return atan2(sqrt(way.x * way.x + way.y * way.y), way.z);
}

static double turn_of(shd_vec3 way) {
    const double pole = SHD_WESTIN_POLE * SHD_WESTIN_POLE;
    return way.x * way.x + way.y * way.y > pole ? atan2(way.y, way.x) : 0;
}

/* rho of each channel: pi f_r / kd. */
static void find_rho(const shd_westin *table, shd_vec3 light, shd_vec3 view, const double kd[3],
                     double out[3]) {
    double turn = turn_of(view), from = turn_of(light);
    if (table->isotropic) { /* the view stands on a node, so that only the difference counts */
        from -= turn - SHD_PI / SHD_WESTIN_TURNS;
        turn = SHD_PI / SHD_WESTIN_TURNS;
    }
    const taps v = taps_at(rise_of(view), turn), l = taps_at(rise_of(light), from);
    double terms[SHD_WESTIN_BOUNCES];
    add_terms(table, &v, &l, terms);
    enum { LAST = SHD_WESTIN_BOUNCES - 1 };
    for (int c = 0; c < 3; c++) {
        out[c] = terms[LAST] / (1 - table->tail * kd[c]);
        for (int n = LAST - 1; n >= 0; n--) out[c] = out[c] * kd[c] + terms[n];
    }
}

void shd_westin_reflect(const shd_westin *table, shd_vec3 light, shd_vec3 view, const double kd[3],
                        double out[3]) {
    out[0] = out[1] = out[2] = 0;
    if (!(light.z > 0 && view.z > 0)) return;
    find_rho(table, light, view, kd, out);
    for (int c = 0; c < 3; c++) out[c] *= kd[c];
}

void shd_westin_color(const shd_westin *table, double kd, double *out) {
    enum { LAST = SHD_WESTIN_BOUNCES - 1 };
    const double rest = 1 / (1 - table->tail * kd);
    for (size_t v = 0; v < SHD_WESTIN_QUARTER; v++)
        for (size_t r = 0; r < SHD_WESTIN_RISES; r++, out += SHD_WESTIN_ROW) {
            for (size_t t = 0; t < SHD_WESTIN_TURNS; t++) {
                const float *rho = table->rho[v][r * SHD_WESTIN_TURNS + t];
                double sum = (double)rho[LAST] * rest;
                for (int n = LAST - 1; n >= 0; n--) sum = sum * kd + (double)rho[n];
                out[t] = sum;
            }
            for (size_t t = SHD_WESTIN_TURNS; t < SHD_WESTIN_ROW; t++)
                out[t] = out[t - SHD_WESTIN_TURNS];
        }
}

/* ---- How large and how steep it is. ---- */

/* A node's values, as the last bounce stands for all that follow: no more for any reflectance up to
 * 1. */
static void read_node(const shd_westin *table, int view, int light,
                      double out[SHD_WESTIN_BOUNCES]) {
    enum { LAST = SHD_WESTIN_BOUNCES - 1 };
    const float *rho = shd_westin_at(table, view, light);
    for (int n = 0; n <= LAST; n++) out[n] = (double)rho[n];
    out[LAST] /= 1 - table->tail;
}

/* The way of a node's neighbor, as splines read it: across the pole, and again at the horizon. */
static int beside(int way, int rises, int turns) {
    int rise = way / SHD_WESTIN_TURNS + rises, turn = way % SHD_WESTIN_TURNS + turns;
    if (rise < 0) {
        rise = -1 - rise;
        turn += SHD_WESTIN_TURNS / 2;
    }
    if (rise >= SHD_WESTIN_RISES) rise = SHD_WESTIN_RISES - 1;
    return rise * SHD_WESTIN_TURNS + (turn & (SHD_WESTIN_TURNS - 1));
}

static void widen(const shd_westin *table, const double here[SHD_WESTIN_BOUNCES], int view,
                  int light, double *apart) {
    double there[SHD_WESTIN_BOUNCES], sum = 0;
    read_node(table, view, light, there);
    for (int n = 0; n < SHD_WESTIN_BOUNCES; n++) sum += fabs(there[n] - here[n]);
    *apart = shd_larger(*apart, sum);
}

/* Adds a pair of nodes and its neighbors. If only the difference of both turns counts, that of
 * either direction turns the other one, too. */
static void add_node(const shd_westin *table, int view, int light, shd_table_limits *out) {
    enum { NEAR = 3 * SHD_WESTIN_TURNS }; /* SHD_WESTIN_NEAR */
    const bool either = table->isotropic && (view < NEAR || light < NEAR);
    double here[SHD_WESTIN_BOUNCES], sum = 0;
    read_node(table, view, light, here);
    for (int n = 0; n < SHD_WESTIN_BOUNCES; n++) sum += here[n];
    out->most = shd_larger(out->most, sum);
    for (int side = -1; side <= 1; side += 2) {
        widen(table, here, view, beside(light, side, 0), &out->rise);
        widen(table, here, beside(view, side, 0), light, &out->rise);
    }
    widen(table, here, view, beside(light, 0, 1), either || light < NEAR ? &out->near : &out->turn);
    widen(table, here, beside(view, 0, 1), light, either || view < NEAR ? &out->near : &out->turn);
}

void shd_westin_limit(shd_westin *table) {
    static const double MORE = 1 + 1e-12;
    shd_table_limits out = {0, 0, 0, 0};
    for (int view = 0; view < SHD_WESTIN_WAYS; view++)
        for (int light = 0; light < SHD_WESTIN_WAYS; light++) add_node(table, view, light, &out);
    out.turn = shd_larger(out.turn, out.near);
    table->limits =
        (shd_table_limits){out.most * MORE, out.rise * MORE, out.turn * MORE, out.near * MORE};
}

shd_westin_error shd_westin_noise(const shd_westin *table) {
    return table->noise;
}

/* ---- Surfaces. ---- */

static shd_vec3 turn_by(const double linear[3][3], shd_vec3 v) {
    double out[3];
    for (int r = 0; r < 3; r++)
        out[r] = linear[r][0] * v.x + linear[r][1] * v.y + linear[r][2] * v.z;
    return (shd_vec3){out[0], out[1], out[2]};
}

/* The unit part of `axis` that is perpendicular to the normal. False: there is hardly any. */
static bool lay_flat(shd_vec3 axis, shd_vec3 normal, shd_vec3 *out) {
    const double size = shd_length(axis);
    const shd_vec3 flat = shd_madd(axis, normal, -shd_dot(axis, normal));
    const double left = shd_length(flat);
    if (!(left > 1e-3 * size)) return false;
    *out = shd_scale(flat, 1 / left);
    return true;
}

shd_tangents shd_tangents_of(const shd_object *object) {
    const shd_shape shape = object->shape;
    shd_tangents out = {.around = false};
    const double(*linear)[3] = object->transform.linear;
    for (int axis = 0; axis < 3; axis++)
        out.axes[axis] = (shd_vec3){linear[0][axis], linear[1][axis], linear[2][axis]};
    if (shape == SHD_SPHERE || shape == SHD_CYLINDER || shape == SHD_CONE || shape == SHD_TORUS)
        out.around = shd_object_frame(object, &out.to_world, &out.from_world);
    return out;
}

shd_vec3 shd_tangent_at(const shd_tangents *t, shd_vec3 position, shd_vec3 normal) {
    shd_vec3 out;
    if (t->around) {
        const shd_vec3 p = turn_by(t->from_world.linear, shd_sub(position, t->to_world.origin)),
                       around = {p.z, 0, -p.x};
        if (lay_flat(turn_by(t->to_world.linear, around), normal, &out)) return out;
    }
    if (lay_flat(t->axes[0], normal, &out) || lay_flat(t->axes[2], normal, &out) ||
        lay_flat(t->axes[1], normal, &out))
        return out;
    return (shd_vec3){1, 0, 0}; /* no invertible transform comes here */
}

shd_vec3 shd_surface_tangent(const shd_object *object, shd_vec3 position, shd_vec3 normal) {
    const shd_tangents tangents = shd_tangents_of(object);
    return shd_tangent_at(&tangents, position, normal);
}

shd_tangents shd_westin_tangents(const shd_westin *table, const shd_object *object) {
    if (!table->isotropic) return shd_tangents_of(object);
    return (shd_tangents){.axes = {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}}};
}

void shd_westin_weigh(const shd_westin *table, const shd_object *object, const shd_surface *at,
                      shd_vec3 toward, double row[3]) {
    row[0] = row[1] = row[2] = 0;
    const shd_vec3 n = at->normal;
    const shd_tangents tangents = shd_westin_tangents(table, object);
    const shd_vec3 t = shd_tangent_at(&tangents, at->position, n);
    const shd_vec3 b = shd_cross(n, t),
                   light = {shd_dot(toward, t), shd_dot(toward, b), shd_dot(toward, n)},
                   view = {shd_dot(at->view, t), shd_dot(at->view, b), shd_dot(at->view, n)};
    if (!(light.z > 0 && view.z > 0)) return;
    /* The scene's, since the plan's is 1 if there is a spectrum. */
    const double *kd = at->material->from->diffuse;
    double here[3];
    for (int c = 0; c < 3; c++) here[c] = at->facets ? at->facets[c][at->facets_at] : kd[c];
    find_rho(table, light, view, here, row);
    for (int c = 0; c < 3; c++) row[c] *= light.z;
}
