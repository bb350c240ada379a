/* With ' the derivative along any unit step, N' and P' those of the surface, X = light - P and L =
 * X / |X|:
 *
 *     L' = -(P' - L (L.P')) / |X|,  (N.L)' = N'.L + N.L'
 *     |(N.L)''| <= |N''| + 2 |N'| |L'| + |L''|,  |L''| <= |P''| / |X| + 1.5 (|P'| / |X|)^2
 *
 * with the most of derivatives that sight/bend.c proves, from what strikes most (plan/moves.c):
 * what a pixel moves rays by is at right angles to them, and moved along them into the tangent
 * plane. */
#include "bound/light/sets.h"

#include "plan/nodes.h"

/* More than rounding does. */
static const double SLACK = 1 + 1e-6, APART = 1e-9;

/* The most of derivatives of points, in the world, and of normals. */
static void find_slopes(const shd_strike *m, shd_slopes *points, shd_slopes *normals) {
    const double cosine = m->ball ? sqrt(1 - m->beside * m->beside) : m->cosine,
                 turn = m->orthographic ? 0 : m->pace,
                 off = m->orthographic ? m->pace / m->size : m->t * turn, first = off / cosine,
                 sine = sqrt(1 - shd_smaller(cosine * cosine, 1)),
                 moved = 2 * first * sine * turn + off * turn, curve = m->ball ? 1 : 0,
                 second = (moved + curve * first * first) / cosine;
    *points = (shd_slopes){m->size * first, m->size * second};
    *normals = (shd_slopes){curve * first, curve * second};
}

bool shd_find_setting(const shd_analytic *a, const shd_plan_light *light, shd_setting *out) {
    const double reach = a->centers + SHD_BESIDE, bend = a->strike.ball ? 1 / a->strike.size : 0;
    const shd_vec3 moves[2] = {a->right, a->down};
    shd_strike worst;
    shd_slopes points, normals, ways = {0, 0};
    if (!shd_worst_strike(&a->strike, reach, &worst)) return false;
    find_slopes(&worst, &points, &normals);
    shd_vec3 way = light->toward;
    double away = INFINITY, slope[2];
    if (!light->directional) {
        const shd_vec3 x = shd_sub(light->position, a->point);
        away = shd_length(x);
        way = shd_scale(x, 1 / away);
        const double near = away - points.first * reach;
        if (!(near > 0.25 * away)) return false;
        ways.first = points.first / near;
        ways.second = points.second / near + 1.5 * ways.first * ways.first;
    }
    for (int k = 0; k < 2; k++) {
        const shd_vec3 turn = shd_scale(shd_madd(moves[k], way, -shd_dot(way, moves[k])), 1 / away);
        slope[k] = bend * shd_dot(moves[k], way) - shd_dot(a->normal, turn);
    }
    *out = (shd_setting){shd_dot(a->normal, way), slope[0], slope[1],
                         (normals.second + 2 * normals.first * ways.first + ways.second) * SLACK,
                         a->side};
    return isfinite(out->second);
}

uint64_t shd_off_setting(const shd_setting *set, double reach) {
    static const double ROOT2 = 1.4142135624;
    const double first = 0.5 * (1 - set->side), away = (reach - first) * ROOT2,
                 apart = reach * (fabs(set->right) + fabs(set->down)) * SLACK +
                         set->second / 2 * away * away + APART;
    uint64_t off = 0, bit = 1;
    for (int row = 0; row < set->side; row++) {
        double value = set->middle + first * set->right + (first + row) * set->down;
        for (int column = 0; column < set->side; column++, bit <<= 1, value += set->right)
            off |= fabs(value) > apart ? bit : 0;
    }
    return off;
}
