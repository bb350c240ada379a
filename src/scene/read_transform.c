/* Transforms of objects: scale, then rotate, then translate; or a matrix. */
#include <string.h>

#include "scene/read.h"

/* scale.x and matrix[0] are NAN if numbers that an inverse depends on are wrong. */
typedef struct raw_transform {
    shd_vec3 scale, rotate, translate;
    double matrix[16]; /* column-major */
} raw_transform;

enum { PARTS = 1, MATRIX = 2 }; /* marks */

static void read_scale(shd_reader *r, const shd_node *node, void *out) {
    double scale[3] = {NAN, NAN, NAN};
    bool good = true;
    if (json_is_number(node->value))
        scale[0] = scale[1] = scale[2] = json_number_value(node->value);
    else if (json_is_array(node->value))
        good = shd_get_three(r, node, scale);
    else
        shd_node_expect(r->report, node, "a number or an array of 3 numbers");
    if (scale[0] == 0 || scale[1] == 0 || scale[2] == 0) {
        shd_wrong(r, node, "a scale must not be 0: nothing would be left");
        good = false;
    }
    *(shd_vec3 *)out = (shd_vec3){good ? scale[0] : NAN, scale[1], scale[2]};
}

static void read_matrix(shd_reader *r, const shd_node *node, void *out) {
    double m[16];
    for (int i = 0; i < 16; i++) m[i] = i == 15 ? 1 : i > 11 || i % 4 == 3 ? 0 : NAN;
    shd_get_numbers(r, node, 16, 16, "an array of 16 numbers", m);
    for (int i = 0; i < 12; i++)
        if (isnan(m[i])) m[0] = NAN;
    /* Which row an item is in is known only if there are sixteen. */
    if (json_array_size(node->value) != 16)
        m[0] = NAN;
    else if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
        shd_wrong(r, node,
                  "the last row (items 3, 7, 11, 15: the matrix is column-major) must be "
                  "0, 0, 0, 1");
    memcpy(out, m, sizeof m);
}

/* Its sine and cosine are exact at multiples of 90 degrees. */
static shd_affine rotation_about(int axis, double degrees) {
    int quarters;
    const double rest = remquo(degrees, 90, &quarters) * (SHD_PI / 180);
    const double sines[4] = {sin(rest), cos(rest), -sin(rest), -cos(rest)}; /* a quarter apart */
    const double s = sines[quarters & 3], c = sines[(quarters + 1) & 3];
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    shd_affine m = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
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
        const shd_affine turn = rotation_about(axis, degrees[axis]);
        m = shd_compose(&turn, &m);
    }
    m.origin = raw->translate;
    return m;
}

static shd_affine from_matrix(const double matrix[16]) {
    shd_affine m = {.origin = shd_vec3_at(matrix, 4)};
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) m.linear[row][column] = matrix[4 * column + row];
    return m;
}

/* Sets the transform that the member says; NAN if it is not known or has no inverse. */
static void set_transform(shd_reader *r, const shd_node *node, const char *member, bool known,
                          const shd_affine *transform, shd_affine *out) {
    shd_node given = shd_node_member(node, member);
    shd_affine inverse;
    *out = *transform;
    if (known && shd_invert(transform, &inverse)) return;
    out->linear[0][0] = NAN;
    if (known)
        shd_wrong(r, given.value ? &given : node,
                  "the transform has no inverse: it flattens the object, or its numbers are "
                  "too far apart");
}

void shd_read_transform(shd_reader *r, const shd_node *node, void *out) {
    static const shd_field fields[] = {
        {"scale", read_scale, offsetof(raw_transform, scale), .mark = PARTS},
        {"rotate", shd_read_vector, offsetof(raw_transform, rotate), .mark = PARTS},
        {"translate", shd_read_vector, offsetof(raw_transform, translate), .mark = PARTS},
        {"matrix", read_matrix, offsetof(raw_transform, matrix), .mark = MATRIX},
    };
    shd_affine *transform = out;
    raw_transform raw = {.scale = {1, 1, 1}};
    transform->linear[0][0] = NAN;
    if (!shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a transform", &raw)) return;
    shd_affine parts = from_parts(&raw), whole = from_matrix(raw.matrix);
    set_transform(r, node, "scale", !isnan(raw.scale.x), &parts, transform);
    if (!(r->seen & MATRIX)) return;
    set_transform(r, node, "matrix", !isnan(raw.matrix[0]), &whole, transform);
    if (!(r->seen & PARTS)) return;
    shd_wrong(r, node, "`matrix` stands alone: leave out `scale`, `rotate` and `translate`");
    transform->linear[0][0] = NAN;
}
