/* The surfaces of meshes where rays meet them. Compiled once an instruction set. */
#include "sight/batch.h"
#include "sight/tree.h"

/* A triangle. */
typedef struct facet {
    uint32_t triangle;
    double plane[4][3];  /* the first corner, from it to the others, and the normal by these */
    double normal[3][3]; /* the corners' normals, of the side that is seen */
} facet;

/* All rays that meet a triangle see the same side of it. The normal is turned to that here if there
 * are others at the corners, and else by cast.simd.c. */
static void set_facet(const shd_item *it, uint32_t triangle, facet *out) {
    const uint32_t *vertex = it->triangles.indices + 3 * (size_t)triangle;
    const double *positions = it->triangles.positions, scale = it->view.tree->scale;
    const shd_vec3 at = shd_vec3_at(positions, vertex[0]),
                   ab = shd_sub(shd_vec3_at(positions, vertex[1]), at),
                   ac = shd_sub(shd_vec3_at(positions, vertex[2]), at),
                   face = shd_cross(shd_scale(ab, scale), shd_scale(ac, scale)),
                   ray = it->view.orthographic ? it->forward : shd_sub(at, it->eye);
    const bool behind = it->smooth && shd_dot(face, ray) > 0 && !it->front_only;
    const double turn = behind ? -1 : 1;
    out->triangle = triangle;
    memcpy(out->plane, (shd_vec3[]){at, ab, ac, shd_scale(face, turn)}, sizeof out->plane);
    for (int n = 0; it->smooth && n < 3; n++) {
        const shd_vec3 normal = shd_scale(shd_vec3_at(it->units, vertex[n]), turn);
        memcpy(out->normal[n], &normal, sizeof normal);
    }
}

/* Places a vector of rays that meet the facet. Points are reckoned from a corner. If all corners of
 * a triangle have one y, so do all of its points, and no light at this y shines on some of them. If
 * the corners' normals cancel, the plane's own stays. */
SHD_INLINE void place_rays(const facet *f, bool smooth, shd_vd u, shd_vd v, shd_vd point[3],
                           shd_vd normal[3]) {
    const shd_vd zero = shd_vd_set(0), first = shd_vd_set(1) - u - v;
    shd_vd sum[3], size = zero;
    for (int c = 0; c < 3; c++) {
        point[c] = shd_vd_set(f->plane[0][c]) + shd_vd_set(f->plane[1][c]) * u +
                   shd_vd_set(f->plane[2][c]) * v;
        normal[c] = shd_vd_set(f->plane[3][c]);
    }
    for (int c = 0; smooth && c < 3; c++) {
        sum[c] = shd_vd_set(f->normal[0][c]) * first + shd_vd_set(f->normal[1][c]) * u +
                 shd_vd_set(f->normal[2][c]) * v;
        size = shd_vd_max(size, shd_vd_max(sum[c], zero - sum[c]));
    }
    const shd_md some = shd_vd_gt(size, zero);
    for (int c = 0; smooth && c < 3; c++) normal[c] = shd_vd_select(some, sum[c], normal[c]);
}

/* Has the corners of all triangles on their way, of which a large mesh has few in caches: first
 * what names them, then these. Neighbors often meet the same one. */
static void fetch_corners(const shd_triangles *t, double object, const shd_stage *hits) {
    uint32_t next[SHD_RAYS], count = 0, last = UINT32_MAX;
    for (int i = 0; i < SHD_RAYS; i++) {
        if (hits->object[i] != object || hits->triangle[i] == last) continue;
        last = next[count++] = hits->triangle[i];
        __builtin_prefetch(t->indices + 3 * (size_t)last);
    }
    for (uint32_t i = 0; count > 1 && i < count; i++)
        for (size_t k = 0; k < 3; k++)
            __builtin_prefetch(t->positions + 3 * (size_t)t->indices[3 * (size_t)next[i] + k]);
}

/* Most rays of a vector meet the same triangle. So each triangle is set for all of them, in turn.
 * Lanes that meet nothing of the object keep what is there. */
void SHD_VARIANT(shd_place_mesh)(const shd_item *it, double object, const shd_stage *hits,
                                 shd_surfaces *out) {
    enum { WIDE = SHD_W / 2, MANY = 2048 };
    facet known[4]; /* rows of a block go back and forth between its triangles */
    for (int k = 0; k < 4; k++) known[k].triangle = UINT32_MAX;
    if (it->triangles.triangle_count > MANY) fetch_corners(&it->triangles, object, hits);
    for (int i = 0; i < SHD_RAYS; i += WIDE) {
        SHD_ALIGNED double name[WIDE];
        unsigned left = 0;
        for (int k = 0; k < WIDE; k++) {
            name[k] = hits->triangle[i + k];
            left |= (unsigned)(hits->object[i + k] == object) << k;
        }
        while (left) {
            const uint32_t triangle = hits->triangle[i + __builtin_ctz(left)];
            facet *f = &known[triangle % 4];
            if (triangle != f->triangle) set_facet(it, triangle, f);
            const shd_vd u = shd_vd_load(hits->u + i), v = shd_vd_load(hits->v + i);
            shd_vd p[3], n[3];
            place_rays(f, it->smooth, u, v, p, n);
            const shd_vd names = shd_vd_load(name), wanted = shd_vd_set((double)triangle);
            const shd_md others = shd_md_or(shd_vd_gt(names, wanted), shd_vd_gt(wanted, names));
            for (int c = 0; c < 3; c++) {
                double *point = out->point[c] + i, *normal = out->normal[c] + i;
                shd_vd_store(point, shd_vd_select(others, shd_vd_load(point), p[c]));
                shd_vd_store(normal, shd_vd_select(others, shd_vd_load(normal), n[c]));
            }
            left &= shd_md_bits(others);
        }
    }
}
