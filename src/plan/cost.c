#include "plan/cost.h"

#include "plan/bunches.h"
#include "plan/kernel_costs.h"
#include "plan/paths.h"
#include "plan/textures.h"

/* Nanoseconds with AVX-512 kernels, of the processor that kernel_costs.h names. On another one all
 * of them are longer or shorter by about the same factor. `tests/bench/costs.py` measures them
 * beside these estimates. */
static const double PIXEL = 0.4;        /* a pixel, to find out what its block may see */
static const double SAMPLE = 1.8;       /* a hit, from light sums to the film */
static const double WIDE_SAMPLE = 4.5;  /* the same if it is lit in f64 */
static const double EXACT_SAMPLE = 1.2; /* more in the exact tier, which keeps positions in f64 */
static const double FACET = 3;          /* a hit between points that are lit */
static const double WIDE_SPOT = 2.5;    /* how many other lights a spot costs in f64 */
static const double BALL = 3.5;         /* a ray at a sphere that stays one, in a tier in f32 */
static const double WIDE_BALL = 6.5;    /* the same if more digits are wanted */
static const double BUNDLE_RAY = 4.5;   /* a ray at a mesh */
static const double TRIANGLE_RAY =
    3.5;                             /* more for each triangle that a block's rays are tried at */
static const double TRIANGLE = 350;  /* a triangle of a mesh, to make it findable */
static const double FOOTPRINT = 120; /* a place on a chart, and what is seen around it */
static const double PICTURE = 500;   /* a picture's mean over that */
static const double FRAME = 150;     /* a map's normal, turned to the world */

/* What rays, and samples, cost with other kernels, times these. */
static const double slower_rays[SHD_ISA_COUNT] = {
    [SHD_PORTABLE] = 3, [SHD_AVX2] = 1.65, [SHD_AVX512] = 1};
static const double slower_samples[SHD_ISA_COUNT] = {
    [SHD_PORTABLE] = 2.2, [SHD_AVX2] = 1.5, [SHD_AVX512] = 1};

/* A ray at an object that its block of pixels may see. */
static const double rays[SHD_SHAPE_COUNT] = {
    [SHD_SPHERE] = 9.5, [SHD_PLANE] = 5.5, [SHD_DISC] = 4,  [SHD_BOX] = 7,
    [SHD_CYLINDER] = 7, [SHD_CONE] = 5.5,  [SHD_TORUS] = 8,
};

/* Pixels on a side of a block, whose rays are cast at what it may see. */
static const double BLOCK = 8;

/* How much of its box's outline a shape fills, about. A sphere fills its own outline. */
static const double fills[SHD_SHAPE_COUNT] = {
    [SHD_SPHERE] = SHD_PI, [SHD_DISC] = SHD_PI, [SHD_BOX] = 4,    [SHD_CYLINDER] = 3.5,
    [SHD_CONE] = 2.2,      [SHD_TORUS] = 2.4,   [SHD_MESH] = 1.7,
};

/* How much of the picture a plane fills, about. */
static const double PLANE_FILLS = 0.8;

/* ---- Outlines. ---- */

static shd_vec3 scaled_column(const shd_affine *m, int c, double scale) {
    return (shd_vec3){scale * m->linear[0][c], scale * m->linear[1][c], scale * m->linear[2][c]};
}

/* By how much an object's transform scales lengths. */
static void measure_stretch(const shd_object *object, double *least, double *most) {
    const shd_affine *m = &object->transform;
    const double x = shd_length(scaled_column(m, 0, 1)), y = shd_length(scaled_column(m, 1, 1)),
                 z = shd_length(scaled_column(m, 2, 1));
    *least = fmin(fmin(x, y), z);
    *most = fmax(fmax(x, y), z);
}

/* An object on the picture, about, in pixels. */
typedef struct outline {
    double area; /* what it fills */
    double met;  /* what the blocks have that may see it */
} outline;

/* A rectangle, in pixels from the picture's middle. */
typedef struct frame {
    double left, right, bottom, top;
} frame;

/* Pixels that a length of 1 is long at distance 1, or anywhere in an orthographic camera. */
static double pixels_of(const shd_scene *scene) {
    return scene->raster.height / (2 * shd_half_height(&scene->camera));
}

/* Finds the rectangle around the corners of an object's box. False: some are behind the camera. */
static bool find_frame(const shd_scene *scene, const shd_object *object, double pixels,
                       shd_vec3 low, shd_vec3 high, frame *out) {
    const shd_camera *camera = &scene->camera;
    const shd_affine *m = &object->transform;
    frame f = {INFINITY, -INFINITY, INFINITY, -INFINITY};
    /* What each end of the box's sides makes of the sum that shd_transform has. */
    const shd_vec3 x_ends[2] = {scaled_column(m, 0, low.x), scaled_column(m, 0, high.x)},
                   y_ends[2] = {scaled_column(m, 1, low.y), scaled_column(m, 1, high.y)},
                   z_ends[2] = {scaled_column(m, 2, low.z), scaled_column(m, 2, high.z)};
    for (int corner = 0; corner < 8; corner++) {
        const shd_vec3 side = shd_add(x_ends[corner & 1], y_ends[corner >> 1 & 1]),
                       at = shd_add(shd_add(side, z_ends[corner >> 2]), m->origin),
                       v = shd_sub(at, camera->position);
        const double depth = -shd_dot(camera->back, v),
                     scale = camera->projection == SHD_PERSPECTIVE ? pixels / depth : pixels;
        if (!(depth > 0)) return false;
        const double x = shd_dot(camera->right, v) * scale, y = shd_dot(camera->up, v) * scale;
        f = (frame){shd_smaller(x, f.left), shd_larger(x, f.right), shd_smaller(y, f.bottom),
                    shd_larger(y, f.top)};
    }
    *out = f;
    return true;
}

static double area_of(const frame *f) {
    return fmax(f->right - f->left, 0) * fmax(f->top - f->bottom, 0);
}

/* The area that a shape fills, seen along `view` from far away, in the world's lengths. */
static double seen_of(const shd_object *object, shd_vec3 low, shd_vec3 high, shd_vec3 view) {
    const shd_vec3 size = shd_scale(shd_sub(high, low), 0.5);
    const shd_vec3 a = scaled_column(&object->transform, 0, size.x),
                   b = scaled_column(&object->transform, 1, size.y),
                   c = scaled_column(&object->transform, 2, size.z);
    const double x = fabs(shd_dot(view, shd_cross(b, c))), y = fabs(shd_dot(view, shd_cross(c, a))),
                 z = fabs(shd_dot(view, shd_cross(a, b)));
    return fills[object->shape] *
           (object->shape == SHD_SPHERE ? sqrt(x * x + y * y + z * z) : x + y + z);
}

/* `per_length`: as pixels_of has it; `most`: as measure_stretch has. */
static outline outline_of(const shd_plan *plan, size_t index, double per_length, double most) {
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    const shd_object *object = &scene->objects[index];
    const double w = scene->raster.width, h = scene->raster.height, all = w * h;
    double radius = plan->objects[index].radius; /* of a sphere around the object */
    if (object->shape == SHD_SPHERE) radius = fmin(radius, object->radius * most);
    shd_vec3 low, high, view = camera->back;
    if (!shd_object_box(object, &low, &high)) return (outline){PLANE_FILLS * all, all};
    double pixels = per_length;
    const shd_vec3 path = shd_sub(camera->position, plan->objects[index].center);
    if (shd_dot(camera->back, path) <= -radius) return (outline){0, 0}; /* behind the camera */
    if (camera->projection == SHD_PERSPECTIVE) {
        const double distance = shd_length(path);
        if (distance > radius) view = shd_scale(path, 1 / distance);
        pixels /= fmax(distance, radius);
    }
    frame whole = {-w / 2, w / 2, -h / 2, h / 2};
    find_frame(scene, object, per_length, low, high, &whole);
    const frame part = {fmax(whole.left, -w / 2), fmin(whole.right, w / 2),
                        fmax(whole.bottom, -h / 2), fmin(whole.top, h / 2)};
    if (!(part.left <= part.right && part.bottom <= part.top)) return (outline){0, 0};
    /* Nothing beside the picture is seen. Blocks are left out that neither the frame nor the circle
     * around the object, widened by half of their diagonals, reaches. */
    const double seen = seen_of(object, low, high, view) * pixels * pixels,
                 shown = area_of(&part) / area_of(&whole),
                 around = radius * pixels + BLOCK * sqrt(0.5);
    const double framed = (part.right - part.left + BLOCK) * (part.top - part.bottom + BLOCK);
    return (outline){fmin(seen * fmin(shown, 1), area_of(&part)),
                     fmin(fmin(framed, SHD_PI * around * around), all)};
}

/* ---- Rays and lights. ---- */

static size_t triangles_of(const shd_object *object) {
    if (object->shape == SHD_MESH) return object->mesh->triangle_count;
    if (object->interpolation == SHD_PHONG) return 0;
    return shd_tessellation_triangles(object->shape, object->segments);
}

/* What a map of normals costs at the faces or corners of an object that is lit there. */
static double mapped_facets(const shd_plan *plan, size_t index) {
    const shd_object *object = &plan->scene->objects[index];
    if (object->interpolation == SHD_PHONG ||
        !plan->materials[plan->objects[index].material].normal)
        return 0;
    const double looks = object->interpolation == SHD_FLAT ? 1 : 3;
    return looks * (double)triangles_of(object) * (FOOTPRINT + PICTURE + FRAME);
}

size_t shd_plan_built_triangles(const shd_scene *scene, size_t index) {
    const shd_object *object = &scene->objects[index];
    const shd_mesh *mesh = object->mesh;
    if (mesh && (mesh->kept || (mesh->shared && mesh->first < index))) return 0;
    return triangles_of(object);
}

/* Half of the triangles face the camera, side by side, and the other half is behind them. A block's
 * rays are tried in rows at those that reach into it. */
static double mesh_ray(size_t triangles, const outline *o) {
    const double count = fmax(0.5 * (double)triangles, 1), each = fmax(o->area, 1) / count,
                 side = sqrt(each), reaching = (side + BLOCK) * (side + BLOCK) / each;
    return BUNDLE_RAY + TRIANGLE_RAY * reaching * fmin((side + 1) / BLOCK, 1);
}

/* What a ray costs that may meet the object. `least` and `most`: as measure_stretch has them. */
static double cast_of(const shd_plan *plan, const shd_object *object, const outline *o,
                      double least, double most, shd_tier tier) {
    const size_t triangles = triangles_of(object);
    double ray = rays[object->shape];
    if (triangles)
        ray = mesh_ray(triangles, o);
    else if (object->shape == SHD_SPHERE && most <= 1.000001 * least)
        ray = tier == SHD_EXACT || plan->split_positions ? WIDE_BALL : BALL;
    return ray * slower_rays[plan->isa];
}

/* What a light costs on the average, times the table's. Spots are dearer in f64, in which spots too
 * steep for f32 are summed in any tier. */
static double light_factor(const shd_plan *plan, const shd_kernel_cost *costs, shd_tier tier) {
    double sum = 0;
    for (size_t i = 0; i < plan->light_count; i++) {
        const shd_plan_light *light = &plan->lights[i];
        const double wide = light->spot ? WIDE_SPOT : 1;
        sum += tier == SHD_EXACT ? wide : 1;
        if (light->steep && tier != SHD_EXACT)
            sum += wide * costs[SHD_EXACT].light / costs[tier].light;
    }
    return plan->light_count ? sum / (double)plan->light_count : 1;
}

/* What a sample's footprint on a chart costs, the means of patterns over it, and how far highlights
 * are widened there. */
static double patterns_of(const shd_plan_material *material, bool faceted) {
    static const double MEAN = 150, BEND = 150, WIDEN = 15;
    const shd_plan_textures *textures = material->textures;
    double sum = textures ? FOOTPRINT : 0;
    for (size_t p = 0; textures && p < textures->pattern_count; p++)
        sum += textures->patterns[p].picture ? PICTURE : MEAN;
    for (int k = 0; textures && k < SHD_RAY_COEFFICIENTS; k++)
        if (textures->rays[k].texture)
            sum += textures->rays[k].texture->pattern.picture ? PICTURE : MEAN;
    if (faceted) return sum;
    if (!textures && (material->normal || material->gloss)) sum += FOOTPRINT;
    if (material->normal) sum += FRAME + (material->normal->pattern.picture ? PICTURE : MEAN);
    for (size_t k = 0; material->gloss && k < material->lobe_count; k++)
        if (material->gloss[k].texture)
            sum += material->gloss[k].texture->pattern.picture ? PICTURE : MEAN;
    if (material->antialiased) sum += BEND + WIDEN * (double)material->lobe_count;
    return sum;
}

/* Lights that cost as much as all of the object's lights, where most are told together
 * (shade/far.h): looking at them, and what is left to be lit. That is what is near, what is at the
 * horizon of some point of a block, and what may have a highlight there. `area`: in pixels. */
static double told_lights(const shd_plan *plan, size_t index, double area) {
    static const double LOOK = 0.18, NEAR = 0.02, FAINT = 7 /* exp(-7) is little */,
                        LIT = 1.6 /* what one costs that is neither behind nor dull, of all */;
    const shd_plan_object *lit = &plan->objects[index];
    const shd_plan_material *m = &plan->materials[lit->material];
    const double all = (double)lit->light_count;
    if (!plan->bunches || all < SHD_BUNCHES_LEAST || !m->has_diffuse || m->textures) return all;
    const shd_object *object = &plan->scene->objects[index];
    const bool round = shd_is_curved(object) || object->shape == SHD_MESH;
    const double turn = round ? BLOCK * sqrt(0.5) / sqrt(fmax(area, 1) / SHD_PI) : 0;
    double widest = 0;
    for (size_t k = 0; k < m->lobe_count; k++)
        widest = fmax(widest, acos(fmax(1 - FAINT / fmax(m->lobes[k].shininess, 1e-9), -1)));
    const double glitter = m->lobe_count ? 0.5 * (1 - cos(fmin(widest + 2 * turn, SHD_PI))) : 0;
    return all * fmin(LOOK + LIT * (NEAR + turn + glitter), 1 + LOOK);
}

/* What the light costs of a ray that meets the object, which fills `area` pixels. */
static double light_of(const shd_plan *plan, size_t index, const shd_kernel_cost *cost,
                       double factor, double area, shd_tier tier) {
    const shd_plan_object *lit = &plan->objects[index];
    const double lobes = (double)plan->materials[lit->material].lobe_count;
    const double slower = slower_samples[plan->isa];
    if (plan->scene->objects[index].interpolation != SHD_PHONG)
        return SAMPLE * slower + FACET + patterns_of(&plan->materials[lit->material], true);
    const double sample = slower * (tier == SHD_EXACT ? WIDE_SAMPLE + EXACT_SAMPLE : SAMPLE) +
                          patterns_of(&plan->materials[lit->material], false);
    const double light = factor * cost->light + lobes * cost->lobe;
    if (!plan->extended) {
        const double lights =
            tier == SHD_EXACT ? (double)lit->light_count : told_lights(plan, index, area);
        return sample + lights * light;
    }
    const shd_plan_textures *textures = plan->materials[lit->material].textures;
    const double parts = textures && textures->part_count ? (double)textures->part_count : 1;
    double sum = sample;
    for (size_t j = 0; j < lit->light_count; j++)
        sum += parts * slower *
               shd_beyond_cost(plan, &plan->materials[lit->material], &plan->lights[lit->lights[j]],
                               tier, light / slower);
    return sum;
}

/* The samples of a pixel that shows the object, on the average: where a surface is smooth, some in
 * three of four pixels of a ball or a plane take one. */
static double samples_of(const shd_plan *plan, const shd_object *object) {
    static const double SMOOTH = 0.75;
    const double samples = plan->scene->raster.samples;
    const bool bends =
        shd_plan_is_thin(plan) && (object->shape == SHD_SPHERE || object->shape == SHD_PLANE);
    return bends ? samples - SMOOTH * (samples - 1) : samples;
}

/* What is left of the cost of rays and of light at an object of which some blocks are sketched, as
 * callgrind counts them (tests/bench/instructions.py). */
static void sketch_costs(const shd_plan *plan, size_t index, double *rays_left,
                         double *light_left) {
    static const double RAYS = 0.4, LIGHT = 0.8, MESH_RAYS = 0.6, MESH_LIGHT = 0.9;
    const bool mesh = plan->scene->objects[index].shape == SHD_MESH;
    *rays_left = *light_left = 1;
    if (!plan->sketched) return;
    *rays_left = mesh ? MESH_RAYS : RAYS;
    *light_left = mesh ? MESH_LIGHT : LIGHT;
}

const shd_kernel_cost *shd_plan_kernel_costs(const shd_plan *plan) {
    return shd_kernel_costs[plan->isa];
}

shd_ray_cost shd_plan_ray_cost(const shd_plan *plan, shd_tier tier, const shd_kernel_cost *costs) {
    const shd_scene *scene = plan->scene;
    const double all = (double)scene->raster.width * scene->raster.height;
    const double factor = light_factor(plan, costs, tier);
    const shd_paths paths = shd_find_paths(plan);
    const double per_length = pixels_of(scene);
    double covered = 0;
    shd_ray_cost cost = {.rays = PIXEL};
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_object *object = &scene->objects[i];
        double least, most;
        measure_stretch(object, &least, &most);
        const outline o = outline_of(plan, i, per_length, most);
        const double samples = samples_of(plan, object);
        covered += o.area / all;
        double rays_left, light_left;
        sketch_costs(plan, i, &rays_left, &light_left);
        cost.rays +=
            samples * o.met / all * cast_of(plan, object, &o, least, most, tier) * rays_left;
        cost.light += samples * o.area / all *
                      light_of(plan, i, &costs[tier], factor, o.area, tier) * light_left;
        const shd_traced_cost traced = shd_find_traced_cost(plan, &paths, i);
        cost.shadow += samples * o.area / all * traced.shadow;
        cost.trace += samples * o.area / all * traced.trace;
        cost.meshes += (double)shd_plan_built_triangles(scene, i) * TRIANGLE;
        cost.meshes += mapped_facets(plan, i);
    }
    /* Objects are taken to be side by side until the picture is full, and then before each other:
     * rays are cast at each, and the nearest one is lit. */
    if (covered > 1) {
        cost.light /= covered;
        cost.shadow /= covered;
        cost.trace /= covered;
    }
    return cost;
}

double shd_plan_most_cost(const shd_plan *plan, shd_tier tier, const shd_kernel_cost *costs) {
    static const double FILLED = 6; /* times the radius' square: no shape fills more (seen_of) */
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    const double all = (double)scene->raster.width * scene->raster.height,
                 factor = light_factor(plan, costs, tier), per_length = pixels_of(scene);
    double sum = 0;
    if (plan->bunches || plan->extended) return INFINITY;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *bounds = &plan->objects[i];
        if (triangles_of(&scene->objects[i])) return INFINITY;
        double met = all, area = all;
        if (bounds->bounded) {
            const double distance = shd_length(shd_sub(camera->position, bounds->center)),
                         pixels = camera->projection == SHD_PERSPECTIVE
                                      ? per_length / shd_larger(distance, bounds->radius)
                                      : per_length,
                         reach = bounds->radius * pixels, around = reach + BLOCK * sqrt(0.5);
            met = shd_smaller(SHD_PI * around * around, all);
            area = shd_smaller(FILLED * reach * reach, all);
        }
        sum += met * rays[scene->objects[i].shape] * slower_rays[plan->isa] +
               area * light_of(plan, i, &costs[tier], factor, area, tier);
    }
    return PIXEL + scene->raster.samples * sum / all;
}

void shd_plan_rank_tiers(const shd_plan *plan, const shd_kernel_cost *costs,
                         shd_tier out[SHD_EXACT + 1]) {
    double total[SHD_EXACT + 1];
    for (int t = 0; t <= SHD_EXACT; t++) {
        const shd_ray_cost cost = shd_plan_ray_cost(plan, (shd_tier)t, costs);
        total[t] = cost.rays + cost.light;
        int at = t;
        for (; at > 0 && total[t] <= total[out[at - 1]]; at--) out[at] = out[at - 1];
        out[at] = (shd_tier)t;
    }
}
