/* Meshes: long arrays, checked item by item without a node for each. */
#include <stdio.h>
#include <string.h>

#include "scene/read.h"

/* A mesh with one mistake often has it a million times. The first few are named, the rest are
 * counted. */
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
        shd_node_report(t->r->report, t->array, SHD_SCENE, "%zu more %s are wrong",
                        t->count - NAMED, what);
}

/* An array of numbers, which is packed or read item by item. */
typedef struct list {
    shd_node node;
    shd_numbers numbers;
} list;

static list list_of(const shd_reader *r, const shd_node *parent, const char *key, json_t *value) {
    return (list){{parent, key, 0, value}, shd_json_numbers(r->json, value)};
}

/* Whether item i is a number. */
static bool get_number(const list *l, size_t i, double *out) {
    if (l->numbers.values) {
        *out = l->numbers.values[i];
        return true;
    }
    const json_t *item = json_array_get(l->node.value, i);
    *out = json_real_value(item);
    return json_is_real(item);
}

/* Checks that an array comes in threes, or in twos; `what` names its items. */
static bool in_groups(shd_reader *r, const list *l, const char *what, size_t of) {
    if (!l->numbers.values && !json_is_array(l->node.value)) {
        shd_node_expect(r->report, &l->node, "an array of numbers");
        return false;
    }
    const size_t size = l->numbers.count;
    if (size > 0 && size % of == 0) return true;
    shd_wrong(r, &l->node, "expected %s in %s, got %zu numbers", what, of == 3 ? "threes" : "twos",
              size);
    return false;
}

static bool in_threes(shd_reader *r, const list *l, const char *what) {
    return in_groups(r, l, what, 3);
}

/* Reads the array's numbers. If `wanted` is false, or one item is no number, they are only
 * checked. */
static const double *read_numbers(shd_reader *r, const list *l, const char *what, bool wanted) {
    if (l->numbers.values) return l->numbers.values;
    tally bad = {r, &l->node, 0};
    double value, *out = wanted ? shd_take(r, l->numbers.count, sizeof *out) : NULL;
    for (size_t i = 0; i < l->numbers.count && !shd_is_cancelled_at(r->cancelled, i); i++) {
        if (!get_number(l, i, &value) && may_name(&bad)) {
            shd_node at = shd_node_item(&l->node, i);
            shd_node_expect(r->report, &at, "a number");
        }
        if (out) out[i] = value;
    }
    count_rest(&bad, what);
    return out;
}

/* Makes indices below `end` of numbers. False: one of them is none. */
static bool take_indices(const double *values, size_t count, int32_t end, uint32_t *out) {
    uint32_t wrong = 0;
    for (size_t i = 0; i < count; i++) {
        const double least = values[i] > 0 ? values[i] : 0, held = least < end ? least : end;
        const int32_t index = (int32_t)held;
        wrong |= (uint32_t)(index != values[i]) | (uint32_t)(index >= end);
        out[i] = (uint32_t)index;
    }
    return !wrong;
}

/* Reads packed indices, piece by piece, up to the first piece that has one that is wrong. Returns
 * how many these are. */
static size_t read_right_indices(const shd_reader *r, const list *l, double end, uint32_t *out) {
    enum { PIECE = 1024 };
    const double *values = l->numbers.values;
    const size_t count = l->numbers.count;
    size_t i = 0;
    if (!values || !out || !(end <= INT32_MAX)) return 0;
    while (i < count && !shd_is_cancelled(r->cancelled)) {
        const size_t left = count - i, some = left < PIECE ? left : PIECE;
        if (!take_indices(values + i, some, (int32_t)end, out + i)) break;
        i += some;
    }
    return i;
}

/* Reads indices. If `vertices` is 0, the number of vertices is not known. `out` may be NULL. */
static void read_indices(shd_reader *r, const list *l, size_t vertices, uint32_t *out) {
    tally bad = {r, &l->node, 0};
    char most[32] = "";
    if (vertices) snprintf(most, sizeof most, " to %zu", vertices - 1);
    double value, end = vertices ? (double)vertices : INFINITY;
    const size_t right = read_right_indices(r, l, end, out);
    for (size_t i = right; i < l->numbers.count && !shd_is_cancelled_at(r->cancelled, i); i++) {
        const bool number = get_number(l, i, &value);
        if (number && value >= 0 && value < end && value == floor(value)) {
            if (out) out[i] = (uint32_t)value;
        } else if (may_name(&bad)) {
            shd_node at = shd_node_item(&l->node, i);
            if (number)
                shd_wrong(r, &at, "an index must be an integer from 0%s, got %.9g", most, value);
            else
                shd_node_expect(r->report, &at, "an index");
        }
    }
    count_rest(&bad, "indices");
}

static bool is_zero(const list *l, size_t i) {
    double value;
    return get_number(l, i, &value) && value == 0;
}

static void check_normals(shd_reader *r, const list *l) {
    tally bad = {r, &l->node, 0};
    for (size_t i = 0; i + 2 < l->numbers.count; i += 3) {
        if (shd_is_cancelled_at(r->cancelled, i)) return;
        if (!is_zero(l, i) || !is_zero(l, i + 1) || !is_zero(l, i + 2) || !may_name(&bad)) continue;
        shd_node at = shd_node_item(&l->node, i);
        shd_wrong(r, &at, "the normal of vertex %zu is zero", i / 3);
    }
    count_rest(&bad, "normals");
}

/* Counts triangles whose normals point to their back. The order of corners decides which side of a
 * triangle is seen; normals of the other side are then negated, and light the mesh from within. */
static size_t count_inverted(const shd_reader *r, const shd_mesh *mesh) {
    size_t inverted = 0;
    for (size_t i = 0; i < mesh->triangle_count && !shd_is_cancelled_at(r->cancelled, i); i++) {
        const uint32_t *corner = mesh->indices + 3 * i;
        const shd_vec3 a = shd_vec3_at(mesh->positions, corner[0]),
                       ab = shd_sub(shd_vec3_at(mesh->positions, corner[1]), a),
                       ac = shd_sub(shd_vec3_at(mesh->positions, corner[2]), a);
        shd_vec3 sum = {0, 0, 0};
        for (int k = 0; k < 3; k++) sum = shd_add(sum, shd_vec3_at(mesh->normals, corner[k]));
        inverted += shd_dot(shd_cross(ab, ac), sum) < 0;
    }
    return inverted;
}

static void warn_of_inverted_normals(shd_reader *r, const shd_node *node, const shd_mesh *mesh) {
    if (mesh->inverted > mesh->triangle_count / 2)
        shd_warn(r, node,
                 "the normals of %zu of %zu triangles point to the side from which their "
                 "corners run clockwise, which is their back",
                 mesh->inverted, mesh->triangle_count);
}

static void measure_box(const shd_reader *r, shd_mesh *mesh) {
    shd_vec3 low = shd_vec3_at(mesh->positions, 0), high = low;
    for (size_t i = 1; i < mesh->vertex_count && !shd_is_cancelled_at(r->cancelled, i); i++) {
        const shd_vec3 p = shd_vec3_at(mesh->positions, i);
        low = shd_vec3_min(p, low);
        high = shd_vec3_max(p, high);
    }
    mesh->low = low;
    mesh->high = high;
}

typedef struct arrays {
    list positions, indices, normals, uvs; /* the node's value is NULL if there is none */
    size_t vertices, triangles;
} arrays;

/* Checks the arrays' sizes, before any memory is taken for their content. False: the positions are
 * not whole. */
static bool measure_arrays(shd_reader *r, arrays *a) {
    const bool whole = a->positions.node.value && in_threes(r, &a->positions, "positions");
    const size_t size = a->positions.numbers.count;
    a->vertices = size / 3 + (size % 3 > 0);
    a->triangles = a->vertices / 3;
    if (a->indices.node.value) {
        in_threes(r, &a->indices, "indices");
        a->triangles = a->indices.numbers.count / 3;
    } else if (whole && a->vertices % 3) {
        shd_wrong(r, &a->positions.node,
                  "without `indices` every three positions are a triangle; there are %zu",
                  a->vertices);
    }
    if (a->normals.node.value && in_threes(r, &a->normals, "normals") && whole &&
        a->normals.numbers.count != size)
        shd_wrong(r, &a->normals.node,
                  "expected as many normals as positions, %zu numbers, got %zu", size,
                  a->normals.numbers.count);
    if (a->uvs.node.value && in_groups(r, &a->uvs, "uvs", 2) && whole &&
        a->uvs.numbers.count != 2 * a->vertices)
        shd_wrong(r, &a->uvs.node, "expected two uvs a vertex, %zu numbers, got %zu",
                  2 * a->vertices, a->uvs.numbers.count);
    if (a->vertices > UINT32_MAX)
        shd_wrong(r, &a->positions.node, "a mesh has at most 4294967295 positions");
    return whole;
}

shd_mesh *shd_make_mesh(shd_reader *r, const shd_node *node, const shd_mesh_source *source) {
    json_t *normals_given = json_is_null(source->normals) ? NULL : source->normals;
    arrays a = {.positions = list_of(r, node, "positions", source->positions),
                .indices = list_of(r, node, "indices", source->indices),
                .normals = list_of(r, node, "normals", normals_given),
                .uvs = list_of(r, node, "uvs", source->uvs)};
    const size_t errors = r->report->error_count;
    const bool whole = measure_arrays(r, &a);
    r->triangles += a.triangles; /* too many are reported once, for all objects */

    const bool wanted =
        whole && r->report->error_count == errors && r->triangles <= r->limits->triangles;
    shd_mesh *mesh = wanted ? shd_take(r, 1, sizeof *mesh) : NULL;
    uint32_t *indices = wanted ? shd_take(r, a.triangles, 3 * sizeof *indices) : NULL;
    const double *positions = read_numbers(r, &a.positions, "positions", wanted), *normals = NULL,
                 *uvs = NULL;
    if (a.indices.node.value)
        read_indices(r, &a.indices, a.vertices, indices);
    else if (indices)
        for (size_t i = 0; i < 3 * a.triangles; i++) indices[i] = (uint32_t)i;
    if (a.normals.node.value) {
        normals = read_numbers(r, &a.normals, "normals", wanted);
        check_normals(r, &a.normals);
    }
    if (a.uvs.node.value) uvs = read_numbers(r, &a.uvs, "uvs", wanted);
    if (!mesh || r->report->error_count > errors) return NULL;
    *mesh = (shd_mesh){.vertex_count = a.vertices,
                       .triangle_count = a.triangles,
                       .positions = positions,
                       .normals = normals,
                       .indices = indices,
                       .uvs = uvs};
    measure_box(r, mesh);
    if (normals) mesh->inverted = count_inverted(r, mesh);
    warn_of_inverted_normals(r, &a.normals.node, mesh);
    return mesh;
}

/* ---- Meshes that are kept ---- */

/* The mesh that `data` names. NULL if it names none, which is an error, or if it is not kept. */
static const shd_mesh *find_mesh(shd_reader *r, const shd_node *data) {
    static const char prefix[] = "sha256-";
    const size_t length = sizeof prefix - 1;
    const char *name = shd_get_text(r, data, "a string");
    const shd_mesh *mesh = NULL;
    shd_digest digest;
    if (!name) return NULL;
    if (strncmp(name, prefix, length) || !shd_digest_read(name + length, &digest)) {
        shd_wrong(r, data,
                  "expected \"sha256-\" and 64 hexadecimal digits, in lower case, got \"%s\"",
                  shd_quote(name).text);
    } else if (!r->shelf || !r->shelf->find) {
        shd_wrong(r, data, "no meshes are kept here: give `positions`, `indices` and `normals`");
    } else if (!(mesh = r->shelf->find(r->shelf->context, &digest))) {
        shd_note_missing(r, data, "mesh", name);
    } else {
        warn_of_inverted_normals(r, data, mesh);
    }
    return mesh;
}

const shd_mesh *shd_read_mesh(shd_reader *r, const shd_node *node, const shd_mesh_source *source,
                              shd_mesh **own) {
    const shd_node data = {node, "data", 0, source->data};
    *own = NULL;
    if (source->data && (source->positions || source->indices || source->normals || source->uvs))
        shd_wrong(r, &data,
                  "give either `data` or `positions`, `indices`, `normals` and `uvs`, not both");
    else if (source->data)
        return find_mesh(r, &data);
    return source->data ? NULL : (*own = shd_make_mesh(r, node, source));
}
