/* Ways to the points of a light. Compiled once for each instruction set; the equations are those of
 * pattern.c. */
#include "trace/aims.h"

#include "base/cpu.h"
#include "base/simd.h"

enum { VW = SHD_W / 2 };

typedef struct lanes3 {
    shd_vd x, y, z;
} lanes3;

SHD_INLINE lanes3 set3(shd_vec3 v) {
    return (lanes3){shd_vd_set(v.x), shd_vd_set(v.y), shd_vd_set(v.z)};
}

SHD_INLINE lanes3 madd3(lanes3 a, lanes3 b, shd_vd by) {
    return (lanes3){a.x + b.x * by, a.y + b.y * by, a.z + b.z * by};
}

SHD_INLINE shd_vd dot3(lanes3 a, lanes3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

SHD_INLINE lanes3 scale3(lanes3 a, shd_vd by) {
    return (lanes3){a.x * by, a.y * by, a.z * by};
}

SHD_INLINE shd_vd way_to_flat(const shd_aim *aim, const shd_aim_pattern *p, size_t i,
                              lanes3 *toward, shd_vd *far) {
    const struct shd_light *light = aim->light;
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1), half = shd_vd_set(0.5);
    shd_vd x, y;
    if (light->type == SHD_LIGHT_RECT) {
        x = (shd_vd_load(p->u + i) - half) * shd_vd_set(light->size[0]);
        y = (shd_vd_load(p->v + i) - half) * shd_vd_set(light->size[1]);
    } else {
        const shd_vd r = shd_vd_set(light->radius) * shd_vd_load(p->root + i);
        x = r * shd_vd_load(p->cosine + i);
        y = r * shd_vd_load(p->sine + i);
    }
    const lanes3 middle = set3(light->position), from = set3(aim->from),
                 point = madd3(madd3(middle, set3(aim->a), x), set3(aim->b), y),
                 path = {point.x - from.x, point.y - from.y, point.z - from.z};
    const shd_vd squared = dot3(path, path);
    const shd_md is = shd_vd_gt(squared, shd_vd_set(0x1p-1000));
    const shd_vd length = shd_vd_sqrt(shd_vd_select(is, squared, one));
    *far = length;
    *toward = scale3(path, one / length);
    const shd_vd facing = -dot3(*toward, set3(light->direction));
    return shd_vd_mul_in(shd_vd_gt_in(is, facing, zero), facing, one / (length * length));
}

SHD_INLINE shd_vd way_to_sphere(const shd_aim *aim, const shd_aim_pattern *p, size_t i,
                                lanes3 *toward, shd_vd *far) {
    const double r = aim->light->radius;
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1), two = shd_vd_set(2);
    const shd_vd down = shd_vd_load(p->u + i) * shd_vd_set(aim->most),
                 aside = shd_vd_sqrt(down * (two - down));
    const lanes3 path = set3(shd_sub(aim->light->position, aim->from));
    lanes3 way = scale3(set3(aim->axis), one - down);
    way = madd3(way, set3(aim->a), aside * shd_vd_load(p->cosine + i));
    way = madd3(way, set3(aim->b), aside * shd_vd_load(p->sine + i));
    *toward = scale3(way, one / shd_vd_sqrt(dot3(way, way)));
    const shd_vd along = dot3(path, *toward);
    const lanes3 off = madd3(path, *toward, -along);
    const shd_vd half = shd_vd_sqrt(shd_vd_max(shd_vd_set(r * r) - dot3(off, off), zero));
    *far = aim->most < 2 ? along - half : along + half;
    return one;
}

void SHD_VARIANT(shd_aim)(const shd_aim *aim, const shd_aim_pattern *pattern, size_t first,
                          size_t n, shd_aims *out) {
    const bool sphere = aim->light->type == SHD_LIGHT_SPHERE;
    const lanes3 normal = set3(aim->normal);
    for (size_t i = 0; i < n; i += VW) {
        lanes3 toward;
        shd_vd far;
        const shd_vd weight = sphere ? way_to_sphere(aim, pattern, first + i, &toward, &far)
                                     : way_to_flat(aim, pattern, first + i, &toward, &far);
        shd_vd_store(out->toward[0] + i, toward.x);
        shd_vd_store(out->toward[1] + i, toward.y);
        shd_vd_store(out->toward[2] + i, toward.z);
        shd_vd_store(out->far + i, far);
        shd_vd_store(out->weight + i, weight * shd_vd_max(dot3(normal, toward), shd_vd_set(0)));
    }
}
