/* Meshes: long arrays, checked item by item without a node for each. */
#include <math.h>

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

static bool is_clean(const tally *t, const char *what) {
    if (t->count > NAMED)
        shd_node_fail(t->r->report, t->array, SHD_SCENE, "%zu more %s are wrong", t->count - NAMED,
                      what);
    return t->count == 0;
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

static bool read_numbers(shd_reader *r, const shd_node *node, const char *what, double *out) {
    tally bad = {r, node, 0};
    size_t size = json_array_size(node->value);
    for (size_t i = 0; i < size; i++) {
        const json_t *item = json_array_get(node->value, i);
        if (json_is_real(item)) {
            out[i] = json_real_value(item);
        } else if (may_name(&bad)) {
            shd_node at = shd_node_item(node, i);
            shd_node_expect(r->report, &at, "a number");
        }
    }
    return is_clean(&bad, what);
}

static bool read_indices(shd_reader *r, const shd_node *node, size_t vertices, uint32_t *out) {
    tally bad = {r, node, 0};
    size_t size = json_array_size(node->value);
    for (size_t i = 0; i < size; i++) {
        const json_t *item = json_array_get(node->value, i);
        double value = json_is_real(item) ? json_real_value(item) : -1;
        if (value >= 0 && value < (double)vertices && value == floor(value)) {
            out[i] = (uint32_t)value;
        } else if (may_name(&bad)) {
            shd_node at = shd_node_item(node, i);
            if (json_is_real(item))
                shd_node_fail(r->report, &at, SHD_SCENE,
                              "an index must be an integer from 0 to %zu, got %.9g", vertices - 1,
                              value);
            else
                shd_node_expect(r->report, &at, "an index");
        }
    }
    return is_clean(&bad, "indices");
}

static bool check_normals(shd_reader *r, const shd_node *node, size_t vertices,
                          const double *normals) {
    tally bad = {r, node, 0};
    for (size_t i = 0; i < vertices; i++) {
        const double *n = normals + 3 * i;
        if (n[0] != 0 || n[1] != 0 || n[2] != 0 || !may_name(&bad)) continue;
        shd_node at = shd_node_item(node, 3 * i);
        shd_node_fail(r->report, &at, SHD_SCENE, "the normal of vertex %zu is zero", i);
    }
    return is_clean(&bad, "normals");
}

static const double *read_normals(shd_reader *r, const shd_node *node, size_t vertices) {
    if (!in_threes(r, node, "normals")) return NULL;
    size_t size = json_array_size(node->value);
    if (size != 3 * vertices) {
        shd_node_fail(r->report, node, SHD_SCENE,
                      "expected as many normals as positions, %zu numbers, got %zu", 3 * vertices,
                      size);
        return NULL;
    }
    double *normals = shd_take(r, size, sizeof *normals);
    if (!normals || !read_numbers(r, node, "normals", normals)) return NULL;
    return check_normals(r, node, vertices, normals) ? normals : NULL;
}

/* Indices of consecutive triangles where the document has none. */
static const uint32_t *make_indices(shd_reader *r, const shd_node *node, size_t vertices,
                                    size_t triangles) {
    uint32_t *indices = shd_take(r, triangles, 3 * sizeof *indices);
    if (!indices) return NULL;
    if (node->value) return read_indices(r, node, vertices, indices) ? indices : NULL;
    for (size_t i = 0; i < 3 * triangles; i++) indices[i] = (uint32_t)i;
    return indices;
}

const shd_mesh *shd_make_mesh(shd_reader *r, const shd_node *node, const shd_mesh_source *source) {
    shd_node at = {node, "positions", 0, source->positions};
    shd_node at_indices = {node, "indices", 0, source->indices};
    shd_node at_normals = {node, "normals", 0, source->normals};
    const bool has_normals = at_normals.value && !json_is_null(at_normals.value);
    size_t errors = r->report->error_count;
    if (at.value)
        in_threes(r, &at, "positions");
    else
        shd_node_fail(r->report, node, SHD_SCENE, "the member \"positions\" is missing");
    if (at_indices.value) in_threes(r, &at_indices, "indices");
    if (r->report->error_count > errors) {
        if (has_normals) in_threes(r, &at_normals, "normals");
        return NULL;
    }
    size_t vertices = json_array_size(at.value) / 3, triangles = vertices / 3;
    if (at_indices.value) {
        triangles = json_array_size(at_indices.value) / 3;
    } else if (vertices % 3) {
        shd_node_fail(r->report, &at, SHD_SCENE,
                      "without `indices` every three positions are a triangle; there are %zu",
                      vertices);
        return NULL;
    }
    if (vertices > UINT32_MAX) {
        shd_node_fail(r->report, &at, SHD_SCENE, "a mesh has at most 4294967295 positions");
        return NULL;
    }
    r->triangles += triangles;
    if (r->triangles > r->limits->triangles) return NULL; /* reported once for all objects */

    shd_mesh *mesh = shd_take(r, 1, sizeof *mesh);
    double *positions = shd_take(r, vertices, 3 * sizeof *positions);
    if (!mesh || !positions) return NULL;
    read_numbers(r, &at, "positions", positions);
    *mesh = (shd_mesh){.vertex_count = vertices,
                       .triangle_count = triangles,
                       .positions = positions,
                       .indices = make_indices(r, &at_indices, vertices, triangles)};
    if (has_normals) mesh->normals = read_normals(r, &at_normals, vertices);
    return r->report->error_count == errors ? mesh : NULL;
}
