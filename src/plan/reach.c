/* Which lights reach which objects, and objects that are lit alike. */
#include <assert.h>
#include <string.h>
#include <xxhash.h>

#include "plan/parts.h"

/* ---- Things that are equal, found by their hashes. ---- */

typedef struct table {
    uint32_t *slots; /* [mask + 1]: index of a thing, plus 1; 0: empty */
    size_t mask;
    bool (*equal)(const void *things, size_t a, size_t b);
    const void *things;
} table;

static bool make_table(table *t, size_t count, shd_arena *arena) {
    size_t size = 16;
    while (size < 2 * count) size *= 2;
    t->mask = size - 1;
    t->slots = shd_arena_zalloc(arena, size, sizeof *t->slots);
    return t->slots;
}

/* The first thing that equals thing `index`, or that itself. */
static size_t first_equal(table *t, uint64_t hash, size_t index) {
    size_t at = (size_t)hash & t->mask;
    for (; t->slots[at]; at = (at + 1) & t->mask)
        if (t->equal(t->things, t->slots[at] - 1, index)) return t->slots[at] - 1;
    t->slots[at] = (uint32_t)index + 1;
    return index;
}

/* ---- Materials. ---- */

static bool same_color(const double a[3], const double b[3]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* But for their textures. */
static bool same_fresnel(const shd_fresnel *a, const shd_fresnel *b) {
    return same_color(a->n, b->n) && same_color(a->k, b->k) && a->n_curve == b->n_curve &&
           a->k_curve == b->k_curve && a->f0_curve == b->f0_curve;
}

/* Whether they are equal in what only extended scenes have. */
static bool same_extension(const shd_plan_material *x, const shd_plan_material *y) {
    const shd_material *a = x->from, *b = y->from;
    return a->model == b->model && a->sigma == b->sigma && a->antialiased == b->antialiased &&
           same_fresnel(&a->fresnel, &b->fresnel) && same_color(a->opacity, b->opacity) &&
           same_color(a->reflection, b->reflection) &&
           same_color(a->transmission, b->transmission) && a->ior == b->ior &&
           shd_same_microgeometry(a->microgeometry, b->microgeometry) && shd_same_textures(a, b) &&
           (!x->bins || !memcmp(x->bins, y->bins, x->bin_count * sizeof *x->bins)) &&
           shd_same_tint(x, y);
}

static bool same_material(const void *things, size_t x, size_t y) {
    const shd_plan_material *a = (const shd_plan_material *)things + x,
                            *b = (const shd_plan_material *)things + y;
    if (!same_color(a->emissive, b->emissive) || !same_color(a->ambient, b->ambient) ||
        !same_color(a->diffuse, b->diffuse) || a->front_only != b->front_only ||
        a->lobe_count != b->lobe_count)
        return false;
    for (size_t k = 0; k < a->lobe_count; k++)
        if (!same_color(a->lobes[k].specular, b->lobes[k].specular) ||
            a->lobes[k].shininess != b->lobes[k].shininess)
            return false;
    return same_extension(a, b);
}

/* The hash of those values in which most materials differ. */
static uint64_t hash_material(const shd_plan_material *m) {
    double values[11] = {0};
    for (int c = 0; c < 3; c++) {
        values[c] = m->constant[c] + 0.0; /* -0 is 0 */
        values[3 + c] = m->diffuse[c] + 0.0;
        if (m->lobe_count) values[6 + c] = m->lobes[0].specular[c] + 0.0;
    }
    if (m->lobe_count) values[9] = m->lobes[0].shininess + 0.0;
    values[10] = m->front_only;
    const uint64_t bins = m->bins ? XXH3_64bits(m->bins, m->bin_count * sizeof *m->bins) : 0;
    return XXH3_64bits_withSeed(values, sizeof values, bins);
}

/* `first`: [material_count], for each the first that equals it. */
static bool merge_materials(const shd_plan *plan, size_t *first, shd_arena *arena) {
    const size_t count = plan->scene->material_count;
    table t = {.equal = same_material, .things = plan->materials};
    /* Materials that differ only by lobes that are black are not alike in a lobe's layer. */
    const bool apart = plan->whole || plan->wants[SHD_LAYER_LOBE];
    if (!make_table(&t, count, arena)) return false;
    for (size_t m = 0; m < count; m++) {
        if (shd_is_cancelled(plan->cancelled)) return false;
        first[m] = apart ? m : first_equal(&t, hash_material(&plan->materials[m]), m);
    }
    return true;
}

/* ---- Lights. ---- */

typedef struct reach {
    shd_plan *plan;
    shd_plan_object *objects;
    const shd_plan_light *given;
    size_t count;
    uint32_t *all;  /* [count]: 0, 1, 2 ... */
    bool *used;     /* [count] */
    uint8_t *drops; /* [scene->light_count] */
    shd_plan_group *groups;
    size_t group_count;
    table table; /* of groups */
} reach;

static bool reflects_color(const shd_plan_material *material, const double color[3]) {
    for (int c = 0; c < 3; c++) {
        if (color[c] == 0) continue;
        if (material->diffuse[c] != 0) return true;
        for (size_t k = 0; k < material->lobe_count; k++)
            if (material->lobes[k].specular[c] != 0) return true;
    }
    return false;
}

/* The reason why light j adds nothing to the object; 0: it may add something. */
static uint8_t find_drop(const reach *r, const shd_plan_object *object,
                         const shd_plan_material *material, const shd_back *back, size_t j) {
    const shd_plan_light *light = &r->given[j];
    /* Mirrors see what the camera does not, and a shape is not where its middle is. */
    const bool everywhere = r->plan->scene->trace.depth || light->shape || light->environment;
    if (!reflects_color(material, light->color)) return SHD_DROP_UNLIT;
    if (everywhere) return 0;
    if (light->spot && object->bounded &&
        shd_outside_cone(light, shd_sub(light->position, object->center), object->radius))
        return SHD_DROP_CONE;
    return shd_is_behind(back, light) ? SHD_DROP_BEHIND : 0;
}

static bool same_group(const void *things, size_t x, size_t y) {
    const shd_plan_group *a = (const shd_plan_group *)things + x,
                         *b = (const shd_plan_group *)things + y;
    return a->material == b->material && a->faceted == b->faceted &&
           a->light_count == b->light_count &&
           (a->lights == b->lights ||
            !memcmp(a->lights, b->lights, a->light_count * sizeof *a->lights));
}

/* Joins the group of the object's material and the list. The list of a new group is copied, unless
 * it has all lights. False: memory. */
static bool join_group(reach *r, size_t index, const uint32_t *list, size_t count,
                       shd_arena *arena) {
    shd_plan_object *object = &r->objects[index];
    const bool faceted = r->plan->materials[object->material].textures &&
                         r->plan->scene->objects[index].interpolation != SHD_PHONG;
    if (count == r->count) list = r->all;
    /* Lists of all lights are known to be equal without reading them. */
    const size_t read = count == r->count ? 0 : count;
    uint64_t hash = XXH3_64bits_withSeed(list, read * sizeof *list, object->material);
    r->groups[r->group_count] = (shd_plan_group){object->material, faceted, list, count};
    object->group = first_equal(&r->table, hash, r->group_count);
    object->light_count = count;
    if (object->group < r->group_count) return true;
    if (list != r->all) {
        uint32_t *copy = shd_arena_alloc(arena, count, sizeof *copy);
        if (!copy) return false;
        memcpy(copy, list, count * sizeof *copy);
        r->groups[r->group_count].lights = copy;
    }
    r->group_count++;
    return true;
}

static bool find_lists(reach *r, shd_arena *arena) {
    const shd_plan *plan = r->plan;
    const shd_scene *scene = plan->scene;
    uint32_t *list = shd_arena_alloc(arena, r->count, sizeof *list);
    if (!list) return false;
    const bool few = scene->object_count <= SHD_PLAN_PAIRS / (r->count ? r->count : 1);
    bool all_used = false;
    for (size_t i = 0; i < scene->object_count; i++) {
        if (shd_is_cancelled(plan->cancelled)) return false;
        shd_plan_object *object = &r->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        const bool lit = material->has_diffuse || material->lobe_count;
        if (plan->whole || (lit && !few)) {
            all_used = true;
            if (!join_group(r, i, r->all, r->count, arena)) return false;
            continue;
        }
        size_t count = 0;
        shd_back back = {.known = false};
        if (lit) back = shd_back_of(scene, &scene->objects[i], object);
        for (size_t j = 0; j < r->count; j++) {
            const uint8_t drop = lit ? find_drop(r, object, material, &back, j) : SHD_DROP_UNLIT;
            r->drops[r->given[j].index] |= drop;
            if (drop) continue;
            r->used[j] = true;
            list[count++] = (uint32_t)j;
        }
        if (!join_group(r, i, list, count, arena)) return false;
    }
    for (size_t j = 0; all_used && j < r->count; j++) r->used[j] = true;
    return true;
}

/* Takes out lights that are in no list, and numbers the lists anew. False: memory, or cancelled. */
static bool keep_used(reach *r, shd_arena *arena) {
    shd_plan *plan = r->plan;
    shd_plan_light *lights = shd_arena_alloc(arena, r->count, sizeof *lights);
    uint32_t *number = shd_arena_alloc(arena, r->count, sizeof *number);
    if (!lights || !number) return false;
    plan->light_count = 0;
    for (size_t j = 0; j < r->count; j++) {
        const size_t index = r->given[j].index;
        if (!r->used[j] && !plan->whole) {
            if (!r->drops[index]) r->drops[index] = SHD_DROP_UNLIT; /* no object */
            continue;
        }
        r->drops[index] = 0;
        number[j] = (uint32_t)plan->light_count;
        lights[plan->light_count++] = r->given[j];
    }
    for (size_t g = 0; g < r->group_count; g++) {
        if (shd_is_cancelled(plan->cancelled)) return false;
        shd_plan_group *group = &r->groups[g];
        assert(group->light_count <= plan->light_count);
        if (group->light_count == plan->light_count) {
            group->lights = r->all;
            continue;
        }
        uint32_t *list = shd_arena_alloc(arena, group->light_count, sizeof *list);
        if (!list) return false;
        for (size_t k = 0; k < group->light_count; k++) list[k] = number[group->lights[k]];
        group->lights = list;
    }
    for (size_t i = 0; i < plan->scene->object_count; i++)
        r->objects[i].lights = r->groups[r->objects[i].group].lights;
    plan->lights = lights;
    return true;
}

bool shd_plan_reach(shd_plan *plan, const shd_plan_light *given, size_t count, uint8_t *drops,
                    shd_arena *arena) {
    const shd_scene *scene = plan->scene;
    size_t *first = shd_arena_alloc(arena, scene->material_count, sizeof *first);
    reach r = {.plan = plan,
               .given = given,
               .count = count,
               .all = shd_arena_alloc(arena, count, sizeof(uint32_t)),
               .drops = drops,
               .used = shd_arena_zalloc(arena, count, sizeof(bool)),
               .objects = shd_arena_zalloc(arena, scene->object_count, sizeof(shd_plan_object)),
               .groups = shd_arena_alloc(arena, scene->object_count, sizeof(shd_plan_group))};
    r.table = (table){.equal = same_group, .things = r.groups};
    if (!first || !r.all || !r.used || !r.objects || !r.groups ||
        !make_table(&r.table, scene->object_count, arena) || !merge_materials(plan, first, arena))
        return false;
    for (size_t j = 0; j < count; j++) r.all[j] = (uint32_t)j;
    for (size_t i = 0; i < scene->object_count; i++) {
        shd_plan_object *object = &r.objects[i];
        object->bounded = shd_object_bounds(&scene->objects[i], &object->center, &object->radius);
        object->material = first[scene->objects[i].material];
        plan->faceted |= scene->objects[i].interpolation != SHD_PHONG;
    }
    if (!find_lists(&r, arena) || !keep_used(&r, arena)) return false;
    plan->objects = r.objects;
    plan->groups = r.groups;
    plan->group_count = r.group_count;
    plan->drops = drops;
    return true;
}
