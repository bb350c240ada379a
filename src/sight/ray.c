/* Rays among objects: a tree of boxes over those that are bounded, and the others one by one. */
#include "sight/ray.h"

#include <string.h>

#include "plan/tier.h"
#include "sight/ray_parts.h"

enum { FEW = 4, DEPTH = 64 }; /* objects of a leaf; levels of the tree */

typedef struct branch {
    shd_vec3 low, high;
    uint32_t first, count; /* count > 0: objects order[first...]; else branches first, first + 1 */
} branch;

/* What rays ask of an object before they meet it. */
typedef struct aim {
    shd_vec3 center;
    double radius;    /* with room for rounding; infinite: the object is not bounded */
    double length[3]; /* of the rows of the item's map from the world */
    uint8_t seen[3];  /* bits 0, 1 and 2: the row's x, y and z are not 0 */
} aim;

struct shd_caster {
    const shd_sight *sight;
    const shd_item **items; /* [object] */
    aim *aims;              /* the same */
    branch *branches;       /* [branch_count]; 0: no object is bounded */
    uint32_t branch_count;
    uint32_t *order; /* bounded objects, by leaf */
    uint32_t *endless;
    size_t bounded_count, endless_count;
};

/* ---- The tree over objects. ---- */

static shd_vec3 middle_of(const shd_caster *c, uint32_t object) {
    return c->aims[object].center;
}

static double component(shd_vec3 v, int axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static aim aim_at(const shd_plan_object *object, const shd_item *it) {
    aim a = {.center = object->center, .radius = INFINITY};
    if (object->bounded)
        a.radius = object->radius * (1 + 1e-9) + 1e-14 * shd_max_abs(object->center);
    for (int i = 0; i < 3; i++) {
        const double *row = it->from_world.linear[i];
        a.length[i] = shd_length((shd_vec3){row[0], row[1], row[2]});
        for (int k = 0; k < 3; k++) a.seen[i] |= (uint8_t)((row[k] != 0) << k);
    }
    return a;
}

static void enclose_objects(const shd_caster *c, branch *b, shd_vec3 *low, shd_vec3 *high) {
    const shd_vec3 least = {-INFINITY, -INFINITY, -INFINITY}, most = {INFINITY, INFINITY, INFINITY};
    b->low = *low = most;
    b->high = *high = least;
    for (uint32_t i = b->first; i < b->first + b->count; i++) {
        const aim *object = &c->aims[c->order[i]];
        const double r = object->radius;
        const shd_vec3 p = object->center, out = {r, r, r};
        b->low = shd_vec3_min(shd_sub(p, out), b->low);
        b->high = shd_vec3_max(shd_add(p, out), b->high);
        *low = shd_vec3_min(p, *low);
        *high = shd_vec3_max(p, *high);
    }
}

/* Moves those with the smaller middles along an axis before the others, half by half (C. A. R.
 * Hoare, "Algorithm 65: Find", 1961). */
static void part_halves(const shd_caster *c, uint32_t first, uint32_t count, int axis) {
    uint32_t low = first, high = first + count - 1;
    const uint32_t wanted = first + count / 2;
    while (low < high) {
        const double pivot = component(middle_of(c, c->order[wanted]), axis);
        uint32_t i = low, j = high;
        for (;;) {
            while (component(middle_of(c, c->order[i]), axis) < pivot) i++;
            while (component(middle_of(c, c->order[j]), axis) > pivot) j--;
            if (i <= j) {
                const uint32_t before = c->order[i];
                c->order[i++] = c->order[j];
                c->order[j] = before;
                if (!j) break;
                j--;
            }
            if (i > j) break;
        }
        if (wanted <= j)
            high = j;
        else if (wanted >= i)
            low = i;
        else
            return;
    }
}

/* Halves branches until few objects are left in each. */
static void grow_tree(shd_caster *c) {
    c->branches[0] = (branch){.first = 0, .count = (uint32_t)c->bounded_count};
    c->branch_count = 1;
    for (uint32_t at = 0; at < c->branch_count; at++) {
        branch *b = &c->branches[at];
        shd_vec3 low, high;
        enclose_objects(c, b, &low, &high);
        if (b->count <= FEW) continue;
        const shd_vec3 size = shd_sub(high, low);
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const uint32_t first = b->first, half = b->count / 2, rest = b->count - half;
        part_halves(c, first, b->count, axis);
        b->first = c->branch_count;
        b->count = 0;
        c->branches[c->branch_count++] = (branch){.first = first, .count = half};
        c->branches[c->branch_count++] = (branch){.first = first + half, .count = rest};
    }
}

/* All items, and those of balls among them: rays ask for these one by one. NULL: the arena is full.
 */
static const shd_item **list_items(const shd_sight *sight, shd_arena *arena) {
    const shd_item **items = shd_arena_alloc(arena, sight->count, sizeof *items);
    size_t balls = 0;
    for (size_t i = 0; i < sight->count; i++) balls += !sight->items[i];
    shd_item *room = shd_arena_alloc(arena, balls, sizeof *room);
    if (!items || !room) return NULL;
    for (size_t i = 0; i < sight->count; i++) {
        items[i] = shd_item_of(sight, i, room);
        room += !sight->items[i];
    }
    return items;
}

shd_caster *shd_caster_new(const shd_sight *sight, shd_arena *arena) {
    const shd_plan *plan = sight->plan;
    const size_t count = plan->scene->object_count;
    shd_caster *c = shd_arena_zalloc(arena, 1, sizeof *c);
    if (!c) return NULL;
    c->sight = sight;
    c->aims = shd_arena_alloc(arena, count, sizeof *c->aims);
    c->branches = shd_arena_alloc(arena, 2 * count + 1, sizeof *c->branches);
    c->order = shd_arena_alloc(arena, count, sizeof *c->order);
    c->endless = shd_arena_alloc(arena, count, sizeof *c->endless);
    if (!c->aims || !c->branches || !c->order || !c->endless) return NULL;
    if (!(c->items = list_items(sight, arena))) return NULL;
    for (uint32_t i = 0; i < count; i++) {
        c->aims[i] = aim_at(&plan->objects[i], c->items[i]);
        if (plan->objects[i].bounded)
            c->order[c->bounded_count++] = i;
        else
            c->endless[c->endless_count++] = i;
    }
    if (c->bounded_count) grow_tree(c);
    return c;
}

/* ---- One object. ---- */

/* How far off rounding puts the components of an origin in an item's frame, where `sizes` are those
 * that were added up in the world: at each, the row's length times that of the components at which
 * it is not 0. */
static shd_vec3 carried_by(const aim *a, shd_vec3 sizes) {
    const double one[8] = {0, sizes.x, sizes.y, 0, sizes.z, 0, 0, 0};
    double reach[3];
    for (int i = 0; i < 3; i++) {
        const int seen = a->seen[i];
        if (!(seen & (seen - 1))) /* one axis needs no root */
            reach[i] = one[seen];
        else if (i && seen == a->seen[i - 1])
            reach[i] = reach[i - 1];
        else
            reach[i] = shd_length(
                (shd_vec3){seen & 1 ? sizes.x : 0, seen & 2 ? sizes.y : 0, seen & 4 ? sizes.z : 0});
    }
    return (shd_vec3){SHD_HIT_ROUNDING * (a->length[0] * reach[0]),
                      SHD_HIT_ROUNDING * (a->length[1] * reach[1]),
                      SHD_HIT_ROUNDING * (a->length[2] * reach[2])};
}

/* A normal in the frame of an item: the map's transpose carries it back. */
static shd_vec3 carry_normal(const shd_item *it, shd_vec3 n) {
    const double(*m)[3] = it->to_world.linear;
    return (shd_vec3){m[0][0] * n.x + m[1][0] * n.y + m[2][0] * n.z,
                      m[0][1] * n.x + m[1][1] * n.y + m[2][1] * n.z,
                      m[0][2] * n.x + m[1][2] * n.y + m[2][2] * n.z};
}

/* The ray in the frame of an item, but for `any`; field by field: a compiler copies a whole one
 * once more. */
static void carry_ray(const shd_item *it, const aim *at, size_t object, const shd_ray *ray,
                      double far, shd_local_ray *r) {
    const shd_vec3 from = shd_sub(ray->origin, it->to_world.origin),
                   sizes = shd_add(shd_sizes(ray->origin), shd_sizes(it->to_world.origin));
    r->origin = shd_linear(&it->from_world, from);
    r->direction = shd_linear(&it->from_world, ray->direction);
    r->carried = carried_by(at, sizes);
    r->far = far;
    r->starts = ray->start.object == (int32_t)object;
    r->start = ray->start.triangle;
    r->outward = false;
    if (!r->starts || it->shape == SHD_MESH) return;
    const shd_vec3 own = carry_normal(it, ray->start.normal);
    const bool same = shd_points_outward(it, r->origin, own);
    r->outward = (shd_dot(own, r->direction) >= 0) == same;
}

/* Whether the ray may meet the object's sphere before `far`. `pad`: what rounding may do. */
static bool may_meet(const aim *object, const shd_ray *ray, double pad, double far) {
    if (!(object->radius < INFINITY)) return true;
    const shd_vec3 toward = shd_sub(object->center, ray->origin);
    const double radius = object->radius + pad, along = shd_dot(toward, ray->direction);
    const shd_vec3 off = shd_madd(toward, ray->direction, -along);
    return shd_dot(off, off) <= radius * radius * (1 + 1e-12) + 1e-28 * along * along &&
           along >= -radius && along - radius <= far;
}

/* What was found so far. */
typedef struct search {
    const shd_caster *caster;
    const shd_ray *ray;
    const bool *solid;
    shd_meeting *out;
    double pad; /* what rounding does to the ray's origin */
    double far; /* as far as it is worth looking */
    bool met, done;
} search;

/* At equal distance, to within rounding, the object that comes first in the scene stays, as to the
 * eye. */
static void try_object(search *s, uint32_t object) {
    const shd_item *it = s->caster->items[object];
    const aim *at = &s->caster->aims[object];
    if (!may_meet(at, s->ray, s->pad, s->far)) return;
    shd_local_ray local;
    local.any = s->solid && s->solid[object];
    carry_ray(it, at, object, s->ray, s->far, &local);
    shd_meeting m;
    if (!(it->shape == SHD_MESH ? shd_meet_mesh(it, &local, s->caster->sight->cancelled, &m)
                                : shd_meet_shape(it, &local, &m)))
        return;
    m.object = object;
    s->done = local.any;
    if (s->met && !s->done) {
        const double both = m.rounding + s->out->rounding;
        if (m.t > s->out->t + both || (!(m.t < s->out->t - both) && object > s->out->object))
            return;
    }
    *s->out = m;
    s->met = true;
    s->far = shd_smaller((m.t + 4 * m.rounding) * (1 + 1e-9), s->ray->far);
}

/* ---- All of them. ---- */

static bool may_enter(const branch *b, const shd_ray *ray, double far) {
    const double o[3] = {ray->origin.x, ray->origin.y, ray->origin.z},
                 d[3] = {ray->direction.x, ray->direction.y, ray->direction.z},
                 least[3] = {b->low.x, b->low.y, b->low.z},
                 most[3] = {b->high.x, b->high.y, b->high.z};
    double low = 0, high = far;
    for (int k = 0; k < 3; k++) {
        const double pad = 1e-14 * (fabs(o[k]) + fabs(least[k]) + fabs(most[k]));
        const double near = least[k] - pad - o[k], beyond = most[k] + pad - o[k];
        if (d[k] == 0) {
            if (near > 0 || beyond < 0) return false;
            continue;
        }
        const double one = near / d[k], two = beyond / d[k];
        low = shd_larger(one < two ? one : two, low);
        high = shd_smaller(one < two ? two : one, high);
    }
    return low <= high * (1 + 1e-14);
}

static void walk_tree(search *s) {
    const shd_caster *c = s->caster;
    uint32_t waiting[DEPTH];
    int waits = 0;
    if (c->branch_count) waiting[waits++] = 0;
    while (waits && !s->done) {
        const branch *b = &c->branches[waiting[--waits]];
        if (!may_enter(b, s->ray, s->far)) continue;
        if (b->count) {
            for (uint32_t i = b->first; i < b->first + b->count && !s->done; i++)
                try_object(s, c->order[i]);
            continue;
        }
        waiting[waits++] = b->first + 1;
        waiting[waits++] = b->first;
    }
}

bool shd_cast_ray(const shd_caster *caster, const shd_ray *ray, const uint32_t *list, size_t count,
                  const bool *solid, shd_meeting *out) {
    search s = {.caster = caster,
                .ray = ray,
                .solid = solid,
                .out = out,
                .pad = 1e-14 * shd_max_abs(ray->origin),
                .far = ray->far};
    if (list) {
        for (size_t k = 0; k < count && !s.done; k++) try_object(&s, list[k]);
        return s.met;
    }
    for (size_t k = 0; k < caster->endless_count && !s.done; k++)
        try_object(&s, caster->endless[k]);
    walk_tree(&s);
    return s.met;
}

/* ---- What may be between points and a light. ---- */

static double size_of(const shd_affine *m) {
    double sum = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) sum += m->linear[i][k] * m->linear[i][k];
    return sqrt(sum);
}

bool shd_is_convex(const shd_caster *caster, size_t object) {
    static const double THIN = 1e3;
    const shd_item *it = caster->items[object];
    return (it->shape == SHD_SPHERE || it->shape == SHD_BOX || it->shape == SHD_CYLINDER ||
            it->shape == SHD_CONE) &&
           size_of(&it->to_world) * size_of(&it->from_world) < THIN;
}

bool shd_is_outside(const shd_caster *caster, size_t object, shd_vec3 position, shd_vec3 normal) {
    const shd_item *it = caster->items[object];
    const shd_vec3 from = shd_linear(&it->from_world, shd_sub(position, it->to_world.origin));
    return shd_points_outward(it, from, carry_normal(it, normal));
}

size_t shd_list_between(const shd_caster *c, shd_ball at, const shd_plan_light *light, size_t own,
                        uint32_t *list, size_t most) {
    const shd_plan *plan = c->sight->plan;
    uint32_t waiting[DEPTH];
    size_t found = 0;
    int waits = 0;
    for (size_t k = 0; k < c->endless_count; k++)
        if (c->endless[k] != own && shd_may_object_hide(plan, at, light, c->endless[k])) {
            if (found < most) list[found] = c->endless[k];
            found++;
        }
    if (c->branch_count) waiting[waits++] = 0;
    while (waits && found <= most) {
        const branch *b = &c->branches[waiting[--waits]];
        const shd_vec3 half = shd_scale(shd_sub(b->high, b->low), 0.5);
        if (!shd_may_hide(at, light, (shd_ball){shd_add(b->low, half), shd_length(half)})) continue;
        if (!b->count) {
            waiting[waits++] = b->first + 1;
            waiting[waits++] = b->first;
            continue;
        }
        for (uint32_t i = b->first; i < b->first + b->count; i++) {
            if (c->order[i] == own || !shd_may_object_hide(plan, at, light, c->order[i])) continue;
            if (found < most) list[found] = c->order[i];
            found++;
        }
    }
    return found;
}

/* ---- The surface there. ---- */

shd_vec3 shd_own_normal(const shd_caster *caster, size_t object, uint32_t triangle) {
    const shd_item *it = caster->items[object];
    shd_vec3 normal = {0, 0, 0};
    if (it->shape != SHD_MESH) return normal;
    const double scale = it->view.tree->scale;
    const shd_vec3 a = shd_triangle_corner(&it->triangles, triangle, 0),
                   b = shd_triangle_corner(&it->triangles, triangle, 1),
                   c = shd_triangle_corner(&it->triangles, triangle, 2);
    const shd_vec3 own =
        shd_cross(shd_scale(shd_sub(b, a), scale), shd_scale(shd_sub(c, a), scale));
    shd_normalize(shd_linear(&it->normal_map, own), &normal);
    return normal;
}

static shd_met_at place_on_triangle(const shd_caster *caster, const shd_meeting *m) {
    const shd_item *it = caster->items[m->object];
    const shd_vec3 a = shd_triangle_corner(&it->triangles, m->triangle, 0),
                   b = shd_triangle_corner(&it->triangles, m->triangle, 1),
                   c = shd_triangle_corner(&it->triangles, m->triangle, 2);
    const shd_vec3 p = shd_madd(shd_madd(a, shd_sub(b, a), m->u), shd_sub(c, a), m->v);
    shd_met_at place = {.position = shd_transform(&it->to_world, p)};
    place.own = place.normal = shd_own_normal(caster, m->object, m->triangle);
    if (!it->smooth) return place;
    const uint32_t *vertex = it->triangles.indices + 3 * (size_t)m->triangle;
    shd_vec3 sum = shd_scale(shd_vec3_at(it->units, vertex[0]), 1 - m->u - m->v);
    sum = shd_madd(sum, shd_vec3_at(it->units, vertex[1]), m->u);
    sum = shd_madd(sum, shd_vec3_at(it->units, vertex[2]), m->v);
    shd_normalize(shd_linear(&it->normal_map, sum), &place.normal);
    return place;
}

shd_met_at shd_met_place(const shd_caster *caster, const shd_meeting *m) {
    const shd_item *it = caster->items[m->object];
    if (it->shape == SHD_MESH) return place_on_triangle(caster, m);
    shd_met_at place = {.position = shd_transform(&it->to_world, m->local), .own = {0, 1, 0}};
    shd_normalize(shd_linear(&it->normal_map, m->bend), &place.own);
    place.normal = place.own;
    return place;
}

shd_vec3 shd_outward_normal(const shd_caster *caster, size_t object, uint32_t triangle,
                            shd_vec3 position, shd_vec3 normal) {
    const shd_item *it = caster->items[object];
    if (it->shape == SHD_MESH) {
        const shd_vec3 own = shd_own_normal(caster, object, triangle);
        return own.x == 0 && own.y == 0 && own.z == 0 ? normal : own;
    }
    const shd_vec3 at = shd_linear(&it->from_world, shd_sub(position, it->to_world.origin));
    return shd_points_outward(it, at, carry_normal(it, normal)) ? normal : shd_scale(normal, -1);
}
