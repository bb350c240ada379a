/* Outlines of objects: where in the picture each may be seen, from which depth on, and lists of
 * what is seen where. survey.c holds rectangles of pixels against them. */
#include <assert.h>
#include <float.h>
#include <string.h>

#include "base/bits.h"
#include "sight/item.h"

/* A vector in the camera's frame. */
static shd_vec3 in_camera(const shd_camera *camera, shd_vec3 v) {
    return (shd_vec3){shd_dot(v, camera->right), shd_dot(v, camera->up), -shd_dot(v, camera->back)};
}

typedef struct range {
    double low, high;
} range;

/* The slopes x/z of tangents from the origin to a circle around (x, z), which lies at z > 0. */
static range tangent_slopes(double x, double z, double radius) {
    double square = x * x + z * z - radius * radius;
    if (!(square > 0)) return (range){-INFINITY, INFINITY};
    double length = sqrt(square);
    return (range){(x * length - z * radius) / (z * length + x * radius),
                   (x * length + z * radius) / (z * length - x * radius)};
}

static void grow_ranges(range *p, range *q, double x, double y) {
    *p = (range){fmin(p->low, x), fmax(p->high, x)};
    *q = (range){fmin(q->low, y), fmax(q->high, y)};
}

static range common_range(range a, range b) {
    return (range){shd_larger(a.low, b.low), shd_smaller(a.high, b.high)};
}

/* Widens a range by more than rounding moves it on the image plane. */
static range widened_range(range r) {
    return (range){r.low - 1e-12 * (1 + fabs(r.low)), r.high + 1e-12 * (1 + fabs(r.high))};
}

/* Where an object may be seen: its outline, and the rectangle around it on the image plane. */
typedef struct sighting {
    shd_outline_kind kind;
    shd_outline *outline;
    range p, q;
    double nearest;
} sighting;

/* Makes a frame from the image plane. Rounding to f32 is less than a hundredth of any pixel. */
static shd_frame frame_of(const shd_lens *lens, const sighting *from) {
    const range p = widened_range(from->p), q = widened_range(from->q);
    const double across = lens->middle_x / lens->half_x, down = lens->middle_y / lens->half_y;
    return (shd_frame){(float)(lens->middle_x + p.low * across - SHD_WIDER),
                       (float)(lens->middle_x + p.high * across + SHD_WIDER),
                       (float)(lens->middle_y - q.high * down - SHD_WIDER),
                       (float)(lens->middle_y - q.low * down + SHD_WIDER)};
}

/* The next f32 that is no larger than x >= 0, and not -0. */
static float rounded_down(double x) {
    const float y = (float)(x < FLT_MAX ? x : FLT_MAX);
    return (double)y > x ? shd_float_of(shd_bits_of(y) - 1) : y + 0.0f;
}

/* More than rounding makes of depths, relative to the sizes of what they are made of. */
static const double DEEPER = 1e-9;

/* Where the corners of the box around an object are seen, and from which depth on. False: not all
 * are before the eye. */
static bool corner_ranges(const shd_sight *sight, size_t index, range *p, range *q, double *depth) {
    const shd_camera *camera = sight->lens.camera;
    const shd_object *object = &sight->plan->scene->objects[index];
    shd_vec3 low, high;
    if (!shd_object_box(object, &low, &high)) return false;
    const shd_vec3 from = shd_sub(object->transform.origin, camera->position);
    double least = INFINITY, size = shd_max_abs(from);
    *p = *q = (range){INFINITY, -INFINITY};
    for (int corner = 0; corner < 8; corner++) {
        shd_vec3 at = shd_box_corner(low, high, corner);
        shd_vec3 v = in_camera(camera, shd_add(shd_linear(&object->transform, at), from));
        least = fmin(least, v.z);
        size = fmax(size, shd_max_abs(v));
        if (camera->projection == SHD_PERSPECTIVE) {
            if (!(v.z > 1e-9 * shd_max_abs(v))) return false;
            v.x /= v.z;
            v.y /= v.z;
        }
        grow_ranges(p, q, v.x, v.y);
    }
    *depth = least - DEEPER * size;
    return true;
}

/* Finds where a mesh's vertices are seen, from which depth on, and how far they are from its middle
 * `v`, as rays see them. False: not all are before the eye. */
static bool vertex_ranges(const shd_item *it, shd_vec3 v, range *p, range *q, double *radius,
                          double *depth) {
    const shd_mesh_view *view = &it->view;
    double square = 0, least = INFINITY, size = shd_max_abs(v);
    *p = *q = (range){INFINITY, -INFINITY};
    for (size_t i = 0; i < it->triangles.vertex_count; i++) {
        const shd_seen_vertex *at = &view->vertices[i];
        const shd_vec3 from =
            shd_sub((shd_vec3){at->x * view->unit, at->y * view->unit, at->depth * view->unit}, v);
        const double w = shd_seen_w(view->orthographic, at),
                     x = view->orthographic ? at->x * view->unit : at->x / w,
                     y = view->orthographic ? at->y * view->unit : at->y / w;
        if (!(w > 1e-9 * (fabs(at->x) + fabs(at->y))) || !isfinite(x + y)) return false;
        square = fmax(square, shd_dot(from, from));
        least = fmin(least, at->depth);
        size = fmax(size, view->unit * fmax(fabs(at->x), fmax(fabs(at->y), fabs(at->depth))));
        grow_ranges(p, q, x, y);
    }
    *depth = least * view->unit - DEEPER * size - view->unit * 1e-12 * shd_max_abs(view->eye);
    if (isfinite(square) && square > 1e-200) *radius = fmin(*radius, sqrt(square));
    return true;
}

/* A ray hits a plane if it goes toward it: on one side of a line on the image plane. */
static void outline_plane(const shd_sight *sight, const shd_item *it, sighting *s) {
    shd_outline *out = s->outline;
    const shd_camera *camera = sight->lens.camera;
    const shd_vec3 up = in_camera(camera, shd_vec3_at(it->from_world.linear[1], 0));
    const bool orthographic = camera->projection == SHD_ORTHOGRAPHIC;
    /* Along the plane's normal, either the ray's origin or its direction is fixed for all rays, and
     * the other one depends on the pixel. */
    double fixed = orthographic ? up.z : it->eye.y, sign = fixed > 0 ? 1 : -1;
    s->kind = fixed == 0 ? SHD_OUTLINE_NONE : SHD_OUTLINE_HALF;
    out->center = (shd_vec3){sign * up.x, sign * up.y, sign * (orthographic ? it->eye.y : up.z)};
    double error = orthographic ? shd_max_abs(shd_sub(camera->position, it->to_world.origin)) : 1;
    out->radius = 1e-12 * error * shd_max_abs(up);
}

/* `it`: NULL for a ball. */
static void outline_sphere(const shd_sight *sight, size_t index, const shd_item *it, sighting *s) {
    shd_outline *out = s->outline;
    const shd_camera *camera = sight->lens.camera;
    const shd_plan_object *bounds = &sight->plan->objects[index];
    shd_vec3 v = in_camera(camera, shd_sub(bounds->center, camera->position));
    double radius = bounds->radius;
    range p, q;
    double depth = 0;
    /* Around a ball before the eye, tangents are closer than a box. */
    const bool mesh = it && it->shape == SHD_MESH, round = !it && v.z > 2 * radius,
               ranged = mesh && it->view.vertices
                            ? vertex_ranges(it, v, &p, &q, &radius, &depth)
                            : !round && corner_ranges(sight, index, &p, &q, &depth);
    if (!it)
        radius = shd_smaller(radius, sight->seen[index].ball.size);
    else if (it->shape == SHD_SPHERE)
        radius = fmin(radius, shd_norm(&it->to_world));
    radius *= 1 + 1e-9;
    const double distance = shd_length(v);
    if (!isfinite(distance) || !isfinite(radius)) {
        s->kind = SHD_OUTLINE_ALL;
        return;
    }
    out->center = v;
    out->radius = radius;
    if (v.z + radius <= 0) {
        s->kind = SHD_OUTLINE_NONE;
        return;
    }
    s->nearest = shd_larger(shd_larger(v.z - radius - DEEPER * distance, depth), 0);
    if (camera->projection == SHD_ORTHOGRAPHIC) {
        s->kind = SHD_OUTLINE_ROUND;
        const double reach = radius + 1e-12 * fmax(fabs(v.x), fabs(v.y));
        s->p = (range){v.x - reach, v.x + reach};
        s->q = (range){v.y - reach, v.y + reach};
    } else {
        s->kind = distance > radius ? SHD_OUTLINE_CONE : SHD_OUTLINE_ALL;
        out->tangent = sqrt(distance - radius) * sqrt(distance + radius);
        if (v.z > radius) {
            s->p = tangent_slopes(v.x, v.z, radius);
            s->q = tangent_slopes(v.y, v.z, radius);
        }
    }
    if (ranged) {
        s->p = common_range(s->p, p);
        s->q = common_range(s->q, q);
    }
}

/* Sorts by distance, and of equal ones as they come: byte by byte of the bits, which are in the
 * order of numbers that are not negative. `spare` has as much room. */
static void sort_distances(shd_distance *distances, shd_distance *spare, size_t count) {
    enum { DIGITS = 4 };
    uint32_t starts[DIGITS][257] = {{0}};
    shd_distance *from = distances, *to = spare;
    for (size_t i = 0; i < count; i++)
        for (int d = 0; d < DIGITS; d++)
            starts[d][1 + (shd_bits_of(distances[i].nearest) >> 8 * d & 255)]++;
    for (int d = 0; d < DIGITS; d++) {
        if (starts[d][1 + (shd_bits_of(from[0].nearest) >> 8 * d & 255)] == count) continue;
        for (int k = 1; k < 256; k++) starts[d][k + 1] += starts[d][k];
        for (size_t i = 0; i < count; i++)
            to[starts[d][shd_bits_of(from[i].nearest) >> 8 * d & 255]++] = from[i];
        shd_distance *const sorted = to;
        to = from;
        from = sorted;
    }
    if (from != distances) memcpy(distances, from, count * sizeof *distances);
}

/* A rectangle of cells that an object's frame reaches into: first and last columns and rows. There
 * are none if the last one is before the first. */
typedef struct cell_range {
    int left, right, top, bottom;
} cell_range;

/* The first and last of `count` cells in a row that [low, high], in cells, reaches into. An edge
 * between two is in both; not-a-number is in all. */
static void reach_cells(float low, float high, int count, int *first, int *last) {
    const float most = (float)count;
    *first = !(low > 1) ? 0 : low < most ? (int)low - ((float)(int)low == low) : count - 1;
    *last = !(high < most) ? count - 1 : high >= 0 ? (int)high : -1;
    if (low > most) *last = -1;
}

/* Finds the cells of each frame, of so many columns. Returns how many they are together. */
static size_t find_cells(shd_sight *sight, int across, cell_range *out) {
    const float part = 1.0f / SHD_CELL; /* a power of 2 */
    size_t total = 0;
    sight->cells_across = across;
    for (size_t i = 0; i < sight->count; i++) {
        const shd_frame *f = &sight->seen[i].frame;
        cell_range *r = &out[i];
        reach_cells(part * f->top, part * f->bottom, sight->cells_down, &r->top, &r->bottom);
        r->left = r->right = 0;
        if (across > 1) reach_cells(part * f->left, part * f->right, across, &r->left, &r->right);
        if (r->bottom >= r->top && r->right >= r->left)
            total += (size_t)(r->right - r->left + 1) * (size_t)(r->bottom - r->top + 1);
    }
    return total;
}

/* Sorts many objects by the cells that they reach into, or if most are wide by rows of these,
 * unless they are high too. False: the arena is full. */
static bool fill_cells(shd_sight *sight, shd_arena *arena) {
    enum { MANY = 256, LARGE = 4 };
    const size_t most = LARGE * sight->count;
    if (sight->count < MANY) return true;
    cell_range *ranges = shd_arena_alloc(arena, sight->count, sizeof *ranges);
    if (!ranges) return false;
    sight->cells_down = (int)ceil(sight->lens.height / SHD_CELL);
    size_t total = find_cells(sight, (int)ceil(sight->lens.width / SHD_CELL), ranges);
    if (total > most) total = find_cells(sight, 1, ranges);
    if (total > most) return true;
    const int across = sight->cells_across;
    const size_t count = (size_t)across * (size_t)sight->cells_down;
    uint32_t *cells = shd_arena_zalloc(arena, count + 2, sizeof *cells);
    sight->celled = shd_arena_alloc(arena, total + 1, sizeof *sight->celled);
    if (!cells || !sight->celled) return false;
    for (const cell_range *r = ranges; r < ranges + sight->count; r++)
        for (int y = r->top; y <= r->bottom; y++)
            for (int x = r->left; x <= r->right; x++) cells[y * across + x + 2]++;
    for (size_t c = 0; c < count; c++) cells[c + 2] += cells[c + 1];
    for (size_t k = 0; k < sight->count; k++) {
        const uint32_t object = sight->order[k];
        const cell_range *r = &ranges[object];
        for (int y = r->top; y <= r->bottom; y++)
            for (int x = r->left; x <= r->right; x++)
                sight->celled[cells[y * across + x + 1]++] = object;
    }
    sight->cells = cells;
    return true;
}

/* Lists frames in the sight's order. False: the arena is full. */
static bool list_frames(shd_sight *sight, shd_arena *arena) {
    const size_t count = sight->count;
    float *frames = shd_arena_alloc(arena, 4 * count, sizeof *frames);
    if (!frames) return false;
    sight->frames = (shd_frames){frames, frames + count, frames + 2 * count, frames + 3 * count};
    for (size_t k = 0; k < count; k++) {
        const shd_frame *frame = &sight->seen[sight->order[k]].frame;
        sight->frames.left[k] = frame->left;
        sight->frames.right[k] = frame->right;
        sight->frames.top[k] = frame->top;
        sight->frames.bottom[k] = frame->bottom;
    }
    return true;
}

void shd_sight_outline(shd_sight *sight, size_t index) {
    const range all = {-INFINITY, INFINITY}, none = {INFINITY, -INFINITY};
    const shd_item *it = sight->items[index];
    shd_seen_object *one = &sight->seen[index];
    sighting seen = {.outline = &one->outline, .p = all, .q = all};
    if (it && it->shape == SHD_PLANE)
        outline_plane(sight, it, &seen);
    else
        outline_sphere(sight, index, it, &seen);
    if (seen.kind == SHD_OUTLINE_NONE) seen.p = none;
    one->frame = frame_of(&sight->lens, &seen);
    one->nearest = rounded_down(seen.nearest);
    one->kind = (uint8_t)seen.kind;
    one->tube = it && it->shape == SHD_TORUS;
    sight->distances[index] = (shd_distance){one->nearest, (uint32_t)index};
}

bool shd_sight_order(shd_sight *sight, shd_arena *arena) {
    const size_t count = sight->count;
    if (count) sort_distances(sight->distances, sight->distances + count, count);
    for (size_t k = 0; k < count; k++) sight->order[k] = sight->distances[k].object;
    return fill_cells(sight, arena) && (sight->cells || list_frames(sight, arena));
}
