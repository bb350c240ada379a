#include "bound/light/extended.h"

#include "bound/light/brightest.h"
#include "bound/light/error.h"
#include "bound/light/met.h"
#include "bound/light/misplaced.h"
#include "bound/light/sums.h"
#include "plan/around.h"

/* ---- Lights at a piece. ---- */

/* What is found of an object's pieces. */
typedef struct finding {
    shd_lit_errors sums; /* of the piece in question */
    double steps;        /* on straight rays, by as much more f64 misplaces points */
    shd_misplaced misplaced;
} finding;

/* The direction to the eye from the piece's middle; those from its other points are within the
 * spread. */
static shd_vec3 toward_eye(const shd_scene *scene, const shd_piece *piece, shd_angle *spread) {
    const shd_camera *camera = &scene->camera;
    *spread = (shd_angle){1, 0};
    if (camera->projection == SHD_ORTHOGRAPHIC) return camera->back;
    const shd_vec3 path = shd_sub(camera->position, piece->center);
    const double distance = shd_plan_length(path);
    *spread = distance > 0 && isfinite(piece->radius) ? shd_seen_from(piece->radius, 1 / distance)
                                                      : SHD_ANY_ANGLE;
    return distance > 0 ? shd_scale(path, 1 / distance) : camera->back;
}

/* The least N.V at a flat piece: the eye's height over it, of the longest way there; 0: it is not
 * known. */
static double least_flat_view(const finding *f, const shd_piece *piece) {
    const shd_camera *camera = &f->sums.plan->scene->camera;
    const shd_vec3 path = shd_sub(piece->center, camera->position);
    if (camera->projection == SHD_ORTHOGRAPHIC)
        return fabs(shd_dot(piece->axis, camera->back)) - SHD_WEIGHT_DIRECTION;
    const double height =
        fabs(shd_dot(piece->axis, path)) - 4 * SHD_HIT_ROUNDING * f->misplaced.span;
    return height / (shd_plan_length(path) + piece->radius);
}

/* The least N.V at the piece, seen from the eye, that counts. Flat ones may all be seen as flatly,
 * but for the horizon of infinite planes. */
static double least_view(const finding *f, const shd_piece *piece, shd_vec3 eye, shd_angle eyes) {
    if (!f->misplaced.smooth && piece->spread.cosine >= 1) {
        const double flat = least_flat_view(f, piece);
        if (flat > 0) return flat;
    }
    const double facing = shd_cosine_more(shd_angle_of(shd_dot(piece->axis, eye)),
                                          shd_angle_sum(eyes, piece->spread));
    return shd_larger(facing, f->misplaced.grazing > 0 ? f->misplaced.grazing : 1e-4);
}

static void see_piece(const finding *f, const shd_piece *piece, const shd_plan_light *light,
                      shd_glance *g) {
    shd_angle eyes, lights = {1, 0};
    const shd_vec3 eye = toward_eye(f->sums.plan->scene, piece, &eyes);
    shd_vec3 toward = light->toward;
    if (!light->directional) {
        const shd_vec3 path = shd_sub(light->position, piece->center);
        const double distance = shd_plan_length(path);
        lights = distance > 0 && isfinite(piece->radius)
                     ? shd_seen_from(piece->radius, 1 / distance)
                     : SHD_ANY_ANGLE;
        toward = distance > 0 ? shd_scale(path, 1 / distance) : eye;
    }
    g->drifts = g->narrow = false;
    const double between =
        shd_cosine_more(shd_angle_of(shd_dot(eye, toward)), shd_angle_sum(eyes, lights));
    g->view = least_view(f, piece, eye, eyes);
    /* |L + V| is 2 V.H, and no less than N.V where the light is before the surface. */
    g->half = shd_larger(sqrt(shd_larger((1 + between) / 2, 0)), g->view / 2);
    double beyond;
    g->place = f->steps * shd_misplaced_at(f->sums.plan->scene, &f->misplaced, piece, light,
                                           g->lit.nearest, &beyond);
    beyond *= f->steps;
    /* Normals are turned by as much less as rays meet the surface more upright. */
    const double turned = f->misplaced.turned * shd_smaller(1, f->misplaced.grazing / g->view);
    g->direction = SHD_WEIGHT_DIRECTION + g->place + beyond + 2 * turned;
    if (f->sums.material->model != SHD_MODEL_WESTIN) return;
    const double moved = f->steps * SHD_HIT_ROUNDING * f->misplaced.span / g->view;
    g->around = shd_turned_around(&f->sums.place, f->sums.material->normal, moved,
                                  SHD_WEIGHT_DIRECTION + turned);
}

/* By how much directions to points of a shape, their lengths and normals are off together. Out on
 * an infinite plane a light is half as far away as the eye at least, if it is no larger than the
 * way to it is long. Heights over the plane are off by rounding of that way, which is some of
 * SHD_WEIGHT_DIRECTION in N.L; and what the plane's point is beside by along it changes N.L and
 * lengths by as much of themselves. N.L counts from 1e-4 on (shd_add_share), where that is no more
 * than what ends the function adds. */
static double off_of_shape(const finding *f, const shd_piece *piece, const shd_plan_light *light) {
    const shd_scene *scene = f->sums.plan->scene;
    const shd_misplaced *m = &f->misplaced;
    const double nearest = shd_shape_distance(&f->sums.place, light->shape),
                 reach = shd_light_reach(light->shape);
    shd_angle eyes;
    const shd_vec3 eye = toward_eye(scene, piece, &eyes);
    const double view = least_view(f, piece, eye, eyes),
                 turned = m->turned * shd_smaller(1, m->grazing / view);
    double beyond, far = 0;
    if (!(nearest > 0)) return 1;
    const double place = f->steps * shd_misplaced_at(scene, m, piece, light, nearest, &beyond);
    if (m->plane && scene->camera.projection != SHD_ORTHOGRAPHIC) {
        const double height = fabs(shd_dot(m->normal, shd_sub(m->point, scene->camera.position))),
                     above = reach +
                             fabs(shd_dot(m->normal, shd_sub(light->shape->position, m->point))),
                     away = shd_length(shd_sub(light->shape->position, scene->camera.position));
        if (!(reach <= away + height)) return 1;
        far = f->steps * 4 * SHD_HIT_ROUNDING * (m->span * 1e-4 + 2 * above) / height;
    }
    return 4 * SHD_WEIGHT_DIRECTION + place + 2 * turned + far;
}

/* Where a flat shape is above the piece by h, or the piece above it, no point of it is nearer.
 * Light at the corners of facets counts for all of them, however these are seen. */
static shd_stance find_stance(const finding *f, const shd_piece *piece,
                              const shd_plan_light *light) {
    static const double LESS = 1 - 1e-12;
    const shd_light *shape = light->shape;
    const double reach = shd_light_reach(shape);
    shd_stance out = {.nearest = shd_shape_distance(&f->sums.place, shape)};
    if (f->sums.place.object->interpolation != SHD_PHONG || !isfinite(piece->radius)) return out;
    const shd_vec3 path = shd_sub(shape->position, piece->center);
    const double distance = shd_plan_length(path), beside = distance - piece->radius - reach,
                 before = shape->type == SHD_LIGHT_SPHERE
                              ? 0
                              : -shd_dot(path, shape->direction) - piece->radius;
    out.nearest = LESS * shd_larger(out.nearest, shd_larger(beside, before));
    shd_angle eyes;
    const shd_vec3 eye = toward_eye(f->sums.plan->scene, piece, &eyes);
    out.view = least_view(f, piece, eye, eyes);
    if (!(distance > 0)) return out;
    const shd_angle lights = shd_seen_from(piece->radius + reach, 1 / distance),
                    between = shd_angle_of(shd_dot(eye, path) / distance);
    const double cosine = shd_cosine_more(between, shd_angle_sum(eyes, lights));
    out.half = LESS * sqrt(shd_larger((1 + cosine) / 2 - 1e-15, 0));
    return out;
}

/* Makes of what f64 does what f32 does: errors of directions by rounding of positions, of lights
 * and of points, are those of Phong's model. */
static void see_narrowly(const finding *f, const shd_plan_light *light, shd_glance *g) {
    const shd_path path = light->directional                 ? SHD_PATH_DIRECTIONAL
                          : light->attenuated || light->spot ? SHD_PATH_ATTENUATED
                                                             : SHD_PATH_POINT;
    const shd_moved moved = shd_moved_by_f32(f->sums.plan, &f->sums.place, light);
    g->narrow = true;
    g->relative = shd_path_error_of(SHD_ROUNDS_FUSED, path)->relative;
    g->place = moved.far + (moved.near > 0 ? moved.near / g->lit.nearest : 0);
    g->place = shd_smaller(g->place, 1);
    g->direction = SHD_WEIGHT_DIRECTION32 + g->place;
}

static void add_light(finding *f, const shd_piece *piece, const shd_plan_light *light) {
    shd_lit_errors *sums = &f->sums;
    if (sums->noise) {
        shd_add_noise(sums, piece, light);
        return;
    }
    if (sums->only_sums && !light->environment) return; /* all tiers sum it as one */
    if (light->environment) {
        shd_glance g = {.lit = {.nearest = INFINITY}};
        see_piece(f, piece, light, &g);
        shd_add_environment(sums, light, &g);
        return;
    }
    if (light->shape) {
        const shd_stance at = find_stance(f, piece, light);
        shd_add_shape(sums, light, &at);
        if (sums->plan->scene->trace.shadows)
            shd_add_share(sums, light, &at, off_of_shape(f, piece, light));
        return;
    }
    const double least = light->directional ? 0 : shd_least_distance(&sums->place, light->position);
    shd_glance g;
    if (!shd_piece_lit(sums->plan->scene, piece, light, least, &g.lit)) return;
    see_piece(f, piece, light, &g);
    shd_add_terms(sums, light, &g);
    if (!shd_has_models32(sums->plan)) return;
    see_narrowly(f, light, &g);
    shd_add_narrow_terms(sums, light, &g);
}

/* ---- The picture. ---- */

bool shd_errs_otherwise(const shd_plan *plan) {
    if (!plan->extended) return false;
    if (plan->scene->trace.depth || plan->bins || plan->scene->backdrop || plan->antialiased ||
        plan->bumped || plan->glossed)
        return true;
    for (size_t j = 0; j < plan->light_count; j++)
        if (plan->lights[j].shape || plan->lights[j].environment) return true;
    for (size_t m = 0; m < plan->scene->material_count; m++)
        if (plan->materials[m].model != SHD_MODEL_PHONG) return true;
    return false;
}

/* What has an estimate beside its bound. */
typedef struct loose {
    bool simulated, summed; /* microgeometry; other models under lights with a shape */
} loose;

static loose find_loose(const shd_plan *plan) {
    loose out = {false, false};
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *m = &plan->materials[object->material];
        out.simulated |= m->model == SHD_MODEL_WESTIN && object->light_count;
        for (size_t j = 0; m->model != SHD_MODEL_PHONG && j < object->light_count; j++)
            out.summed |= plan->lights[object->lights[j]].shape != NULL;
    }
    return out;
}

/* How far rays may be beside where they should be, over what is counted for the object: a ray that
 * goes straight on begins where f64 put the last hit, which is off by the lengths on the way to it.
 */
static double find_steps(const shd_plan *plan, const shd_misplaced *own) {
    const shd_scene *scene = plan->scene;
    double span = 0;
    for (size_t i = 0; i < scene->object_count && scene->trace.depth; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        if (!shd_lets_through(plan, i)) continue;
        const shd_place place = shd_place_of(&scene->objects[i], &plan->objects[i]);
        const shd_misplaced there = shd_misplaced_of(scene, &place);
        span = shd_larger(span, there.span);
    }
    return span > 0 ? 1 + scene->trace.depth * (1 + span / own->span) : 1;
}

/* Whether points as far away as one likes have any normals, and a light that is somewhere. */
static bool is_mapped_to_horizon(const shd_plan *plan, size_t index) {
    const shd_plan_object *object = &plan->objects[index];
    if (object->bounded || !plan->materials[object->material].normal) return false;
    for (size_t j = 0; j < object->light_count; j++) {
        const shd_plan_light *light = &plan->lights[object->lights[j]];
        if (!light->directional && !light->environment) return true;
    }
    return false;
}

/* At any piece of the object. */
static shd_brought look_at(const shd_plan *plan, size_t index, bool estimated, bool only_sums,
                           const double *noise, double rounding) {
    enum { FINENESS = 2 };
    const shd_scene *scene = plan->scene;
    const shd_plan_object *bounds = &plan->objects[index];
    const shd_plan_material *m = &plan->materials[bounds->material];
    finding f = {.sums = {.plan = plan,
                          .material = m,
                          .place = shd_place_of(&scene->objects[index], bounds),
                          .estimated = estimated,
                          .only_sums = only_sums}};
    if (noise && m->model == SHD_MODEL_WESTIN) f.sums.noise = &noise[bounds->material];
    f.misplaced = shd_misplaced_of(scene, &f.sums.place);
    f.steps = find_steps(plan, &f.misplaced);
    f.misplaced.turned = shd_smaller(f.steps * f.misplaced.turned, 1);
    f.misplaced.grazing *= sqrt(f.steps);
    shd_piece pieces[SHD_MOST_PIECES];
    const size_t count = shd_plan_pieces(scene, index, bounds, FINENESS, plan->cancelled, pieces);
    shd_brought out = {0, 0};
    if (count && is_mapped_to_horizon(plan, index)) return (shd_brought){INFINITY, INFINITY};
    for (size_t p = 0; p < count && !shd_is_cancelled(plan->cancelled); p++) {
        shd_begin_errors(&f.sums, &scene->objects[index]);
        for (size_t j = 0; j < bounds->light_count; j++)
            add_light(&f, &pieces[p], &plan->lights[bounds->lights[j]]);
        for (int c = 0; c < 3; c++) {
            out.most = shd_larger(out.most, f.sums.most[c]);
            out.error = shd_larger(out.error, f.sums.error[c] + rounding * f.sums.most[c]);
        }
    }
    return out;
}

/* ---- The picture. ---- */

/* Over a transparent background a color is what rays bring over their alpha a, 1 - the mean of what
 * is let through. In any channel what is seen adds up to no more than 3 a, and so errors do. That
 * of a itself is some roundings of 1, which matter where little is seen. */
static double divided_by_alpha(const shd_plan *plan, shd_brought all) {
    const shd_scene *scene = plan->scene;
    double least = 1;
    bool any = false;
    for (size_t i = 0; i < scene->object_count && scene->transparent; i++) {
        if (!shd_lets_through(plan, i)) continue;
        const double mean = shd_mean_share(plan, shd_coefficients_of(plan, i).opacity);
        const bool varies = plan->materials[plan->objects[i].material].from->opacity_texture;
        if (mean > 0 || varies) least = shd_smaller(least, mean);
        any = true;
    }
    if (!any) return all.error;
    if (!(least > 0)) return INFINITY; /* where a pattern lets nearly all through */
    const double alpha = 0x1p-47 / least + (scene->raster.samples + 6) * 0x1p-24;
    return least > 1e-30 ? 3 * (all.error + alpha * all.most) : INFINITY;
}

/* Of colors, and once more of what rays have met, by what they have gone through. */
static double rounding_of(const shd_plan *plan) {
    const shd_tier tier = shd_has_models32(plan) ? SHD_STANDARD : SHD_EXACT;
    return shd_color_error(plan, tier) + (plan->scene->trace.depth ? 0x1p-24 : 0);
}

/* Of all that is lit by weights whose error is known. Of surfaces behind each other, what is seen
 * is a mean, so that no error is more than the largest of one. */
static double picture_error(const shd_plan *plan, bool estimated, bool only_sums,
                            const double *noise, const shd_brought *beyond) {
    const shd_scene *scene = plan->scene;
    const double rounding = rounding_of(plan), behind = shd_background_most(plan);
    /* Rays of the eye have their directions to within rounding. */
    shd_brought all = {behind, rounding * behind + SHD_WEIGHT_DIRECTION * shd_backdrop_slope(plan)};
    for (size_t i = 0; i < scene->object_count; i++)
        shd_add_beyond(plan, i, look_at(plan, i, estimated, only_sums, noise, rounding), beyond,
                       &all);
    const double error = divided_by_alpha(plan, all);
    return error < 1e37 && !plan->beyond ? error : INFINITY;
}

const char *shd_no_linear_bound(void) {
    return "a light may touch a surface, a value exceed what floats hold, or a plane with a map of "
           "normals have a light at some place";
}

double shd_extended_error(const shd_plan *plan) {
    const shd_brought beyond = shd_find_beyond(plan, rounding_of(plan), false);
    return picture_error(plan, false, false, NULL, &beyond);
}

double shd_sums_error(const shd_plan *plan) {
    const shd_brought beyond = shd_find_beyond(plan, rounding_of(plan), false);
    return picture_error(plan, false, true, NULL, &beyond);
}

/* Whether channels of the map make none less that is seen. */
static bool keeps_signs(const shd_light *environment) {
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++)
            if (environment->of_map[k][c] < 0) return false;
    return true;
}

double shd_quick_share(const shd_plan *plan) {
    bool walked = false, keeps = true;
    for (size_t m = 0; m < plan->scene->material_count; m++)
        for (size_t t = 0; t < 1 + plan->materials[m].lobe_count; t++)
            walked |= shd_may_be_walked(&plan->materials[m], t);
    for (size_t j = 0; j < plan->light_count; j++)
        keeps &= !plan->lights[j].environment || keeps_signs(plan->lights[j].environment);
    if (!plan->glows || !walked) return 0;
    return keeps && shd_adds_up(plan) ? SHD_QUICK_SHARE : -1;
}

double shd_linear_estimate(const shd_plan *plan, const double *noise) {
    const loose l = find_loose(plan);
    if (!l.summed && !l.simulated) return INFINITY;
    if (l.simulated && !noise) return INFINITY;
    const shd_brought beyond = shd_find_beyond(plan, rounding_of(plan), true);
    return picture_error(plan, true, false, noise, &beyond);
}

const shd_strays *shd_find_strays(const shd_plan *plan, shd_arena *arena) {
    shd_strays *out = shd_arena_zalloc(arena, 1, sizeof *out);
    if (!out) return NULL;
    out->of = shd_arena_zalloc(arena, plan->scene->object_count, sizeof *out->of);
    if (!out->of) return NULL;
    shd_fill_strays(plan, rounding_of(plan), out);
    const shd_brought nothing = {0, 0};
    out->seen = picture_error(plan, false, false, NULL, &nothing);
    return out;
}
