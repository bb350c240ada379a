#include "render/tiles/mapped.h"

#include "shade/gloss.h"

/* Means of these lengths have no direction. */
static const double SHORTEST = 1e-6;

/* Lists each point's corners, in the order of triangles, by counting. */
static void list_corners(const shd_facets *facets, size_t step, uint32_t *begins,
                         uint32_t *corners) {
    const size_t points = facets->point_count, count = 3 * facets->triangle_count;
    for (size_t k = 0; k < count; k += step) begins[facets->corners[k] + 1]++;
    for (size_t p = 0; p < points; p++) begins[p + 1] += begins[p];
    for (size_t k = 0; k < count; k += step) corners[begins[facets->corners[k]]++] = (uint32_t)k;
    for (size_t p = points; p > 0; p--) begins[p] = begins[p - 1];
    begins[0] = 0;
}

bool shd_mapped_facets_make(const shd_plan *plan, const shd_sight *sight, size_t object,
                            shd_arena *arena, shd_mapped_facets *out) {
    const shd_facets *facets = shd_sight_facets(sight, object);
    const shd_object *of = &plan->scene->objects[object];
    const bool flat = of->interpolation == SHD_FLAT;
    const size_t step = flat ? 3 : 1;
    uint32_t *begins = shd_arena_zalloc(arena, facets->point_count + 1, sizeof *begins);
    uint32_t *corners = shd_arena_alloc(arena, 3 * facets->triangle_count / step, sizeof *corners);
    if (!begins || !corners) return false;
    /* Corners of a sight that was cancelled may be unset. */
    if (!shd_is_cancelled(plan->cancelled)) list_corners(facets, step, begins, corners);
    *out = (shd_mapped_facets){.sight = sight,
                               .facets = facets,
                               .material = &plan->materials[plan->objects[object].material],
                               .object = object,
                               .flat = flat,
                               .chart = shd_chart_of(of),
                               .begins = begins,
                               .corners = corners};
    return true;
}

/* A point's share of one of its triangles. */
typedef struct share {
    shd_charted_point point;
    shd_footprint uv;
    double area; /* 0: it is none, and nothing else is set */
} share;

static share share_of(const shd_mapped_facets *m, shd_vec3 normal, uint32_t corner) {
    share out = {.area = 0};
    const uint32_t triangle = corner / 3, k = corner % 3;
    const double part = m->flat ? 1.0 / 3 : 0.25, along = m->flat ? 12.0 / 72 : 12.0 / 80,
                 across = m->flat ? 12.0 / 24 : 12.0 / 40;
    shd_vec3 at[3];
    shd_sight_corners(m->sight, m->object, triangle, at);
    const shd_vec3 p = shd_sub(at[(k + 1) % 3], at[k]), q = shd_sub(at[(k + 2) % 3], at[k]),
                   s = shd_add(p, q),
                   sides[2] = {shd_scale(s, sqrt(along)), shd_scale(shd_sub(p, q), sqrt(across))};
    const double area = shd_length(shd_cross(p, q));
    if (!(area > 0 && isfinite(area))) return out;
    double weight[3] = {part, part, part};
    weight[k] = 1 - 2 * part;
    out.point = (shd_charted_point){.position = shd_madd(at[k], s, part),
                                    .normal = normal,
                                    .triangle = triangle,
                                    .b = weight[1],
                                    .c = weight[2]};
    out.uv = shd_chart_around(&m->chart, &out.point, sides);
    out.area = area;
    return out;
}

shd_bump shd_mapped_point(const shd_mapped_facets *m, size_t point) {
    shd_bump out = {m->facets->normals[point], 1};
    shd_vec3 sum = {0, 0, 0};
    double areas = 0;
    if (!m->material->normal) return out;
    for (uint32_t i = m->begins[point]; i < m->begins[point + 1]; i++) {
        const share s = share_of(m, out.normal, m->corners[i]);
        if (!(s.area > 0)) continue;
        const shd_bump bump = shd_bump_at(m->material->normal, &m->chart, &s.point, &s.uv);
        sum = shd_madd(sum, bump.normal, s.area * bump.length);
        areas += s.area;
    }
    if (!(areas > 0)) return out;
    out.length = shd_smaller(shd_length(sum) / areas, 1);
    if (out.length > SHORTEST) shd_normalize(sum, &out.normal);
    return out;
}

double shd_mapped_gloss(const shd_mapped_facets *m, size_t point, size_t lobe) {
    const shd_gloss *gloss = m->material->gloss;
    const double own = m->material->lobes[lobe].shininess;
    double sum = 0, areas = 0;
    if (!gloss || !gloss[lobe].texture) return own;
    for (uint32_t i = m->begins[point]; i < m->begins[point + 1]; i++) {
        const share s = share_of(m, m->facets->normals[point], m->corners[i]);
        if (!(s.area > 0)) continue;
        sum += s.area * shd_gloss_of(m->material, lobe, &s.uv);
        areas += s.area;
    }
    if (!(areas > 0)) return own;
    return shd_smaller(shd_larger(sum / areas, gloss[lobe].least), gloss[lobe].most);
}
