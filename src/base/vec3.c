#include "base/vec3.h"

#include <string.h>

shd_affine shd_compose(const shd_affine *a, const shd_affine *b) {
    shd_affine out;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            out.linear[r][c] = a->linear[r][0] * b->linear[0][c] +
                               a->linear[r][1] * b->linear[1][c] +
                               a->linear[r][2] * b->linear[2][c];
    out.origin = shd_transform(a, b->origin);
    return out;
}

static shd_vec3 column_of(const shd_affine *m, int c) {
    return (shd_vec3){m->linear[0][c], m->linear[1][c], m->linear[2][c]};
}

/* Scales the columns to length 1 and finds their cofactors. The rows of the inverse of a matrix
 * with columns a, b, c are b x c, c x a and a x b over the determinant a . (b x c). */
static bool scaled_cofactors(const shd_affine *m, double length[3], shd_vec3 cofactor[3],
                             double *determinant) {
    shd_vec3 unit[3];
    for (int c = 0; c < 3; c++) {
        length[c] = shd_length(column_of(m, c));
        if (!shd_normalize(column_of(m, c), &unit[c])) return false;
    }
    for (int c = 0; c < 3; c++) cofactor[c] = shd_cross(unit[(c + 1) % 3], unit[(c + 2) % 3]);
    *determinant = shd_dot(unit[0], cofactor[0]);
    return true;
}

static const double IDENTITY[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* Most objects are only moved: what is found of these takes thousands of objects no time. To the
 * bit, so that zeros have the signs that the formulas give. */
static bool is_identity(const shd_affine *m) {
    return !memcmp(m->linear, IDENTITY, sizeof IDENTITY);
}

bool shd_invert(const shd_affine *m, shd_affine *out) {
    double length[3], determinant;
    shd_vec3 cofactor[3];
    if (is_identity(m) && shd_is_finite(m->origin)) {
        const shd_vec3 origin = shd_scale(shd_linear(m, m->origin), -1);
        memcpy(out->linear, IDENTITY, sizeof IDENTITY);
        out->origin = origin;
        return true;
    }
    if (!scaled_cofactors(m, length, cofactor, &determinant)) return false;
    if (!(fabs(determinant) >= 1e-12) || !shd_is_finite(m->origin)) return false;
    shd_affine inverse;
    for (int r = 0; r < 3; r++) {
        shd_vec3 row = shd_scale(shd_scale(cofactor[r], 1 / determinant), 1 / length[r]);
        if (!shd_is_finite(row)) return false;
        inverse.linear[r][0] = row.x;
        inverse.linear[r][1] = row.y;
        inverse.linear[r][2] = row.z;
    }
    inverse.origin = shd_scale(shd_linear(&inverse, m->origin), -1);
    if (!shd_is_finite(inverse.origin)) return false;
    *out = inverse;
    return true;
}

shd_affine shd_normal_map(const shd_affine *m) {
    shd_affine out = {.linear = {{0}}};
    double length[3], determinant;
    shd_vec3 cofactor[3];
    if (!scaled_cofactors(m, length, cofactor, &determinant)) return out;
    /* The cofactor matrix has the columns b x c, c x a, a x b. Dividing column c by its length
     * is a common factor away from multiplying by the other two lengths. */
    double smallest = fmin(length[0], fmin(length[1], length[2]));
    double sign = determinant < 0 ? -1 : 1;
    for (int c = 0; c < 3; c++) {
        shd_vec3 normal = shd_scale(cofactor[c], sign * (smallest / length[c]));
        out.linear[0][c] = normal.x;
        out.linear[1][c] = normal.y;
        out.linear[2][c] = normal.z;
    }
    return out;
}

/* The largest eigenvalue of M^T M by its characteristic polynomial's trigonometric solution
 * (O. K. Smith, "Eigenvalues of a symmetric 3 x 3 matrix", 1961). */
double shd_norm(const shd_affine *m) {
    double a[3][3], largest = 0;
    if (is_identity(m)) return 1 + 1e-7;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) largest = fmax(largest, fabs(m->linear[r][c]));
    if (!(largest > 0) || !isfinite(largest)) return largest;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            a[r][c] = 0;
            for (int k = 0; k < 3; k++)
                a[r][c] += m->linear[k][r] / largest * (m->linear[k][c] / largest);
        }
    const double mean = (a[0][0] + a[1][1] + a[2][2]) / 3;
    double spread = 2 * (a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2]);
    for (int i = 0; i < 3; i++) spread += (a[i][i] - mean) * (a[i][i] - mean);
    const double p = sqrt(spread / 6);
    double most = mean;
    if (p > 1e-12 * mean) {
        for (int i = 0; i < 3; i++) a[i][i] -= mean;
        const double half = (a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                             a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                             a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])) /
                            (2 * p * p * p);
        most += 2 * p * cos(acos(fmin(fmax(half, -1), 1)) / 3);
    }
    /* If the two largest are nearly the same, acos has half of its digits. */
    return largest * sqrt(most) * (1 + 1e-7);
}

/* Whether a map scales each axis alike, and does nothing else. */
static bool is_scaling(const shd_affine *m, double *size) {
    const double(*l)[3] = m->linear;
    *size = fabs(l[0][0]);
    return l[0][1] == 0 && l[0][2] == 0 && l[1][0] == 0 && l[1][2] == 0 && l[2][0] == 0 &&
           l[2][1] == 0 && fabs(l[1][1]) == *size && fabs(l[2][2]) == *size && *size > 0 &&
           isfinite(*size);
}

bool shd_is_similar(const shd_affine *m, double length[3]) {
    double size;
    if (is_scaling(m, &size)) {
        length[0] = length[1] = length[2] = size;
        return true;
    }
    for (int c = 0; c < 3; c++)
        length[c] = shd_length((shd_vec3){m->linear[0][c], m->linear[1][c], m->linear[2][c]});
    const double s = length[0];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3;
        double product = 0;
        for (int r = 0; r < 3; r++) product += m->linear[r][c] / s * (m->linear[r][d] / s);
        if (!(fabs(length[c] / s - 1) < 1e-14 && fabs(product) < 1e-14)) return false;
    }
    return true;
}
