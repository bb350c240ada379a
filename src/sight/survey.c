/* Surveys: outlines of objects against rectangles of pixels.
 *
 * An outline is a rectangle of pixels and, within it, the cone around the object's sphere (or the
 * half plane below a plane's horizon). Both are larger than the object by more than rounding can
 * move a ray. A rectangle of pixels is seen as the circle around it on the image plane: at
 * distance 1 from the eye, with c the middle and h the half diagonal, all of its rays are within
 * asin(h / |c|) of c. The cone around a sphere at v of radius R has the sine R / |v|, so with k =
 * sqrt(c.c - h h) and l = sqrt(v.v - R R) they meet where c.v >= k l - h R: the cosine of the
 * sum. */
#include <assert.h>
#include <string.h>

#include "base/bits.h"
#include "sight/bend.h"
#include "sight/item.h"

/* As many candidates of a block are listed before any ray tells what is hidden, and then so many
 * times more. */
enum { AT_FIRST = 16, FURTHER = 4 };

/* The part of a pixel by which outlines are widened on all sides. */
static const double WIDER = 1e-2;

/* ---- Outlines. ---- */

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

/* Sets a frame from the image plane. Rounding to f32 is less than a hundredth of any pixel. */
static void set_frame(const shd_lens *lens, const sighting *from, const shd_frames *frames,
                      size_t k) {
    range p = widened_range(from->p), q = widened_range(from->q);
    frames->left[k] = (float)((p.low / lens->half_x + 1) * lens->width / 2 - WIDER);
    frames->right[k] = (float)((p.high / lens->half_x + 1) * lens->width / 2 + WIDER);
    frames->top[k] = (float)((1 - q.high / lens->half_y) * lens->height / 2 - WIDER);
    frames->bottom[k] = (float)((1 - q.low / lens->half_y) * lens->height / 2 + WIDER);
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
        const double x = view->orthographic ? at->x * view->unit : at->p,
                     y = view->orthographic ? at->y * view->unit : at->q;
        if (!(at->w > 1e-9 * (fabs(at->x) + fabs(at->y))) || !isfinite(x + y)) return false;
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

/* The bands that an object's frame reaches into, first and last. False: none. */
static bool bands_reached(const shd_sight *sight, size_t rank, int reached[2]) {
    const float most = (float)sight->band_count, top = sight->frames.top[rank] / SHD_BAND,
                bottom = sight->frames.bottom[rank] / SHD_BAND;
    if (bottom < 0 || top > most) return false;
    /* An edge between bands is in both. Not-a-number reaches anywhere. */
    reached[0] = top > 1 ? (int)ceilf(top) - 1 : 0;
    reached[1] = bottom < most ? (int)bottom : sight->band_count - 1;
    if (reached[0] >= sight->band_count) reached[0] = sight->band_count - 1;
    return true;
}

/* Sorts the ranks of many objects by the bands that they reach into, unless most are high. False:
 * the arena is full. */
static bool fill_bands(shd_sight *sight, shd_arena *arena) {
    enum { MANY = 256, HIGH = 4 };
    if (sight->count < MANY) return true;
    sight->band_count = (int)ceil(sight->lens.height / SHD_BAND);
    size_t total = 0;
    int reached[2];
    for (size_t k = 0; k < sight->count; k++)
        if (bands_reached(sight, k, reached)) total += (size_t)(reached[1] - reached[0] + 1);
    if (total > HIGH * sight->count) return true;
    uint32_t *bands = shd_arena_zalloc(arena, (size_t)sight->band_count + 2, sizeof *bands);
    sight->banded = shd_arena_alloc(arena, total + 1, sizeof *sight->banded);
    if (!bands || !sight->banded) return false;
    for (size_t k = 0; k < sight->count; k++)
        if (bands_reached(sight, k, reached))
            for (int b = reached[0]; b <= reached[1]; b++) bands[b + 2]++;
    for (int b = 0; b < sight->band_count; b++) bands[b + 2] += bands[b + 1];
    for (size_t k = 0; k < sight->count; k++)
        if (bands_reached(sight, k, reached))
            for (int b = reached[0]; b <= reached[1]; b++)
                sight->banded[bands[b + 1]++] = (uint32_t)k;
    sight->bands = bands;
    return true;
}

bool shd_sight_outline(shd_sight *sight, shd_arena *arena) {
    const size_t count = sight->count;
    sighting *seen = shd_arena_alloc(arena, count, sizeof *seen);
    place *places = shd_arena_alloc(arena, count, sizeof *places);
    float *frames = shd_arena_alloc(arena, 4 * count, sizeof *frames);
    sight->order = shd_arena_alloc(arena, count, sizeof *sight->order);
    sight->outlines = shd_arena_alloc(arena, count, sizeof *sight->outlines);
    if (!seen || !places || !frames || !sight->order || !sight->outlines) return false;
    sight->frames = (shd_frames){frames, frames + count, frames + 2 * count, frames + 3 * count};
    const range all = {-INFINITY, INFINITY}, none = {INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++) {
        shd_item *it = &sight->items[i];
        seen[i] = (sighting){.outline.tube = it->shape == SHD_TORUS, .p = all, .q = all};
        if (it->shape == SHD_PLANE)
            outline_plane(sight, it, &seen[i].outline);
        else
            outline_sphere(sight, i, it, &seen[i]);
        if (seen[i].outline.kind == SHD_OUTLINE_NONE) seen[i].p = none;
        it->nearest = seen[i].nearest;
        places[i] = (place){seen[i].nearest + 0.0, (uint32_t)i}; /* -0 + 0 is 0 */
    }
    static_assert(sizeof(place) == 4 * sizeof(float), "frames have room for places");
    if (count) sort_places(places, (place *)(void *)frames, count); /* they are set below */
    for (size_t k = 0; k < count; k++) {
        const uint32_t object = sight->order[k] = places[k].object;
        sight->outlines[k] = seen[object].outline;
        set_frame(&sight->lens, &seen[object], &sight->frames, k);
        sight->items[object].frame = (shd_frame){sight->frames.left[k], sight->frames.right[k],
                                                 sight->frames.top[k], sight->frames.bottom[k]};
    }
    return fill_bands(sight, arena);
}

/* ---- Rectangles of pixels. ---- */

/* A rectangle of pixels. */
typedef struct shd_window {
    float left, right, top, bottom; /* pixels */
    double p, q, across, down;      /* the middle, and half of the sides, on the image plane */
    double h, k;                    /* half of the diagonal there, and sqrt(c.c - h h) */
} window;

static window make_window(const shd_lens *lens, double x, double y, double w, double h) {
    window out = {x,
                  x + w,
                  y,
                  y + h,
                  .across = (w / 2 + WIDER) * lens->step_x,
                  .down = (h / 2 + WIDER) * lens->step_y};
    out.p = (x + w / 2 - lens->middle_x) * lens->step_x;
    out.q = (lens->middle_y - y - h / 2) * lens->step_y;
    double square = out.across * out.across + out.down * out.down;
    out.h = sqrt(square);
    out.k = out.p * out.p + out.q * out.q + 1 - square;
    out.k = out.k > 0 ? sqrt(out.k) : 0;
    return out;
}

/* Whether an object may be seen through a window that its frame reaches into. */
static bool may_see(const shd_outline *o, const window *w) {
    const shd_vec3 v = o->center;
    if (o->kind == SHD_OUTLINE_CONE)
        return w->p * v.x + w->q * v.y + v.z + w->h * o->radius + (w->k + w->h) * o->margin >=
               w->k * o->tangent;
    if (o->kind == SHD_OUTLINE_ROUND) {
        double x = w->p - v.x, y = w->q - v.y, reach = w->h + o->radius + o->margin;
        return x * x + y * y <= reach * reach * (1 + 1e-9);
    }
    if (o->kind == SHD_OUTLINE_HALF)
        return v.x * w->p + v.y * w->q + v.z - fabs(v.x) * w->across - fabs(v.y) * w->down <=
               o->margin * (1 + fabs(w->p) + fabs(w->q));
    return o->kind == SHD_OUTLINE_ALL;
}

/* Whether rays through a window may meet a torus: the one through its middle is followed in steps
 * that none of them can meet the tube within, for which the widest of them is taken as a tube more.
 */
static bool may_meet_tube(const shd_sight *sight, const shd_item *it, const window *w) {
    const shd_camera *camera = sight->lens.camera;
    const bool orthographic = camera->projection == SHD_ORTHOGRAPHIC;
    const shd_vec3 aside =
        shd_linear(&it->from_world, shd_madd(shd_scale(camera->right, w->p), camera->up, w->q));
    const shd_vec3 from = orthographic ? shd_add(it->eye, aside) : it->eye,
                   way = orthographic ? it->forward : shd_add(it->forward, aside);
    const double length = shd_length(way), away = shd_length(from),
                 spread = it->similar ? w->h / it->size : w->h * shd_norm(&it->from_world),
                 wide = 1e-12 * (1 + away) + (orthographic ? spread : 0),
                 wider = orthographic ? 0 : spread / length, reach = 1 + it->tube + wide,
                 middle = -shd_dot(from, way) / length, end = (middle + reach) / (1 - wider);
    if (!(wider < 1 && away < 1e100)) return true;
    const shd_vec3 unit = shd_scale(way, 1 / length);
    double t = fmax(0, (middle - reach) / (1 + wider));
    for (int step = 0; step < 64; step++) {
        if (t > end) return false;
        const shd_vec3 p = shd_madd(from, unit, t);
        const double off = sqrt(p.x * p.x + p.z * p.z) - 1,
                     clear = sqrt(off * off + p.y * p.y) - it->tube - wide - wider * t;
        if (!(clear > 1e-2 * it->tube)) return true;
        t += clear * (1 - wider);
    }
    return true;
}

void shd_survey_lay_out(size_t object_count, int w, int h, shd_scratch *memory, shd_survey *out) {
    size_t across = ((size_t)w + SHD_BLOCK_SIDE - 1) / SHD_BLOCK_SIDE,
           down = ((size_t)h + SHD_BLOCK_SIDE - 1) / SHD_BLOCK_SIDE;
    *out = (shd_survey){.capacity = across * down};
    out->blocks = shd_scratch_take(memory, out->capacity, sizeof *out->blocks);
    out->windows = shd_scratch_take(memory, out->capacity, sizeof *out->windows);
    out->candidates =
        shd_scratch_take(memory, (out->capacity + 1) * object_count, sizeof *out->candidates);
}

static inline bool reaches_into(const shd_frames *f, size_t k, const window *w) {
    /* Not-a-number reaches anywhere. */
    return !((f->right[k] < w->left) | (f->left[k] > w->right) | (f->bottom[k] < w->top) |
             (f->top[k] > w->bottom));
}

/* The band of the picture in which a row lies, or -1. */
static int band_of(const shd_sight *sight, float row) {
    if (!sight->bands || !(row >= 0 && row < (float)(sight->band_count * SHD_BAND))) return -1;
    return (int)row / SHD_BAND;
}

/* Lists the ranks of objects that may be seen. Returns how many. */
static size_t look_through(const shd_sight *sight, const window *w, uint32_t *ranks) {
    enum { CHUNK = 64 };
    size_t count = 0;
    const int band = band_of(sight, w->top);
    if (band >= 0 && w->bottom <= (float)((band + 1) * SHD_BAND)) {
        for (uint32_t i = sight->bands[band]; i < sight->bands[band + 1]; i++) {
            const uint32_t rank = sight->banded[i];
            if (reaches_into(&sight->frames, rank, w) && may_see(&sight->outlines[rank], w))
                ranks[count++] = rank;
        }
        return count;
    }
    for (size_t first = 0; first < sight->count; first += CHUNK) {
        const size_t left = sight->count - first, size = left < CHUNK ? left : CHUNK;
        uint32_t reaches[CHUNK], any = 0;
        for (size_t i = 0; i < size; i++) {
            reaches[i] = reaches_into(&sight->frames, first + i, w) ? 1 : 0;
            any |= reaches[i];
        }
        for (size_t i = 0; any && i < size; i++)
            if (reaches[i] && may_see(&sight->outlines[first + i], w))
                ranks[count++] = (uint32_t)(first + i);
    }
    return count;
}

/* Whether an object may be seen through a window. */
static bool may_see_rank(const shd_sight *sight, uint32_t rank, const window *w) {
    const shd_outline *o = &sight->outlines[rank];
    return reaches_into(&sight->frames, rank, w) && may_see(o, w) &&
           (!o->tube || may_meet_tube(sight, &sight->items[sight->order[rank]], w));
}

bool shd_sight_is_empty(const shd_sight *sight, const shd_survey *s, size_t block, int part) {
    enum { SIDE = SHD_BLOCK_SIDE / 2 };
    const size_t object = s->candidates[s->blocks[block].first], across = (size_t)s->across;
    const window w = make_window(
        &sight->lens, s->rect.x + (int)(block % across) * SHD_BLOCK_SIDE + (part & 1) * SIDE,
        s->rect.y + (int)(block / across) * SHD_BLOCK_SIDE + (part >> 1) * SIDE, SIDE, SIDE);
    uint32_t rank = s->only;
    for (size_t k = 0; s->candidate_count > 1; k++)
        if (sight->order[rank = s->candidates[k]] == object) break;
    return !may_see_rank(sight, rank, &w);
}

void shd_survey_further(const shd_sight *sight, shd_survey *s, size_t index) {
    shd_block *block = &s->blocks[index];
    const uint32_t most = FURTHER * block->count;
    for (; block->next < s->candidate_count && block->count < most; block->next++) {
        const uint32_t rank = s->candidates[block->next];
        if (may_see_rank(sight, rank, &s->windows[index]))
            s->candidates[block->first + block->count++] = sight->order[rank];
    }
}

/* The blocks in a row of `count` that [low, high] reaches into, first and last, if the row begins
 * at `from`. The edge between two is in both; not-a-number is in all. */
static void blocks_reached(float low, float high, int from, int count, int reached[2]) {
    const float first = (low - (float)from) / SHD_BLOCK_SIDE,
                last = (high - (float)from) / SHD_BLOCK_SIDE, most = (float)count;
    reached[0] = !(first > 1) ? 0 : first < most ? (int)ceilf(first) - 1 : count - 1;
    reached[1] = !(last < most) ? count - 1 : last >= 0 ? (int)last : -1;
}

/* Lists candidates of all blocks, AT_FIRST of each. */
static void list_first(const shd_sight *sight, shd_survey *s) {
    const size_t blocks = (size_t)s->across * (size_t)s->down;
    size_t waiting = blocks;
    for (size_t k = 0; k < s->candidate_count && waiting; k++) {
        const uint32_t rank = s->candidates[k];
        int x[2], y[2];
        blocks_reached(sight->frames.left[rank], sight->frames.right[rank], s->rect.x, s->across,
                       x);
        blocks_reached(sight->frames.top[rank], sight->frames.bottom[rank], s->rect.y, s->down, y);
        for (int row = y[0]; row <= y[1]; row++)
            for (int i = row * s->across + x[0]; i <= row * s->across + x[1]; i++) {
                shd_block *block = &s->blocks[i];
                if (block->count == AT_FIRST || !may_see_rank(sight, rank, &s->windows[i]))
                    continue;
                s->candidates[block->first + block->count++] = sight->order[rank];
                if (block->count < AT_FIRST) continue;
                block->next = (uint32_t)k + 1;
                waiting--;
            }
    }
}

void shd_sight_survey(const shd_sight *sight, shd_tile rect, shd_survey *out) {
    out->across = (rect.w + SHD_BLOCK_SIDE - 1) / SHD_BLOCK_SIDE;
    out->down = (rect.h + SHD_BLOCK_SIDE - 1) / SHD_BLOCK_SIDE;
    const size_t blocks = (size_t)out->across * (size_t)out->down;
    assert(blocks <= out->capacity);
    const window all = make_window(&sight->lens, rect.x, rect.y, rect.w, rect.h);
    const size_t count = look_through(sight, &all, out->candidates);
    out->candidate_count = count;
    out->rect = rect;
    out->even = false;
    for (size_t i = 0; i < blocks; i++) {
        const int x = (int)(i % (size_t)out->across) * SHD_BLOCK_SIDE,
                  y = (int)(i / (size_t)out->across) * SHD_BLOCK_SIDE,
                  w = rect.w - x < SHD_BLOCK_SIDE ? rect.w - x : SHD_BLOCK_SIDE,
                  h = rect.h - y < SHD_BLOCK_SIDE ? rect.h - y : SHD_BLOCK_SIDE;
        out->blocks[i] = (shd_block){(uint32_t)(count * (i + 1)), 0, (uint32_t)count};
        if (count) out->windows[i] = make_window(&sight->lens, rect.x + x, rect.y + y, w, h);
    }
    list_first(sight, out);
    if (count != 1) return;
    out->only = out->candidates[0];
    out->candidates[0] = sight->order[out->candidates[0]];
    out->even = sight->items[out->candidates[0]].ball;
}
