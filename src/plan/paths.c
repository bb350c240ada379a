#include "plan/paths.h"

/* Nanoseconds, of the processor that kernel_costs.h names: a ray, which depends on what it passes:
 * this is for a few objects; one at a mesh, or among many objects. */
static const double RAY = 120, LONG_RAY = 300;

/* Whether rays to a light are needed for the points of a block; and the rays, on the average of
 * points that need some and others: on a convex object alone, among objects. */
static const double LOOK = 15, ALONE = 2, AMONG = 30;

/* How many rays that go on from a surface meet another one from which rays go on: most of those
 * within glass, few of those that are mirrored. The examples' pictures have this at least. */
static const double AGAIN = 0.6;

/* The most that rays of each kind bring from a surface: mirrored, refracted and straight ones. */
typedef struct brought {
    double by[3];
} brought;

static brought find_brought(const shd_plan *plan, size_t object) {
    const shd_coefficients k = shd_coefficients_of(plan, object);
    brought b = {{0, 0, 0}};
    const bool varies = plan->materials[plan->objects[object].material].from->opacity_texture;
    for (size_t c = 0; c < k.count; c++) {
        const double most = varies ? 1 : k.opacity[c];
        b.by[0] = shd_larger(fabs(most * k.reflection[c]), b.by[0]);
        b.by[1] = shd_larger(fabs(most * k.transmission[c]), b.by[1]);
        b.by[2] = shd_larger(fabs(1 - k.opacity[c]), b.by[2]);
    }
    return b;
}

static double sum_of(const brought *b) {
    return b->by[0] + b->by[1] + b->by[2];
}

static int kinds_of(const brought *b) {
    return (b->by[0] > 0) + (b->by[1] > 0) + (b->by[2] > 0);
}

/* Ways to order `steps` steps, of which `first` are of one kind and `second` of another. */
static double count_orders(int steps, int first, int second) {
    double ways = 1;
    for (int k = 1; k <= first; k++) ways *= (double)(steps - first + k) / k;
    for (int k = 1; k <= second; k++) ways *= (double)(steps - first - second + k) / k;
    return ways;
}

/* The paths of so many steps that bring `least` or more. */
static double count_paths(const brought *b, int steps, double least) {
    double count = 0;
    for (int i = 0; i <= steps; i++)
        for (int k = 0; i + k <= steps; k++) {
            const double brings =
                pow(b->by[0], i) * pow(b->by[1], k) * pow(b->by[2], steps - i - k);
            if (brings > 0 && brings >= least) count += count_orders(steps, i, k);
        }
    return count;
}

shd_paths shd_find_paths(const shd_plan *plan) {
    const shd_trace *trace = &plan->scene->trace;
    shd_paths paths = {0, 0, 0};
    brought all = {{0, 0, 0}};
    double most = 0, rays = 0;
    for (size_t i = 0; trace->depth && i < plan->scene->object_count; i++) {
        const brought b = find_brought(plan, i);
        paths.bouncing += kinds_of(&b) > 0;
        most = shd_larger(sum_of(&b), most);
        rays = shd_larger(kinds_of(&b), rays);
        for (int k = 0; k < 3; k++) all.by[k] = shd_larger(b.by[k], all.by[k]);
    }
    if (!paths.bouncing) return paths;
    for (int l = 1; l <= trace->depth; l++)
        paths.steps += pow(AGAIN, l - 1) * count_paths(&all, l, trace->min_contribution);
    const double deep = pow(most, trace->depth + 1),
                 faint = trace->min_contribution * pow(rays, trace->depth);
    paths.cut = fmin(pow(fmax(most, 1), trace->depth + 1), deep + faint);
    return paths;
}

double shd_sent_on(const shd_plan *plan, size_t object) {
    const shd_coefficients k = shd_coefficients_of(plan, object);
    const shd_material *from = plan->materials[plan->objects[object].material].from;
    double most = 0;
    if (!plan->scene->trace.depth) return 0;
    if (from->reflection_texture && from->transmission_texture) /* in bins these are greys */
        for (size_t c = 0; c < 3; c++) most = shd_larger(most, shd_bounced_most(from, c));
    else
        for (size_t c = 0; c < k.count; c++)
            most = shd_larger(most, fabs(k.reflection[c]) + fabs(k.transmission[c]));
    return most;
}

/* The least that objects are many. */
enum { MANY = 100 };

static double ray_of(const shd_plan *plan, size_t object) {
    const shd_object *from = &plan->scene->objects[object];
    const bool folded =
        from->shape == SHD_MESH || from->shape == SHD_TORUS || from->interpolation != SHD_PHONG;
    if (folded || plan->scene->object_count >= MANY) return LONG_RAY;
    return plan->scene->object_count > 1 ? AMONG : ALONE;
}

/* What is done for a point to know what arrives of the lights of an object. */
static double find_arriving(const shd_plan *plan, size_t object) {
    const shd_trace *trace = &plan->scene->trace;
    const shd_plan_object *lit = &plan->objects[object];
    const double ray = ray_of(plan, object);
    double sum = 0;
    for (size_t j = 0; trace->shadows && j < lit->light_count; j++)
        sum += LOOK + ray * (plan->lights[lit->lights[j]].shape ? trace->shadow_samples : 1);
    return sum;
}

shd_traced_cost shd_find_traced_cost(const shd_plan *plan, const shd_paths *paths, size_t object) {
    if (!shd_is_traced(plan->scene)) return (shd_traced_cost){0, 0};
    const brought b = find_brought(plan, object);
    const double from = kinds_of(&b) ? paths->steps : 0, lights = find_arriving(plan, object);
    return (shd_traced_cost){lights, from * (RAY + lights)};
}
