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

#include "sight/bend.h"
#include "sight/item.h"

/* As many candidates of a block are listed before any ray tells what is hidden, and then so many
 * times more. */
enum { AT_FIRST = 16, FURTHER = 4 };

/* Objects that are fetched ahead of their use. */
enum { AHEAD = 16 };

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
                  .across = (w / 2 + SHD_WIDER) * lens->step_x,
                  .down = (h / 2 + SHD_WIDER) * lens->step_y};
    out.p = (x + w / 2 - lens->middle_x) * lens->step_x;
    out.q = (lens->middle_y - y - h / 2) * lens->step_y;
    double square = out.across * out.across + out.down * out.down;
    out.h = sqrt(square);
    out.k = out.p * out.p + out.q * out.q + 1 - square;
    out.k = out.k > 0 ? sqrt(out.k) : 0;
    return out;
}

/* Whether an object may be seen through a window that its frame reaches into. */
static bool may_see(const shd_seen_object *g, const window *w) {
    const shd_outline *o = &g->outline;
    const shd_vec3 v = o->center;
    if (g->kind == SHD_OUTLINE_CONE)
        return w->p * v.x + w->q * v.y + v.z + w->h * o->radius +
                   1e-13 * (w->k + w->h) * (o->radius + o->tangent) >=
               w->k * o->tangent;
    if (g->kind == SHD_OUTLINE_ROUND) {
        double x = w->p - v.x, y = w->q - v.y,
               reach = w->h + o->radius + 1e-12 * (fabs(v.x) + fabs(v.y));
        return x * x + y * y <= reach * reach * (1 + 1e-9);
    }
    if (g->kind == SHD_OUTLINE_HALF)
        return v.x * w->p + v.y * w->q + v.z - fabs(v.x) * w->across - fabs(v.y) * w->down <=
               o->radius * (1 + fabs(w->p) + fabs(w->q));
    return g->kind == SHD_OUTLINE_ALL;
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

static inline bool reaches_into(shd_frame f, const window *w) {
    /* Not-a-number reaches anywhere. */
    return !((f.right < w->left) | (f.left > w->right) | (f.bottom < w->top) | (f.top > w->bottom));
}

/* The cell of the picture in which a window lies, or -1. */
static int cell_of(const shd_sight *sight, const window *w) {
    if (!sight->cells) return -1;
    const int row = (int)w->top / SHD_CELL,
              column = sight->cells_across > 1 ? (int)w->left / SHD_CELL : 0;
    const bool within = w->top >= 0 && w->bottom <= (float)((row + 1) * SHD_CELL) &&
                        row < sight->cells_down && w->left >= 0 && column < sight->cells_across &&
                        (sight->cells_across == 1 || w->right <= (float)((column + 1) * SHD_CELL));
    return within ? row * sight->cells_across + column : -1;
}

/* Lists those of some objects that may be seen, in their order. Returns how many. */
static size_t look_at(const shd_sight *sight, const window *w, const uint32_t *objects, size_t most,
                      uint32_t *out) {
    size_t count = 0;
    for (size_t i = 0; i < most; i++) {
        const shd_seen_object *g = &sight->seen[objects[i]];
        if (i + AHEAD < most) shd_fetch_seen(&sight->seen[objects[i + AHEAD]]);
        if (reaches_into(g->frame, w) && may_see(g, w)) out[count++] = objects[i];
    }
    return count;
}

/* Lists the objects that may be seen, in the sight's order. Returns how many. */
static size_t look_through(const shd_sight *sight, const window *w, uint32_t *out) {
    enum { CHUNK = 64 };
    const shd_frames *f = &sight->frames;
    size_t count = 0;
    const int cell = cell_of(sight, w);
    if (cell >= 0) {
        const uint32_t first = sight->cells[cell], end = sight->cells[cell + 1];
        if (sight->cells_across == 1)
            return look_at(sight, w, sight->celled + first, end - first, out);
        memcpy(out, sight->celled + first, (end - first) * sizeof *out); /* a tile is a cell */
        return end - first;
    }
    if (sight->cells) return look_at(sight, w, sight->order, sight->count, out);
    for (size_t first = 0; first < sight->count; first += CHUNK) {
        const size_t left = sight->count - first, size = left < CHUNK ? left : CHUNK;
        uint32_t reaches[CHUNK], any = 0;
        for (size_t i = 0; i < size; i++) {
            const size_t k = first + i;
            const shd_frame frame = {f->left[k], f->right[k], f->top[k], f->bottom[k]};
            reaches[i] = reaches_into(frame, w) ? 1 : 0;
            any |= reaches[i];
        }
        for (size_t i = 0; any && i < size; i++) {
            const uint32_t object = sight->order[first + i];
            if (reaches[i] && may_see(&sight->seen[object], w)) out[count++] = object;
        }
    }
    return count;
}

/* Whether an object may be seen through a window. */
static bool may_see_object(const shd_sight *sight, uint32_t object, const window *w) {
    const shd_seen_object *g = &sight->seen[object];
    return reaches_into(g->frame, w) && may_see(g, w) &&
           (!g->tube || may_meet_tube(sight, sight->items[object], w));
}

/* No ray through the window meets the object at a smaller depth. A plane is met where its height
 * above or below the eye is used up, of which each step of depth takes -(a p + b q + c). */
static double nearest_through(const shd_sight *sight, uint32_t object, const window *w) {
    const shd_item *it = sight->items[object];
    const shd_seen_object *g = &sight->seen[object];
    if (!it) return (double)g->nearest;
    const shd_vec3 v = g->outline.center;
    const double height = fabs(it->eye.y);
    if (it->shape != SHD_PLANE || sight->lens.camera->projection != SHD_PERSPECTIVE ||
        !(height > 1e-6 * shd_length(it->eye)))
        return (double)g->nearest;
    const double steepest =
        fabs(v.x) * w->across + fabs(v.y) * w->down - v.x * w->p - v.y * w->q - v.z;
    return steepest > 0 ? height / steepest : (double)INFINITY;
}

size_t shd_sight_seen(const shd_sight *sight, const shd_survey *s, size_t block, int part,
                      shd_seen out[SHD_SEEN_MOST]) {
    enum { SIDE = SHD_BLOCK_SIDE / 2 };
    const shd_block *at = &s->blocks[block];
    const size_t across = (size_t)s->across;
    if (at->next < s->candidate_count || at->count > SHD_SEEN_MOST) return SHD_SEEN_MANY;
    const window w =
        part == SHD_WHOLE
            ? s->windows[block]
            : make_window(&sight->lens,
                          s->rect.x + (int)(block % across) * SHD_BLOCK_SIDE + (part & 1) * SIDE,
                          s->rect.y + (int)(block / across) * SHD_BLOCK_SIDE + (part >> 1) * SIDE,
                          SIDE, SIDE);
    size_t count = 0;
    for (size_t k = 0; k < at->count; k++) {
        const uint32_t object = s->candidates[at->first + k];
        if (part == SHD_WHOLE || may_see_object(sight, object, &w))
            out[count++] = (shd_seen){object, nearest_through(sight, object, &w)};
    }
    return count;
}

/* Those of a quarter, which is at (x, y) in the picture, through which one of some objects may be
 * seen. Frames and tubes are left to larger windows. */
static uint64_t pixels_of(const shd_sight *sight, const shd_seen *seen, size_t count, int x,
                          int y) {
    enum { SIDE = SHD_BLOCK_SIDE / 2 };
    const shd_lens *lens = &sight->lens;
    window w = make_window(lens, x, y, 1, 1);
    const double p = w.p, q = w.q, hh = w.h * w.h;
    uint64_t out = 0;
    for (size_t k = 0; k < count; k++) {
        const shd_seen_object *g = &sight->seen[seen[k].object];
        for (int i = 0; i < SIDE * SIDE; i++) {
            w.p = p + i % SIDE * lens->step_x;
            w.q = q - i / SIDE * lens->step_y;
            w.k = sqrt(fmax(0, w.p * w.p + w.q * w.q + 1 - hh));
            out |= (uint64_t)may_see(g, &w) << (i / SIDE * SHD_BLOCK_SIDE + i % SIDE);
        }
    }
    return out;
}

uint64_t shd_sight_pixels(const shd_sight *sight, const shd_survey *s, size_t block) {
    enum { SIDE = SHD_BLOCK_SIDE / 2 };
    const size_t across = (size_t)s->across;
    const int x = s->rect.x + (int)(block % across) * SHD_BLOCK_SIDE,
              y = s->rect.y + (int)(block / across) * SHD_BLOCK_SIDE;
    uint64_t out = 0;
    for (int part = 0; part < SHD_QUARTERS; part++) {
        shd_seen seen[SHD_SEEN_MOST];
        const int right = (part & 1) * SIDE, down = (part >> 1) * SIDE;
        const size_t count = shd_sight_seen(sight, s, block, part, seen);
        if (count == SHD_SEEN_MANY) return ~(uint64_t)0;
        out |= pixels_of(sight, seen, count, x + right, y + down)
               << (down * SHD_BLOCK_SIDE + right);
    }
    return out;
}

void shd_survey_further(const shd_sight *sight, shd_survey *s, size_t index) {
    shd_block *block = &s->blocks[index];
    const uint32_t most = FURTHER * block->count;
    for (; block->next < s->candidate_count && block->count < most; block->next++) {
        const uint32_t object = s->candidates[block->next];
        if (may_see_object(sight, object, &s->windows[index]))
            s->candidates[block->first + block->count++] = object;
    }
}

/* The blocks in a row of `count` that [low, high] reaches into, first and last, if the row begins
 * at `from`. The edge between two is in both; not-a-number is in all. */
static void blocks_reached(float low, float high, int from, int count, int reached[2]) {
    const float first = (low - (float)from) / SHD_BLOCK_SIDE, /* a power of 2 */
        last = (high - (float)from) / SHD_BLOCK_SIDE, most = (float)count;
    reached[0] = !(first > 1)   ? 0
                 : first < most ? (int)first - ((float)(int)first == first)
                                : count - 1;
    reached[1] = !(last < most) ? count - 1 : last >= 0 ? (int)last : -1;
}

/* Lists candidates of all blocks, AT_FIRST of each. */
static void list_first(const shd_sight *sight, shd_survey *s) {
    const size_t blocks = (size_t)s->across * (size_t)s->down;
    size_t waiting = blocks;
    for (size_t k = 0; k < s->candidate_count && waiting; k++) {
        const uint32_t object = s->candidates[k];
        if (k + AHEAD < s->candidate_count) shd_fetch_seen(&sight->seen[s->candidates[k + AHEAD]]);
        const shd_frame *frame = &sight->seen[object].frame;
        int x[2], y[2];
        blocks_reached(frame->left, frame->right, s->rect.x, s->across, x);
        blocks_reached(frame->top, frame->bottom, s->rect.y, s->down, y);
        for (int row = y[0]; row <= y[1]; row++)
            for (int i = row * s->across + x[0]; i <= row * s->across + x[1]; i++) {
                shd_block *block = &s->blocks[i];
                if (block->count == AT_FIRST || !may_see_object(sight, object, &s->windows[i]))
                    continue;
                s->candidates[block->first + block->count++] = object;
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
    for (size_t i = 0; i < blocks; i++) {
        const int x = (int)(i % (size_t)out->across) * SHD_BLOCK_SIDE,
                  y = (int)(i / (size_t)out->across) * SHD_BLOCK_SIDE,
                  w = rect.w - x < SHD_BLOCK_SIDE ? rect.w - x : SHD_BLOCK_SIDE,
                  h = rect.h - y < SHD_BLOCK_SIDE ? rect.h - y : SHD_BLOCK_SIDE;
        out->blocks[i] = (shd_block){(uint32_t)(count * (i + 1)), 0, (uint32_t)count};
        if (count) out->windows[i] = make_window(&sight->lens, rect.x + x, rect.y + y, w, h);
    }
    list_first(sight, out);
    out->even = count == 1 && sight->seen[out->candidates[0]].is_ball;
}
