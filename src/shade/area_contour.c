#include "shade/area_contour.h"

#include "shade/gauss.h"

/* ---- Quadrature of one variable. ---- */

typedef double integrand(const void *context, double t);

/* The integral by 15 points. *error: how far 7 points are off that, which is far more than 15 are
 * off. */
static double integrate_once(integrand *f, const void *context, double from, double to,
                             double *error) {
    const double half = (to - from) / 2, middle = from + half, center = f(context, middle);
    double fine = SHD_WEIGHTS_15[7] * center, coarse = SHD_WEIGHTS_G7[3] * center;
    for (int i = 0; i < 7; i++) {
        const double off = half * SHD_NODES_15[i],
                     both = f(context, middle - off) + f(context, middle + off);
        fine += SHD_WEIGHTS_15[i] * both;
        if (i % 2) coarse += SHD_WEIGHTS_G7[i / 2] * both;
    }
    *error = fabs(half * (fine - coarse));
    return half * fine;
}

/* Halves [from, to] until each part is within `tolerance`, but at most so many times. *error grows
 * by the sum of what is told of the parts. */
static double integrate(integrand *f, const void *context, double from, double to, double tolerance,
                        double *error) {
    enum { DEEPEST = 40 };
    double ends[DEEPEST + 1], sum = 0;
    int depth[DEEPEST + 1], count = 0, steps = 0;
    ends[count] = to;
    depth[count++] = 0;
    while (count) {
        double off;
        const double end = ends[count - 1];
        const int level = depth[count - 1];
        const double part = integrate_once(f, context, from, end, &off);
        if (off > tolerance && level < DEEPEST && count < DEEPEST && ++steps < 200) {
            depth[count - 1] = level + 1;
            ends[count] = from + (end - from) / 2;
            depth[count++] = level + 1;
            continue;
        }
        sum += part;
        *error += off;
        from = end;
        count--;
    }
    return sum;
}

/* ---- The diffuse term. ---- */

/* The integral of N.(p x dp) / |p|^2 along an arc is one of (m0 + m1 cos t + m2 sin t) / (k + b cos
 * t). */
typedef struct fraction {
    double m0, m1, m2, k, b;
} fraction;

/* For b below k / 10, where closed forms cancel: 1 / (k + b cos t) is a series of cosines, E_0 / 2
 * + sum_j E_j cos jt with E_j = 2 (-b / (k + root))^j / root, root^2 = k^2 - b^2. */
static double series_of(const fraction *f, double root, double from, double to) {
    const double rho = -f->b / (f->k + root), c[2] = {cos(from), cos(to)},
                 s[2] = {sin(from), sin(to)};
    double last[2] = {0, 0}, now[2] = {s[0], s[1]}; /* sin (j - 1) t, sin jt */
    double before = 2 / root, e = before * rho;     /* E_(j - 1), E_j */
    double sum = (f->m0 * before + f->m1 * e) / 2 * (to - from);
    for (int j = 1; fabs(before) > 1e-18 / root; j++) {
        const double after = e * rho, part = (now[1] - now[0]) / j;
        sum += (f->m0 * e + f->m1 * (before + after) / 2) * part;
        for (int i = 0; i < 2; i++) {
            const double next = 2 * c[i] * now[i] - last[i];
            last[i] = now[i];
            now[i] = next;
        }
        before = e;
        e = after;
    }
    /* And sin t / (k + b cos t) is -log(k + b cos t)' / b. */
    const double step = (c[1] - c[0]) / (f->k + f->b * c[0]), x = f->b * step;
    return sum - f->m2 * step * (x != 0 ? log1p(x) / x : 1);
}

static double arc_diffuse(const shd_seen *s, const shd_stretch *p, shd_vec3 normal) {
    const double r = s->radius, ca = shd_dot(s->center, s->a), cb = shd_dot(s->center, s->b);
    const double aside = sqrt(ca * ca + cb * cb), turn = aside > 0 ? atan2(cb, ca) : 0;
    const double m1 = r * shd_dot(normal, shd_cross(s->center, s->b)),
                 m2 = -r * shd_dot(normal, shd_cross(s->center, s->a));
    const double near = (aside - r) * (aside - r) + s->height * s->height,
                 far = (aside + r) * (aside + r) + s->height * s->height;
    const fraction f = {r * r * shd_dot(normal, s->away), m1 * cos(turn) + m2 * sin(turn),
                        m2 * cos(turn) - m1 * sin(turn), (near + far) / 2, 2 * r * aside};
    const double from = p->from - turn, to = p->to - turn;
    if (p->to - p->from >= 2 * SHD_PI) {
        const double root = sqrt(near * far);
        return 2 * SHD_PI / root * (f.m0 - f.m1 * f.b / (f.k + root));
    }
    if (f.b < 0.1 * f.k) return series_of(&f, sqrt(near * far), from, to);
    const double m = sqrt(near / far);
    double whole = 0, ends[2] = {from, to}, t[2], logs[2];
    for (int e = 0; e < 2; e++) {
        const double sine = sin(ends[e]), cosine = cos(ends[e]);
        t[e] = ends[e] - 2 * atan2((1 - m) * sine, (1 + m) + (1 - m) * cosine);
        logs[e] = log(f.k + f.b * cosine);
    }
    whole = (t[1] - t[0]) / sqrt(near * far);
    return f.m1 / f.b * (to - from) + (f.m0 - f.m1 * f.k / f.b) * whole -
           f.m2 / f.b * (logs[1] - logs[0]);
}

/* A segment as a great circle's arc of unit vectors. */
typedef struct edge {
    shd_vec3 from, along, around; /* unit: where it begins, the way on, and along's axis */
    double length;                /* angle */
} edge;

/* The segment's own difference is exact, which that of its ends would not be. */
static bool make_edge(const shd_seen *s, const shd_stretch *p, edge *out) {
    const shd_vec3 from = shd_seen_at(s, p->x[0], p->y[0]), to = shd_seen_at(s, p->x[1], p->y[1]);
    const shd_vec3 step = shd_madd(shd_scale(s->a, p->x[1] - p->x[0]), s->b, p->y[1] - p->y[0]);
    const shd_vec3 across = shd_cross(from, step);
    const double size = sqrt(shd_dot(across, across));
    if (!(size > 0)) return false;
    out->around = shd_scale(across, 1 / size);
    out->from = shd_scale(from, 1 / sqrt(shd_dot(from, from)));
    out->along = shd_cross(out->around, out->from);
    out->length = atan2(size, shd_dot(from, to));
    return true;
}

double shd_contour_diffuse(const shd_seen *seen, shd_vec3 normal) {
    double sum = 0;
    for (int i = 0; i < seen->count; i++) {
        edge e;
        if (seen->pieces[i].arc)
            sum += arc_diffuse(seen, &seen->pieces[i], normal);
        else if (make_edge(seen, &seen->pieces[i], &e))
            sum += e.length * shd_dot(normal, e.around);
    }
    return shd_larger(sum / 2, 0);
}

/* ---- Lobes. ---- */

/* Where (1-d)^(n+1) is less than exp(-this), it is nothing beside 1. */
static const double NOTHING = 40;

/* What a quadrature may be off, of the most that the light can add. */
static const double TOLERANCE = 1e-8;

/* The same as sum of z^2k, for an integer: nothing cancels. */
static double whole_fall(unsigned power, double z) {
    const double q = z * z;
    double sum = 0, last = 1; /* of k < m, and q^m, for the first bits of power / 2 as m */
    for (unsigned bit = 1u << 6; bit > 1; bit >>= 1) {
        sum *= 1 + last;
        last *= last;
        if (!(power & bit)) continue;
        sum = 1 + q * sum;
        last *= q;
    }
    return power & 1 ? sum + last / (1 + z) : sum;
}

/* (1 - z^(n+1)) / (1 - z^2) with z = 1 - d; `power` is n + 1. */
static double fall_of(double power, double d) {
    if (power < 128 && power == (unsigned)power && d <= 1)
        return whole_fall((unsigned)power, 1 - d);
    if (!(d > 1e-300)) return power / 2;
    /* exp and log are quicker, where nothing cancels. */
    const double z = 1 - shd_smaller(d, 1), log_z = d > 0.25 ? log(z) : log1p(-d),
                 x = power * log_z, fall = x < -0.5 ? 1 - exp(x) : -expm1(x);
    return fall / (d * (2 - d));
}

/* An edge seen from the lobe's axis: z = r cos t with t from the foot of the perpendicular. */
typedef struct swept {
    double power, from, to; /* t */
    double offset;          /* W.around, the sine of the distance; it has a sign */
    double r, low;          /* r, and 1 - r without cancellation */
    double width;           /* t is this times sinh x */
} swept;

static swept sweep(const edge *e, shd_vec3 mirror, double power) {
    const double a = shd_dot(mirror, e->from), b = shd_dot(mirror, e->along), foot = atan2(b, a);
    swept s = {.power = power, .from = -foot, .to = e->length - foot};
    s.offset = shd_dot(mirror, e->around);
    s.r = sqrt(a * a + b * b);
    s.low = s.offset * s.offset / (1 + s.r);
    s.width = shd_larger(fabs(s.offset), 1 / sqrt(power));
    return s;
}

static double swept_at(const void *context, double x) {
    const swept *s = context;
    const double e = exp(x), inverse = 1 / e, t = s->width * (e - inverse) / 2, sine = sin(t / 2);
    return s->width * (e + inverse) / 2 * fall_of(s->power, s->low + 2 * s->r * sine * sine);
}

/* The angle around the lobe's axis that is swept between two t, less than a whole turn. */
static double turned(const swept *s, double from, double to) {
    const double size = fabs(s->offset),
                 angle = atan2(sin(to), cos(to) * size) - atan2(sin(from), cos(from) * size);
    return angle < -SHD_PI / 2 ? angle + 2 * SHD_PI : angle;
}

/* The edge's part, times n + 1. */
static double edge_lobe(const edge *e, shd_vec3 mirror, double power, double tolerance,
                        double *error) {
    const swept s = sweep(e, mirror, power);
    if (s.offset == 0) return 0;
    /* The angle itself where the power is nothing, and quadrature between. */
    const double half = (NOTHING / power - s.low) / (2 * s.r);
    const double cut = half >= 1 ? INFINITY : half > 0 ? 2 * asin(sqrt(half)) : 0;
    const double from = shd_smaller(shd_larger(s.from, -cut), s.to),
                 to = shd_larger(shd_smaller(s.to, cut), s.from);
    if (!(to > from)) return copysign(turned(&s, s.from, s.to), s.offset);
    double sum = turned(&s, s.from, from) + turned(&s, to, s.to), off = 0;
    const double size = fabs(s.offset);
    const double begin = asinh(from / s.width), end = asinh(to / s.width);
    if (begin < 0 && end > 0)
        sum += size * (integrate(swept_at, &s, begin, 0, tolerance / size, &off) +
                       integrate(swept_at, &s, 0, end, tolerance / size, &off));
    else
        sum += size * integrate(swept_at, &s, begin, end, tolerance / size, &off);
    *error += size * off;
    return copysign(sum, s.offset);
}

/* The same for an integer n: the sum of the moments of z of order n - 1, n - 3 ... to 0, or to 1,
 * which leaves the polygon's solid angle (Arvo 1995, eq. 19 and the algorithm under it). */
static double edge_moments(const edge *e, shd_vec3 mirror, int n) {
    const double a = shd_dot(mirror, e->from), b = shd_dot(mirror, e->along),
                 cosine = cos(e->length), sine = sin(e->length);
    /* z and -dz/dt at both ends, and their powers. */
    const double z[2] = {a, a * cosine + b * sine}, y[2] = {-b, a * sine - b * cosine};
    const double squared = a * a + b * b;
    const bool odd = n % 2;
    double power[2] = {odd ? z[0] : z[0] * z[0], odd ? z[1] : z[1] * z[1]};
    double moment = odd ? e->length : y[1] - y[0], sum = n ? moment : 0;
    for (int k = odd ? 2 : 3; k < n; k += 2) {
        moment = (power[1] * y[1] - power[0] * y[0] + (k - 1) * squared * moment) / k;
        sum += moment;
        for (int i = 0; i < 2; i++) power[i] *= z[i] * z[i];
    }
    return sum * shd_dot(mirror, e->around);
}

/* The solid angle of a fan of triangles: A. Van Oosterom and J. Strackee, "The Solid Angle of a
 * Plane Triangle", IEEE Trans. Biomed. Eng. 30(2), 1983. */
static double solid_angle(const shd_seen *s) {
    double sum = 0;
    const shd_vec3 p = shd_seen_at(s, s->pieces[0].x[0], s->pieces[0].y[0]);
    for (int i = 1; i + 1 < s->count; i++) {
        const shd_stretch *e = &s->pieces[i];
        const shd_vec3 q = shd_seen_at(s, e->x[0], e->y[0]), r = shd_seen_at(s, e->x[1], e->y[1]);
        const double x0 = s->pieces[0].x[0], y0 = s->pieces[0].y[0];
        const double twice = (e->x[0] - x0) * (e->y[1] - y0) - (e->x[1] - x0) * (e->y[0] - y0);
        const double lp = sqrt(shd_dot(p, p)), lq = sqrt(shd_dot(q, q)), lr = sqrt(shd_dot(r, r));
        sum += 2 * atan2(s->height * twice, lp * lq * lr + shd_dot(p, q) * lr + shd_dot(q, r) * lp +
                                                shd_dot(r, p) * lq);
    }
    return sum;
}

bool shd_has_moments(double exponent) {
    return exponent <= SHD_MOMENTS_MOST && exponent == floor(exponent);
}

static double polygon_lobe(const shd_seen *seen, shd_vec3 mirror, int n) {
    double sum = n % 2 ? 0 : solid_angle(seen);
    for (int i = 0; n && i < seen->count; i++) {
        edge e;
        if (make_edge(seen, &seen->pieces[i], &e)) sum += edge_moments(&e, mirror, n);
    }
    return sum / (n + 1);
}

/* An arc as it is integrated. */
typedef struct swung {
    const shd_seen *seen;
    shd_vec3 mirror;
    double power;
} swung;

static double swung_at(const void *context, double angle) {
    const swung *c = context;
    const shd_seen *s = c->seen;
    const double cosine = s->radius * cos(angle), sine = s->radius * sin(angle);
    const shd_vec3 p = shd_seen_at(s, cosine, sine),
                   step = shd_madd(shd_scale(s->a, -sine), s->b, cosine);
    const double squared = shd_dot(p, p);
    const shd_vec3 off = shd_sub(shd_scale(p, 1 / sqrt(squared)), c->mirror);
    return shd_dot(c->mirror, shd_cross(p, step)) / squared *
           fall_of(c->power, shd_dot(off, off) / 2);
}

/* A whole circle by equal steps from `begin`, where the lobe is, which converge faster than any
 * power as the integrand is periodic. They are halved until that changes little. `even`: both ways
 * around are the same. False: they are too many. */
static bool round_lobe(const swung *c, double begin, bool even, double tolerance, double *sum,
                       double *error) {
    enum { FIRST = 16, MOST = 128 };
    double last = INFINITY, values = 0;
    for (int n = FIRST; n <= MOST; n *= 2) {
        for (int i = 0; i <= (even ? n / 2 : n - 1); i++) {
            if (n > FIRST && i % 2 == 0) continue;
            const double twice = even && i && i < n / 2 ? 2 : 1;
            values += twice * swung_at(c, begin + 2 * SHD_PI * i / n);
        }
        *sum = values * (2 * SHD_PI / n);
        if (fabs(*sum - last) <= tolerance) {
            *error += fabs(*sum - last);
            return true;
        }
        last = *sum;
    }
    return false;
}

/* It is cut where it is nearest to the lobe's axis, about, so that no lobe is missed. */
static double arc_lobe(const shd_seen *s, const shd_stretch *p, shd_vec3 mirror, double power,
                       double tolerance, double *error) {
    const swung c = {s, mirror, power};
    const double ahead = shd_dot(mirror, s->away);
    const shd_vec3 at = shd_madd(shd_scale(mirror, s->height), s->center, -ahead);
    const double nearest = atan2(shd_dot(at, s->b), shd_dot(at, s->a));
    double sum = 0, from = p->from;
    const bool even = fabs(shd_dot(s->center, s->a)) + fabs(shd_dot(s->center, s->b)) < 1e-14;
    if (p->to - from >= 2 * SHD_PI && round_lobe(&c, nearest, even, tolerance, &sum, error))
        return sum;
    sum = 0;
    double cut = nearest + 2 * SHD_PI * ceil((from - nearest) / (2 * SHD_PI));
    cut -= SHD_PI / 2 * floor((cut - from) / (SHD_PI / 2));
    while (from < p->to) {
        if (!(cut > from)) cut += SHD_PI / 2;
        const double to = shd_smaller(cut, p->to);
        sum += integrate(swung_at, &c, from, to, tolerance, error);
        from = to;
    }
    return sum;
}

double shd_contour_lobe(const shd_seen *seen, shd_vec3 mirror, double exponent, double *error) {
    bool polygon = true;
    *error = 0;
    for (int i = 0; i < seen->count; i++) polygon &= !seen->pieces[i].arc;
    if (!seen->count) return 0;
    if (polygon && shd_has_moments(exponent))
        return shd_larger(polygon_lobe(seen, mirror, (int)exponent), 0);
    const double power = exponent + 1, size = shd_smaller(seen->size, 1);
    const double tolerance = TOLERANCE * shd_smaller(1, power * size * size);
    double sum = 0;
    for (int i = 0; i < seen->count; i++) {
        edge e;
        if (seen->pieces[i].arc)
            sum += arc_lobe(seen, &seen->pieces[i], mirror, power, tolerance, error);
        else if (make_edge(seen, &seen->pieces[i], &e))
            sum += edge_lobe(&e, mirror, power, tolerance, error);
    }
    *error /= power;
    return shd_larger(sum / power, 0);
}
