/* A mesh by itself: as JSON, or the same arrays as plain numbers. */
#include <assert.h>
#include <endian.h>
#include <stdio.h>
#include <string.h>

#include "base/bits.h"
#include "base/json_memory.h"
#include "scene/read.h"

/* ---- The plain form ---- */

enum { WITH_NORMALS = 1, WITH_UVS = 2, HEAD = 12 /* bytes */ };

typedef struct plain {
    const unsigned char *bytes;
    size_t at; /* where the next array begins */
    uint64_t vertices, indices;
    uint32_t flags;
    shd_arena *arena;
    shd_report *report;
    shd_json *json;
} plain;

static uint32_t word_at(const plain *p, size_t offset) {
    uint32_t word;
    memcpy(&word, p->bytes + offset, sizeof word);
    return le32toh(word);
}

/* Counts are 32 bits: nothing overflows. */
static bool check_length(const plain *p, size_t length) {
    const bool normals = p->flags & WITH_NORMALS, uvs = p->flags & WITH_UVS;
    const uint64_t floats = p->vertices * (3 + (normals ? 3 : 0) + (uvs ? 2 : 0)),
                   needed = HEAD + 4 * (floats + p->indices);
    if (length == needed) return true;
    shd_report_error(
        p->report, SHD_SCENE, "",
        "%llu vertices%s%s%s and %llu indices are %llu bytes with their head: there are "
        "%zu",
        (unsigned long long)p->vertices, normals || uvs ? " with " : "", normals ? "normals" : "",
        uvs ? normals ? " and uvs" : "uvs" : "", (unsigned long long)p->indices,
        (unsigned long long)needed, length);
    return false;
}

static bool read_head(plain *p, size_t length) {
    if (length < HEAD) {
        shd_report_error(p->report, SHD_SCENE, "",
                         "a mesh begins with 12 bytes, its counts of vertices and of indices and "
                         "its flags: there are %zu",
                         length);
        return false;
    }
    p->vertices = word_at(p, 0);
    p->indices = word_at(p, 4);
    p->flags = word_at(p, 8);
    if (p->flags & ~(uint32_t)(WITH_NORMALS | WITH_UVS))
        shd_report_error(p->report, SHD_SCENE, "",
                         "byte 8: the flags are %lu: there are 1, for normals, and 2, for uvs",
                         (unsigned long)p->flags);
    else
        return check_length(p, length);
    return false;
}

static void check_finite(const plain *p, const char *key, const double *values, size_t count) {
    enum { NAMED = 3 };
    size_t wrong = 0;
    char pointer[64];
    for (size_t i = 0; i < count; i++) {
        if (isfinite(values[i]) || ++wrong > NAMED) continue;
        snprintf(pointer, sizeof pointer, "/%s/%zu", key, i);
        shd_report_error(p->report, SHD_SCENE, pointer, "byte %zu: the number is not finite",
                         p->at + 4 * i);
    }
    snprintf(pointer, sizeof pointer, "/%s", key);
    if (wrong > NAMED)
        shd_report_error(p->report, SHD_SCENE, pointer, "%zu more numbers are not finite",
                         wrong - NAMED);
}

/* Reads the next array. It is like a long one of JSON: the tree has its index among the packs. */
static bool read_array(plain *p, const char *key, size_t count, bool floats) {
    double *values = shd_arena_alloc(p->arena, count, sizeof *values);
    if (!values) return false;
    for (size_t i = 0; i < count; i++) {
        const uint32_t word = word_at(p, p->at + 4 * i);
        values[i] = floats ? (double)shd_float_of(word) : word;
    }
    if (floats) check_finite(p, key, values, count);
    p->at += 4 * count;
    shd_packs *packs = &p->json->packs;
    json_t *index = json_integer((json_int_t)packs->count);
    packs->arrays[packs->count++] = (shd_numbers){values, count, 0, 0};
    return !json_object_set_new(p->json->tree, key, index);
}

/* The tree that the reader of JSON would have made of it. */
static bool read_plain(const void *data, size_t length, shd_arena *arena, shd_json *out,
                       shd_report *report) {
    shd_json json = {.packs = {.arrays = shd_arena_alloc(arena, 4, sizeof(shd_numbers))}};
    plain p = {.bytes = data, .at = HEAD, .arena = arena, .report = report, .json = &json};
    if (!read_head(&p, length)) return false;
    shd_json_memory_watch();
    json.tree = json_object();
    const bool made =
        json.tree && json.packs.arrays && read_array(&p, "positions", 3 * p.vertices, true) &&
        (!(p.flags & WITH_NORMALS) || read_array(&p, "normals", 3 * p.vertices, true)) &&
        (!(p.flags & WITH_UVS) || read_array(&p, "uvs", 2 * p.vertices, true)) &&
        (!p.indices || read_array(&p, "indices", p.indices, false));
    assert(!made || p.at == length); /* as check_length has found */
    if (!made) shd_report_error(report, SHD_MEMORY, "", "there is not enough memory for the mesh");
    *out = json;
    if (report->status != SHD_OK) json_decref(json.tree);
    return report->status == SHD_OK;
}

/* ---- Either form ---- */

static const shd_mesh *read_members(shd_reader *r, json_t *tree) {
    static const shd_field fields[] = {
        {"positions", shd_keep_value, .offset = offsetof(shd_mesh_source, positions)},
        {"indices", shd_keep_value, .offset = offsetof(shd_mesh_source, indices)},
        {"normals", shd_keep_value, .offset = offsetof(shd_mesh_source, normals)},
        {"uvs", shd_keep_value, .offset = offsetof(shd_mesh_source, uvs)},
    };
    const shd_node root = {.value = tree};
    shd_mesh_source source = {.positions = NULL};
    if (!shd_read_fields(r, &root, fields, SHD_LENGTH(fields), 0, "a mesh", &source)) return NULL;
    if (!source.positions) shd_wrong(r, &root, "the member \"positions\" is missing");
    const shd_mesh *mesh = shd_make_mesh(r, &root, &source);
    shd_hold_to_limit(r, &root, "the mesh has", r->triangles, SHD_LIMIT_TRIANGLES,
                      r->limits->triangles);
    return mesh;
}

shd_status shd_mesh_read(const void *data, size_t length, bool binary, const shd_limits *limits,
                         const atomic_bool *cancelled, shd_arena *arena, const shd_mesh **out,
                         shd_report *report) {
    shd_json json;
    if (!(binary ? read_plain(data, length, arena, &json, report)
                 : shd_json_parse(data, length, limits->memory, false, cancelled, arena, &json,
                                  report)))
        return report->status;
    shd_reader r = {
        .limits = limits, .cancelled = cancelled, .arena = arena, .json = &json, .report = report};
    const shd_mesh *mesh = read_members(&r, json.tree);
    shd_json_drop(&json, arena);
    if (shd_is_cancelled(cancelled)) {
        shd_report_init(report, arena);
        shd_report_error(report, SHD_CANCELLED, "", "the reading was cancelled");
    }
    if (report->status == SHD_OK) *out = mesh;
    return report->status;
}
