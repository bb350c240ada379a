/* Visibility: camera rays, analytic shapes, meshes.
 *
 * Rays meet every object in its own frame or the camera's, in f64. For shapes, the ray's origin is
 * first moved to where the ray passes closest to the object, so that spheres 1e6 radii away,
 * coordinates of 1e20 and tiny objects far from the origin keep their precision. Hits on a mesh are
 * weighted means of a triangle's corners. Each sample is cast for itself, so that a region equals
 * the crop of the whole picture bit for bit. */
#pragma once

#include <stdatomic.h>

#include "base/arena.h"
#include "base/pattern.h"
#include "plan/nodes.h"
#include "plan/plan.h"
#include "sight/gbuffer.h"

/* The objects of a scene, ready to be seen. Constant once made; any thread may cast. */
typedef struct shd_sight shd_sight;

/* Builds trees over meshes, in the arena. If any thread sets `cancelled` (or NULL), this ends soon,
 * also amid a mesh, and so does casting. SHD_MEMORY, SHD_CANCELLED or SHD_INTERNAL. */
shd_status shd_sight_new(const shd_plan *plan, const atomic_bool *cancelled, shd_arena *arena,
                         shd_sight **out, shd_error *error);

/* Whether any tree was built: of meshes that are not kept, or of shapes in facets. */
bool shd_sight_has_built(const shd_sight *sight);

/* A rectangle of pixels of the whole picture. */
typedef struct shd_tile {
    int x, y, w, h;
} shd_tile;

/* ---- Surveys: what may be seen where, before any ray is cast. ---- */

/* What may be seen through any point of a block of 8 x 8 pixels, or fewer at the rectangle's right
 * and lower edges. */
typedef struct shd_block {
    uint32_t first, count; /* in survey.candidates; count 0: nothing is seen, and no ray is cast */
    uint32_t next;         /* of the rectangle's, from this one on nothing was looked at so far */
} shd_block;

typedef struct shd_survey {
    int across, down;           /* blocks of the rectangle that was surveyed */
    shd_tile rect;              /* that */
    shd_block *blocks;          /* [down][across] */
    struct shd_window *windows; /* [down][across] */
    uint32_t *candidates;       /* indices of objects, nearer ones roughly first; see below */
    size_t candidate_count;     /* of the whole rectangle: the first ones of `candidates` */
    bool even;       /* rays cost the same in any order, because there is only one ball */
    size_t capacity; /* in blocks */
} shd_survey;

/* Lays out memory for one thread's surveys of rectangles of up to w x h pixels, in a scene of so
 * many objects. */
void shd_survey_lay_out(size_t object_count, int w, int h, shd_scratch *memory, shd_survey *out);

/* Surveys a rectangle of pixels of the whole picture, or partly outside of it, in blocks from its
 * upper left corner. An object that is seen through a block is always among its candidates once
 * these are all listed. An object that is not seen may be. Of a block with many candidates only
 * the nearest ones are listed at first, because they may hide the rest. */
void shd_sight_survey(const shd_sight *sight, shd_tile rect, shd_survey *out);

/* Lists further candidates of a block, the nearest of those that are not listed: some, or all. */
void shd_survey_further(const shd_sight *sight, shd_survey *survey, size_t block);

/* ---- Casting. ---- */

/* The sample of a shot through a pixel's center, beside a pattern of so many. */
static inline size_t shd_center_sample(size_t samples) {
    return samples;
}

/* The first of the shots through the nodes of a rule (plan/nodes.h) that are the pixel's own. */
static inline size_t shd_rule_sample(size_t samples, size_t rule) {
    return samples + 1 + (rule == SHD_FRINGE + 1 ? 4 : 0);
}

/* Casts the shots at the candidates and appends the hits to `out`, which must have room for
 * shots->count more. Returns how many there were. Candidates are all objects that the shots may
 * hit, and any others, in any order, which matters only to three surfaces that lie in each other
 * (tie.h). A hit's values depend on the shot alone, and not on its neighbors, further candidates or
 * the instruction set. Once the flag of shd_sight_new is raised, hits are missing or wrong. */
size_t shd_sight_shoot(const shd_sight *sight, const uint32_t *candidates, size_t candidate_count,
                       const shd_shots *shots, shd_hits *out);

/* The same at what is seen through a block, which lists no more candidates than it has to. */
size_t shd_sight_shoot_block(const shd_sight *sight, shd_survey *survey, size_t block,
                             const shd_shots *shots, shd_hits *out);

/* The points at which a faceted object is lit. Flat: each face's centroid with the face's normal.
 * Gouraud: each vertex with its normal, once for each side from which a face is seen that the
 * vertex is part of. In the world's frame, with normals of that side as in the G-buffer. */
typedef struct shd_facets {
    size_t point_count;
    const shd_vec3 *positions, *normals, *views; /* [point_count] */
    size_t triangle_count;
    const uint32_t *corners; /* [triangle_count][3] into the points; flat: three times the same */
    /* [point_count]: the first triangle of each point; NULL: the scene is not traced */
    const uint32_t *triangles;
} shd_facets;

/* NULL: the object is shaded at every sample. */
const shd_facets *shd_sight_facets(const shd_sight *sight, size_t object);

/* The corners of a triangle of a faceted object, in the world's frame. */
void shd_sight_corners(const shd_sight *sight, size_t object, size_t triangle, shd_vec3 out[3]);
