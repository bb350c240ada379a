#include "attack/reflect.h"

#include <complex.h>
#include <stdbool.h>

static const long double HALF_TURN = 3.14159265358979323846264338327950288L;

/* ---- Gauss and Legendre's nodes. ---- */

enum { NODES = 12, ENERGY_NODES = 40 };

typedef struct nodes {
    bool known;
    double at[ENERGY_NODES], weight[ENERGY_NODES]; /* of [-1, 1] */
} nodes;

static void find_nodes(nodes *n, int count) {
    for (int i = 0; i < count && !n->known; i++) {
        long double x = cosl(HALF_TURN * (i + 0.75L) / (count + 0.5L)), slope = 1;
        for (int step = 0; step < 60; step++) {
            long double before = 1, p = x;
            for (int k = 2; k <= count; k++) {
                const long double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
                before = p;
                p = next;
            }
            slope = count * (x * p - before) / (x * x - 1);
            x -= p / slope;
        }
        n->at[i] = (double)x;
        n->weight[i] = (double)(2 / ((1 - x * x) * slope * slope));
    }
    n->known = true;
}

/* ---- Models. ---- */

/* The integral of (R.V)+^n (N.V)+ over all V above the horizon, by circles around R: a circle of
 * the angle t is above it by 2 (p a + q sin a), where p = c cos t, q = s sin t, and a is the half
 * of it that is. Up to t = 90 degrees less the light's angle all of it is, which has a closed form.
 */
static real energy_of(real c, real n) {
    static _Thread_local nodes known;
    find_nodes(&known, ENERGY_NODES);
    if (c > 1) c = 1;
    const real pi = ANGLE(0, -1), s = ROOT((1 - c) * (1 + c)), kink = ANGLE(c, s);
    const real whole = 2 * pi * c * (1 - POWER(s, n + 2)) / (n + 2);
    /* What falls below exp(-50) of what it is at the kink counts no more. */
    const real rest = pi / 2 - kink, least = s * EXPONENT(-50 / (n + 1));
    const real end = smaller(pi / 2, ANGLE(ROOT(1 - least * least), least)), span = end - kink;
    real sum = 0;
    if (!(rest > 0 && s > 0)) return whole;
    /* In steps that grow from both ends, at which there are roots. */
    enum { PANELS = 12 };
    for (int k = 0; k < PANELS * ENERGY_NODES; k++) {
        const int i = k % ENERGY_NODES;
        const real u = (k / ENERGY_NODES + (real)(known.at[i] + 1) / 2) / PANELS,
                   t = kink + span * u * u * u * (10 + u * (6 * u - 15)),
                   step =
                       span * 30 * u * u * (1 - u) * (1 - u) * (real)known.weight[i] / 2 / PANELS,
                   p = c * COSINE(t), q = s * SINE(t), ratio = q > p ? p / q : 1, a = ARC(-ratio);
        sum += step * POWER(COSINE(t), n) * SINE(t) * 2 *
               (p * a + q * ROOT(larger(0, (1 - ratio) * (1 + ratio))));
    }
    return whole + sum;
}

/* The same between Chebyshev's nodes in the light's angle, of parts that are found when they are
 * first asked for: integrals over lights with a shape want it some 1e5 times. Parts are narrower
 * than 1 / sqrt(n), over which it changes at the horizon, for exponents up to 1e6; it is off by
 * 5e-11 of itself at most, and by 1e-12 if exponents are 1 or more. */
enum { FEWEST_PARTS = 128, PARTS = 1280, PART_NODES = 12, KEPT = 4 };
static const real MOST_KEPT = (real)1e6; /* the largest exponent */

typedef struct energies {
    real exponent;
    bool known[PARTS], used;
    real value[PARTS][PART_NODES];
} energies;

static energies *energies_of(real n) {
    static _Thread_local energies kept[KEPT];
    static _Thread_local int next;
    for (int i = 0; i < KEPT; i++)
        if (kept[i].used && kept[i].exponent == n) return &kept[i];
    energies *e = &kept[next++ % KEPT];
    *e = (energies){.exponent = n, .used = true};
    return e;
}

static real kept_energy_of(real c, real n) {
    const int parts = (int)larger(FEWEST_PARTS, smaller((real)1.28 * ROOT(n), PARTS));
    const real width = (real)(HALF_TURN / 2) / parts, angle = ANGLE(ROOT(larger(0, 1 - c * c)), c);
    const int part = (int)smaller(angle / width, parts - 1);
    real x[PART_NODES], above = 0, below = 0;
    if (n > MOST_KEPT) return energy_of(c, n);
    energies *e = energies_of(n);
    for (int k = 0; k < PART_NODES; k++) {
        x[k] = width * (part + (1 - COSINE((real)HALF_TURN * (k + (real)0.5) / PART_NODES)) / 2);
        if (!e->known[part]) e->value[part][k] = energy_of(COSINE(x[k]), n);
    }
    e->known[part] = true;
    for (int k = 0; k < PART_NODES; k++) { /* Lagrange's polynomial, in its barycentric form */
        if (angle == x[k]) return e->value[part][k];
        const real weight = (k % 2 ? -1 : 1) *
                            SINE((real)HALF_TURN * (k + (real)0.5) / PART_NODES) / (angle - x[k]);
        above += weight * e->value[part][k];
        below += weight;
    }
    return above / below;
}

/* Of unpolarized light, by Fresnel's amplitudes. */
static real fresnel_of(real n, real k, real cosine) {
    if (isinf((double)n)) return 1;
    const long double c = (long double)cosine;
    const long double _Complex index = (long double)n + (long double)k * _Complex_I,
                               inside = csqrtl(1 - (1 - c * c) / (index * index)),
                               across = (c - index * inside) / (c + index * inside),
                               along = (index * c - inside) / (index * c + inside);
    const long double a = cabsl(across), b = cabsl(along);
    return (real)((a * a + b * b) / 2);
}

static real diffuse_of(const stuff *m, real facing, real viewing, real between) {
    if (m->kind != OREN_NAYAR) return facing;
    const real square = m->sigma * m->sigma, view = larger(viewing, 0),
               rough = larger(0, between - facing * view) / larger(facing, view);
    return facing * (1 - square / (2 * (square + (real)33 / 100)) +
                     (real)45 / 100 * square / (square + (real)9 / 100) * rough);
}

/* F D G / (4 N.V) but for F. */
static real facets_of(real slope, real facing, real viewing, real upright, real bent) {
    const real square = upright * upright,
               d = EXPONENT(-(1 - upright) * (1 + upright) / square / slope / slope) /
                   (slope * slope * square * square),
               masked = 2 * upright * viewing / bent, hidden = 2 * upright * facing / bent;
    return d * smaller(1, smaller(masked, hidden)) / (4 * viewing);
}

typedef real energy_function(real c, real n);

static void reflect_by(energy_function *energy, const stuff *m, point n, point v, point l,
                       unsigned *cases, real out[3]) {
    const real facing = larger(0, dot(n, l)), viewing = dot(n, v), between = dot(l, v),
               shine = 2 * facing * viewing - between;
    const point sum = add(l, v), half = unit(sum);
    const bool bisects = length(sum) > 0;
    const real upright = bisects ? dot(n, half) : 0, bent = bisects ? dot(v, half) : 0;
    *cases = (viewing > 0) + 2 * (shine > 0) + 4 * (upright > 0);
    const long double nvl[3][3] = {{(long double)n.x, (long double)n.y, (long double)n.z},
                                   {(long double)v.x, (long double)v.y, (long double)v.z},
                                   {(long double)l.x, (long double)l.y, (long double)l.z}};
    for (int c = 0; c < 3; c++)
        out[c] =
            m->diffuse[c] * (m->kind == TABLED ? m->weigh(m->table, nvl, (long double)m->diffuse[c])
                                               : diffuse_of(m, facing, viewing, between));
    for (size_t k = 0; k < m->lobe_count; k++) {
        const real e = m->lobes[k].shininess;
        real weight = 0;
        if (m->kind == BLINN)
            weight = upright > 0 ? POWER(upright, e) : 0;
        else if (m->kind == COOK_TORRANCE)
            weight = viewing > 0 && upright > 0 && bent > 0
                         ? facets_of(e, facing, viewing, upright, bent)
                         : 0;
        else
            weight = shine > 0 ? POWER(shine, e) : 0;
        if (m->kind == NORMALIZED && weight > 0)
            weight *= ANGLE(0, -1) * facing / energy(facing, e);
        for (int c = 0; c < 3; c++) {
            const real mirrors =
                m->kind == COOK_TORRANCE ? fresnel_of(m->index[c], m->absorption[c], bent) : 1;
            if (weight > 0) out[c] += m->lobes[k].specular[c] * weight * mirrors;
        }
    }
}

void reflect_light(const stuff *m, point n, point v, point l, unsigned *cases, real out[3]) {
    reflect_by(energy_of, m, n, v, l, cases, out);
}

/* ---- Lights with a shape. ---- */

/* A rectangle or a disc, seen from a point; of a sphere the disc that its cone of directions has
 * in common with it. */
typedef struct sheet {
    const stuff *m;
    point n, v, w;
    point middle, across, up, out_of; /* from the point that is lit */
    bool round;
    real area;
    real sharp; /* how wide the sharpest lobe is */
    point creases[2];
} sheet;

/* Points of a line or of numbers between which sums are smooth. */
typedef struct marks {
    real at[160];
    int count;
    real low, high;
} marks;

static void mark(marks *m, real at) {
    if (!(at > m->low && at < m->high) || m->count == 160) return;
    int i = m->count++;
    for (; i > 0 && m->at[i - 1] > at; i--) m->at[i] = m->at[i - 1];
    m->at[i] = at;
}

/* Around a place where what is summed changes within `width`. */
static void mark_peak(marks *m, real at, real width) {
    const real span = m->high - m->low;
    mark(m, at);
    for (width = larger(width, span * (real)1e-9); width < span; width *= 4) {
        mark(m, at - width);
        mark(m, at + width);
    }
}

static void light_from(const sheet *s, point path, real out[3]) {
    const real d2 = dot(path, path), d = ROOT(d2);
    const point l = times(path, 1 / d);
    const real cosine = -dot(l, s->out_of);
    unsigned cases;
    out[0] = out[1] = out[2] = 0;
    if (!(d > 0 && cosine > 0 && dot(s->n, l) > 0)) return;
    reflect_by(kept_energy_of, s->m, s->n, s->v, l, &cases, out);
    for (int c = 0; c < 3; c++) out[c] *= cosine / d2;
}

typedef struct line {
    const sheet *s;
    point from, step; /* path = from + t step */
    real scale;
} line;

typedef void summand(const void *context, real at, real out[3]);

static void on_line(const void *context, real t, real out[3]) {
    const line *l = context;
    light_from(l->s, add(l->from, times(l->step, t)), out);
    for (int c = 0; c < 3; c++) out[c] *= l->scale;
}

static void sum_panel(summand *f, const void *context, real low, real high, real out[3]) {
    static _Thread_local nodes known;
    find_nodes(&known, NODES);
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < NODES; i++) {
        real value[3];
        f(context, low + (high - low) * (real)(known.at[i] + 1) / 2, value);
        for (int c = 0; c < 3; c++) out[c] += (high - low) / 2 * (real)known.weight[i] * value[c];
    }
}

/* Adds a panel whose sum is `whole`, in halves until they agree to `within`. */
static void sum_halves(summand *f, const void *context, real low, real high, const real whole[3],
                       real within, int depth, real out[3]) {
    const real middle = (low + high) / 2;
    real left[3], right[3], off = 0;
    sum_panel(f, context, low, middle, left);
    sum_panel(f, context, middle, high, right);
    for (int c = 0; c < 3; c++) off = larger(off, SIZE(left[c] + right[c] - whole[c]));
    if (off <= within || depth == 0) {
        for (int c = 0; c < 3; c++) out[c] += left[c] + right[c];
        return;
    }
    sum_halves(f, context, low, middle, left, within / 2, depth - 1, out);
    sum_halves(f, context, middle, high, right, within / 2, depth - 1, out);
}

static void sum_marks(summand *f, const void *context, marks *m, real relative, int depth,
                      real out[3]) {
    real panels[161][3], most = 0;
    for (int i = 0; i <= m->count; i++) {
        const real low = i ? m->at[i - 1] : m->low, high = i < m->count ? m->at[i] : m->high;
        sum_panel(f, context, low, high, panels[i]);
        for (int c = 0; c < 3; c++) most += SIZE(panels[i][c]);
    }
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i <= m->count; i++) {
        const real low = i ? m->at[i - 1] : m->low, high = i < m->count ? m->at[i] : m->high;
        sum_halves(f, context, low, high, panels[i], relative * most, depth, out);
    }
}

/* Where from + t step is nearest to where `to` points. */
static real toward_on(point from, point step, point to) {
    const real a = dot(to, from), b = dot(to, step), aa = dot(from, from), ab = dot(from, step),
               bb = dot(step, step);
    return (b * aa - a * ab) / (a * bb - b * ab);
}

/* The sum along one line of the sheet: at `a` of its first axis, from -1 to 1. */
static void on_sheet(const void *context, real a, real out[3]) {
    const sheet *s = context;
    const real turn = (real)(HALF_TURN / 2) * a, wide = s->round ? COSINE(turn) : 1;
    line l = {s, add(s->middle, times(s->across, s->round ? SINE(turn) : a)), times(s->up, wide),
              s->round ? s->area / (real)HALF_TURN * wide * wide * (real)(HALF_TURN / 2)
                       : s->area / 4};
    marks m = {.count = 0, .low = -1, .high = 1};
    const real foot = -dot(l.from, l.step) / dot(l.step, l.step), size = length(l.step);
    mark_peak(&m, foot, length(add(l.from, times(l.step, foot))) / size);
    mark(&m, -dot(s->n, l.from) / dot(s->n, l.step));
    for (int k = 0; k < 2; k++) mark(&m, -dot(s->creases[k], l.from) / dot(s->creases[k], l.step));
    const real peak = toward_on(l.from, l.step, s->w);
    if (s->sharp < (real)0.5)
        mark_peak(&m, peak, s->sharp * length(add(l.from, times(l.step, peak))) / size);
    sum_marks(on_line, &l, &m, (real)1e-9, 10, out);
}

/* Where the plane of the normal n cuts the sheet's outline, on its first axis. */
static void mark_plane(const sheet *s, point n, marks *m) {
    const real e = dot(n, s->middle), a = dot(n, s->across), b = dot(n, s->up);
    if (!s->round) {
        mark(m, (-e - b) / a);
        mark(m, (-e + b) / a);
        return;
    }
    const real size = ROOT(a * a + b * b), at = -e / size; /* sin(x + turn) */
    if (!(SIZE(at) < 1)) return;
    const real turn = ANGLE(b, a), over = ANGLE(at, ROOT(1 - at * at));
    for (int k = 0; k < 2; k++) {
        const real x = (k ? (real)HALF_TURN - over : over) - turn;
        for (int j = -1; j <= 1; j++)
            mark(m, (x + 2 * j * (real)HALF_TURN) / (real)(HALF_TURN / 2));
        for (int j = -1; j <= 1; j++)
            mark(m, ((real)HALF_TURN - x + 2 * j * (real)HALF_TURN) / (real)(HALF_TURN / 2));
    }
}

static void sum_sheet(const sheet *s, real out[3]) {
    marks m = {.count = 0, .low = -1, .high = 1};
    const real size = length(s->across), high = -dot(s->middle, s->out_of);
    real foot = -dot(s->middle, s->across) / size / size;
    mark_plane(s, s->n, &m);
    for (int k = 0; k < 2; k++) mark_plane(s, s->creases[k], &m);
    const real down = -dot(s->w, s->out_of);
    real peak =
        down > 0 ? dot(sub(times(s->w, high / down), s->middle), s->across) / size / size : 2;
    const real width = down > 0 ? s->sharp * high / down / size : 1;
    if (s->round) {
        foot = SIZE(foot) < 1 ? ANGLE(foot, ROOT(1 - foot * foot)) / (real)(HALF_TURN / 2) : foot;
        peak = SIZE(peak) < 1 ? ANGLE(peak, ROOT(1 - peak * peak)) / (real)(HALF_TURN / 2) : peak;
    }
    mark_peak(&m, foot, high / size);
    if (s->sharp < (real)0.5) mark_peak(&m, peak, width);
    sum_marks(on_sheet, s, &m, (real)1e-8, 8, out);
}

void reflect_shape(const stuff *m, const lamp *l, point at, point n, point v, real out[3]) {
    const point w = sub(times(n, 2 * dot(n, v)), v), path = sub(l->position, at);
    sheet s = {.m = m,
               .n = n,
               .v = v,
               .w = w,
               .middle = path,
               .across = l->across,
               .up = l->up,
               .out_of = l->axis,
               .round = l->kind != RECTANGLE,
               .sharp = 1,
               .creases = {w, sub(v, times(n, dot(n, v)))}};
    real area = (real)HALF_TURN * l->radius * l->radius;
    out[0] = out[1] = out[2] = 0;
    for (size_t k = 0; k < m->lobe_count; k++) {
        const real e = m->lobes[k].shininess;
        s.sharp = smaller(s.sharp, m->kind == COOK_TORRANCE ? 2 * e : 1 / ROOT(e + 1));
    }
    s.area = area;
    if (l->kind == RECTANGLE) s.area = area = 4 * length(cross(l->across, l->up));
    if (l->kind == BALL) {
        const real d = length(path), r = l->radius;
        if (!(d > r)) return;
        const real share = (d - r) * (d + r) / d / d, radius = r * ROOT(share);
        s.out_of = times(path, -1 / d);
        s.middle = times(path, share);
        const point aside = SIZE(s.out_of.x) < (real)0.5 ? (point){1, 0, 0} : (point){0, 1, 0};
        s.across = times(unit(cross(aside, s.out_of)), radius);
        s.up = cross(s.out_of, s.across);
        s.area = (real)HALF_TURN * radius * radius;
    }
    if (!(-dot(s.middle, s.out_of) > 0)) return;
    sum_sheet(&s, out);
    for (int c = 0; c < 3; c++) out[c] *= l->color[c] / area;
}
