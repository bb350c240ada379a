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
#include "plan/bend.h"

/* More than rounding does, of unit vectors, and relative to lengths. */
static const double SLACK = 1e-9;

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
static double way_moves(const shd_strike *m, double e) {
    if (m->ball) {
        const double at = 1 - m->beside * m->beside,
                     far = m->beside * m->beside + m->along * m->along - 1,
                     by = m->orthographic ? e * (2 * m->beside + e)
                                          : e * (2 * m->along * m->beside + fmax(1, far) * e);
        if (!(by < 0.999 * at)) return INFINITY;
        const double root = root_moves(at, by);
        return m->orthographic ? root : (m->beside * e + root + m->t * e * e) / (1 - e * e);
    }
    const double aslant = e * sqrt(1 - m->cosine * m->cosine);
    if (m->orthographic) return aslant / m->cosine;
    return aslant < 0.999 * m->cosine ? m->t * aslant / (m->cosine - aslant) : (double)INFINITY;
}

/* What is moved grows with the pace, with what is along and beside a ball, and with t, and falls
 * with the plane's cosine. Real rays turn by an angle whose tangent is e, or their origins move by
 * that. */
bool shd_worst_strike(const shd_strike *m, double reach, shd_strike *out) {
    const double x = reach * m->pace, e = m->orthographic ? x / m->size : x / (1 - x);
    *out = *m;
    if (!m->orthographic && !(x < 0.4)) return false;
    if (!m->orthographic) out->pace = m->pace / (1 - x);
    if (m->ball) {
        out->along += m->orthographic ? 0 : m->beside * e;
        out->beside += m->orthographic ? e : m->along * e;
        const double square = 1 - out->beside * out->beside;
        if (!(square > 0)) return false;
        out->t = out->along - sqrt(square);
    } else {
        const double aslant = e * sqrt(1 - m->cosine * m->cosine);
        if (m->orthographic)
            out->t += aslant / m->cosine;
        else {
            out->cosine = (m->cosine - aslant) / hypotenuse(1, e);
            if (!(out->cosine > 0)) return false;
            out->t = 1 / out->cosine;
        }
    }
    return true;
}

bool shd_move(const shd_strike *m, double reach, shd_moves *out) {
    const double x = reach * m->pace, e = m->orthographic ? x / m->size : x / (1 - x);
    if (!m->orthographic && !(x < 0.4)) return false;
    const double way = way_moves(m, e);
    if (!(way < 0.999 * m->t)) return false;
    const double point =
        hypotenuse(way, m->orthographic ? e : (m->t + way) * e) * (1 + SLACK) + SLACK;
    *out = (shd_moves){m->size * point, m->ball ? point : 0, m->orthographic ? 0 : turn_of(e)};
    return true;
}
