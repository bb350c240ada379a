#include "plan/cells.h"

#include <string.h>

#include "plan/parts.h"

/* All that cells depend on, beside the mesh. */
typedef struct view {
    shd_affine to_world, normal_map;
    shd_vec3 eye, back;
    int projection, side, own;
} view;

/* Instead of a projection: the mesh's own frame, from no place. */
enum { NOWHERE = -1 };

static shd_vec3 normal_of(const shd_vec3 at[3]) {
    return shd_cross(shd_sub(at[1], at[0]), shd_sub(at[2], at[0]));
}

/* Finds the normals at a triangle's corners, in the world's frame. Returns how many: 0, 1 or 3. */
static int normals_of(const view *v, const shd_mesh *mesh, const uint32_t *corner,
                      const shd_vec3 at[3], shd_vec3 out[3]) {
    const int count = v->own ? 1 : 3;
    for (int c = 0; c < count; c++) {
        const shd_vec3 n = v->own ? normal_of(at) : shd_vec3_at(mesh->normals, corner[c]);
        if (!shd_plan_normalize(shd_linear(&v->normal_map, n), &out[c])) return 0;
    }
    return count;
}

/* Notes the sides of a triangle's plane that the viewer may be on. */
static void add_sides(const view *v, const shd_vec3 at[3], bool sides[2]) {
    const shd_vec3 p = shd_transform(&v->to_world, at[0]),
                   n = shd_linear(&v->normal_map, normal_of(at));
    const shd_vec3 toward = v->projection == SHD_ORTHOGRAPHIC ? v->back : shd_sub(v->eye, p);
    const double facing = shd_dot(n, toward),
                 margin = SHD_PIECE_MARGIN * shd_plan_length(n) * shd_plan_length(toward);
    sides[0] = sides[0] || !(facing < -margin);
    sides[1] = sides[1] || !(facing > margin);
}

/* The cell of the grid that a triangle's middle lies in, along one axis. */
static int cell_step(double sum, double low, double high, int side) {
    const double at = (sum / 3 - low) / (high - low) * side;
    if (!(at > 0)) return 0; /* also if the box is flat, or too large for the sum */
    return at < side ? (int)at : side - 1;
}

static void find_cells(const view *v, const shd_mesh *mesh, const atomic_bool *cancelled,
                       shd_cell cells[SHD_CELLS]) {
    const int side = v->side;
    const shd_vec3 low = mesh->low, high = mesh->high;
    for (int i = 0; i < side * side * side; i++)
        cells[i] = (shd_cell){.low = {INFINITY, INFINITY, INFINITY},
                              .high = {-INFINITY, -INFINITY, -INFINITY},
                              .cosine = 1};
    for (int pass = 0; pass < 2; pass++) {
        for (size_t t = 0; t < mesh->triangle_count; t++) {
            if (shd_is_cancelled_at(cancelled, t)) return;
            const uint32_t *corner = mesh->indices + 3 * t;
            shd_vec3 p[3], sum = {0, 0, 0}, n[3];
            for (int c = 0; c < 3; c++) {
                p[c] = shd_vec3_at(mesh->positions, corner[c]);
                sum = shd_add(sum, p[c]);
            }
            shd_cell *to = &cells[(cell_step(sum.z, low.z, high.z, side) * side +
                                   cell_step(sum.y, low.y, high.y, side)) *
                                      side +
                                  cell_step(sum.x, low.x, high.x, side)];
            const int count = normals_of(v, mesh, corner, p, n);
            for (int c = 0; pass == 0 && c < 3; c++) {
                to->low = shd_vec3_min(to->low, p[c]);
                to->high = shd_vec3_max(to->high, p[c]);
            }
            if (pass == 0 && !v->own && v->projection != NOWHERE) add_sides(v, p, to->sides);
            for (int c = 0; c < count; c++) {
                if (pass == 0)
                    to->normals = shd_add(to->normals, n[c]);
                else
                    to->cosine = shd_smaller(to->cosine, shd_dot(to->normals, n[c]));
            }
            if (!count) to->cosine = -1;
            to->any = true;
            if (v->projection == NOWHERE) to->sides[0] = to->sides[1] = true;
        }
        for (int i = 0; pass == 0 && i < side * side * side; i++)
            if (cells[i].any && !shd_plan_normalize(cells[i].normals, &cells[i].normals))
                cells[i].cosine = -1;
    }
}

/* ---- Kept meshes ---- */

enum {
    VIEWS = 4,            /* a scene may have several objects of one mesh */
    TRIANGLES_LEAST = 512 /* smaller meshes are looked at in less than what else a request takes */
};

struct shd_mesh_memo {
    atomic_bool taken; /* somebody uses it, and others do without, so that nobody waits */
    unsigned next;     /* the view that is replaced next */
    struct {
        view view; /* side 0: there is none */
        shd_cell cells[SHD_CELLS];
    } seen[VIEWS];
};

size_t shd_mesh_memo_size(const shd_mesh *mesh) {
    return mesh->triangle_count < TRIANGLES_LEAST ? 0 : sizeof(struct shd_mesh_memo);
}

static bool recall_cells(struct shd_mesh_memo *memo, const view *v, shd_cell out[SHD_CELLS]) {
    if (!memo || atomic_exchange(&memo->taken, true)) return false;
    bool found = false;
    for (int i = 0; i < VIEWS && !found; i++) {
        found = !memcmp(&memo->seen[i].view, v, sizeof *v);
        if (found) memcpy(out, memo->seen[i].cells, sizeof memo->seen[i].cells);
    }
    memo->taken = false;
    return found;
}

static void note_cells(struct shd_mesh_memo *memo, const view *v, const shd_cell in[SHD_CELLS]) {
    if (!memo || atomic_exchange(&memo->taken, true)) return;
    const unsigned i = memo->next++ % VIEWS;
    memcpy(&memo->seen[i].view, v, sizeof *v);
    memcpy(memo->seen[i].cells, in, sizeof memo->seen[i].cells);
    memo->taken = false;
}

/* ---- Meshes that are there many times ---- */

/* So many triangles of all objects together, some of them again and again, are not looked at. */
enum { CROWD = 1 << 20 };

/* From the mesh's frame to the world's. Angles between normals are the same there if the map turns,
 * mirrors and scales all alike, to less than what add_mesh takes off. */
static void turn_cells(const shd_affine *to_world, const shd_affine *normal_map, int side,
                       shd_cell cells[SHD_CELLS]) {
    double length[3];
    const bool similar = shd_is_similar(to_world, length);
    for (int i = 0; i < side * side * side; i++) {
        shd_cell *c = &cells[i];
        if (!similar || !(c->cosine > -1) ||
            !shd_plan_normalize(shd_linear(normal_map, c->normals), &c->normals))
            c->cosine = -1;
    }
}

void shd_plan_cells(const shd_scene *scene, const shd_object *object, const shd_affine *to_world,
                    const shd_affine *normal_map, int side, const atomic_bool *cancelled,
                    shd_cell out[SHD_CELLS]) {
    const shd_mesh *mesh = object->mesh;
    struct shd_mesh_memo *memo = mesh->kept ? mesh->kept->memo : NULL;
    view v;
    const bool crowded = memo && scene->mesh_triangles > CROWD;
    memset(&v, 0, sizeof v); /* its padding is compared, too */
    v.side = side;
    v.own = !mesh->normals || object->interpolation == SHD_FLAT;
    if (crowded) {
        v.to_world = v.normal_map = (shd_affine){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
        v.projection = NOWHERE;
    } else {
        v.to_world = *to_world;
        v.normal_map = *normal_map;
        v.eye = scene->camera.position;
        v.back = scene->camera.back;
        v.projection = scene->camera.projection;
    }
    if (!recall_cells(memo, &v, out)) {
        find_cells(&v, mesh, cancelled, out);
        if (!shd_is_cancelled(cancelled)) note_cells(memo, &v, out);
    }
    if (crowded) turn_cells(to_world, normal_map, side, out);
}
