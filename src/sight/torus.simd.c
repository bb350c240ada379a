/* The torus, some rays at a time. (|p|^2 + 1 - r^2)^2 = 4 (x^2 + z^2) along a ray is a quartic.
 * From outside, its first root is before its first minimum, if it is negative there, or else before
 * its last one; from inside, between some of its turning points, where it is monotone. Those are
 * found as roots of its derivative between the roots of the second derivative, which is quadratic:
 * no root is lost to cancellation as closed formulas lose them. Turning points need few digits; the
 * surface itself is found on the distance from the tube's circle, which is well conditioned for
 * thin tubes and has the quartic's sign.
 *
 * Each lane stops by itself, so that its result does not depend on how long others take. Compiled
 * once an instruction set. */
#include "sight/batch.h"

enum { PART = 32 }; /* lanes that are worked on together: they stop when the last one does */

#define LANES(i) for (int i = 0; i < SHD_RAYS; i++)
#define EACH(i)  for (int i = 0; i < PART; i++)

/* On unit directions, from the ray's closest point to the centre. */
typedef struct quartic {
    SHD_ALIGNED double ox[PART], oy[PART], oz[PART];
    double dx[PART], dy[PART], dz[PART];
    double inverse[PART];             /* 1 / the direction's length as it came */
    double a[PART], b[PART], c[PART]; /* its derivative is 4 (t^3 + a t^2 + b t + c) */
    double low[PART], high[PART];     /* where the torus may be; low >= high: nowhere */
    double first[PART], last[PART];   /* where the second derivative is 0, held within */
    double inside[PART];              /* 1: the ray starts inside; until find_insides: it may */
    /* The surface is met between these, where its distance changes its sign. */
    double from[PART], to[PART], met[PART];
} quartic;

/* The directions, and where rays are within the sphere around the torus and the planes above and
 * below it, a little widened, so that the ends are outside. False: none is. */
static bool bound(double tube, const shd_work *restrict w, int at, quartic *restrict q) {
    const double wider = 1 + 1e-6, around = (1 + tube) * wider, square_around = around * around;
    const double above = tube * wider;
    long long any = 0;
    EACH(i) {
        double dx = w->dx[at + i], dy = w->dy[at + i], dz = w->dz[at + i];
        double square = dx * dx + dy * dy + dz * dz, inverse = 1 / sqrt(square);
        dx *= inverse, dy *= inverse, dz *= inverse;
        double ox = w->ox[at + i], oy = w->oy[at + i], oz = w->oz[at + i];
        double reach2 = square_around - (ox * ox + oy * oy + oz * oz);
        double reach = sqrt(reach2 > 0 ? reach2 : 0), near = w->near[at + i] * (square * inverse);
        double per_y = 1 / dy, one = (-above - oy) * per_y, other = (above - oy) * per_y;
        double enter = one < other ? one : other, leave = one < other ? other : one;
        /* level: always or never between the planes */
        double never = fabs(oy) > above ? INFINITY : -INFINITY;
        enter = dy == 0 ? never : enter;
        leave = dy == 0 ? INFINITY : leave;
        double low = enter > -reach ? enter : -reach, high = leave < reach ? leave : reach;
        q->inside[i] = near > low ? 1 : 0; /* perhaps */
        low = near > low ? near : low;
        q->ox[i] = ox, q->oy[i] = oy, q->oz[i] = oz;
        q->dx[i] = dx, q->dy[i] = dy, q->dz[i] = dz;
        q->inverse[i] = inverse;
        q->low[i] = low;
        q->high[i] = high;
        any |= low < high ? 1 : 0;
    }
    return any;
}

static void derive(double tube, quartic *restrict q) {
    EACH(i) {
        double ox = q->ox[i], oy = q->oy[i], oz = q->oz[i];
        double dx = q->dx[i], dy = q->dy[i], dz = q->dz[i];
        double low = q->low[i], high = q->high[i] > low ? q->high[i] : low;
        double od = ox * dx + oy * dy + oz * dz, k = ox * ox + oy * oy + oz * oz + 1 - tube * tube;
        double a = 3 * od, b = k + 2 * od * od - 2 * (dx * dx + dz * dz),
               c = od * k - 2 * (ox * dx + oz * dz);
        double square_root = a * a - 3 * b, half = sqrt(square_root > 0 ? square_root : 0);
        double first = (-a - half) * (1.0 / 3), last = (-a + half) * (1.0 / 3);
        first = first > low ? first : low;
        last = last > low ? last : low;
        q->first[i] = first < high ? first : high;
        q->last[i] = last < high ? last : high;
        q->a[i] = a, q->b[i] = b, q->c[i] = c;
    }
}

/* The derivative's root between `from` and `to`, where it is monotone; `to` where there is none.
 * Begun at `start`, Halley's steps do not pass the root: at the outer end of the outer intervals,
 * and in the inner one as near to its inflection as may be. A step's square over the slope is more
 * than what is left after it; of that, the quartic's minimum feels the square. */
static void find_turn(const quartic *restrict q, const double *restrict from,
                      const double *restrict to, const double *restrict start,
                      double *restrict out) {
    const double enough = 1e-9;
    SHD_ALIGNED double t[PART], going[PART];
    EACH(i) {
        double a = q->a[i], b = q->b[i], c = q->c[i], x = from[i], y = to[i];
        double before = ((x + a) * x + b) * x + c, after = ((y + a) * y + b) * y + c;
        bool root = before * after < 0;
        going[i] = root ? 1 : 0;
        t[i] = root ? start[i] : y;
    }
    for (int step = 0; step < 64; step++) {
        long long any = 0;
        EACH(i) {
            double a = q->a[i], b = q->b[i], c = q->c[i], x = t[i];
            double value = ((x + a) * x + b) * x + c, slope = (3 * x + 2 * a) * x + b;
            double bend = 3 * x + a; /* half of the second derivative */
            double next = x - value * slope / (slope * slope - value * bend);
            next = next > from[i] ? next : from[i]; /* not-a-number too */
            next = next < to[i] ? next : to[i];
            bool on = going[i] > 0 && (next - x) * (next - x) > enough * fabs(slope);
            t[i] = going[i] > 0 ? next : x;
            going[i] = on ? 1 : 0;
            any |= on ? 1 : 0;
        }
        if (!any) break;
    }
    memcpy(out, t, sizeof t);
}

/* By (distance from the tube's circle)^2 - r^2. */
static inline bool is_inside(const quartic *restrict q, int i, double tube, double t) {
    double x = q->ox[i] + q->dx[i] * t, y = q->oy[i] + q->dy[i] * t, z = q->oz[i] + q->dz[i] * t;
    double off = sqrt(x * x + z * z) - 1;
    return (off - tube) * (off + tube) + y * y < 0;
}

/* Whether any ray starts inside, which those do not that start where they enter the bounds. */
static bool find_insides(double tube, quartic *restrict q) {
    long long any = 0;
    EACH(i) any |= q->inside[i] > 0 ? 1 : 0;
    if (!any) return false;
    any = 0;
    EACH(i) {
        bool close = q->inside[i] > 0, inside = is_inside(q, i, tube, q->low[i]);
        q->inside[i] = close && inside ? 1 : 0;
        any |= close && inside ? 1 : 0;
    }
    return any;
}

/* From outside. */
static void enter(double tube, quartic *restrict q) {
    SHD_ALIGNED double turn[PART], last[PART];
    find_turn(q, q->low, q->first, q->low, turn);
    long long more = 0;
    EACH(i) {
        bool wanted = q->low[i] < q->high[i], met = is_inside(q, i, tube, turn[i]);
        q->met[i] = wanted && met ? 1 : 0;
        q->from[i] = q->low[i];
        q->to[i] = turn[i];
        more |= wanted && !met ? 1 : 0;
    }
    if (!more) return;
    find_turn(q, q->last, q->high, q->high, last);
    EACH(i) {
        bool wanted = q->low[i] < q->high[i], met = is_inside(q, i, tube, last[i]);
        bool before = q->met[i] > 0;
        q->from[i] = before ? q->from[i] : q->to[i];
        q->to[i] = before ? q->to[i] : last[i];
        q->met[i] = wanted && (before || met) ? 1 : 0;
    }
}

/* From inside: the first of the four monotone intervals at whose end it is outside. */
static void leave(double tube, quartic *restrict q) {
    SHD_ALIGNED double middle[PART], turn[4][PART], searching[PART];
    EACH(i) {
        double x = q->a[i] * (-1.0 / 3);
        x = x > q->first[i] ? x : q->first[i];
        middle[i] = x < q->last[i] ? x : q->last[i];
        searching[i] = q->inside[i];
    }
    find_turn(q, q->low, q->first, q->low, turn[0]);
    find_turn(q, q->first, q->last, middle, turn[1]);
    find_turn(q, q->last, q->high, q->high, turn[2]);
    memcpy(turn[3], q->high, sizeof turn[3]);
    for (int part = 0; part < 4; part++) {
        const double *restrict begin = part ? turn[part - 1] : q->low, *restrict end = turn[part];
        EACH(i) {
            bool here = searching[i] > 0, outside = !is_inside(q, i, tube, end[i]);
            double met = outside ? 1 : 0;
            q->from[i] = here ? begin[i] : q->from[i];
            q->to[i] = here ? end[i] : q->to[i];
            q->met[i] = here ? met : q->met[i];
            searching[i] = here && !outside ? 1 : 0;
        }
    }
}

/* From the end outside of the tube Newton's steps do not pass the root where the distance is
 * convex; where they leave the bracket it is halved. */
static void find_surface(double tube, quartic *restrict q, double *restrict t) {
    const double enough = 1e-15 * (1 + tube);
    SHD_ALIGNED double going[PART];
    long long any = 0;
    EACH(i) {
        bool met = q->met[i] > 0, inside = q->inside[i] > 0;
        t[i] = inside ? q->to[i] : q->from[i];
        going[i] = met ? 1 : 0;
        any |= met ? 1 : 0;
    }
    for (int step = 0; any && step < 64; step++) {
        any = 0;
        EACH(i) {
            double now = t[i], dx = q->dx[i], dy = q->dy[i], dz = q->dz[i];
            double x = q->ox[i] + dx * now, y = q->oy[i] + dy * now, z = q->oz[i] + dz * now;
            double ring = sqrt(x * x + z * z), off = ring - 1, along = (x * dx + z * dz) / ring;
            double value = (off - tube) * (off + tube) + y * y, slope = 2 * (off * along + y * dy);
            bool before = (value < 0) == (q->inside[i] > 0); /* on the side of `from` */
            double a = before ? now : q->from[i], b = before ? q->to[i] : now;
            double next = now - value / slope, half = 0.5 * (a + b);
            bool held = next >= a && next <= b;
            next = held ? next : half;
            /* What a step leaves is about its square over the slope. */
            double size = fabs(next - now), rest = held ? size * size : size;
            bool on = going[i] > 0 && size > enough && rest > enough * (held ? fabs(slope) : 1);
            q->from[i] = a;
            q->to[i] = b;
            t[i] = going[i] > 0 ? next : now;
            going[i] = on ? 1 : 0;
            any |= on ? 1 : 0;
        }
    }
}

void SHD_VARIANT(shd_find_torus)(double tube, shd_work *work) {
    for (int at = 0; at < SHD_RAYS; at += PART) {
        quartic q;
        SHD_ALIGNED double t[PART];
        if (!bound(tube, work, at, &q)) {
            EACH(i) work->t[at + i] = INFINITY;
            continue;
        }
        derive(tube, &q);
        enter(tube, &q);
        if (find_insides(tube, &q)) leave(tube, &q);
        find_surface(tube, &q, t);
        EACH(i) work->t[at + i] = q.met[i] > 0 ? t[i] * q.inverse[i] : INFINITY;
    }
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
