#include "render/tiles/keep.h"

#include <assert.h>
#include <string.h>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif
#include <nettle/sha2.h>

#include "shade/lighting.h"

/* ---- Keys. ---- */

/* A hash that nobody can make two pictures for. */
typedef struct sha256_ctx hash;

static void put_bytes(hash *h, const void *data, size_t size) {
    sha256_update(h, size, data);
}

static void put_count(hash *h, uint64_t value) {
    put_bytes(h, &value, sizeof value);
}

static void put_numbers(hash *h, const double *values, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const double value = values[i] + 0.0; /* -0 as 0 */
        put_bytes(h, &value, sizeof value);
    }
}

static void put_vec(hash *h, shd_vec3 v) {
    put_numbers(h, (const double[]){v.x, v.y, v.z}, 3);
}

/* If the request is cancelled, a key of a part is as good: nothing comes of it. */
static void put_array(hash *h, const void *data, size_t size, const atomic_bool *cancelled) {
    enum { AT_ONCE = 1 << 16 };
    for (size_t at = 0; at < size && !shd_is_cancelled(cancelled); at += AT_ONCE)
        put_bytes(h, (const char *)data + at, size - at < AT_ONCE ? size - at : AT_ONCE);
}

static void put_mesh(hash *h, const shd_mesh *mesh, size_t object, const atomic_bool *cancelled) {
    const bool again = mesh->shared && mesh->first < object;
    put_count(h, again ? 2 : mesh->kept != NULL);
    if (again) {
        put_count(h, mesh->first);
        return;
    }
    if (mesh->kept) {
        put_bytes(h, &mesh->kept->digest, sizeof mesh->kept->digest);
        return;
    }
    const uint64_t counts[] = {mesh->vertex_count, mesh->triangle_count, mesh->normals != NULL};
    put_bytes(h, counts, sizeof counts);
    const size_t vectors = 3 * mesh->vertex_count * sizeof(double);
    put_array(h, mesh->positions, vectors, cancelled);
    if (mesh->normals) put_array(h, mesh->normals, vectors, cancelled);
    put_count(h, mesh->uvs != NULL);
    if (mesh->uvs) put_array(h, mesh->uvs, 2 * mesh->vertex_count * sizeof *mesh->uvs, cancelled);
    put_array(h, mesh->indices, 3 * mesh->triangle_count * sizeof *mesh->indices, cancelled);
}

static void put_object(hash *h, const shd_object *object, size_t index,
                       const shd_plan_material *material, const atomic_bool *cancelled) {
    put_count(h, object->shape);
    put_numbers(h, (const double[]){object->radius, object->tube, object->height}, 3);
    put_vec(h, object->size);
    for (int r = 0; r < 3; r++) put_numbers(h, object->transform.linear[r], 3);
    put_vec(h, object->transform.origin);
    put_count(h, material->front_only);
    if (object->interpolation != SHD_PHONG) {
        const int faces[] = {-1, (int)object->interpolation, object->segments};
        put_bytes(h, faces, sizeof faces);
    }
    if (object->shape == SHD_MESH) put_mesh(h, object->mesh, index, cancelled);
}

static void put_geometry(hash *h, const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    const shd_raster *raster = &scene->raster;
    put_count(h, camera->projection);
    put_vec(h, camera->position);
    put_vec(h, camera->right);
    put_vec(h, camera->up);
    put_vec(h, camera->back);
    put_numbers(h, (const double[]){camera->fov, camera->height}, 2);
    const int numbers[] = {raster->width, raster->height, raster->x,      raster->y,
                           raster->w,     raster->h,      raster->samples};
    put_bytes(h, numbers, sizeof numbers);
    put_count(h, plan->split_positions);
    if (plan->charted) put_count(h, UINT64_MAX);               /* hits tell of triangles */
    if (shd_plan_is_draft(plan)) put_count(h, UINT64_MAX - 1); /* smooth blocks have fewer */
    put_count(h, scene->object_count);
    for (size_t o = 0; o < scene->object_count; o++)
        put_object(h, &scene->objects[o], o, &plan->materials[scene->objects[o].material],
                   plan->cancelled);
}

static void put_light(hash *h, const shd_plan_light *light) {
    /* Their places in the scene's list tell which lights are summed in f32 together. */
    put_count(h, light->index / SHD_LIGHT_GROUP);
    put_count(h, (unsigned)light->directional | (unsigned)light->attenuated << 1 |
                     (unsigned)light->spot << 2);
    put_vec(h, light->position);
    put_vec(h, light->toward);
    put_vec(h, light->axis);
    put_numbers(h, light->color, 3);
    const double numbers[] = {
        light->a,     light->b,     light->c,       light->gain, light->min_distance,
        light->outer, light->inner, light->exponent};
    put_numbers(h, numbers, sizeof numbers / sizeof numbers[0]);
}

/* Where patterns are and what they multiply, but no color. */
static void put_textures(hash *h, const shd_plan_textures *textures) {
    put_count(h, UINT64_MAX);
    put_count(h, textures->slot_count);
    for (size_t e = 0; e < textures->slot_count; e++) {
        const shd_plan_slot *slot = &textures->slots[e];
        const shd_pattern *p = &textures->patterns[slot->pattern];
        const uint64_t counts[] = {slot->of, slot->term, p->kind, p->wrap, (uint64_t)p->octaves};
        put_bytes(h, counts, sizeof counts);
        put_numbers(h, &p->map[0][0], 6);
        put_numbers(h, &p->width, 1);
        if (!p->picture) continue;
        put_bytes(h, p->picture->texels->key.bytes, sizeof p->picture->texels->key.bytes);
        put_count(h, (uint64_t)p->channel);
    }
}

static void put_colors(hash *h, const shd_plan_material *material) {
    put_numbers(h, material->constant, 3);
    put_numbers(h, material->diffuse, 3);
    for (size_t k = 0; k < material->lobe_count; k++)
        put_numbers(h, material->lobes[k].specular, 3);
}

static void put_lights(hash *h, const shd_plan *plan) {
    const uint64_t counts[] = {plan->tier, plan->grey_lights, plan->light_count, plan->group_count,
                               plan->scene->light_count /* lobes are cut by it */};
    put_bytes(h, counts, sizeof counts);
    for (size_t j = 0; j < plan->light_count; j++) put_light(h, &plan->lights[j]);
    if (shd_plan_is_draft(plan)) /* which blocks are smooth, within what a budget leaves, too */
        put_numbers(h, (const double[]){plan->mean_room.absolute, plan->mean_room.relative}, 2);
    for (size_t g = 0; g < plan->group_count; g++) {
        if (shd_is_cancelled(plan->cancelled)) return;
        const shd_plan_group *group = &plan->groups[g];
        /* Colors matter only by which terms there are. */
        const shd_plan_material *material = &plan->materials[group->material];
        put_count(h, material->has_diffuse);
        put_count(h, material->lobe_count);
        for (size_t k = 0; k < material->lobe_count; k++)
            put_numbers(h, &material->lobes[k].shininess, 1);
        if (material->textures) put_textures(h, material->textures);
        if (shd_plan_is_draft(plan)) put_colors(h, material); /* the same */
        /* A material's sums leave out lights whose color it has nothing of. */
        put_count(h, group->light_count);
        put_bytes(h, group->lights, group->light_count * sizeof *group->lights);
    }
    for (size_t o = 0; o < plan->scene->object_count; o++) put_count(h, plan->objects[o].group);
}

/* The key of all that was put so far. More may follow. */
static shd_reuse_key key_of(const hash *h) {
    hash ended = *h;
    shd_reuse_key key;
    sha256_digest(&ended, sizeof key, (uint8_t *)&key);
    return key;
}

/* The keys of all that hits and fragments depend on. False: they are not kept, as are none of an
 * extended plan, whose tier is the exact one. */
static bool find_keys(const shd_plan *plan, shd_reuse_key *geometry, shd_reuse_key *light) {
    const shd_scene *scene = plan->scene;
    if (plan->tier == SHD_EXACT || plan->plane_count > 1 || plan->drop_tolerance > 0) return false;
    if (plan->extended) return false; /* keys know nothing of models */
    if (plan->sketched) return false; /* sketches have neither hits nor sums */
    for (int k = SHD_LAYER_NORMAL; k < SHD_LAYER_KINDS; k++)
        if (plan->wants[k]) return false;
    for (size_t o = 0; o < scene->object_count; o++)
        if (scene->objects[o].interpolation != SHD_PHONG &&
            !plan->groups[plan->objects[o].group].faceted)
            return false; /* its colors are in its light */
    hash h;
    sha256_init(&h);
    put_geometry(&h, plan);
    *geometry = key_of(&h);
    put_lights(&h, plan);
    *light = key_of(&h);
    return true;
}

/* ---- Records. ---- */

shd_recall shd_recall_open(shd_reuse *reuse, const shd_plan *plan) {
    shd_recall recall = {0};
    shd_reuse_key geometry, light;
    if (!shd_reuse_keeps(reuse) || !find_keys(plan, &geometry, &light)) return recall;
    recall.light = shd_reuse_find(reuse, SHD_RECORD_LIGHT, light);
    if (recall.light) return recall;
    const size_t tiles = shd_tile_count(&plan->scene->raster);
    recall.keep_light = shd_record_new(reuse, SHD_RECORD_LIGHT, light, tiles);
    recall.geometry = shd_reuse_find(reuse, SHD_RECORD_GEOMETRY, geometry);
    if (!recall.geometry)
        recall.keep_geometry = shd_record_new(reuse, SHD_RECORD_GEOMETRY, geometry, tiles);
    return recall;
}

void shd_recall_close(shd_recall *recall, bool complete) {
    if (complete && recall->keep_light) shd_record_publish(recall->keep_light);
    if (complete && recall->keep_geometry) shd_record_publish(recall->keep_geometry);
    shd_record_drop((shd_record *)recall->light);
    shd_record_drop((shd_record *)recall->geometry);
    shd_record_drop(recall->keep_light);
    shd_record_drop(recall->keep_geometry);
    *recall = (shd_recall){0};
}

/* ---- What a tile leaves: arrays side by side, in one piece of its record's memory. ---- */

enum { ALIGNED = 64 };

/* A piece without memory only counts what it takes. */
typedef struct piece {
    char *memory;
    size_t size;
} piece;

/* The next array of a piece. */
static void *next_array(piece *p, size_t size) {
    void *array = p->memory ? p->memory + p->size : NULL;
    p->size += (size + ALIGNED - 1) / ALIGNED * ALIGNED;
    return array;
}

static void *copy_array(piece *p, const void *from, size_t size) {
    void *to = next_array(p, size);
    return to ? memcpy(to, from, size) : NULL;
}

/* stream_array copies past the caches, if there are instructions for it. What is kept is not read
 * soon and would push out what is, and its lines need not be read before they are written.
 * finish_streams makes what was streamed visible to others. */
#if defined(__SSE2__)
static void *stream_array(piece *p, const void *from, size_t size) {
    void *to = next_array(p, size);
    if (!to) return NULL;
    const __m128i *in = from;
    __m128i *out = to;
    for (size_t line = 0; line < size / ALIGNED; line++, in += 4, out += 4)
        for (int k = 0; k < 4; k++) _mm_stream_si128(out + k, _mm_loadu_si128(in + k));
    memcpy(out, in, size % ALIGNED);
    return to;
}
#define finish_streams() _mm_sfence()
#else
#define stream_array     copy_array
#define finish_streams() (void)0
#endif

/* ---- Fragments. ---- */

static shd_fragments *copy_fragments(piece *p, const shd_plan *plan, const shd_fragments *from) {
    const size_t arrays = shd_sum_of(plan, 1, 0, 0), count = from->count;
    const size_t channels = plan->grey_lights ? 1 : 3;
    shd_fragments counted, *made = next_array(p, sizeof *made), *to = made ? made : &counted;
    *to = (shd_fragments){.count = count, .capacity = count, .run_count = from->run_count};
    if (!count) return made;
    to->cell = copy_array(p, from->cell, count * sizeof *to->cell);
    to->runs = copy_array(p, from->runs, from->run_count * sizeof *to->runs);
    if (from->coverage) to->coverage = copy_array(p, from->coverage, count * sizeof *to->coverage);
    size_t terms = 0; /* of the run that has most: other sums are not copied */
    for (size_t r = 0; r < from->run_count; r++) {
        const size_t some = shd_terms_of(plan, from->runs[r].group);
        terms = some > terms ? some : terms;
    }
    to->sums = next_array(p, arrays * sizeof *to->sums);
    for (size_t k = 0; k < arrays; k++) {
        const bool used = k / 3 < terms && k % 3 < channels;
        float *sum = used ? stream_array(p, from->sums[k], count * sizeof *sum) : NULL;
        if (to->sums) to->sums[k] = sum;
    }
    return made;
}

void shd_keep_fragments(shd_record *record, size_t tile, const shd_plan *plan,
                        const shd_fragments *from) {
    piece counted = {NULL, 0};
    copy_fragments(&counted, plan, from);
    piece taken = {shd_record_alloc(record, counted.size), 0};
    if (!taken.memory) return;
    shd_record_put(record, tile, copy_fragments(&taken, plan, from));
    assert(taken.size == counted.size);
    finish_streams();
}

/* ---- Hits. ---- */

/* `alike`: of one object. There is room for whole vectors from wherever a run begins. */
static shd_kept_cast *copy_cast(piece *p, const shd_plan *plan, const uint16_t *shot_cell,
                                size_t shots, const shd_hits *hits, bool alike) {
    const size_t count = hits->count,
                 room = (count + SHD_LANES - 1) / SHD_LANES * SHD_LANES + SHD_LANES,
                 floats = room * sizeof(float);
    shd_kept_cast counted, *made = next_array(p, sizeof *made), *to = made ? made : &counted;
    *to = (shd_kept_cast){.shots = shots, .hits = {.count = count, .capacity = room}};
    to->shot_cell = copy_array(p, shot_cell, shots * sizeof *shot_cell);
    if (!count) return made;
    to->object = hits->object[0];
    /* If all shots hit, shot[i] is i. */
    if (count != shots) to->hits.shot = copy_array(p, hits->shot, room * sizeof *hits->shot);
    if (!alike) to->hits.object = copy_array(p, hits->object, room * sizeof *hits->object);
    for (int c = 0; c < 3; c++) {
        to->hits.position32[c] = stream_array(p, hits->position32[c], floats);
        to->hits.normal32[c] = stream_array(p, hits->normal32[c], floats);
        to->hits.mirror32[c] = stream_array(p, hits->mirror32[c], floats);
        if (plan->split_positions) to->hits.low32[c] = stream_array(p, hits->low32[c], floats);
    }
    if (plan->charted) {
        to->hits.triangle = copy_array(p, hits->triangle, count * sizeof *hits->triangle);
        to->hits.u = copy_array(p, hits->u, count * sizeof *hits->u);
        to->hits.v = copy_array(p, hits->v, count * sizeof *hits->v);
    }
    return made;
}

void shd_keep_cast(shd_record *record, size_t tile, const shd_plan *plan, const uint16_t *shot_cell,
                   size_t shots, const shd_hits *hits) {
    const bool alike = shd_is_one_object(hits);
    piece counted = {NULL, 0};
    copy_cast(&counted, plan, shot_cell, shots, hits, alike);
    piece taken = {shd_record_alloc(record, counted.size), 0};
    if (!taken.memory) return;
    shd_kept_cast *to = copy_cast(&taken, plan, shot_cell, shots, hits, alike);
    assert(taken.size == counted.size);
    finish_streams();
    shd_kept_cast *first = (shd_kept_cast *)shd_record_get(record, tile), *last = first;
    while (last && last->next) last = last->next;
    if (last)
        last->next = to;
    else
        shd_record_put(record, tile, to);
}

void shd_recall_cast(const shd_kept_cast *cast, shd_hits *room, shd_hits *out) {
    *out = cast->hits;
    if (!out->count) return;
    if (!out->shot) {
        out->shot = room->shot;
        for (size_t i = 0; i < out->capacity; i++) out->shot[i] = (uint32_t)i;
    }
    if (!out->object) {
        out->object = room->object;
        for (size_t i = 0; i < out->capacity; i++) out->object[i] = cast->object;
    }
}
