/* Visibility: camera rays, analytic shapes, meshes through Embree.
 *
 * Every object is intersected in its own frame, with the ray's origin first moved to where the
 * ray passes closest to the object: spheres 1e6 radii away, coordinates of 1e20 and tiny objects
 * far from the origin keep their precision. Embree finds the triangle in f32; the hit point is
 * then found from that triangle in f64 and taken from barycentrics. Each sample is cast alone, so
 * that a region equals the crop of the whole picture bit for bit. */
#ifndef SHD_SIGHT_SIGHT_H
#define SHD_SIGHT_SIGHT_H

#include "base/arena.h"
#include "plan/plan.h"
#include "sight/gbuffer.h"

/* Embree's device, made when the first mesh comes. Shared by threads. */
typedef struct shd_tracer shd_tracer;

shd_tracer *shd_tracer_new(void); /* NULL: out of memory */
void shd_tracer_drop(shd_tracer *tracer);

/* The objects of a scene, ready to be seen. Constant once made; any thread may cast. */
typedef struct shd_sight shd_sight;

/* Builds acceleration structures. Lives in the arena, but holds Embree's memory: drop it before
 * the arena goes. SHD_MEMORY, or SHD_INTERNAL with Embree's words. */
shd_status shd_sight_new(const shd_plan *plan, shd_tracer *tracer, shd_arena *arena,
                         shd_sight **out, shd_error *error);
void shd_sight_drop(shd_sight *sight); /* NULL is fine */

/* A rectangle of pixels of the whole picture. */
typedef struct shd_tile {
    int x, y, w, h;
} shd_tile;

/* Memory for one thread's object lists (NULL: there is none), and for tiles of up to `count`
 * samples (false: there is none). */
typedef struct shd_cast_scratch shd_cast_scratch;
shd_cast_scratch *shd_cast_scratch_new(const shd_sight *sight, shd_arena *arena);
bool shd_gbuffer_new(size_t count, shd_arena *arena, shd_gbuffer *out);

/* Fills out->count = tile.w * tile.h * samples entries; `out` must have room for them. Returns
 * the number that hit something. */
size_t shd_sight_cast(const shd_sight *sight, shd_tile tile, shd_cast_scratch *scratch,
                      shd_gbuffer *out);

/* Where the sample pattern's ray i of n goes through the pixel, in [0,1)^2 from its top left:
 * the Hammersley set x = (i + 1/2)/n, y = van der Corput in base 2 of i, plus half of its
 * spacing. One sample goes through the centre, four are a rotated grid. */
void shd_sample_offset(int i, int n, double *x, double *y);

/* The points at which a faceted object is lit: a face's centroid with the face's normal (flat),
 * or vertices with their normals (gouraud). World frame, normals turned like the G-buffer's. */
typedef struct shd_facets {
    size_t point_count;
    const shd_vec3 *positions, *normals, *views; /* [point_count] */
    size_t triangle_count;
    const uint32_t *corners; /* [triangle_count][3] into the points; flat: three times the same */
} shd_facets;

/* NULL where the object is shaded at every sample. */
const shd_facets *shd_sight_facets(const shd_sight *sight, size_t object);

#endif
