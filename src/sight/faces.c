#include "sight/faces.h"

#include "sight/list_faces.h"
#include "sight/tree.h"

/* The middle of a block's rays on the image plane, and a pixel's steps there, in the mesh's units.
 */
typedef struct middle {
    double p, q, across, up;
} middle;

/* A triangle's corners: the numbers of vertices, and how a ray through the middle passes them. */
typedef struct corners {
    uint32_t vertex[3];
    double x[3], y[3], w[3];
    double most; /* no product of an x and a y that a ray of the block makes is more */
} corners;

static middle middle_of(const shd_sight *sight, const shd_item *it, double x, double y) {
    const shd_lens *lens = &sight->lens;
    const double unit = it->view.orthographic ? 1 / it->view.unit : 1, across = lens->step_x * unit,
                 up = lens->step_y * unit;
    return (middle){(x - lens->middle_x) * across, (lens->middle_y - y) * up, across, up};
}

static corners corners_of(const shd_item *it, uint32_t triangle, const middle *m) {
    const shd_mesh_view *view = &it->view;
    corners out;
    double x = 0, y = 0;
    memcpy(out.vertex, it->triangles.indices + 3 * (size_t)triangle, sizeof out.vertex);
    for (int k = 0; k < 3; k++) {
        const uint32_t vertex = out.vertex[k];
        const shd_seen_vertex v =
            view->vertices ? view->vertices[vertex] : shd_see_vertex(view, vertex);
        const double w = shd_seen_w(view->orthographic, &v);
        out.x[k] = v.x - m->p * w;
        out.y[k] = v.y - m->q * w;
        out.w[k] = w;
        x = shd_larger(x, fabs(v.x) + (fabs(m->p) + SHD_BLOCK_SIDE * m->across) * fabs(w));
        y = shd_larger(y, fabs(v.y) + (fabs(m->q) + SHD_BLOCK_SIDE * m->up) * fabs(w));
    }
    out.most = x * y;
    return out;
}

/* What each corner's weight is, whose sum is 1 in the middle, and grows by to the right and down.
 */
typedef struct weights {
    double at[3], right[3], down[3], sum_right, sum_down;
    double inverse; /* what they are multiplied by, for that */
} weights;

static weights weights_of(const corners *c, const middle *m) {
    weights out = {.sum_right = 0};
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        out.at[k] = c->x[i] * c->y[j] - c->y[i] * c->x[j];
        out.right[k] = m->across * (c->y[i] * c->w[j] - c->w[i] * c->y[j]);
        out.down[k] = m->up * (c->x[i] * c->w[j] - c->w[i] * c->x[j]);
    }
    out.inverse = 1 / (out.at[0] + out.at[1] + out.at[2]);
    for (int k = 0; k < 3; k++) {
        out.at[k] *= out.inverse;
        out.sum_right += out.right[k] *= out.inverse;
        out.sum_down += out.down[k] *= out.inverse;
    }
    return out;
}

static shd_ramp ramp_of(const weights *w, const shd_vec3 corner[3]) {
    shd_ramp out = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < 3; k++) {
        out.at = shd_madd(out.at, corner[k], w->at[k]);
        out.right = shd_madd(out.right, corner[k], w->right[k]);
        out.down = shd_madd(out.down, corner[k], w->down[k]);
    }
    return out;
}

static double longest_of(const shd_vec3 v[3]) {
    double most = 0;
    for (int k = 0; k < 3; k++) most = shd_larger(most, shd_dot(v[k], v[k]));
    return sqrt(most);
}

/* The corners' normals, or the plane's own for all of them, of the side that shots show: as in
 * facet.simd.c and cast.simd.c. */
static void set_normals(const shd_item *it, const corners *c, shd_vec3 ray, shd_vec3 out[3]) {
    const double *positions = it->triangles.positions, scale = it->view.tree->scale;
    const shd_vec3 at = shd_vec3_at(positions, c->vertex[0]),
                   ab = shd_sub(shd_vec3_at(positions, c->vertex[1]), at),
                   ac = shd_sub(shd_vec3_at(positions, c->vertex[2]), at),
                   face = shd_cross(shd_scale(ab, scale), shd_scale(ac, scale));
    if (!it->smooth) {
        shd_vec3 n = shd_linear(&it->normal_map, face);
        n = shd_scale(n, 1 / shd_max_abs(n));
        if (!it->front_only && shd_dot(n, ray) > 0) n = shd_scale(n, -1);
        out[0] = out[1] = out[2] = n;
        return;
    }
    const shd_vec3 seen = it->view.orthographic ? it->forward : shd_sub(at, it->eye);
    const double turn = shd_dot(face, seen) > 0 && !it->front_only ? -1 : 1;
    double most = 0;
    for (int k = 0; k < 3; k++) {
        out[k] = shd_linear(&it->normal_map, shd_vec3_at(it->units, c->vertex[k]));
        most = shd_larger(most, shd_max_abs(out[k]));
    }
    for (int k = 0; k < 3; k++) out[k] = shd_scale(out[k], turn / most);
}

/* The block's point: where the middle ray meets the triangle's plane, in the object's frame. */
static shd_vec3 point_of(const shd_item *it, uint32_t triangle, const middle *m) {
    const corners c = corners_of(it, triangle, m);
    const weights w = weights_of(&c, m);
    shd_vec3 at[3];
    for (int k = 0; k < 3; k++) at[k] = shd_vec3_at(it->triangles.positions, c.vertex[k]);
    return ramp_of(&w, at).at;
}

static void set_face(const shd_item *it, uint32_t triangle, const middle *m, shd_vec3 point,
                     shd_vec3 ray, shd_seen_face *out) {
    static const double ROUNDING = 4e-14; /* as in mesh_bundle_simd.h, of four products */
    const corners c = corners_of(it, triangle, m);
    const weights w = weights_of(&c, m);
    shd_vec3 at[3], normal[3];
    for (int k = 0; k < 3; k++)
        at[k] = shd_linear(&it->to_frame,
                           shd_sub(shd_vec3_at(it->triangles.positions, c.vertex[k]), point));
    set_normals(it, &c, ray, normal);
    out->point = ramp_of(&w, at);
    out->normal = ramp_of(&w, normal);
    if (!it->smooth) out->normal = (shd_ramp){normal[0], {0, 0, 0}, {0, 0, 0}};
    out->right = w.sum_right;
    out->down = w.sum_down;
    out->off_weight = 3 * ROUNDING * c.most * fabs(w.inverse);
    out->off_point = out->off_weight * longest_of(at);
    out->off_normal = it->smooth ? out->off_weight * longest_of(normal) : 0;
}

/* The rays, in the world. */
static void set_ways(const shd_lens *lens, double x, double y, shd_block_faces *out) {
    const shd_camera *camera = lens->camera;
    out->way = shd_scale(camera->back, -1);
    out->way_right = out->way_down = (shd_vec3){0, 0, 0};
    if (camera->projection == SHD_ORTHOGRAPHIC) return;
    out->way = shd_madd(out->way, camera->right, (x - lens->middle_x) * lens->step_x);
    out->way = shd_madd(out->way, camera->up, (lens->middle_y - y) * lens->step_y);
    const double inverse = 1 / shd_length(out->way);
    out->way = shd_scale(out->way, inverse);
    out->way_right = shd_scale(camera->right, lens->step_x * inverse);
    out->way_down = shd_scale(camera->up, -lens->step_y * inverse);
}

bool shd_sight_faces(const shd_sight *sight, const shd_survey *survey, size_t block, int sample,
                     shd_block_faces *out) {
    static shd_list_faces_function *const variants[SHD_ISA_COUNT] = SHD_VARIANTS(shd_list_faces);
    const shd_block *at = &survey->blocks[block];
    if (at->count != 1 || at->next < survey->candidate_count) return false;
    out->object = survey->candidates[at->first];
    const shd_item *it = sight->items[out->object]; /* NULL: a ball */
    if (!it || it->shape != SHD_MESH) return false;
    const double x = survey->rect.x + (double)(block % (size_t)survey->across) * SHD_BLOCK_SIDE +
                     sight->offset_x[sample],
                 y = survey->rect.y + (double)(block / (size_t)survey->across) * SHD_BLOCK_SIDE +
                     sight->offset_y[sample];
    uint32_t list[SHD_FACES_MOST];
    if (!variants[sight->plan->isa](sight, it, x, y, list, out)) return false;
    if (!out->count) return true;
    const middle m = middle_of(sight, it, x + SHD_FACE_REACH, y + SHD_FACE_REACH);
    const shd_vec3 point = point_of(it, list[0], &m);
    if (!shd_is_finite(point)) return false;
    set_ways(&sight->lens, x + SHD_FACE_REACH, y + SHD_FACE_REACH, out);
    out->point = shd_transform(&it->to_world, point);
    for (int k = 0; k < out->count; k++) set_face(it, list[k], &m, point, out->way, &out->list[k]);
    return true;
}
