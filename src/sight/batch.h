/* Rays in batches, component by component, for loops that vectorize. Inside of sight/.
 *
 * A lane's result does not depend on the other lanes, to the bit, so that batches may begin
 * anywhere. Variants of the kernels (base/cpu.h) give the same bits. */
#pragma once

#include "base/bits.h"
#include "base/cpu.h"
#include "base/simd.h"
#include "sight/item.h"

enum { SHD_RAYS = 64 }; /* lanes of a batch; arrays of them are never shorter */

/* Lanes 8 v to 8 v + 7 are sector v. Sectors are told as bits of a word. */
enum { SHD_SECTORS = SHD_RAYS / 8 };

/* A batch's arrays fill whole cache lines: the widest vectors are one. */
#define SHD_ALIGNED      _Alignas(64)
#define SHD_EACH_LANE(i) for (int i = 0; i < SHD_RAYS; i++)

/* A batch in a shape's frame. A ray meets a shape of finite size from where it is closest to the
 * center, so that coordinates are of the shape's own size. */
typedef struct shd_work {
    SHD_ALIGNED double origin[3][SHD_RAYS]; /* moved */
    double direction[3][SHD_RAYS];          /* they need not be unit */
    double near[SHD_RAYS];                  /* only t > near counts */
    double shift[SHD_RAYS];                 /* how far the origin was moved along the ray */
    double t[SHD_RAYS];                     /* from the moved origin; infinity: missed */
    double face[SHD_RAYS];                  /* which of the shape's faces */
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
    double cosine[SHD_RAYS];                     /* between the ray and the camera's axis */
    double scale;                                /* of the plan's frame */
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

/* Where rays meet a mesh. */
typedef struct shd_mesh_hits {
    SHD_ALIGNED double t[SHD_RAYS]; /* infinity: missed, and the rest is not set */
    uint32_t triangle[SHD_RAYS];
    double u[SHD_RAYS], v[SHD_RAYS]; /* the weights of its second and third corner */
} shd_mesh_hits;

/* The rays of `used` shots from `first` on, the last of which the other lanes repeat; and their
 * cosines. */
void SHD_VARIANT(shd_make_rays)(const shd_sight *sight, const shd_shots *shots, size_t first,
                                int used, shd_batch *b);
void SHD_VARIANT(shd_set_cosines)(const shd_sight *sight, shd_batch *b);
/* The functions of a variant. "Find" tells where rays meet a shape other than a mesh: t,
 * and what "place" needs, which tells the surface there. */
void SHD_VARIANT(shd_find_surfaces)(shd_shape shape, double tube, shd_work *work);
void SHD_VARIANT(shd_place_surfaces)(shd_shape shape, double tube, const shd_work *work,
                                     shd_surfaces *out);
void SHD_VARIANT(shd_find_torus)(double tube, shd_work *work);
void SHD_VARIANT(shd_place_torus)(double tube, const shd_work *work, shd_surfaces *out);
/* The nearest triangles at depths up to about `limit`; the surface, where `hits` are the object's.
 */
bool SHD_VARIANT(shd_find_mesh)(const shd_lens *lens, const shd_item *it, const shd_batch *b,
                                double limit, shd_mesh_hits *out);
/* The names (tree.h) of the nearest triangles alone, [SHD_RAYS]; infinity: missed. */
bool SHD_VARIANT(shd_name_triangles)(const shd_lens *lens, const shd_item *it, const shd_batch *b,
                                     double *name);
void SHD_VARIANT(shd_place_mesh)(const shd_item *it, double object, const shd_stage *hits,
                                 shd_surfaces *out);
/* Where rays meet an item that is no mesh: t, and in `work` what its surface is made from. What is
 * met of it, in the batch's surfaces; unless it is `made`, its `work` is made again. */
void SHD_VARIANT(shd_find_shape)(const shd_item *it, const shd_batch *b, shd_work *work, double *t);
void SHD_VARIANT(shd_place_shape)(const shd_item *it, shd_batch *b, shd_work *work, bool made);
/* Fills t and object of `out`, and of meshes triangle, u and v, with the nearest of the targets.
 * Returns which of the batch's works belongs to the object `*holder`. */
int SHD_VARIANT(shd_find_nearest)(const shd_sight *sight, const shd_targets *targets, shd_batch *b,
                                  shd_stage *out, int *holder);
/* The depth from which on nothing is seen any more, nor equal to what is. */
double SHD_VARIANT(shd_end_of)(const shd_batch *b, const shd_stage *hits);
/* t of balls; their surfaces; both, with what tiers in f32 want. */
void SHD_VARIANT(shd_find_ball)(const shd_seen_ball *own, const shd_batch *b, double *t);
void SHD_VARIANT(shd_place_ball)(const shd_seen_ball *own, const shd_batch *b, shd_surfaces *out);
void SHD_VARIANT(shd_show_ball)(const shd_seen_ball *own, const shd_batch *b, double *t,
                                shd_stage *out);
/* In some sectors: what tiers in f32 want but t. */
void SHD_VARIANT(shd_show_ball_in)(const shd_seen_ball *own, const shd_batch *b, unsigned sectors,
                                   shd_stage *out);
/* Appends the hits of a stage, as shd_append_hits does, where these are balls of which tiers in f32
 * want no more than they light: what is seen is made for the lanes that hit, and for no other.
 * False, and nothing is done: they are not all such, or it is faster to show the one ball that is
 * in all lanes. */
bool SHD_VARIANT(shd_append_balls)(const shd_sight *sight, const shd_batch *b,
                                   const shd_stage *stage, size_t hits, size_t first,
                                   shd_hits *out);
/* Appends the hits of a stage, whose first lane is shot `first`. */
void SHD_VARIANT(shd_append_hits)(const shd_stage *stage, size_t hits, size_t first, shd_hits *out);

/* Lane i's vector. */
SHD_INLINE shd_vec3 shd_lane(const double v[3][SHD_RAYS], int i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

SHD_INLINE void shd_set_lane(double v[3][SHD_RAYS], int i, shd_vec3 to) {
    v[0][i] = to.x;
    v[1][i] = to.y;
    v[2][i] = to.z;
}

SHD_INLINE void shd_set_lane32(float v[3][SHD_RAYS], int i, shd_vec3 to) {
    v[0][i] = (float)to.x;
    v[1][i] = (float)to.y;
    v[2][i] = (float)to.z;
}

/* Finds the extremes of pairs. */
SHD_INLINE void shd_halve_extremes(const double *low, const double *high, int pairs,
                                   double *restrict least, double *restrict most) {
    for (int i = 0; i < pairs; i++) {
        least[i] = shd_smaller(low[2 * i], low[2 * i + 1]);
        most[i] = shd_larger(high[2 * i], high[2 * i + 1]);
    }
}

/* Finds the extremes of sectors. */
SHD_INLINE void shd_bound_sectors(const double *restrict at, double *restrict least,
                                  double *restrict most) {
    SHD_ALIGNED double low[2][SHD_RAYS / 2], high[2][SHD_RAYS / 2];
    shd_halve_extremes(at, at, SHD_RAYS / 2, low[0], high[0]);
    shd_halve_extremes(low[0], high[0], SHD_RAYS / 4, low[1], high[1]);
    shd_halve_extremes(low[1], high[1], SHD_SECTORS, least, most);
}

/* Where lane i's ray is at t. */
SHD_INLINE shd_vec3 shd_lane_at(const shd_work *w, int i, double t) {
    return shd_madd(shd_lane(w->origin, i), shd_lane(w->direction, i), t);
}

/* Moves lane i's ray, of which origin, direction and near are set, to where it is closest to the
 * frame's origin. */
SHD_INLINE void shd_approach(shd_work *w, int i) {
    const shd_vec3 o = shd_lane(w->origin, i), d = shd_lane(w->direction, i);
    const double shift = -shd_dot(o, d) / shd_dot(d, d);
    shd_set_lane(w->origin, i, shd_madd(o, d, shift));
    w->near[i] -= shift;
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

/* Returns how many lanes hit an object, and takes them from `left`. */
static inline size_t shd_take_lanes(double *restrict left, double object) {
    long long lanes = 0;
    SHD_EACH_LANE(i) {
        const bool same = left[i] == object;
        lanes += same ? 1 : 0;
        left[i] = same ? SHD_NOTHING : left[i];
    }
    return (size_t)lanes;
}

/* Takes an array's lanes that hit `object`. */
#define SHD_TAKE(to, from, array)                                                                  \
    SHD_EACH_LANE(i)                                                                               \
    (to)->array[i] = (to)->object[i] == object ? (from)->array[i] : (to)->array[i]
