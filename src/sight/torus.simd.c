/* The torus, a batch of rays at a time. (|p|^2 + 1 - r^2)^2 = 4 (x^2 + z^2) along a ray is a
 * quartic. Between the roots of its derivative it is monotone, and so is that between the roots of
 * its own derivative, which is quadratic: no root is lost to cancellation as closed formulas lose
 * them. Turning points need few digits; the surface itself is found on the distance from the
 * tube's circle, which is well conditioned for thin tubes and has the quartic's sign.
 *
 * Each lane stops by itself, so that its result does not depend on how long others take. Compiled
 * once an instruction set. */
#include "sight/batch.h"

#define LANES(i) for (int i = 0; i < SHD_RAYS; i++)

/* On unit directions, from the ray's closest point to the centre. */
typedef struct quartic {
    SHD_ALIGNED double ox[SHD_RAYS], oy[SHD_RAYS], oz[SHD_RAYS];
    double dx[SHD_RAYS], dy[SHD_RAYS], dz[SHD_RAYS];
    double inverse[SHD_RAYS];                     /* 1 / the direction's length as it came */
    double a[SHD_RAYS], b[SHD_RAYS], c[SHD_RAYS]; /* its derivative is 4 (t^3 + a t^2 + b t + c) */
    double low[SHD_RAYS], high[SHD_RAYS];         /* where the torus may be; low >= high: nowhere */
    double first[SHD_RAYS], last[SHD_RAYS]; /* where the second derivative is 0, held within */
    double turn[3][SHD_RAYS];               /* where the first is, ascending; or further points */
} quartic;

static bool prepare(double tube, const shd_work *restrict w, quartic *restrict q) {
    /* A little more than the sphere around it, so that the ends are outside. */
    const double bound = (1 + tube) * (1 + 1e-6), bound2 = bound * bound;
    long long any = 0;
    LANES(i) {
        double dx = w->dx[i], dy = w->dy[i], dz = w->dz[i];
        double square = dx * dx + dy * dy + dz * dz, inverse = 1 / sqrt(square);
        dx *= inverse, dy *= inverse, dz *= inverse;
        double ox = w->ox[i], oy = w->oy[i], oz = w->oz[i];
        double oo = ox * ox + oy * oy + oz * oz, reach2 = bound2 - oo;
        double reach = sqrt(reach2 > 0 ? reach2 : 0), near = w->near[i] * (square * inverse);
        double low = near > -reach ? near : -reach;
        double od = ox * dx + oy * dy + oz * dz, k = oo + 1 - tube * tube;
        double a = 3 * od, b = k + 2 * od * od - 2 * (dx * dx + dz * dz),
               c = od * k - 2 * (ox * dx + oz * dz);
        double square_root = a * a - 3 * b, half = sqrt(square_root > 0 ? square_root : 0);
        double first = (-a - half) / 3, last = (-a + half) / 3;
        first = first > low ? first : low;
        last = last > low ? last : low;
        q->first[i] = first < reach ? first : reach;
        q->last[i] = last < reach ? last : reach;
        q->ox[i] = ox, q->oy[i] = oy, q->oz[i] = oz;
        q->dx[i] = dx, q->dy[i] = dy, q->dz[i] = dz;
        q->inverse[i] = inverse;
        q->a[i] = a, q->b[i] = b, q->c[i] = c;
        q->low[i] = low;
        q->high[i] = reach;
        any |= low < reach ? 1 : 0;
    }
    return any;
}

/* The derivative's root between `from` and `to`, where it is monotone; `to` where there is none.
 * Begun at `start`, Newton's steps do not pass the root: at the outer end of the outer intervals,
 * and in the inner one as near to its inflection as may be. */
static void find_turn(const quartic *restrict q, const double *restrict from,
                      const double *restrict to, const double *restrict start, double enough,
                      double *restrict out) {
    SHD_ALIGNED double t[SHD_RAYS], going[SHD_RAYS];
    LANES(i) {
        double a = q->a[i], b = q->b[i], c = q->c[i], x = from[i], y = to[i];
        double before = ((x + a) * x + b) * x + c, after = ((y + a) * y + b) * y + c;
        bool root = before * after < 0;
        going[i] = root ? 1 : 0;
        t[i] = root ? start[i] : y;
    }
    for (int step = 0; step < 64; step++) {
        long long any = 0;
        LANES(i) {
            double a = q->a[i], b = q->b[i], c = q->c[i], x = t[i];
            double value = ((x + a) * x + b) * x + c, slope = (3 * x + 2 * a) * x + b;
            double next = x - value / slope;
            next = next > from[i] ? next : from[i]; /* not-a-number too */
            next = next < to[i] ? next : to[i];
            bool on = going[i] > 0 && fabs(next - x) > enough;
            t[i] = going[i] > 0 ? next : x;
            going[i] = on ? 1 : 0;
            any |= on ? 1 : 0;
        }
        if (!any) break;
    }
    memcpy(out, t, sizeof t);
}

static void find_turns(double tube, quartic *restrict q) {
    const double enough = 1e-10 * (1 + tube);
    SHD_ALIGNED double middle[SHD_RAYS];
    LANES(i) {
        double x = q->a[i] * (-1.0 / 3);
        x = x > q->first[i] ? x : q->first[i];
        middle[i] = x < q->last[i] ? x : q->last[i];
    }
    find_turn(q, q->low, q->first, q->low, enough, q->turn[0]);
    find_turn(q, q->first, q->last, middle, enough, q->turn[1]);
    find_turn(q, q->last, q->high, q->high, enough, q->turn[2]);
}

/* (distance from the tube's circle)^2 - r^2, and its derivative along the ray. */
static inline double tube_distance(const quartic *restrict q, int i, double tube, double t,
                                   double *slope) {
    double x = q->ox[i] + q->dx[i] * t, y = q->oy[i] + q->dy[i] * t, z = q->oz[i] + q->dz[i] * t;
    double ring = sqrt(x * x + z * z), off = ring - 1;
    double along = (x * q->dx[i] + z * q->dz[i]) / ring; /* not-a-number on the axis */
    *slope = 2 * (off * along + y * q->dy[i]);
    return (off - tube) * (off + tube) + y * y;
}

void SHD_VARIANT(shd_find_torus)(double tube, shd_work *work) {
    quartic q;
    if (!prepare(tube, work, &q)) {
        LANES(i) work->t[i] = INFINITY;
        return;
    }
    find_turns(tube, &q);

    /* The first of the four monotone intervals at whose ends the signs differ. */
    SHD_ALIGNED double low[SHD_RAYS], high[SHD_RAYS], t[SHD_RAYS], inside[SHD_RAYS],
        going[SHD_RAYS];
    LANES(i) {
        double slope, from = q.low[i];
        inside[i] = tube_distance(&q, i, tube, from, &slope) < 0 ? 1 : 0;
        low[i] = from;
        high[i] = from;
        going[i] = 0;
    }
    for (int part = 0; part < 4; part++) {
        const double *restrict end = part < 3 ? q.turn[part] : q.high;
        LANES(i) {
            double slope, to = end[i];
            double now = tube_distance(&q, i, tube, to, &slope) < 0 ? 1 : 0;
            bool searching = going[i] == 0;
            low[i] = searching ? high[i] : low[i];
            high[i] = searching ? to : high[i];
            going[i] = searching && now != inside[i] ? 1 : going[i];
        }
    }
    /* From the end outside of the tube Newton's steps do not pass the root where the distance
     * is convex; where they leave the bracket it is halved. */
    const double enough = 1e-14 * (1 + tube);
    long long any = 0;
    LANES(i) {
        bool on = going[i] > 0 && q.low[i] < q.high[i];
        t[i] = inside[i] > 0 ? high[i] : low[i];
        work->t[i] = on ? 0 : INFINITY;
        going[i] = on ? 1 : 0;
        any |= on ? 1 : 0;
    }
    for (int step = 0; any && step < 64; step++) {
        any = 0;
        LANES(i) {
            double slope, x = t[i], value = tube_distance(&q, i, tube, x, &slope);
            bool before = (value < 0) == (inside[i] > 0); /* on the side of `low` */
            double a = before ? x : low[i], b = before ? high[i] : x;
            double next = x - value / slope, half = 0.5 * (a + b);
            bool held = next >= a && next <= b;
            next = held ? next : half;
            bool on = going[i] > 0 && fabs(next - x) > enough;
            low[i] = a;
            high[i] = b;
            t[i] = going[i] > 0 ? next : x;
            going[i] = on ? 1 : 0;
            any |= on ? 1 : 0;
        }
    }
    LANES(i) work->t[i] = work->t[i] < INFINITY ? t[i] * q.inverse[i] : INFINITY;
}

/* From the tube's circle, of radius 1 around y. */
void SHD_VARIANT(shd_place_torus)(double tube, const shd_work *work, shd_surfaces *out) {
    const shd_work *restrict w = work;
    shd_surfaces *restrict to = out;
    LANES(i) {
        double x = w->ox[i] + w->dx[i] * w->t[i], y = w->oy[i] + w->dy[i] * w->t[i],
               z = w->oz[i] + w->dz[i] * w->t[i];
        double square = x * x + z * z, inverse = shd_inverse_root(square);
        double ax = x * inverse, az = z * inverse, off = square * inverse - 1;
        double scale = shd_inverse_root(off * off + y * y);
        double n = off * scale, ny = y * scale;
        to->normal[0][i] = ax * n;
        to->normal[1][i] = ny;
        to->normal[2][i] = az * n;
        to->point[0][i] = ax * (1 + tube * n);
        to->point[1][i] = tube * ny;
        to->point[2][i] = az * (1 + tube * n);
    }
}
