/* Rays in batches, component by component, for loops that vectorize. Inside of sight/.
 *
 * A lane's result does not depend on the other lanes, to the bit, so that batches may begin
 * anywhere. Variants of the kernels (base/cpu.h) give the same bits. */
#pragma once

#include <string.h>

#include "base/bits.h"
#include "base/cpu.h"
#include "sight/item.h"

enum { SHD_RAYS = 64 }; /* lanes of a batch; arrays of them are never shorter */

/* A batch's arrays fill whole cache lines: the widest vectors are one. */
#define SHD_ALIGNED _Alignas(64)

/* A batch in a shape's frame. A ray meets a shape of finite size from where it is closest to the
 * center, so that coordinates are of the shape's own size. */
typedef struct shd_work {
    SHD_ALIGNED double ox[SHD_RAYS], oy[SHD_RAYS], oz[SHD_RAYS]; /* the moved origin */
    double dx[SHD_RAYS], dy[SHD_RAYS], dz[SHD_RAYS];             /* they need not be unit */
    double near[SHD_RAYS];                                       /* only t > near counts */
    double shift[SHD_RAYS]; /* how far the origin was moved along the ray */
    double t[SHD_RAYS];     /* from the moved origin; infinity: missed */
    double face[SHD_RAYS];  /* which of the shape's faces */
} shd_work;

/* Points and outward unit normals in a shape's frame. */
typedef struct shd_surfaces {
    SHD_ALIGNED double point[3][SHD_RAYS], normal[3][SHD_RAYS];
} shd_surfaces;

/* Rays start at the camera's position, plus `start` in an orthographic camera. */
typedef struct shd_batch {
    SHD_ALIGNED double x[SHD_RAYS], y[SHD_RAYS]; /* in pixels */
    double direction[3][SHD_RAYS];               /* unit */
    double start[3][SHD_RAYS];                   /* set in an orthographic camera */
    bool orthographic;
    shd_work work[2];
    shd_surfaces surfaces;
} shd_batch;

/* A batch of hits, with the lanes that hit nothing. */
typedef struct shd_stage {
    SHD_ALIGNED double t[SHD_RAYS]; /* infinity: nothing */
    double object[SHD_RAYS]; /* a whole number: selects of doubles by doubles vectorize best */
    float position32[3][SHD_RAYS], low32[3][SHD_RAYS], normal32[3][SHD_RAYS], mirror32[3][SHD_RAYS],
        world32[3][SHD_RAYS];
    double position[3][SHD_RAYS], normal[3][SHD_RAYS], view[3][SHD_RAYS], depth[SHD_RAYS];
    uint32_t triangle[SHD_RAYS];
    double u[SHD_RAYS], v[SHD_RAYS];
} shd_stage;

/* What is wanted of a stage. */
typedef struct shd_wants {
    bool fast;  /* position32, normal32, mirror32; else position, normal, view */
    bool low;   /* low32 */
    bool world; /* world32 */
    bool depth;
} shd_wants;

/* Whether it is a ball of which a tier in f32 wants no more than it lights. */
static inline bool shd_is_quick(const shd_item *it, shd_wants wants) {
    return it->ball && wants.fast && !wants.low && !wants.world;
}

typedef struct shd_cast_kernel {
    /* Casts shots [first, first + SHD_RAYS) or as many as there are. Returns the hits. */
    size_t (*cast)(const shd_sight *sight, const uint32_t *candidates, size_t candidate_count,
                   const shd_shots *shots, size_t first, shd_wants wants, shd_stage *out);
    /* Appends the hits of a stage, whose first lane is shot `first`. */
    void (*append)(const shd_stage *stage, size_t hits, size_t first, shd_hits *out);
} shd_cast_kernel;

/* Where rays meet a mesh. */
typedef struct shd_mesh_hits {
    SHD_ALIGNED double t[SHD_RAYS]; /* infinity: missed, and the rest is not set */
    uint32_t triangle[SHD_RAYS];
    double u[SHD_RAYS], v[SHD_RAYS]; /* the weights of its second and third corner */
} shd_mesh_hits;

extern const shd_cast_kernel shd_cast_kernel_portable, shd_cast_kernel_avx2, shd_cast_kernel_avx512;

/* The functions of a kernel. "Find" tells where rays meet a shape other than a mesh: t, and what
 * "place" needs, which tells the surface there. */
#define SHD_CAST_KERNEL_PARTS(isa)                                                                 \
    void shd_find_surfaces_##isa(shd_shape shape, double tube, shd_work *work);                    \
    void shd_place_surfaces_##isa(shd_shape shape, double tube, const shd_work *work,              \
                                  shd_surfaces *out);                                              \
    void shd_find_torus_##isa(double tube, shd_work *work);                                        \
    void shd_place_torus_##isa(double tube, const shd_work *work, shd_surfaces *out);              \
    /* The nearest triangles at t up to about `limit`; the surface, where `hits` are the object's. \
     */                                                                                            \
    bool shd_find_mesh_##isa(const shd_lens *lens, const shd_item *it, const shd_batch *b,         \
                             double limit, shd_mesh_hits *out);                                    \
    void shd_place_mesh_##isa(const shd_item *it, double object, const shd_stage *hits,            \
                              shd_surfaces *out);                                                  \
    /* t of balls; their surfaces; both, with what tiers in f32 want. Then as shd_cast_kernel. */  \
    void shd_find_ball_##isa(const shd_item *it, const shd_batch *b, double *t);                   \
    void shd_place_ball_##isa(const shd_item *it, const shd_batch *b, shd_surfaces *out);          \
    void shd_show_ball_##isa(const shd_item *it, const shd_batch *b, double *t, shd_stage *out);   \
    void shd_append_hits_##isa(const shd_stage *stage, size_t hits, size_t first, shd_hits *out);
SHD_CAST_KERNEL_PARTS(portable)
SHD_CAST_KERNEL_PARTS(avx2)
SHD_CAST_KERNEL_PARTS(avx512)

/* Moves lane i's ray, of which origin, direction and near are set, to where it is closest to the
 * frame's origin. */
static inline void shd_approach(shd_work *w, int i) {
    double ox = w->ox[i], oy = w->oy[i], oz = w->oz[i];
    double dx = w->dx[i], dy = w->dy[i], dz = w->dz[i];
    double shift = -(ox * dx + oy * dy + oz * dz) / (dx * dx + dy * dy + dz * dz);
    w->ox[i] = ox + dx * shift;
    w->oy[i] = oy + dy * shift;
    w->oz[i] = oz + dz * shift;
    w->near[i] = w->near[i] - shift;
    w->shift[i] = shift;
}

/* 1 / sqrt(x) for x > 0, not denormal, to 2 ulp (tests/unit/sight_shapes.c); for 0 it is finite.
 * An integer's guess, good to 3.4 % (C. Lomont, "Fast inverse square root", 2003), and Newton's
 * steps: the same bits from any instruction set, and faster than its own square root and division
 * where vectors are wide. */
static inline double shd_inverse_root(double x) {
    double y = shd_double_of(0x5fe6eb50c7b537a9u - (shd_bits64_of(x) >> 1)), half = 0.5 * x;
    for (int step = 0; step < 3; step++) y = y * (1.5 - half * y * y);
    return y + y * (0.5 - half * y * y);
}
