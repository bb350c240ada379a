/* Outlines of objects: where in the picture each may be seen, from which depth on, and lists of
 * what is seen where. survey.c holds rectangles of pixels against them. */
#include <assert.h>
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
    return (range){fmax(a.low, b.low), fmin(a.high, b.high)};
}

/* Widens a range by more than rounding moves it on the image plane. */
static range widened_range(range r) {
    return (range){r.low - 1e-12 * (1 + fabs(r.low)), r.high + 1e-12 * (1 + fabs(r.high))};
}

/* Where an object may be seen: its outline, and the rectangle around it on the image plane. */
typedef struct sighting {
    shd_outline outline;
    range p, q;
    double nearest;
} sighting;

/* Makes a frame from the image plane. Rounding to f32 is less than a hundredth of any pixel. */
static shd_frame frame_of(const shd_lens *lens, const sighting *from) {
    const range p = widened_range(from->p), q = widened_range(from->q);
    return (shd_frame){(float)((p.low / lens->half_x + 1) * lens->width / 2 - SHD_WIDER),
                       (float)((p.high / lens->half_x + 1) * lens->width / 2 + SHD_WIDER),
                       (float)((1 - q.high / lens->half_y) * lens->height / 2 - SHD_WIDER),
                       (float)((1 - q.low / lens->half_y) * lens->height / 2 + SHD_WIDER)};
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
static void outline_plane(const shd_sight *sight, const shd_item *it, shd_outline *out) {
    const shd_camera *camera = sight->lens.camera;
    const shd_vec3 up = in_camera(camera, shd_vec3_at(it->from_world.linear[1], 0));
    const bool orthographic = camera->projection == SHD_ORTHOGRAPHIC;
    /* Along the plane's normal, either the ray's origin or its direction is fixed for all rays, and
     * the other one depends on the pixel. */
    double fixed = orthographic ? up.z : it->eye.y, sign = fixed > 0 ? 1 : -1;
    out->kind = fixed == 0 ? SHD_OUTLINE_NONE : SHD_OUTLINE_HALF;
    out->center = (shd_vec3){sign * up.x, sign * up.y, sign * (orthographic ? it->eye.y : up.z)};
    double error = orthographic ? shd_max_abs(shd_sub(camera->position, it->to_world.origin)) : 1;
    out->margin = 1e-12 * error * shd_max_abs(up);
}

static void outline_sphere(const shd_sight *sight, size_t index, const shd_item *it, sighting *s) {
    shd_outline *out = &s->outline;
    const shd_camera *camera = sight->lens.camera;
    const shd_plan_object *bounds = &sight->plan->objects[index];
    shd_vec3 v = in_camera(camera, shd_sub(bounds->center, camera->position));
    double radius = bounds->radius;
    range p, q;
    double depth = 0;
    /* Around a ball before the eye, tangents are closer than a box. */
    const bool mesh = it->shape == SHD_MESH, round = it->ball && v.z > 2 * radius,
               ranged = mesh && it->view.vertices
                            ? vertex_ranges(it, v, &p, &q, &radius, &depth)
                            : !round && corner_ranges(sight, index, &p, &q, &depth);
    if (it->shape == SHD_SPHERE)
        radius = fmin(radius, it->ball ? it->size : shd_norm(&it->to_world));
    radius *= 1 + 1e-9;
    const double distance = shd_length(v);
    if (!isfinite(distance) || !isfinite(radius)) {
        out->kind = SHD_OUTLINE_ALL;
        return;
    }
    out->center = v;
    out->radius = radius;
    if (v.z + radius <= 0) {
        out->kind = SHD_OUTLINE_NONE;
        return;
    }
    s->nearest = fmax(0, fmax(depth, v.z - radius - DEEPER * distance));
    if (camera->projection == SHD_ORTHOGRAPHIC) {
        out->kind = SHD_OUTLINE_ROUND;
        out->margin = 1e-12 * fmax(fabs(v.x), fabs(v.y));
        const double reach = radius + out->margin;
        s->p = (range){v.x - reach, v.x + reach};
        s->q = (range){v.y - reach, v.y + reach};
    } else {
        out->kind = distance > radius ? SHD_OUTLINE_CONE : SHD_OUTLINE_ALL;
        out->tangent = sqrt(distance - radius) * sqrt(distance + radius);
        out->margin = 1e-13 * distance;
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

/* What is sorted instead of sightings, which are large. */
typedef struct place {
    double nearest;
    uint32_t object;
} place;

/* Sorts by distance, and of equal ones as they come: byte by byte of the bits, which are in the
 * order of numbers that are not negative. `spare` has as much room. */
static void sort_places(place *places, place *spare, size_t count) {
    place *from = places, *to = spare;
    for (int shift = 0; shift < 64; shift += 8) {
        size_t starts[257] = {0};
        for (size_t i = 0; i < count; i++)
            starts[1 + (shd_bits64_of(from[i].nearest) >> shift & 255)]++;
        if (starts[1 + (shd_bits64_of(from[0].nearest) >> shift & 255)] == count) continue;
        for (int k = 1; k < 256; k++) starts[k + 1] += starts[k];
        for (size_t i = 0; i < count; i++)
            to[starts[shd_bits64_of(from[i].nearest) >> shift & 255]++] = from[i];
        place *const sorted = to;
        to = from;
        from = sorted;
    }
    if (from != places) memcpy(places, from, count * sizeof *places);
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

bool shd_sight_outline(shd_sight *sight, shd_arena *arena) {
    const size_t count = sight->count;
    place *places = shd_arena_alloc(arena, count, 2 * sizeof *places);
    sight->order = shd_arena_alloc(arena, count, sizeof *sight->order);
    if (!places || !sight->order) return false;
    const range all = {-INFINITY, INFINITY}, none = {INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++) {
        const shd_item *it = &sight->items[i];
        shd_seen_object *one = &sight->seen[i];
        sighting seen = {.outline.tube = it->shape == SHD_TORUS, .p = all, .q = all};
        if (it->shape == SHD_PLANE)
            outline_plane(sight, it, &seen.outline);
        else
            outline_sphere(sight, i, it, &seen);
        if (seen.outline.kind == SHD_OUTLINE_NONE) seen.p = none;
        one->outline = seen.outline;
        one->nearest = seen.nearest;
        one->frame = frame_of(&sight->lens, &seen);
        places[i] = (place){seen.nearest + 0.0, (uint32_t)i}; /* -0 + 0 is 0 */
    }
    if (count) sort_places(places, places + count, count);
    for (size_t k = 0; k < count; k++) sight->order[k] = places[k].object;
    return fill_cells(sight, arena) && (sight->cells || list_frames(sight, arena));
}
