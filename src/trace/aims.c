#include "trace/aims.h"

static double mirror_bits(uint32_t i) {
    double value = 0, bit = 0.5;
    for (; i; i >>= 1, bit /= 2) value += i & 1 ? bit : 0;
    return value;
}

bool shd_aim_pattern_make(size_t count, shd_arena *arena, shd_aim_pattern *out) {
    const size_t whole = (count + SHD_AIMS_STEP - 1) / SHD_AIMS_STEP * SHD_AIMS_STEP;
    double *rows = shd_arena_zalloc(arena, 5 * whole, sizeof *rows);
    if (!rows) return false;
    for (size_t i = 0; i < count; i++) {
        const double u = ((double)i + 0.5) / (double)count,
                     v = mirror_bits((uint32_t)i) + 0.5 / (double)count, turn = 2 * SHD_PI * v;
        const double values[5] = {u, v, sqrt(u), cos(turn), sin(turn)};
        for (size_t k = 0; k < 5; k++) rows[k * whole + i] = values[k];
    }
    *out = (shd_aim_pattern){
        count, rows, rows + whole, rows + 2 * whole, rows + 3 * whole, rows + 4 * whole};
    return true;
}

/* Two unit vectors at right angles to a unit vector. */
static void span_plane(shd_vec3 n, shd_vec3 *a, shd_vec3 *b) {
    const shd_vec3 x = {1, 0, 0}, y = {0, 1, 0};
    *a = x;
    shd_normalize(shd_cross(fabs(n.x) < 0.5 ? x : y, n), a);
    *b = shd_cross(n, *a);
}

shd_aim shd_aim_at(const struct shd_light *light, shd_vec3 from, shd_vec3 normal) {
    shd_aim out = {.light = light, .from = from, .normal = normal, .axis = {0, 1, 0}};
    const shd_vec3 path = shd_sub(light->position, from);
    out.distance = shd_length(path);
    if (light->type == SHD_LIGHT_RECT) {
        out.axis = light->direction;
        out.a = light->across;
        out.b = light->up;
        return out;
    }
    if (light->type == SHD_LIGHT_DISC) {
        out.axis = light->direction;
    } else {
        /* without cancellation */
        const double sine = light->radius / out.distance;
        out.most = sine < 1 ? sine * sine / (1 + sqrt(1 - sine * sine)) : 2;
        shd_normalize(path, &out.axis);
    }
    span_plane(out.axis, &out.a, &out.b);
    return out;
}

bool shd_aim_is_held(const shd_aim *aim) {
    const double reach = shd_light_reach(aim->light), least = 1e-140, most = 1e140;
    return aim->distance > least && aim->distance < most && reach > least && reach < most;
}

/* Returns the cosine at the light over the square of the distance; 0: it sends nothing there. */
static double way_to_flat(const shd_aim *aim, const shd_aim_pattern *p, size_t i, shd_vec3 *toward,
                          double *far) {
    const struct shd_light *light = aim->light;
    const bool rect = light->type == SHD_LIGHT_RECT;
    const double x = rect ? (p->u[i] - 0.5) * light->size[0]
                          : light->radius * p->root[i] * p->cosine[i],
                 y = rect ? (p->v[i] - 0.5) * light->size[1]
                          : light->radius * p->root[i] * p->sine[i];
    const shd_vec3 point = shd_madd(shd_madd(light->position, aim->a, x), aim->b, y),
                   path = shd_sub(point, aim->from);
    *far = shd_length(path);
    if (!shd_normalize(path, toward)) return 0;
    const double facing = -shd_dot(*toward, light->direction);
    return facing > 0 ? facing / (*far * *far) : 0;
}

/* Even in the cone in which the sphere is seen, or all around from inside. */
static double way_to_sphere(const shd_aim *aim, const shd_aim_pattern *p, size_t i,
                            shd_vec3 *toward, double *far) {
    const double r = aim->light->radius, down = p->u[i] * aim->most,
                 aside = sqrt(down * (2 - down));
    const shd_vec3 path = shd_sub(aim->light->position, aim->from);
    *toward = shd_madd(shd_scale(aim->axis, 1 - down), aim->a, aside * p->cosine[i]);
    *toward = shd_madd(*toward, aim->b, aside * p->sine[i]);
    shd_normalize(*toward, toward);
    const double along = shd_dot(path, *toward);
    const shd_vec3 off = shd_madd(path, *toward, -along);
    const double half = sqrt(fmax(0, r * r - shd_dot(off, off)));
    *far = aim->most < 2 ? along - half : along + half;
    return 1;
}

void shd_aim_singly(const shd_aim *aim, const shd_aim_pattern *pattern, size_t first, size_t n,
                    shd_aims *out) {
    const bool sphere = aim->light->type == SHD_LIGHT_SPHERE;
    for (size_t i = 0; i < n; i++) {
        shd_vec3 toward = {0, 0, 0};
        double weight =
            (sphere ? way_to_sphere : way_to_flat)(aim, pattern, first + i, &toward, &out->far[i]);
        out->weight[i] = weight * fmax(0, shd_dot(aim->normal, toward));
        out->toward[0][i] = toward.x;
        out->toward[1][i] = toward.y;
        out->toward[2][i] = toward.z;
    }
}
