#include "render/tiles/mapped.h"

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
                               .map = plan->materials[plan->objects[object].material].normal,
                               .object = object,
                               .flat = flat,
                               .chart = shd_chart_of(of),
                               .begins = begins,
                               .corners = corners};
    return true;
}

/* Adds what the map is to the point by one of its triangles. */
static void add_share(const shd_mapped_facets *m, shd_vec3 normal, uint32_t corner, shd_vec3 *sum,
                      double *areas) {
    const uint32_t triangle = corner / 3, k = corner % 3;
    const double part = m->flat ? 1.0 / 3 : 0.25, along = m->flat ? 12.0 / 72 : 12.0 / 80,
                 across = m->flat ? 12.0 / 24 : 12.0 / 40;
    shd_vec3 at[3];
    shd_sight_corners(m->sight, m->object, triangle, at);
    const shd_vec3 p = shd_sub(at[(k + 1) % 3], at[k]), q = shd_sub(at[(k + 2) % 3], at[k]),
                   s = shd_add(p, q),
                   sides[2] = {shd_scale(s, sqrt(along)), shd_scale(shd_sub(p, q), sqrt(across))};
    const double area = shd_length(shd_cross(p, q));
    if (!(area > 0 && isfinite(area))) return;
    double weight[3] = {part, part, part};
    weight[k] = 1 - 2 * part;
    const shd_charted_point point = {.position = shd_madd(at[k], s, part),
                                     .normal = normal,
                                     .triangle = triangle,
                                     .b = weight[1],
                                     .c = weight[2]};
    const shd_footprint uv = shd_chart_around(&m->chart, &point, sides);
    const shd_bump bump = shd_bump_at(m->map, &m->chart, &point, &uv);
    *sum = shd_madd(*sum, bump.normal, area * bump.length);
    *areas += area;
}

shd_bump shd_mapped_point(const shd_mapped_facets *m, size_t point) {
    shd_bump out = {m->facets->normals[point], 1};
    shd_vec3 sum = {0, 0, 0};
    double areas = 0;
    for (uint32_t i = m->begins[point]; i < m->begins[point + 1]; i++)
        add_share(m, out.normal, m->corners[i], &sum, &areas);
    if (!(areas > 0)) return out;
    out.length = shd_smaller(shd_length(sum) / areas, 1);
    if (out.length > SHORTEST) shd_normalize(sum, &out.normal);
    return out;
}
