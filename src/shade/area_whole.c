#include "shade/area_cells.h"

/* Gauss's rules of 2 to 6 points on [-1, 1], whose weights sum to 1. */
static const double NODES[5][6] = {
    {-0.5773502691896257, 0.5773502691896257},
    {-0.7745966692414834, 0.0, 0.7745966692414834},
    {-0.8611363115940526, -0.33998104358485626, 0.33998104358485626, 0.8611363115940526},
    {-0.906179845938664, -0.5384693101056831, 0.0, 0.5384693101056831, 0.906179845938664},
    {-0.932469514203152, -0.6612093864662645, -0.23861918608319693, 0.23861918608319693,
     0.6612093864662645, 0.932469514203152},
};
static const double SHARES[5][6] = {
    {0.5, 0.5},
    {0.27777777777777785, 0.4444444444444444, 0.27777777777777785},
    {0.17392742256872684, 0.3260725774312731, 0.3260725774312731, 0.17392742256872684},
    {0.11846344252809471, 0.2393143352496831, 0.2844444444444445, 0.2393143352496831,
     0.11846344252809471},
    {0.08566224618958487, 0.18038078652406947, 0.23395696728634569, 0.23395696728634569,
     0.18038078652406947, 0.08566224618958487},
};

/* A quarter of the points of rules on the unit disc: the product of Gauss's rule of m points in r^2
 * and of 4 m equal angles, exact to degree 4 m - 1. The weights of a whole turn of 4 sum to 1. */
static const double ROUND[3][2][9] = {
    {{0.5000000000000001}, {0.5000000000000001}},
    {{0.4247082002778669, 0.1759198966061612, 0.8204732385702832, 0.3398511429799874},
     {0.17591989660616117, 0.4247082002778669, 0.33985114297998736, 0.8204732385702832}},
    {{0.3242716227536024, 0.23738330330844495, 0.08688831944515743, 0.6830127018922195,
      0.5000000000000001, 0.18301270189221935, 0.9098684611354353, 0.666069941755647,
      0.24379851937978822},
     {0.08688831944515743, 0.23738330330844493, 0.3242716227536024, 0.18301270189221935,
      0.5000000000000001, 0.6830127018922195, 0.24379851937978822, 0.6660699417556469,
      0.9098684611354353}},
};
static const double ROUND_SHARES[3][9] = {
    {0.25},
    {0.0625, 0.0625, 0.0625, 0.0625},
    {0.023148148148148154, 0.023148148148148154, 0.023148148148148154, 0.037037037037037035,
     0.037037037037037035, 0.037037037037037035, 0.023148148148148154, 0.023148148148148154,
     0.023148148148148154},
};

/* Up to which `off` a rule's mean is within 1e-9 of the largest value: what sums in 16 x 16 points
 * have shown over random lights and lobes of exponents 1 to 1e6, with room of a factor of 2.
 * tests/unit/shade_area_small.c holds them. */
static const double RECT_MOST[5] = {1.5e-4, 0.009, 0.055, 0.23, 0.5},
                    DISC_MOST[3] = {1.4e-4, 0.05, 0.4};

/* Sums are of values times height / distance^3. */
static void add_point(const shd_seen *s, double x, double y, double share, shd_ways *out) {
    const shd_vec3 p = shd_seen_at(s, x, y);
    const double squared = shd_dot(p, p), inverse = 1 / sqrt(squared);
    shd_add_way(out, shd_scale(p, inverse), share * s->height * inverse / squared);
}

static void add_rectangle(const shd_seen *s, int rule, double x, double y, shd_ways *out) {
    const int n = rule + 2;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++)
            add_point(s, x * NODES[rule][i], y * NODES[rule][k],
                      4 * x * y * SHARES[rule][i] * SHARES[rule][k], out);
}

static void add_disc(const shd_seen *s, int rule, shd_ways *out) {
    const double r = s->radius;
    for (int i = 0; i < (rule + 1) * (rule + 1); i++) {
        const double x = r * ROUND[rule][0][i], y = r * ROUND[rule][1][i],
                     share = SHD_PI * r * r * ROUND_SHARES[rule][i];
        add_point(s, x, y, share, out);
        add_point(s, -y, x, share, out);
        add_point(s, -x, -y, share, out);
        add_point(s, y, -x, share, out);
    }
}

/* Whether nothing is cut off. A rectangle is around 0, along both axes. */
static bool is_whole(const shd_seen *s) {
    const shd_stretch *p = s->pieces;
    if (s->count == 1) return p->arc && p->to - p->from >= 2 * SHD_PI;
    if (s->count != 4) return false;
    for (int i = 0; i < 4; i++)
        if (p[i].arc || fabs(p[i].x[0]) != p[1].x[0] || fabs(p[i].y[0]) != p[2].y[0]) return false;
    return p[0].x[0] < 0 && p[0].y[0] < 0 && p[1].y[0] < 0 && p[3].x[0] < 0;
}

bool shd_cells_whole(const shd_seen *s, double off, const shd_area_model *model, double *row) {
    shd_ways ways;
    const bool disc = s->count == 1;
    const double *most = disc ? DISC_MOST : RECT_MOST;
    const int rules = disc ? 3 : 5;
    int rule = 0;
    while (rule < rules && !(off <= most[rule])) rule++;
    if (rule == rules || !is_whole(s)) return false;
    ways.points = 0;
    if (disc)
        add_disc(s, rule, &ways);
    else
        add_rectangle(s, rule, s->pieces[1].x[0], s->pieces[2].y[0], &ways);
    shd_sum_row(model, &ways, row);
    return true;
}
