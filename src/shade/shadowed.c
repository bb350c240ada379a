#include "shade/shadowed.h"

#include <string.h>

#include "base/cpu.h"

/* Of a crowd's rows: 64 points of eight lobes, and 8 of the most lobes that there are. */
enum { MOST_DOUBLES = 2048 };

typedef struct crowded {
    shd_crowd crowd;
    shd_crowd_rows rows;
    double *added[3 + 3 * (1 + SHD_LOBES_MOST)]; /* the rows of `rows.added` */
    double arriving[3 * SHD_CROWD];              /* of the points that are reached, in order */
    double sums[MOST_DOUBLES], parts[MOST_DOUBLES], share[3 * SHD_CROWD];
} crowded;

static shd_vec3 lane_of(const double *const v[3], size_t i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

static size_t whole_steps(size_t points) {
    return (points + SHD_CROWD_STEP - 1) / SHD_CROWD_STEP * SHD_CROWD_STEP;
}

/* As many points as rows have room for. */
static void lay_rows(const shd_plan_material *material, size_t points, crowded *c) {
    const size_t width = 3 + 3 * material->lobe_count;
    size_t stride = MOST_DOUBLES / width / SHD_CROWD_STEP * SHD_CROWD_STEP;
    if (stride > SHD_CROWD) stride = SHD_CROWD;
    if (stride > points) stride = whole_steps(points);
    c->rows = (shd_crowd_rows){width, stride, 0, c->sums, c->parts, c->share};
    for (size_t r = 0; r < width; r++) c->added[r] = c->parts + r * stride;
}

/* Kernels write what is of points in rows that are asked for, and vectors read all rows up to the
 * end of the last step. */
static void begin_rows(crowded *c, bool diffuse) {
    static const size_t STEP = SHD_CROWD_STEP * sizeof(double);
    const size_t last = c->rows.count - SHD_CROWD_STEP, stride = c->rows.stride;
    for (size_t r = 0; r < c->rows.width; r++) {
        memset(c->sums + r * stride, 0, c->rows.count * sizeof *c->sums);
        memset(c->parts + r * stride + last, 0, STEP);
        if (r < 3 && !diffuse) memset(c->parts + r * stride, 0, c->rows.count * sizeof *c->parts);
    }
    for (size_t k = 0; k < 3; k++) memset(c->share + k * stride, 0, c->rows.count * sizeof(double));
}

/* Takes the points of one object that follow each other. */
static void take_crowd(const shd_lighting *lighting, const shd_plan_material *material,
                       const shd_points64 *points, size_t first, bool diffuse, crowded *c) {
    size_t most = c->rows.stride, count = 0;
    if (most > points->count - first) most = points->count - first;
    for (; count < most && points->object[first + count] == points->object[first]; count++) {
        const size_t i = first + count;
        shd_surface *at = &c->crowd.at[count];
        *at = (shd_surface){.position = lane_of(points->position, i),
                            .normal = lane_of(points->normal, i),
                            .view = lane_of(points->view, i),
                            .material = material,
                            .object = (size_t)points->object[i],
                            .triangle = points->triangle ? points->triangle[i] : 0,
                            .sharp = points->sharp,
                            .sharp_at = points->sharp_at + i,
                            .facets = points->facets,
                            .facets_at = points->facets_at + i,
                            .known = points->known,
                            .known_at = points->known_at + i};
        at->mirror = shd_sub(shd_scale(at->normal, 2 * shd_dot(at->normal, at->view)), at->view);
    }
    c->crowd.count = count;
    c->crowd.seconds = points->shadowed;
    lighting->shadows->gather(lighting->shadows->context, &c->crowd);
    c->rows.count = whole_steps(count);
    begin_rows(c, diffuse);
}

static shd_points64 points_of(const shd_points64 *all, size_t first, size_t count) {
    shd_points64 out = {.count = count,
                        .object = all->object + first,
                        .triangle = all->triangle ? all->triangle + first : NULL,
                        .sharp = all->sharp,
                        .sharp_at = all->sharp_at + first,
                        .facets = all->facets,
                        .facets_at = all->facets_at + first,
                        .known = all->known,
                        .known_at = all->known_at + first};
    for (int c = 0; c < 3; c++) {
        out.position[c] = all->position[c] + first;
        out.normal[c] = all->normal[c] + first;
        out.view[c] = all->view[c] + first;
    }
    return out;
}

/* Adds what arrives of the light to the crowd's sums. */
static void let_through(const shd_lighting *lighting, uint32_t index, crowded *c) {
    static shd_find_reached_function *const find_reached[SHD_ISA_COUNT] =
        SHD_VARIANTS(shd_find_reached);
    static shd_add_shares_function *const add_shares[SHD_ISA_COUNT] = SHD_VARIANTS(shd_add_shares);
    const shd_plan *plan = lighting->plan;
    const shd_shadows *shadows = lighting->shadows;
    /* Rows beyond the crowd's end are of an earlier one. */
    uint64_t reached = find_reached[plan->isa](&c->rows) & (UINT64_MAX >> (64 - c->crowd.count));
    uint8_t which[SHD_CROWD];
    size_t n = 0;
    for (; reached; reached &= reached - 1) which[n++] = (uint8_t)__builtin_ctzll(reached);
    if (!n) return;
    shadows->shares(shadows->context, &plan->lights[index], &c->crowd, which, n, c->arriving);
    if (shd_is_cancelled(plan->cancelled)) return;
    for (size_t i = 0; i < n; i++) /* those of other points do not matter */
        for (size_t k = 0; k < 3; k++)
            c->share[k * c->rows.stride + which[i]] = c->arriving[3 * i + k];
    add_shares[plan->isa](&c->rows);
}

void shd_shadowed_sums(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points64 *points,
                       double *const diffuse[3], double *const *specular) {
    crowded c;
    lay_rows(material, points->count, &c);
    for (size_t first = 0; first < points->count; first += c.crowd.count) {
        take_crowd(lighting, material, points, first, diffuse != NULL, &c);
        const shd_points64 here = points_of(points, first, c.crowd.count);
        for (size_t j = 0; j < n; j++) {
            shd_open_sums(lighting, material, &which[j], 1, &here, diffuse ? c.added : NULL,
                          c.added + 3);
            if (shd_is_cancelled(lighting->plan->cancelled)) return;
            let_through(lighting, which[j], &c);
        }
        for (size_t r = 0; r < c.rows.width; r++) {
            double *out = r >= 3 ? specular[r - 3] : diffuse ? diffuse[r] : NULL;
            if (out) memcpy(out + first, c.sums + r * c.rows.stride, c.crowd.count * sizeof *out);
        }
    }
}
