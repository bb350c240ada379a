/* Martin Newell's teapot (University of Utah, 1975; F. Crow, "The Origins of the Teapot", IEEE
 * Computer Graphics and Applications 7(1), 1987): 32 bicubic Bezier patches. The numbers are in the
 * public domain, as S. J. Baker tells of them and GLUT and others publish them, where the bottom's
 * four patches are, too, that the first 28 did not have. Ten patches are written down, and the
 * others mirrored.
 *
 * Six sheets of our own close it, so that light does not get in: a ring between the lid and the
 * rim, the ends of the handle and of the spout within the body, and a funnel in the spout's
 * mouth. */
#include "scene/builtin.h"

/* Slices of a patch each way. */
enum { SLICES = 20, SIDE = SLICES + 1 };

/* Newell's x, y and z (upward), times 100,000: whole numbers, of which sums are exact. */
static const int points[][3] = {
    {20000, 0, 270000},
    {20000, -11200, 270000},
    {11200, -20000, 270000},
    {0, -20000, 270000},
    {133750, 0, 253125},
    {133750, -74900, 253125},
    {74900, -133750, 253125},
    {0, -133750, 253125},
    {143750, 0, 253125},
    {143750, -80500, 253125},
    {80500, -143750, 253125},
    {0, -143750, 253125},
    {150000, 0, 240000},
    {150000, -84000, 240000},
    {84000, -150000, 240000},
    {0, -150000, 240000},
    {175000, 0, 187500},
    {175000, -98000, 187500},
    {98000, -175000, 187500},
    {0, -175000, 187500},
    {200000, 0, 135000},
    {200000, -112000, 135000},
    {112000, -200000, 135000},
    {0, -200000, 135000},
    {200000, 0, 90000},
    {200000, -112000, 90000},
    {112000, -200000, 90000},
    {0, -200000, 90000},
    {-200000, 0, 90000},
    {200000, 0, 45000},
    {200000, -112000, 45000},
    {112000, -200000, 45000},
    {0, -200000, 45000},
    {150000, 0, 22500},
    {150000, -84000, 22500},
    {84000, -150000, 22500},
    {0, -150000, 22500},
    {150000, 0, 15000},
    {150000, -84000, 15000},
    {84000, -150000, 15000},
    {0, -150000, 15000},
    {-160000, 0, 202500},
    {-160000, -30000, 202500},
    {-150000, -30000, 225000},
    {-150000, 0, 225000},
    {-230000, 0, 202500},
    {-230000, -30000, 202500},
    {-250000, -30000, 225000},
    {-250000, 0, 225000},
    {-270000, 0, 202500},
    {-270000, -30000, 202500},
    {-300000, -30000, 225000},
    {-300000, 0, 225000},
    {-270000, 0, 180000},
    {-270000, -30000, 180000},
    {-300000, -30000, 180000},
    {-300000, 0, 180000},
    {-270000, 0, 157500},
    {-270000, -30000, 157500},
    {-300000, -30000, 135000},
    {-300000, 0, 135000},
    {-250000, 0, 112500},
    {-250000, -30000, 112500},
    {-265000, -30000, 93750},
    {-265000, 0, 93750},
    {-200000, -30000, 90000},
    {-190000, -30000, 60000},
    {-190000, 0, 60000},
    {170000, 0, 142500},
    {170000, -66000, 142500},
    {170000, -66000, 60000},
    {170000, 0, 60000},
    {260000, 0, 142500},
    {260000, -66000, 142500},
    {310000, -66000, 82500},
    {310000, 0, 82500},
    {230000, 0, 210000},
    {230000, -25000, 210000},
    {240000, -25000, 202500},
    {240000, 0, 202500},
    {270000, 0, 240000},
    {270000, -25000, 240000},
    {330000, -25000, 240000},
    {330000, 0, 240000},
    {280000, 0, 247500},
    {280000, -25000, 247500},
    {352500, -25000, 249375},
    {352500, 0, 249375},
    {290000, 0, 247500},
    {290000, -15000, 247500},
    {345000, -15000, 251250},
    {345000, 0, 251250},
    {280000, 0, 240000},
    {280000, -15000, 240000},
    {320000, -15000, 240000},
    {320000, 0, 240000},
    {0, 0, 315000},
    {80000, 0, 315000},
    {80000, -45000, 315000},
    {45000, -80000, 315000},
    {0, -80000, 315000},
    {0, 0, 285000},
    {140000, 0, 240000},
    {140000, -78400, 240000},
    {78400, -140000, 240000},
    {0, -140000, 240000},
    {40000, 0, 255000},
    {40000, -22400, 255000},
    {22400, -40000, 255000},
    {0, -40000, 255000},
    {130000, 0, 255000},
    {130000, -72800, 255000},
    {72800, -130000, 255000},
    {0, -130000, 255000},
    {130000, 0, 240000},
    {130000, -72800, 240000},
    {72800, -130000, 240000},
    {0, -130000, 240000},
    {0, 0, 0},
    {142500, -79800, 0},
    {150000, 0, 7500},
    {142500, 0, 0},
    {79800, -142500, 0},
    {0, -150000, 7500},
    {0, -142500, 0},
    {150000, -84000, 7500},
    {84000, -150000, 7500},
    {-155000, 0, 213750},
    {-195000, 0, 75000},
    {170000, 0, 101250},
    {288000, 0, 230000},
};

/* z is up to 3.15, and the body's radius 2. */
static const double UNIT = 200000, HALF = 157500;

typedef struct patch {
    int point[4][4];
    int rows;       /* slices along the first index, 1 if it is straight */
    bool in_x;      /* mirrored in x, too, as all are in y */
    bool reversed;  /* its corners run clockwise from outside */
    double v, step; /* of the chart: at the first row, and from there to the last one */
} patch;

static const patch patches[] = {
    /* rim, body, lid, bottom */
    {{{102, 103, 104, 105}, {4, 5, 6, 7}, {8, 9, 10, 11}, {12, 13, 14, 15}},
     SLICES,
     true,
     false,
     1,
     -0.25},
    {{{12, 13, 14, 15}, {16, 17, 18, 19}, {20, 21, 22, 23}, {24, 25, 26, 27}},
     SLICES,
     true,
     false,
     0.75,
     -0.25},
    {{{24, 25, 26, 27}, {29, 30, 31, 32}, {33, 34, 35, 36}, {37, 38, 39, 40}},
     SLICES,
     true,
     false,
     0.5,
     -0.25},
    {{{96, 96, 96, 96}, {97, 98, 99, 100}, {101, 101, 101, 101}, {0, 1, 2, 3}},
     SLICES,
     true,
     false,
     1,
     -0.5},
    {{{0, 1, 2, 3}, {106, 107, 108, 109}, {110, 111, 112, 113}, {114, 115, 116, 117}},
     SLICES,
     true,
     false,
     0.5,
     -0.5},
    {{{118, 118, 118, 118}, {124, 122, 119, 121}, {123, 126, 125, 120}, {40, 39, 38, 37}},
     SLICES,
     true,
     false,
     0,
     0.25},
    /* handle, spout */
    {{{41, 42, 43, 44}, {45, 46, 47, 48}, {49, 50, 51, 52}, {53, 54, 55, 56}},
     SLICES,
     false,
     false,
     1,
     -0.5},
    {{{53, 54, 55, 56}, {57, 58, 59, 60}, {61, 62, 63, 64}, {28, 65, 66, 67}},
     SLICES,
     false,
     false,
     0.5,
     -0.5},
    {{{68, 69, 70, 71}, {72, 73, 74, 75}, {76, 77, 78, 79}, {80, 81, 82, 83}},
     SLICES,
     false,
     false,
     0,
     0.5},
    {{{80, 81, 82, 83}, {84, 85, 86, 87}, {88, 89, 90, 91}, {92, 93, 94, 95}},
     SLICES,
     false,
     false,
     0.5,
     0.5},
    /* What closes it: straight from the first row of points to the last. */
    {{{114, 115, 116, 117}, {102, 103, 104, 105}, {114, 115, 116, 117}, {102, 103, 104, 105}},
     1,
     true,
     false,
     1,
     -1},
    {{{127, 127, 127, 127}, {41, 42, 43, 44}, {127, 127, 127, 127}, {41, 42, 43, 44}},
     1,
     false,
     false,
     1,
     -1},
    {{{28, 65, 66, 67}, {128, 128, 128, 128}, {28, 65, 66, 67}, {128, 128, 128, 128}},
     1,
     false,
     false,
     1,
     -1},
    {{{129, 129, 129, 129}, {68, 69, 70, 71}, {129, 129, 129, 129}, {68, 69, 70, 71}},
     1,
     false,
     false,
     1,
     -1},
    {{{92, 93, 94, 95}, {130, 130, 130, 130}, {92, 93, 94, 95}, {130, 130, 130, 130}},
     1,
     false,
     false,
     1,
     -1},
};

enum { PATCHES = sizeof patches / sizeof patches[0], COPIES = 6 * 4 + 4 * 2 + 4 + 4 * 2 };

/* Bernstein's polynomials of degree 3 at k / n, times n^3, and a third of their derivatives, times
 * n^2: whole numbers. */
static void weigh(int k, int n, double w[4], double d[4]) {
    const double a = n - k, b = k;
    w[0] = a * a * a;
    w[1] = 3 * a * a * b;
    w[2] = 3 * a * b * b;
    w[3] = b * b * b;
    d[0] = -a * a;
    d[1] = a * a - 2 * a * b;
    d[2] = 2 * a * b - b * b;
    d[3] = b * b;
}

static shd_vec3 sum_points(const patch *p, const double rows[4], const double columns[4]) {
    shd_vec3 sum = {0, 0, 0};
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) {
            const int *at = points[p->point[i][j]];
            sum = shd_madd(sum, (shd_vec3){at[0], at[1], at[2]}, rows[i] * columns[j]);
        }
    }
    return sum;
}

static bool is_zero(shd_vec3 v) {
    return !(shd_max_abs(v) > 0);
}

/* The point at row r and column c, and the normal. All sums are below 2^53 and exact, and each
 * coordinate is rounded once: patches meet to the last bit, and mirrored ones are mirrored. Where a
 * row of points is one point, the normal is the limit along the columns, by l'Hopital's rule. */
static void evaluate(const patch *p, int r, int c, shd_vec3 *position, shd_vec3 *normal) {
    double row[4], along[4], column[4], around[4];
    weigh(r, p->rows, row, along);
    weigh(c, SLICES, column, around);
    const double n = (double)p->rows * SLICES, whole = n * n * n;
    const shd_vec3 at = sum_points(p, row, column), down = sum_points(p, along, column);
    shd_vec3 right = sum_points(p, row, around);
    if (is_zero(right)) right = sum_points(p, along, around);
    if (r == p->rows && p->rows == 1 && is_zero(sum_points(p, row, around)))
        right = shd_scale(right, -1); /* the rows come to a point */
    *position = (shd_vec3){at.x / (whole * UNIT), (at.z - HALF * whole) / (whole * UNIT),
                           -at.y / (whole * UNIT)};
    const shd_vec3 n3 = shd_cross(right, down);
    *normal = (shd_vec3){n3.x, n3.z, -n3.y};
}

/* u at column c: once around the y axis, from -z over +z's middle, by a quarter a patch; or once
 * around a tube, from its lower or inner side, by a half. Seen from outside with v up, it grows to
 * the right. */
static double chart_column(const patch *p, int c, bool in_x, bool in_y) {
    const double part = (p->step < 0 ? SLICES - c : c) / (double)SLICES;
    if (!p->in_x) return in_y ? (1 - part) / 2 : (1 + part) / 2;
    const double turn = in_x == in_y ? part / 4 : -part / 4;
    return in_y ? (in_x ? turn : 1 + turn) : 0.5 + turn;
}

/* One of the patch's mirror images. */
static void add_image(shd_pieces *out, const patch *p, bool in_x, bool in_y) {
    const uint32_t first = (uint32_t)out->vertex_count;
    const bool reversed = (in_x != in_y) == p->reversed;
    const double x = in_x ? -1 : 1, z = in_y ? -1 : 1, side = p->reversed ? -1 : 1;
    double u[SIDE];
    for (int c = 0; c <= SLICES; c++) u[c] = chart_column(p, c, in_x, in_y);
    for (int r = 0; r <= p->rows; r++) {
        for (int c = 0; c <= SLICES; c++) {
            shd_vec3 at, n;
            evaluate(p, r, c, &at, &n);
            shd_pieces_add(out, (shd_vec3){x * at.x, at.y, z * at.z},
                           (shd_vec3){side * x * n.x, side * n.y, side * z * n.z}, u[c],
                           p->v + p->step * r / p->rows);
        }
    }
    for (uint32_t r = 0; r < (uint32_t)p->rows; r++) {
        for (uint32_t c = 0; c < SLICES; c++) {
            const uint32_t a = first + r * SIDE + c, b = a + SIDE;
            shd_pieces_quad(out, (uint32_t[]){a + reversed, a + !reversed},
                            (uint32_t[]){b + reversed, b + !reversed});
        }
    }
}

bool shd_make_teapot(shd_arena *arena, shd_pieces *out) {
    if (!shd_pieces_new(COPIES * SIDE * SIDE, COPIES * 2 * SLICES * SLICES, arena, out))
        return false;
    for (const patch *p = patches; p < patches + PATCHES; p++)
        for (int image = 0; image < 4; image++)
            if (p->in_x || !(image & 1)) add_image(out, p, image & 1, image & 2);
    return true;
}
