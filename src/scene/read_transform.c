/* Transforms of objects: scale, then rotate, then translate; or a matrix. */
#include <math.h>
#include <string.h>

#include "scene/read.h"

typedef struct raw_transform {
    shd_vec3 scale, rotate, translate;
    double matrix[16]; /* column-major */
} raw_transform;

enum { SCALE, ROTATE, TRANSLATE, MATRIX, FIELDS };

static void read_scale(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    shd_vec3 scale = {1, 1, 1};
    if (json_is_number(node->value)) {
        shd_read_number(r, node, field, &scale.x);
        scale.y = scale.z = scale.x;
    } else if (json_is_array(node->value)) {
        shd_read_vector(r, node, field, &scale);
    } else {
        shd_node_expect(r->report, node, "a number or an array of 3 numbers");
        return;
    }
    if (scale.x == 0 || scale.y == 0 || scale.z == 0)
        shd_node_fail(r->report, node, SHD_SCENE, "a scale must not be 0: nothing would be left");
    else
        *(shd_vec3 *)out = scale;
}

static void read_matrix(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field;
    double matrix[16];
    if (!shd_is_array(r, node, 16, 16, "an array of 16 numbers")) return;
    if (!shd_get_numbers(r, node, 16, matrix)) return;
    if (matrix[3] != 0 || matrix[7] != 0 || matrix[11] != 0 || matrix[15] != 1)
        shd_node_fail(r->report, node, SHD_SCENE,
                      "the last row (items 3, 7, 11, 15: the matrix is column-major) must be "
                      "0, 0, 0, 1");
    else
        memcpy(out, matrix, sizeof matrix);
}

/* Sine and cosine of an angle in degrees, exact at multiples of 90. */
static void turn(double degrees, double *sine, double *cosine) {
    int quarters;
    double rest = remquo(degrees, 90, &quarters) * (SHD_PI / 180);
    double s = sin(rest), c = cos(rest);
    switch (quarters & 3) {
    case 0:
        *sine = s, *cosine = c;
        break;
    case 1:
        *sine = c, *cosine = -s;
        break;
    case 2:
        *sine = -s, *cosine = -c;
        break;
    default:
        *sine = -c, *cosine = s;
    }
}

static shd_affine rotation(int axis, double degrees) {
    shd_affine m = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    int a = (axis + 1) % 3, b = (axis + 2) % 3;
    double s, c;
    turn(degrees, &s, &c);
    m.linear[a][a] = c;
    m.linear[a][b] = -s;
    m.linear[b][a] = s;
    m.linear[b][b] = c;
    return m;
}

static shd_affine from_parts(const raw_transform *raw) {
    shd_affine m = {{{raw->scale.x, 0, 0}, {0, raw->scale.y, 0}, {0, 0, raw->scale.z}}, {0, 0, 0}};
    double degrees[3] = {raw->rotate.x, raw->rotate.y, raw->rotate.z};
    for (int axis = 0; axis < 3; axis++) {
        if (degrees[axis] == 0) continue;
        shd_affine turned = rotation(axis, degrees[axis]);
        m = shd_compose(&turned, &m);
    }
    m.origin = raw->translate;
    return m;
}

static shd_affine from_matrix(const double matrix[16]) {
    shd_affine m;
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) m.linear[row][column] = matrix[4 * column + row];
    m.origin = (shd_vec3){matrix[12], matrix[13], matrix[14]};
    return m;
}

void shd_read_transform(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field;
    static const shd_field fields[FIELDS] = {
        [SCALE] = {.name = "scale", .read = read_scale, .offset = offsetof(raw_transform, scale)},
        [ROTATE] = {.name = "rotate",
                    .read = shd_read_vector,
                    .offset = offsetof(raw_transform, rotate)},
        [TRANSLATE] = {.name = "translate",
                       .read = shd_read_vector,
                       .offset = offsetof(raw_transform, translate)},
        [MATRIX] = {.name = "matrix",
                    .read = read_matrix,
                    .offset = offsetof(raw_transform, matrix)},
    };
    if (!shd_is_object(r, node)) return;
    raw_transform raw = {.scale = {1, 1, 1}};
    uint32_t seen = shd_read_fields(r, node, fields, FIELDS, 0, "a transform", &raw);
    bool matrix = seen >> MATRIX & 1;
    if (matrix && seen != UINT32_C(1) << MATRIX) {
        shd_node_fail(r->report, node, SHD_SCENE,
                      "`matrix` stands alone: leave out `scale`, `rotate` and `translate`");
        return;
    }
    if (r->wrong) return;

    shd_affine transform = matrix ? from_matrix(raw.matrix) : from_parts(&raw), inverse;
    if (shd_invert(&transform, &inverse)) {
        *(shd_affine *)out = transform;
        return;
    }
    shd_node given = shd_node_member(node, matrix ? "matrix" : "scale");
    shd_node_fail(r->report, given.value ? &given : node, SHD_SCENE,
                  "the transform has no inverse: it flattens the object, or its numbers are too "
                  "far apart");
}
