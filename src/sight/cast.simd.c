/* Rays through a tile: made, carried into each object's frame, met, and the nearest hits carried
 * back into the world, a batch at a time. Compiled once an instruction set. */
#include <float.h>

#include "sight/batch.h"
#include "sight/shapes.h"

#define LANES(i) for (int i = 0; i < SHD_RAYS; i++)

/* Where a batch stands: its rays in the world, and the nearest hits so far in the frames of the
 * objects that were hit. */
typedef struct batch {
    double x[SHD_RAYS], y[SHD_RAYS]; /* in pixels */
    shd_rays rays;
    shd_surfaces best;
    double object[SHD_RAYS]; /* whole numbers: selects of doubles by doubles vectorize best */
} batch;

/* As shd_lens_ray. The image plane's vectors are unit and at right angles, so that nothing can
 * overflow. */
static void make_rays(const shd_lens *lens, batch *restrict b) {
    const shd_camera *camera = lens->camera;
    const double width = lens->width, height = lens->height;
    const double half_x = lens->half_x, half_y = lens->half_y;
    const shd_vec3 right = camera->right, up = camera->up, back = camera->back,
                   from = camera->position;
    if (camera->projection == SHD_PERSPECTIVE) {
        LANES(i) {
            double p = (2 * b->x[i] / width - 1) * half_x, q = (1 - 2 * b->y[i] / height) * half_y;
            double x = right.x * p + up.x * q - back.x, y = right.y * p + up.y * q - back.y,
                   z = right.z * p + up.z * q - back.z;
            double scale = 1 / sqrt(x * x + y * y + z * z);
            b->rays.direction[0][i] = x * scale;
            b->rays.direction[1][i] = y * scale;
            b->rays.direction[2][i] = z * scale;
            b->rays.origin[0][i] = from.x;
            b->rays.origin[1][i] = from.y;
            b->rays.origin[2][i] = from.z;
        }
        return;
    }
    LANES(i) {
        double p = (2 * b->x[i] / width - 1) * half_x, q = (1 - 2 * b->y[i] / height) * half_y;
        b->rays.origin[0][i] = from.x + (right.x * p + up.x * q);
        b->rays.origin[1][i] = from.y + (right.y * p + up.y * q);
        b->rays.origin[2][i] = from.z + (right.z * p + up.z * q);
        b->rays.direction[0][i] = -back.x;
        b->rays.direction[1][i] = -back.y;
        b->rays.direction[2][i] = -back.z;
    }
}

static void carry(const shd_item *it, const shd_rays *restrict from, shd_rays *restrict to) {
    const shd_vec3 at = it->to_world.origin;
    for (int r = 0; r < 3; r++) {
        const double mx = it->from_world.linear[r][0], my = it->from_world.linear[r][1],
                     mz = it->from_world.linear[r][2];
        double *restrict origin = to->origin[r], *restrict direction = to->direction[r];
        LANES(i) {
            origin[i] = mx * (from->origin[0][i] - at.x) + my * (from->origin[1][i] - at.y) +
                        mz * (from->origin[2][i] - at.z);
            direction[i] = mx * from->direction[0][i] + my * from->direction[1][i] +
                           mz * from->direction[2][i];
        }
    }
    LANES(i) to->near[i] = 0;
}

/* Tori and meshes: a ray at a time. A mesh's triangle and barycentrics go to the G-buffer; its
 * point is found when it is known to be the nearest. */
static void meet_alone(const shd_item *it, double object, const shd_rays *rays, size_t first,
                       int used, batch *b, shd_gbuffer *out) {
    for (int i = 0; i < used; i++) {
        shd_ray ray = {{rays->origin[0][i], rays->origin[1][i], rays->origin[2][i]},
                       {rays->direction[0][i], rays->direction[1][i], rays->direction[2][i]},
                       rays->near[i]};
        if (it->shape == SHD_MESH) {
            double t, u, v;
            uint32_t triangle;
            if (!shd_mesh_tree_intersect(it->tree, &ray, &t, &triangle, &u, &v) ||
                !(t < b->best.t[i]))
                continue;
            b->best.t[i] = t;
            b->object[i] = object;
            out->triangle[first + (size_t)i] = triangle;
            out->u[first + (size_t)i] = u;
            out->v[first + (size_t)i] = v;
            continue;
        }
        shd_surface s;
        if (!shd_intersect(it->shape, it->tube, &ray, &s) || !(s.t < b->best.t[i])) continue;
        b->best.t[i] = s.t;
        b->object[i] = object;
        b->best.point[0][i] = s.point.x, b->best.normal[0][i] = s.normal.x;
        b->best.point[1][i] = s.point.y, b->best.normal[1][i] = s.normal.y;
        b->best.point[2][i] = s.point.z, b->best.normal[2][i] = s.normal.z;
    }
}

/* At equal distance the object that comes first in the scene stays. */
static void keep_nearer(const shd_surfaces *restrict met, double object, batch *restrict b) {
    for (int c = 0; c < 3; c++) {
        LANES(i) {
            bool nearer = met->t[i] < b->best.t[i];
            b->best.point[c][i] = nearer ? met->point[c][i] : b->best.point[c][i];
            b->best.normal[c][i] = nearer ? met->normal[c][i] : b->best.normal[c][i];
        }
    }
    LANES(i) {
        b->object[i] = met->t[i] < b->best.t[i] ? object : b->object[i];
        b->best.t[i] = met->t[i] < b->best.t[i] ? met->t[i] : b->best.t[i];
    }
}

/* Writes the lanes that hit this object: points and normals in the world, the normal turned to
 * the viewer where the material is two-sided. */
static void write_hits(const shd_item *it, double object, const batch *restrict b,
                       double *const position[3], double *const normal[3]) {
    const shd_affine m = it->to_world, k = it->normal_map;
    const double turned = it->front_only ? 1 : -1;
    double *restrict px = position[0], *restrict py = position[1], *restrict pz = position[2];
    LANES(i) {
        double x = b->best.point[0][i], y = b->best.point[1][i], z = b->best.point[2][i];
        bool mine = b->object[i] == object;
        double wx = m.linear[0][0] * x + m.linear[0][1] * y + m.linear[0][2] * z + m.origin.x;
        double wy = m.linear[1][0] * x + m.linear[1][1] * y + m.linear[1][2] * z + m.origin.y;
        double wz = m.linear[2][0] * x + m.linear[2][1] * y + m.linear[2][2] * z + m.origin.z;
        px[i] = mine ? wx : px[i];
        py[i] = mine ? wy : py[i];
        pz[i] = mine ? wz : pz[i];
    }
    double *restrict nx = normal[0], *restrict ny = normal[1], *restrict nz = normal[2];
    LANES(i) {
        double x = b->best.normal[0][i], y = b->best.normal[1][i], z = b->best.normal[2][i];
        double vx = -b->rays.direction[0][i], vy = -b->rays.direction[1][i],
               vz = -b->rays.direction[2][i];
        double wx = k.linear[0][0] * x + k.linear[0][1] * y + k.linear[0][2] * z;
        double wy = k.linear[1][0] * x + k.linear[1][1] * y + k.linear[1][2] * z;
        double wz = k.linear[2][0] * x + k.linear[2][1] * y + k.linear[2][2] * z;
        /* Scaled by the largest component first: thin objects have tiny normals. */
        double ax = fabs(wx), ay = fabs(wy), az = fabs(wz);
        double most = ax > ay ? ax : ay;
        most = most > az ? most : az;
        wx /= most;
        wy /= most;
        wz /= most;
        double square = wx * wx + wy * wy + wz * wz, scale = 1 / sqrt(square);
        /* A sliver without a normal (0/0) is shaded somehow: as if it faced the viewer. */
        wx = square > 0 ? wx * scale : vx;
        wy = square > 0 ? wy * scale : vy;
        wz = square > 0 ? wz * scale : vz;
        double sign = wx * vx + wy * vy + wz * vz < 0 ? turned : 1;
        bool mine = b->object[i] == object;
        nx[i] = mine ? wx * sign : nx[i];
        ny[i] = mine ? wy * sign : ny[i];
        nz[i] = mine ? wz * sign : nz[i];
    }
}

/* Every object that some lane hit, in turn. Returns the hits among the lanes that are used. */
static size_t write_batch(const shd_sight *sight, batch *b, size_t first, int used,
                          shd_gbuffer *out) {
    const shd_vec3 forward = shd_scale(sight->lens.camera->back, -1);
    double *position[3], *normal[3];
    for (int c = 0; c < 3; c++) {
        position[c] = out->position[c] + first;
        normal[c] = out->normal[c] + first;
        double *restrict view = out->view[c] + first;
        LANES(i) view[i] = -b->rays.direction[c][i];
    }
    double *restrict depth = out->depth + first;
    int32_t *restrict object = out->object + first;
    LANES(i) {
        depth[i] = b->best.t[i] *
                   (b->rays.direction[0][i] * forward.x + b->rays.direction[1][i] * forward.y +
                    b->rays.direction[2][i] * forward.z);
        object[i] = (int32_t)b->object[i];
    }
    size_t hits = 0;
    bool written[SHD_RAYS] = {false};
    for (int i = 0; i < used; i++) {
        if (object[i] == SHD_NOTHING) continue;
        hits++;
        if (written[i]) continue;
        const shd_item *it = &sight->items[object[i]];
        for (int k = i; k < used; k++) {
            if (object[k] != object[i]) continue;
            written[k] = true;
            if (it->shape != SHD_MESH) continue;
            shd_vec3 p, n;
            size_t at = first + (size_t)k;
            shd_item_place(it, out->triangle[at], out->u[at], out->v[at], &p, &n);
            b->best.point[0][k] = p.x, b->best.normal[0][k] = n.x;
            b->best.point[1][k] = p.y, b->best.normal[1][k] = n.y;
            b->best.point[2][k] = p.z, b->best.normal[2][k] = n.z;
        }
        write_hits(it, b->object[i], b, position, normal);
    }
    return hits;
}

static size_t cast(const shd_sight *sight, shd_tile tile, const size_t *candidates,
                   size_t candidate_count, shd_gbuffer *out) {
    const int samples = sight->plan->scene->raster.samples;
    const size_t count = (size_t)tile.w * (size_t)tile.h * (size_t)samples;
    batch b;
    shd_rays local;
    shd_surfaces met;
    size_t hits = 0;
    int x = tile.x, y = tile.y, s = 0;
    for (size_t first = 0; first < count; first += SHD_RAYS) {
        /* Beyond the tile's end lanes go on into the rows below, unused. */
        const int used = count - first < SHD_RAYS ? (int)(count - first) : SHD_RAYS;
        for (int i = 0; i < SHD_RAYS; i++) {
            b.x[i] = x + sight->offset_x[s];
            b.y[i] = y + sight->offset_y[s];
            if (++s < samples) continue;
            s = 0;
            if (++x < tile.x + tile.w) continue;
            x = tile.x;
            y++;
        }
        make_rays(&sight->lens, &b);
        for (int c = 0; c < 3; c++) LANES(i) b.best.point[c][i] = b.best.normal[c][i] = 0;
        LANES(i) {
            b.best.t[i] = INFINITY;
            b.object[i] = SHD_NOTHING;
        }
        for (size_t k = 0; k < candidate_count; k++) {
            const shd_item *it = &sight->items[candidates[k]];
            const double object = (double)candidates[k];
            carry(it, &b.rays, &local);
            if (it->shape == SHD_MESH || it->shape == SHD_TORUS)
                meet_alone(it, object, &local, first, used, &b, out);
            else if (SHD_VARIANT(shd_intersect_rays)(it->shape, &local, b.best.t, &met))
                keep_nearer(&met, object, &b);
        }
        hits += write_batch(sight, &b, first, used, out);
    }
    return hits;
}

const shd_cast_kernel SHD_VARIANT(shd_cast_kernel) = {SHD_VARIANT(shd_intersect_rays), cast};
