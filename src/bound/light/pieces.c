/* A part of a shape's unit form lies in the convex hull of a few points, and its normals in the
 * convex cone of a few vectors. Both stay so under affine maps. A sphere around the points holds
 * the hull, and a circular cone around the vectors holds their cone, because both are convex. */
#include "bound/light/pieces.h"

#include <assert.h>

#include "plan/cells.h"

/* The picture's sides are this many pixels farther out, because pixels around it are looked at. */
static const double PIXELS_AROUND = 2;

enum { MOST_POINTS = 9 };

typedef struct hull {
    shd_vec3 points[MOST_POINTS], normals[MOST_POINTS];
    int point_count, normal_count;
} hull;

typedef struct maker {
    const shd_scene *scene;
    const atomic_bool *cancelled;
    shd_affine to_world, normal_map;
    bool closed; /* it is a solid seen from outside, of which nothing is seen that faces away */
    /* Then a point x of a unit sphere, in the frame of the unit form, is seen if x.eye > sight. */
    shd_vec3 eye;
    double sight;
    bool front_only;         /* normals are not turned */
    double half_x, half_y;   /* of the picture, at a distance of 1 in perspective */
    double slant_x, slant_y; /* the lengths of rays to its sides there */
    shd_piece *out;
    size_t count;
} maker;

/* ---- Pieces. ---- */

static bool is_in_frame(const maker *m, shd_vec3 center, double radius) {
    const shd_camera *camera = &m->scene->camera;
    const shd_vec3 from = shd_sub(center, camera->position);
    const double x = fabs(shd_dot(from, camera->right)), y = fabs(shd_dot(from, camera->up)),
                 z = -shd_dot(from, camera->back);
    if (!(radius < INFINITY)) return true;
    radius += SHD_PIECE_MARGIN * (x + y + fabs(z) + radius);
    if (z + radius < 0) return false;
    if (camera->projection == SHD_ORTHOGRAPHIC)
        return x - radius <= m->half_x && y - radius <= m->half_y;
    return x - m->half_x * z <= radius * m->slant_x && y - m->half_y * z <= radius * m->slant_y;
}

/* Finds the direction from the piece to the viewer. Returns how far that of any point may be. */
static shd_angle view_of(const shd_camera *camera, const shd_piece *piece, shd_vec3 *view) {
    *view = camera->back;
    if (camera->projection == SHD_ORTHOGRAPHIC) return (shd_angle){1, 0};
    const shd_vec3 path = shd_sub(camera->position, piece->center);
    const double inverse = 1 / shd_plan_length(path);
    if (!(inverse > 0 && inverse < INFINITY)) return SHD_ANY_ANGLE;
    *view = shd_scale(path, inverse);
    return shd_seen_from(piece->radius, inverse);
}

static void reflect_view(shd_piece *piece, shd_vec3 view, shd_angle views) {
    piece->mirror = shd_sub(shd_scale(piece->axis, 2 * shd_dot(piece->axis, view)), view);
    piece->glitter = shd_angle_sum(shd_angle_sum(piece->spread, piece->spread), views);
}

static void put_piece(maker *m, shd_piece piece, shd_vec3 view, shd_angle views, double sign) {
    assert(m->count < SHD_MOST_PIECES);
    piece.axis = shd_scale(piece.axis, sign);
    reflect_view(&piece, view, views);
    m->out[m->count++] = piece;
}

/* Puts the piece with its normals as they are shaded, if it may be seen: twice if they may be
 * turned either way. `sides` tells which ways that is, or NULL: the normals themselves tell. */
static void put_seen_piece(maker *m, shd_piece piece, const bool *sides) {
    if (!is_in_frame(m, piece.center, piece.radius)) return;
    shd_vec3 view;
    const shd_angle views = view_of(&m->scene->camera, &piece, &view);
    bool toward = sides && sides[0], away = sides && sides[1];
    if (!sides) {
        const shd_angle facing = shd_angle_of(shd_dot(piece.axis, view)),
                        spread = shd_angle_sum(piece.spread, views);
        toward = shd_cosine_less(facing, spread) >= -SHD_PIECE_MARGIN;
        away = !m->closed && shd_cosine_more(facing, spread) <= SHD_PIECE_MARGIN;
    }
    if (toward || m->front_only) put_piece(m, piece, view, views, 1);
    if (away && !m->front_only) put_piece(m, piece, view, views, -1);
}

/* A sphere around the points, whose center is that of their box. */
static shd_piece piece_around(const shd_vec3 *at, int count) {
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < count; i++) {
        low = shd_vec3_min(low, at[i]);
        high = shd_vec3_max(high, at[i]);
    }
    shd_piece piece = {.center = shd_madd(shd_scale(low, 0.5), high, 0.5), .spread = SHD_ANY_ANGLE};
    double most = 0, sum = 0;
    for (int i = 0; i < count; i++) {
        const shd_vec3 out = shd_sub(at[i], piece.center);
        const double squared = shd_dot(out, out);
        most = shd_larger(most, squared);
        sum += squared;
    }
    piece.radius = sqrt(most);
    if (!(most > 1e-280 && sum < 1e280))
        for (int i = 0; i < count; i++)
            piece.radius = shd_larger(piece.radius, shd_length(shd_sub(at[i], piece.center)));
    piece.radius *= 1 + SHD_PIECE_MARGIN;
    return piece;
}

/* Adds the piece of a hull: points and unit normals in the world's frame. */
static void add_hull(maker *m, const shd_vec3 *at, int points, const shd_vec3 *normal,
                     int normals) {
    shd_piece piece = piece_around(at, points);
    for (int i = 0; i < normals; i++) piece.axis = shd_add(piece.axis, normal[i]);
    double cosine = 1;
    if (!shd_plan_normalize(piece.axis, &piece.axis)) cosine = -1;
    for (int i = 0; i < normals; i++) cosine = shd_smaller(cosine, shd_dot(piece.axis, normal[i]));
    /* A cone is convex if it is no wider than a half space. */
    if (cosine >= 1 - 1e-14)
        piece.spread = (shd_angle){1, 0};
    else if (cosine > 0)
        piece.spread = shd_angle_of(cosine - 1e-12);
    put_seen_piece(m, piece, NULL);
}

/* Adds the piece of a hull of the shape's unit form. */
static void add_unit_hull(maker *m, const hull *h) {
    shd_vec3 at[MOST_POINTS], normal[MOST_POINTS];
    for (int i = 0; i < h->point_count; i++) at[i] = shd_transform(&m->to_world, h->points[i]);
    for (int i = 0; i < h->normal_count; i++)
        if (!shd_plan_normalize(shd_linear(&m->normal_map, h->normals[i]), &normal[i])) return;
    add_hull(m, at, h->point_count, normal, h->normal_count);
}

/* Adds the whole object, with any normals. */
static void add_whole(maker *m, const shd_plan_object *bounds) {
    const shd_piece piece = {.center = bounds->center,
                             .radius = bounds->bounded ? bounds->radius : INFINITY,
                             .axis = m->scene->camera.back,
                             .mirror = m->scene->camera.back,
                             .spread = SHD_ANY_ANGLE,
                             .glitter = SHD_ANY_ANGLE};
    if (is_in_frame(m, piece.center, piece.radius)) m->out[m->count++] = piece;
}

/* ---- Shapes, in their unit form. ---- */

/* Adds n x n squares of a flat face: `middle` +- u +- v, or the circle in that if `round`. */
static void add_flat(maker *m, shd_vec3 middle, shd_vec3 u, shd_vec3 v, shd_vec3 normal, int n,
                     bool round) {
    const double step = 2.0 / n;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            const double a = -1 + i * step, b = -1 + k * step;
            const double x = shd_larger(shd_larger(a, -(a + step)), 0),
                         y = shd_larger(shd_larger(b, -(b + step)), 0);
            if (round && x * x + y * y > 1 + SHD_PIECE_MARGIN) continue;
            hull h = {.point_count = 4, .normal_count = 1};
            h.normals[0] = normal;
            for (int c = 0; c < 4; c++)
                h.points[c] = shd_madd(shd_madd(middle, u, a + (c & 1 ? step : 0)), v,
                                       b + (c & 2 ? step : 0));
            add_unit_hull(m, &h);
        }
}

/* The hull of an arc of a unit circle, of at most 90 degrees: its ends, and the point where the
 * tangents at its ends meet. */
static void arc_of(double from, double to, double x[3], double y[3]) {
    const double middle = (from + to) / 2, out = 1 / cos((to - from) / 2);
    x[0] = cos(from), y[0] = sin(from);
    x[1] = cos(to), y[1] = sin(to);
    x[2] = out * cos(middle), y[2] = out * sin(middle);
}

/* n x n parts of a unit sphere, through whose corners the grid of a cube's face is seen. */
typedef struct dome {
    double steps[4];   /* of the grid, along the face's sides */
    double unit[4][4]; /* one over the length of (1, step, step) */
    double apex[3][3]; /* the distance at which the planes that touch a part's corners meet */
} dome;

static void add_dome_face(maker *m, const dome *d, int axis, double sign, int n) {
    shd_vec3 at[4][4], normal[4][4];
    double seen[4][4];
    for (int i = 0; i <= n; i++)
        for (int k = 0; k <= n; k++) {
            const double a = d->steps[i], b = d->steps[k];
            const shd_vec3 out = axis == 0   ? (shd_vec3){sign, a, b}
                                 : axis == 1 ? (shd_vec3){a, sign, b}
                                             : (shd_vec3){a, b, sign};
            at[i][k] = shd_scale(shd_linear(&m->to_world, out), d->unit[i][k]);
            seen[i][k] = shd_dot(m->eye, out) * d->unit[i][k];
            if (!shd_plan_normalize(shd_linear(&m->normal_map, out), &normal[i][k])) return;
        }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            shd_vec3 points[8], normals[4];
            double most = -INFINITY;
            for (int c = 0; c < 4; c++) most = shd_larger(most, seen[i + (c & 1)][k + (c >> 1)]);
            if (m->closed && most * d->apex[i][k] < m->sight) continue;
            for (int c = 0; c < 4; c++) {
                const shd_vec3 p = at[i + (c & 1)][k + (c >> 1)];
                points[c] = shd_add(m->to_world.origin, p);
                points[4 + c] = shd_madd(m->to_world.origin, p, d->apex[i][k]);
                normals[c] = normal[i + (c & 1)][k + (c >> 1)];
            }
            add_hull(m, points, 8, normals, 4);
        }
}

static void add_sphere(maker *m, int n) {
    dome d;
    shd_vec3 out[4][4];
    /* Tangents make parts that are about as large as each other. */
    for (int i = 0; i <= n; i++) d.steps[i] = tan(SHD_PI / 4 * (-1 + 2.0 / n * i));
    for (int i = 0; i <= n; i++)
        for (int k = 0; k <= n; k++) {
            out[i][k] = (shd_vec3){1, d.steps[i], d.steps[k]};
            d.unit[i][k] = 1 / shd_plan_length(out[i][k]);
            out[i][k] = shd_scale(out[i][k], d.unit[i][k]);
        }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            shd_vec3 middle = {0, 0, 0};
            double cosine = 1;
            for (int c = 0; c < 4; c++) middle = shd_add(middle, out[i + (c & 1)][k + (c >> 1)]);
            shd_plan_normalize(middle, &middle);
            for (int c = 0; c < 4; c++)
                cosine = shd_smaller(cosine, shd_dot(middle, out[i + (c & 1)][k + (c >> 1)]));
            d.apex[i][k] = 1 / cosine;
        }
    for (int f = 0; f < 6; f++) add_dome_face(m, &d, f / 2, f % 2 ? -1 : 1, n);
}

/* The side of a cylinder, or of a cone (`tip`). */
static void add_side(maker *m, bool tip, int n) {
    for (int i = 0; i < 4 * n; i++) {
        double x[3], z[3];
        arc_of(SHD_PI / 2 / n * i, SHD_PI / 2 / n * (i + 1), x, z);
        for (int k = 0; k < n; k++) {
            hull h = {.point_count = 6, .normal_count = 3};
            for (int c = 0; c < 3; c++) {
                for (int end = 0; end < 2; end++) {
                    const double y = -0.5 + (double)(k + end) / n, r = tip ? 0.5 - y : 1;
                    h.points[2 * c + end] = (shd_vec3){r * x[c], y, r * z[c]};
                }
                h.normals[c] = (shd_vec3){x[c], tip ? 1 : 0, z[c]};
            }
            add_unit_hull(m, &h);
        }
    }
}

static void add_ring(maker *m, double tube, int n) {
    const int tubes = n > 2 ? 2 * n : 4;
    for (int i = 0; i < 4 * n; i++) {
        double x[3], z[3];
        arc_of(SHD_PI / 2 / n * i, SHD_PI / 2 / n * (i + 1), x, z);
        for (int k = 0; k < tubes; k++) {
            double out[3], up[3];
            arc_of(2 * SHD_PI / tubes * k, 2 * SHD_PI / tubes * (k + 1), out, up);
            hull h = {.point_count = 9, .normal_count = 9};
            for (int c = 0; c < 9; c++) {
                const double r = 1 + tube * out[c % 3];
                h.points[c] = (shd_vec3){r * x[c / 3], tube * up[c % 3], r * z[c / 3]};
                h.normals[c] = (shd_vec3){out[c % 3] * x[c / 3], up[c % 3], out[c % 3] * z[c / 3]};
            }
            add_unit_hull(m, &h);
        }
    }
}

/* Adds the parts of a plane that are seen through n x n cells of the picture. */
static void add_plane(maker *m, int n) {
    const shd_camera *camera = &m->scene->camera;
    const bool far = camera->projection == SHD_ORTHOGRAPHIC;
    shd_piece piece = {.spread = {1, 0}};
    if (!shd_plan_normalize(shd_linear(&m->normal_map, (shd_vec3){0, 1, 0}), &piece.axis)) return;
    const double height = shd_dot(piece.axis, shd_sub(camera->position, m->to_world.origin));
    const double side = height < 0 ? -1 : 1;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            shd_vec3 at[4];
            double steepest = 0;
            int hits = 0;
            for (int c = 0; c < 4; c++) {
                const double a = m->half_x * (-1 + 2.0 / n * (i + (c & 1))),
                             b = m->half_y * (-1 + 2.0 / n * (k + (c >> 1)));
                const shd_vec3 across = shd_madd(shd_scale(camera->right, a), camera->up, b);
                shd_vec3 from = camera->position, ray = shd_sub(across, camera->back);
                if (far) from = shd_add(from, across), ray = shd_scale(camera->back, -1);
                const double down = -shd_dot(ray, piece.axis);
                const double above = shd_dot(piece.axis, shd_sub(from, m->to_world.origin));
                steepest = shd_larger(steepest, side * down);
                if (!(far ? fabs(down) > 1e-6 : side * down > 1e-3)) continue;
                at[hits++] = shd_madd(from, ray, above / down);
            }
            if (!far && !(steepest > 0)) continue;
            if (hits == 4) {
                /* The center of their box may be beside the plane. */
                const shd_piece around = piece_around(at, 4);
                const double off = shd_dot(piece.axis, shd_sub(around.center, m->to_world.origin));
                piece.center = shd_madd(around.center, piece.axis, -off);
                piece.radius = around.radius + fabs(off);
                piece.beyond = 0;
            } else {
                /* A ray to a depth of 1 is at least 1 long. */
                piece.center = m->to_world.origin;
                piece.radius = INFINITY;
                piece.beyond = far ? 0 : fabs(height) / steepest * (1 - SHD_PIECE_MARGIN);
            }
            put_seen_piece(m, piece, NULL);
        }
}

/* ---- Meshes: triangles by the cells of a grid. ---- */

static void add_mesh(maker *m, const shd_object *object, int side) {
    const bool own = !object->mesh->normals || object->interpolation == SHD_FLAT;
    shd_cell cells[SHD_CELLS];
    shd_plan_cells(m->scene, object, &m->to_world, &m->normal_map, side, m->cancelled, cells);
    for (int i = 0; i < side * side * side; i++) {
        const shd_cell *c = &cells[i];
        if (!c->any) continue;
        shd_piece piece = {.axis = c->normals, .spread = SHD_ANY_ANGLE};
        if (c->cosine > 0) piece.spread = shd_angle_of(c->cosine - 1e-9);
        if (!(c->cosine > -1)) piece.axis = (shd_vec3){0, 0, 1};
        piece.center = shd_transform(&m->to_world, shd_madd(shd_scale(c->low, 0.5), c->high, 0.5));
        for (int corner = 0; corner < 8; corner++) {
            const shd_vec3 p = shd_transform(&m->to_world, shd_box_corner(c->low, c->high, corner));
            piece.radius = shd_larger(piece.radius, shd_plan_length(shd_sub(p, piece.center)));
        }
        piece.radius *= 1 + SHD_PIECE_MARGIN;
        put_seen_piece(m, piece, own ? NULL : c->sides);
    }
}

static void add_shape(maker *m, const shd_object *object, int n) {
    const shd_vec3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1}, none = {0, 0, 0};
    switch (object->shape) {
    case SHD_SPHERE:
        add_sphere(m, n);
        break;
    case SHD_PLANE:
        add_plane(m, 2 * n);
        break;
    case SHD_DISC:
        add_flat(m, none, x, z, y, 2 * n, true);
        break;
    case SHD_BOX:
        for (int f = 0; f < 6; f++) {
            const shd_vec3 axes[3] = {x, y, z}, out = shd_scale(axes[f / 2], f % 2 ? -1 : 1);
            add_flat(m, shd_scale(out, 0.5), shd_scale(axes[(f / 2 + 1) % 3], 0.5),
                     shd_scale(axes[(f / 2 + 2) % 3], 0.5), out, n, false);
        }
        break;
    case SHD_CYLINDER:
    case SHD_CONE:
        add_side(m, object->shape == SHD_CONE, n);
        if (object->shape == SHD_CYLINDER) add_flat(m, shd_scale(y, 0.5), x, z, y, n, true);
        add_flat(m, shd_scale(y, -0.5), x, z, shd_scale(y, -1), n, true);
        break;
    case SHD_TORUS:
        add_ring(m, object->tube / object->radius, n);
        break;
    case SHD_MESH:
        add_mesh(m, object, n + 1);
        break;
    case SHD_SHAPE_COUNT:
        break;
    }
}

/* Whether rays go through it, so that a solid is seen from within. */
static bool lets_through(const shd_scene *scene, const shd_object *object) {
    const double *opacity = scene->materials[object->material].opacity;
    return scene->trace.depth && (opacity[0] != 1 || opacity[1] != 1 || opacity[2] != 1);
}

/* A map turns normals anywhere. The axis stays that of the surface's own. */
static void turn_anywhere(shd_piece *pieces, size_t count) {
    for (size_t p = 0; p < count; p++) pieces[p].spread = pieces[p].glitter = SHD_ANY_ANGLE;
}

size_t shd_plan_pieces(const shd_scene *scene, size_t index, const shd_plan_object *bounds,
                       int fineness, const atomic_bool *cancelled, shd_piece *out) {
    const shd_object *object = &scene->objects[index];
    const shd_camera *camera = &scene->camera;
    const shd_raster *raster = &scene->raster;
    const double half = shd_half_height(camera);
    const double around =
        1 + 2 * PIXELS_AROUND / (raster->width < raster->height ? raster->width : raster->height);
    maker m = {.scene = scene,
               .cancelled = cancelled,
               .front_only = scene->materials[object->material].front_only,
               .half_x = half * raster->width / raster->height * around,
               .half_y = half * around,
               .out = out};
    m.slant_x = sqrt(1 + m.half_x * m.half_x);
    m.slant_y = sqrt(1 + m.half_y * m.half_y);
    shd_affine from_world;
    /* Facets are beside the shape that they stand for. */
    const bool faceted = object->interpolation != SHD_PHONG && object->shape != SHD_MESH;
    if (fineness == 0 || faceted || !shd_object_frame(object, &m.to_world, &from_world)) {
        add_whole(&m, bounds);
        return m.count;
    }
    m.normal_map = shd_normal_map(&m.to_world);
    if (object->shape != SHD_PLANE && object->shape != SHD_DISC && object->shape != SHD_MESH &&
        !lets_through(scene, object)) {
        const shd_vec3 from = shd_sub(camera->position, bounds->center);
        const double reach = bounds->radius * (1 + SHD_PIECE_MARGIN);
        const bool far = camera->projection == SHD_ORTHOGRAPHIC;
        m.closed = far ? shd_dot(from, camera->back) > reach : shd_plan_length(from) > reach;
        const shd_vec3 apart = shd_sub(camera->position, m.to_world.origin);
        m.eye = shd_linear(&from_world, far ? camera->back : apart);
        m.sight = (far ? 0 : 1) - SHD_PIECE_MARGIN * shd_plan_length(m.eye);
    }
    add_shape(&m, object, fineness);
    if (scene->materials[object->material].normal_texture) turn_anywhere(out, m.count);
    return m.count;
}

shd_piece shd_piece_of(const shd_scene *scene, const shd_patch *patch) {
    shd_piece piece = {.center = patch->center,
                       .radius = patch->radius,
                       .axis = patch->axis,
                       .spread = patch->cos_spread > 0
                                     ? shd_angle_of(patch->cos_spread - SHD_PIECE_MARGIN)
                                     : SHD_ANY_ANGLE};
    shd_vec3 view;
    const shd_angle views = view_of(&scene->camera, &piece, &view);
    reflect_view(&piece, view, views);
    return piece;
}
