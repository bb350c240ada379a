/* Meshes: long arrays, checked item by item without a node for each. */
#include <math.h>
#include <stdio.h>

#include "scene/read.h"

/* A mesh with one mistake often has it a million times: the first few are named, then counted. */
enum { NAMED = 3 };

typedef struct tally {
    shd_reader *r;
    const shd_node *array;
    size_t count;
} tally;

static bool may_name(tally *t) {
    return ++t->count <= NAMED;
}

static void count_rest(const tally *t, const char *what) {
    if (t->count > NAMED)
        shd_node_fail(t->r->report, t->array, SHD_SCENE, "%zu more %s are wrong", t->count - NAMED,
                      what);
}

/* An array in threes; `what` names its items. */
static bool in_threes(shd_reader *r, const shd_node *node, const char *what) {
    if (!json_is_array(node->value)) {
        shd_node_expect(r->report, node, "an array of numbers");
        return false;
    }
    size_t size = json_array_size(node->value);
    if (size > 0 && size % 3 == 0) return true;
    shd_node_fail(r->report, node, SHD_SCENE, "expected %s in threes, got %zu numbers", what, size);
    return false;
}

/* Where `out` is NULL the numbers are checked only. */
static void read_numbers(shd_reader *r, const shd_node *node, const char *what, double *out) {
    tally bad = {r, node, 0};
    size_t size = json_array_size(node->value);
    for (size_t i = 0; i < size; i++) {
        const json_t *item = json_array_get(node->value, i);
        if (!json_is_real(item) && may_name(&bad)) {
            shd_node at = shd_node_item(node, i);
            shd_node_expect(r->report, &at, "a number");
        }
        if (out) out[i] = json_real_value(item);
    }
    count_rest(&bad, what);
}

/* The same; `vertices` 0: their number is not known. */
static void read_indices(shd_reader *r, const shd_node *node, size_t vertices, uint32_t *out) {
    tally bad = {r, node, 0};
    size_t size = json_array_size(node->value);
    char most[32] = "";
    if (vertices) snprintf(most, sizeof most, " to %zu", vertices - 1);
    double end = vertices ? (double)vertices : INFINITY;
    for (size_t i = 0; i < size; i++) {
        const json_t *item = json_array_get(node->value, i);
        double value = json_is_real(item) ? json_real_value(item) : -1;
        if (value >= 0 && value < end && value == floor(value)) {
            if (out) out[i] = (uint32_t)value;
        } else if (may_name(&bad)) {
            shd_node at = shd_node_item(node, i);
            if (json_is_real(item))
                shd_node_fail(r->report, &at, SHD_SCENE,
                              "an index must be an integer from 0%s, got %.9g", most, value);
            else
                shd_node_expect(r->report, &at, "an index");
        }
    }
    count_rest(&bad, "indices");
}

static bool is_zero(const json_t *number) {
    return json_is_real(number) && json_real_value(number) == 0;
}

static void check_normals(shd_reader *r, const shd_node *node) {
    tally bad = {r, node, 0};
    size_t size = json_array_size(node->value);
    for (size_t i = 0; i + 2 < size; i += 3) {
        if (!is_zero(json_array_get(node->value, i)) ||
            !is_zero(json_array_get(node->value, i + 1)) ||
            !is_zero(json_array_get(node->value, i + 2)) || !may_name(&bad))
            continue;
        shd_node at = shd_node_item(node, i);
        shd_node_fail(r->report, &at, SHD_SCENE, "the normal of vertex %zu is zero", i / 3);
    }
    count_rest(&bad, "normals");
}

const shd_mesh *shd_make_mesh(shd_reader *r, const shd_node *node, const shd_mesh_source *source) {
    shd_node at = {node, "positions", 0, source->positions};
    shd_node at_indices = {node, "indices", 0, source->indices};
    shd_node at_normals = {node, "normals", 0, source->normals};
    bool has_indices = at_indices.value && !json_is_null(at_indices.value);
    bool has_normals = at_normals.value && !json_is_null(at_normals.value);
    size_t errors = r->report->error_count;

    /* The arrays' sizes, before anything is made for what they hold. */
    bool whole = at.value && in_threes(r, &at, "positions");
    size_t size = json_array_size(at.value);
    size_t vertices = size / 3 + (size % 3 > 0), triangles = vertices / 3;
    if (has_indices) {
        in_threes(r, &at_indices, "indices");
        triangles = json_array_size(at_indices.value) / 3;
    } else if (whole && vertices % 3) {
        shd_node_fail(r->report, &at, SHD_SCENE,
                      "without `indices` every three positions are a triangle; there are %zu",
                      vertices);
    }
    if (has_normals && in_threes(r, &at_normals, "normals") && whole &&
        json_array_size(at_normals.value) != size)
        shd_node_fail(r->report, &at_normals, SHD_SCENE,
                      "expected as many normals as positions, %zu numbers, got %zu", size,
                      json_array_size(at_normals.value));
    if (vertices > UINT32_MAX)
        shd_node_fail(r->report, &at, SHD_SCENE, "a mesh has at most 4294967295 positions");
    r->triangles += triangles; /* too many are reported once for all objects */

    shd_mesh *mesh = NULL;
    double *positions = NULL, *normals = NULL;
    uint32_t *indices = NULL;
    if (whole && r->report->error_count == errors && r->triangles <= r->limits->triangles) {
        mesh = shd_take(r, 1, sizeof *mesh);
        positions = shd_take(r, vertices, 3 * sizeof *positions);
        indices = shd_take(r, triangles, 3 * sizeof *indices);
        if (has_normals) normals = shd_take(r, vertices, 3 * sizeof *normals);
    }
    read_numbers(r, &at, "positions", positions);
    if (has_indices)
        read_indices(r, &at_indices, vertices, indices);
    else if (indices)
        for (size_t i = 0; i < 3 * triangles; i++) indices[i] = (uint32_t)i;
    if (has_normals) {
        read_numbers(r, &at_normals, "normals", normals);
        check_normals(r, &at_normals);
    }
    if (!mesh || r->report->error_count > errors) return NULL;
    *mesh = (shd_mesh){vertices, triangles, positions, normals, indices};
    return mesh;
}
