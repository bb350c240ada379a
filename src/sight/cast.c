/* Casting: what may be seen through a tile, and the kernels that look. */
#include "base/cpu.h"
#include "sight/batch.h"

struct shd_cast_scratch {
    size_t *candidates;
};

shd_cast_scratch *shd_cast_scratch_new(const shd_sight *sight, shd_arena *arena) {
    shd_cast_scratch *scratch = shd_arena_alloc(arena, 1, sizeof *scratch);
    if (!scratch) return NULL;
    scratch->candidates = shd_arena_alloc(arena, sight->count, sizeof *scratch->candidates);
    return scratch->candidates ? scratch : NULL;
}

bool shd_gbuffer_new(size_t samples, shd_arena *arena, shd_gbuffer *out) {
    /* Batches are written whole, the last one's unused lanes too. */
    const size_t count = (samples + SHD_RAYS - 1) / SHD_RAYS * SHD_RAYS;
    double *values = shd_arena_alloc(arena, 12 * count, sizeof *values);
    int32_t *object = shd_arena_alloc(arena, count, sizeof *object);
    uint32_t *triangle = shd_arena_alloc(arena, count, sizeof *triangle);
    if (!values || !object || !triangle) return false;
    *out = (shd_gbuffer){.depth = values + 9 * count,
                         .u = values + 10 * count,
                         .v = values + 11 * count,
                         .object = object,
                         .triangle = triangle};
    for (int c = 0; c < 3; c++) {
        out->position[c] = values + (size_t)c * count;
        out->normal[c] = values + (size_t)(3 + c) * count;
        out->view[c] = values + (size_t)(6 + c) * count;
    }
    return true;
}

/* ---- Casting. ---- */

/* Whether a sphere may be seen through a tile: against the cone (perspective) or cylinder
 * (orthographic) around the tile's rays, a little widened so that rounding drops nothing. */
static bool may_see(const shd_item *it, const shd_lens *lens, shd_vec3 origin, shd_vec3 axis,
                    double spread) {
    if (!it->bounded) return true;
    shd_vec3 to = shd_sub(it->center, origin);
    double radius = it->radius * (1 + 1e-9);
    double distance = shd_length(to);
    if (!isfinite(distance) || distance <= radius) return true;
    if (lens->camera->projection == SHD_ORTHOGRAPHIC)
        return shd_length(shd_cross(to, axis)) <= (spread + radius) * (1 + 1e-9);
    shd_vec3 side = shd_cross(shd_scale(to, 1 / distance), axis);
    double angle = atan2(shd_length(side), shd_dot(to, axis) / distance);
    return angle <= spread + asin(radius / distance) + 1e-9;
}

static size_t find_candidates(const shd_sight *sight, shd_tile tile, size_t *candidates) {
    const shd_lens *lens = &sight->lens;
    shd_vec3 origin, axis;
    shd_lens_ray(lens, tile.x + tile.w / 2.0, tile.y + tile.h / 2.0, &origin, &axis);
    double spread = 0;
    for (int corner = 0; corner < 4; corner++) {
        shd_vec3 from, toward;
        shd_lens_ray(lens, tile.x + (corner & 1 ? tile.w : 0), tile.y + (corner & 2 ? tile.h : 0),
                     &from, &toward);
        double reach = lens->camera->projection == SHD_ORTHOGRAPHIC
                           ? shd_length(shd_sub(from, origin))
                           : atan2(shd_length(shd_cross(axis, toward)), shd_dot(axis, toward));
        spread = fmax(spread, reach);
    }
    size_t count = 0;
    for (size_t i = 0; i < sight->count; i++)
        if (may_see(&sight->items[i], lens, origin, axis, spread)) candidates[count++] = i;
    return count;
}

void shd_item_place(const shd_item *it, uint32_t triangle, double u, double v, shd_vec3 *point,
                    shd_vec3 *normal) {
    const shd_triangles *tri = &it->triangles;
    const double weight[3] = {1 - u - v, u, v};
    *point = *normal = (shd_vec3){0, 0, 0};
    for (int k = 0; k < 3; k++)
        *point = shd_madd(*point, shd_triangle_corner(tri, triangle, k), weight[k]);
    if (it->smooth) {
        for (int k = 0; k < 3; k++) {
            const double *n = tri->normals + 3 * (size_t)tri->indices[3 * triangle + (size_t)k];
            shd_vec3 unit = {n[0], n[1], n[2]};
            shd_normalize(unit, &unit);
            *normal = shd_madd(*normal, unit, weight[k]);
        }
    }
    if (!(shd_max_abs(*normal) > 0)) *normal = shd_triangle_normal(tri, triangle);
}

size_t shd_sight_cast(const shd_sight *sight, shd_tile tile, shd_cast_scratch *scratch,
                      shd_gbuffer *out) {
    static const shd_cast_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_cast_kernel);
    const int samples = sight->plan->scene->raster.samples;
    out->count = (size_t)tile.w * (size_t)tile.h * (size_t)samples;
    size_t count = find_candidates(sight, tile, scratch->candidates);
    if (count) return kernels[sight->plan->isa]->cast(sight, tile, scratch->candidates, count, out);
    for (size_t i = 0; i < out->count; i++) out->object[i] = SHD_NOTHING;
    return 0;
}
