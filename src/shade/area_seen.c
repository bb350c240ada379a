#include "shade/area_seen.h"

#include "plan/tier.h"

void shd_perpendicular(shd_vec3 n, shd_vec3 *a, shd_vec3 *b) {
    const double sign = copysign(1, n.z), k = -1 / (sign + n.z), m = n.x * n.y * k;
    *a = (shd_vec3){1 + sign * n.x * n.x * k, sign * m, -sign * n.x};
    *b = (shd_vec3){m, sign + n.y * n.y * k, -n.y};
}

static void set_rectangle(shd_seen *seen, double w, double h) {
    static const double sx[] = {-1, 1, 1, -1, -1}, sy[] = {-1, -1, 1, 1, -1};
    seen->count = 4;
    for (int i = 0; i < 4; i++)
        seen->pieces[i] = (shd_stretch){.x = {sx[i] * w / 2, sx[i + 1] * w / 2},
                                        .y = {sy[i] * h / 2, sy[i + 1] * h / 2}};
}

static void set_circle(shd_seen *seen, double radius) {
    seen->radius = radius;
    seen->count = 1;
    seen->pieces[0] = (shd_stretch){true, {radius, radius}, {0, 0}, 0, 2 * SHD_PI};
}

static double gain_of(double area) {
    return area > 1 / SHD_LARGEST_FALL ? 1 / area : SHD_LARGEST_FALL;
}

static bool see_sphere(const shd_light *light, double distance, shd_seen *out) {
    const double sine = light->radius / distance;
    if (!(sine < 1)) return false;
    const double cosine = sqrt((1 - sine) * (1 + sine));
    out->away = out->toward;
    out->size = sine;
    out->unit = distance;
    out->center = shd_scale(out->toward, cosine);
    out->height = cosine;
    shd_perpendicular(out->away, &out->a, &out->b);
    set_circle(out, sine);
    return cosine > 0;
}

bool shd_see_area(const shd_light *light, shd_vec3 point, shd_seen *out) {
    const double eps = 16 * 0x1p-52;
    const shd_vec3 path = shd_sub(light->position, point);
    const double distance = shd_length(path),
                 reach = shd_length(light->position) + shd_length(point);
    *out = (shd_seen){.gain = gain_of(shd_light_area(light))};
    if (!isfinite(distance) || !shd_normalize(path, &out->toward)) return false;
    double fall = 1 / distance / distance;
    if (light->type == SHD_LIGHT_SPHERE) {
        if (!see_sphere(light, distance, out)) return false;
    } else {
        const double height = -shd_dot(path, light->direction);
        if (!(height > eps * reach)) return false;
        const double w = light->size[0], h = light->size[1];
        const double extent =
            light->type == SHD_LIGHT_DISC ? light->radius : shd_length((shd_vec3){w, h, 0}) / 2;
        out->unit = distance + extent;
        out->size = extent / distance;
        out->center = shd_scale(path, 1 / out->unit);
        out->a = light->across;
        out->b = shd_scale(light->up, -1);
        out->away = shd_scale(light->direction, -1);
        out->height = height / out->unit;
        fall *= height / distance;
        if (light->type == SHD_LIGHT_DISC)
            set_circle(out, extent / out->unit);
        else
            set_rectangle(out, w / out->unit, h / out->unit);
    }
    out->fall = shd_smaller(fall, SHD_LARGEST_FALL);
    out->slack = eps * reach / out->unit;
    return isfinite(out->unit);
}

/* ---- Half-spaces. ---- */

/* The height of a point over the half-space's plane is k + kx x + ky y. */
typedef struct cut {
    double k, kx, ky;
    double swing, middle; /* along the circle: k + swing cos(angle - middle) */
} cut;

static cut cut_of(const shd_seen *s, shd_vec3 n) {
    cut c = {shd_dot(n, s->center), shd_dot(n, s->a), shd_dot(n, s->b), 0, 0};
    c.swing = s->radius * sqrt(c.kx * c.kx + c.ky * c.ky);
    return c;
}

int shd_side_of_seen(const shd_seen *s, shd_vec3 normal, double slack) {
    const cut c = cut_of(s, normal);
    double low = INFINITY, high = -INFINITY;
    for (int i = 0; i < s->count; i++) {
        const shd_stretch *p = &s->pieces[i];
        for (int e = 0; e < 2; e++) {
            const double height = c.k + c.kx * p->x[e] + c.ky * p->y[e];
            low = shd_smaller(height, low);
            high = shd_larger(height, high);
        }
        if (!p->arc) continue;
        low = shd_smaller(c.k - c.swing, low); /* of the whole circle */
        high = shd_larger(c.k + c.swing, high);
    }
    return !(high > slack) ? -1 : low >= 0 ? 1 : 0;
}

static void add_arc(shd_seen *to, double from, double end) {
    if (!(end > from) || to->count == SHD_STRETCHES_MOST) return;
    shd_stretch *p = &to->pieces[to->count++];
    *p = (shd_stretch){.arc = true, .from = from, .to = end};
    p->x[0] = to->radius * cos(from);
    p->y[0] = to->radius * sin(from);
    p->x[1] = to->radius * cos(end);
    p->y[1] = to->radius * sin(end);
}

static void clip_arc(shd_seen *to, const shd_stretch *p, const cut *c) {
    if (c->k >= c->swing) {
        to->pieces[to->count++] = *p;
        return;
    }
    if (c->k <= -c->swing) return;
    const double middle = atan2(c->ky, c->kx), half = acos(-c->k / c->swing);
    if (p->to - p->from >= 2 * SHD_PI) {
        add_arc(to, middle - half, middle + half);
        return;
    }
    /* The turn in which the kept angles begin last before the arc's. */
    const double turns = floor((p->from - (middle - half)) / (2 * SHD_PI));
    for (int i = 0; i < 2; i++) {
        const double at = middle + 2 * SHD_PI * (turns + i);
        add_arc(to, shd_larger(at - half, p->from), shd_smaller(at + half, p->to));
    }
}

static void clip_segment(shd_seen *to, const shd_stretch *p, const cut *c) {
    double t[2] = {0, 1}, height[2];
    for (int e = 0; e < 2; e++) height[e] = c->k + c->kx * p->x[e] + c->ky * p->y[e];
    if (!(height[0] > 0) && !(height[1] > 0)) return;
    const double where = height[0] / (height[0] - height[1]);
    if (!(height[0] > 0)) t[0] = where;
    if (!(height[1] > 0)) t[1] = where;
    shd_stretch *out = &to->pieces[to->count++];
    *out = *p;
    for (int e = 0; e < 2; e++) {
        if (t[e] == e) continue;
        out->x[e] = p->x[0] + t[e] * (p->x[1] - p->x[0]);
        out->y[e] = p->y[0] + t[e] * (p->y[1] - p->y[0]);
    }
}

/* Closes the gap that a cut has left, if it is wider than rounding. */
static void close_gaps(shd_seen *s) {
    const int kept = s->count;
    shd_stretch closed[SHD_STRETCHES_MOST];
    int count = 0;
    for (int i = 0; i < kept && count < SHD_STRETCHES_MOST - 1; i++) {
        const shd_stretch *p = &s->pieces[i], *next = &s->pieces[(i + 1) % kept];
        closed[count++] = *p;
        const double dx = next->x[0] - p->x[1], dy = next->y[0] - p->y[1];
        if (dx != 0 || dy != 0)
            closed[count++] = (shd_stretch){.x = {p->x[1], next->x[0]}, .y = {p->y[1], next->y[0]}};
    }
    for (int i = 0; i < count; i++) s->pieces[i] = closed[i];
    s->count = count;
}

void shd_clip_seen(shd_seen *seen, shd_vec3 normal) {
    const cut c = cut_of(seen, normal);
    shd_seen out = *seen;
    out.count = 0;
    for (int i = 0; i < seen->count && out.count < SHD_STRETCHES_MOST - 2; i++) {
        if (seen->pieces[i].arc)
            clip_arc(&out, &seen->pieces[i], &c);
        else
            clip_segment(&out, &seen->pieces[i], &c);
    }
    close_gaps(&out);
    *seen = out;
}

bool shd_is_in_seen(const shd_seen *s, shd_vec3 direction) {
    const double ahead = shd_dot(direction, s->away);
    if (!(ahead > 0) || !s->count) return false;
    const shd_vec3 at = shd_sub(shd_scale(direction, s->height / ahead), s->center);
    const double x = shd_dot(at, s->a), y = shd_dot(at, s->b);
    for (int i = 0; i < s->count; i++) {
        const shd_stretch *p = &s->pieces[i];
        if (p->arc ? x * x + y * y >= s->radius * s->radius
                   : (p->x[1] - p->x[0]) * (y - p->y[0]) <= (p->y[1] - p->y[0]) * (x - p->x[0]))
            return false;
    }
    return true;
}
