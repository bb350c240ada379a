/* The errors of a light, or of a cluster of lights, at a piece. */
#include "bound/light/finding.h"

#include "plan/nodes.h"

/* What rounding to f32 moves a position by, in the frame's unit: half an ulp below 2 in three
 * coordinates. A light with larger coordinates is moved by as much more. */
static const double POSITION = 1.1e-7;

/* ---- A light at a piece. ---- */

static shd_path path_of(const shd_plan_light *light) {
    return light->directional                 ? SHD_PATH_DIRECTIONAL
           : light->attenuated || light->spot ? SHD_PATH_ATTENUATED
                                              : SHD_PATH_POINT;
}

/* As sight/ finds balls. */
static bool is_ellipsoid(const shd_object *object) {
    double axes[3];
    const shd_affine to_world = shd_object_to_world(object);
    return object->shape == SHD_SPHERE && !shd_is_similar(&to_world, axes);
}

void shd_set_path_errors(shd_finding *f) {
    const shd_rounding rounding = shd_rounding_of(f->tier, f->plan->isa);
    const bool sketched = f->plan->sketched, ellipsoid = sketched && is_ellipsoid(f->place.object);
    for (int p = 0; p < SHD_PATHS; p++)
        f->paths[p] = sketched ? shd_sketch_error_of(ellipsoid, (shd_path)p)
                               : shd_path_error_of(rounding, (shd_path)p);
}

/* `from_origin`: how far the light is away from the frame's. */
static shd_moved moved_by_f32(const shd_plan *plan, const shd_place *place,
                              const shd_plan_light *light, double from_origin) {
    const shd_plan_object *object = place->bounds;
    /* The exact tier rounds points where they are in the world. */
    const double away = object->bounded ? shd_plan_length(object->center) + object->radius
                                        : shd_plan_length(light->position);
    shd_moved out = {
        SHD_HIT_ROUNDING * (2 * shd_plan_length(place->object->transform.origin) + away), 0};
    /* A plane's coordinates grow with the distance. */
    if (!object->bounded) out.far = SHD_HIT_ROUNDING;
    if (plan->split_positions) return out;
    out.near +=
        POSITION * shd_plan_size(plan, object, light) / plan->scale + POSITION / 2 * from_origin;
    if (!object->bounded) out.far = POSITION;
    return out;
}

shd_moved shd_moved_by_f32(const shd_plan *plan, const shd_place *place,
                           const shd_plan_light *light) {
    if (light->directional) return (shd_moved){0, 0};
    return moved_by_f32(plan, place, light,
                        shd_plan_length(shd_sub(light->position, plan->origin)));
}

/* Sets what rounding of positions does to a light that is `from_origin` away from the frame's. */
static void place_source(const shd_finding *f, const shd_plan_light *light, double from_origin,
                         shd_source *to) {
    if (f->tier == SHD_EXACT) return;
    const shd_moved moved = moved_by_f32(f->plan, &f->place, light, from_origin);
    to->near = moved.near;
    to->far = moved.far;
}

shd_source shd_source_of(const shd_finding *f, uint32_t index) {
    const shd_place *place = &f->place;
    const shd_plan *plan = f->plan;
    const shd_plan_light *light = &plan->lights[index];
    shd_source s = {.light = light,
                    .error = f->paths[path_of(light)],
                    .term = f->terms.first[f->hues.of_light[index]],
                    .strength = f->hues.strength[index]};
    if (light->directional) return s;
    s.least = shd_least_distance(place, light->position);
    /* Facets are lit at points that nobody sees, too. */
    if (place->object->interpolation == SHD_PHONG) s.least = shd_larger(s.least, f->beside[index]);
    place_source(f, light, shd_plan_length(shd_sub(light->position, plan->origin)), &s);
    return s;
}

/* Whether pixels may take the mean of few nodes. */
static bool takes_nodes(const shd_finding *f) {
    const shd_shape shape = f->place.object->shape;
    return f->nodes && (shape == SHD_SPHERE || shape == SHD_PLANE);
}

/* How much of what samples err by is in a pixel's mean. */
static double spread_of(const shd_finding *f) {
    return takes_nodes(f) ? SHD_NODES_SPREAD : 1;
}

/* Adds what it changes of a light that points are elsewhere and their normals turned. */
static void add_misplaced(const shd_finding *f, const shd_plan_material *material,
                          const shd_source *from, const shd_piece *piece, const shd_lit *lit) {
    const double high = from->strength * lit->factor_high * spread_of(f),
                 turned = f->misplaced.turned;
    double beyond;
    const double moved =
        shd_misplaced_at(f->plan->scene, &f->misplaced, piece, from->light, lit->nearest, &beyond);
    const double distance = from->light->attenuated ? 2 * moved : 0;
    shd_much *to = &f->much[from->term];
    to->misplaced += high * (moved + beyond + turned + distance * lit->facing_high);
    for (size_t k = 0; k < material->lobe_count; k++) {
        const double most = shd_shine_most(lit->shine_high, material->lobes[k].shininess);
        shd_lobe_error turning = f->lobes[k];
        turning.square = 0; /* it is of the kernels' own rounding */
        to++;
        to->misplaced += high * (distance * most + shd_lobe_turned(&turning, lit->shine_high, most,
                                                                   moved + 2 * turned));
    }
}

/* Adds the light to the terms. Returns the most that it adds to any channel. */
static double add_light_error(shd_finding *f, const shd_plan_material *material,
                              const shd_source *from, const shd_lit *lit) {
    const shd_plan_light *light = from->light;
    const shd_path_error *e = from->error;
    double position = from->far + (from->near > 0 ? from->near / lit->nearest : 0);
    position = position < 1 ? position : 1;
    const double direction = e->direction + position;
    const double distance = e->relative + (light->attenuated ? 2 * position : 0);
    const bool nodes = takes_nodes(f);
    const double spread = spread_of(f);
    f->distance = shd_larger(f->distance, distance * spread);
    const double high = from->strength * lit->factor_high, low = from->strength * lit->factor_low;
    double seen[3], spot = 0;
    /* A low s makes the errors low that it multiplies, but not its own. */
    if (light->spot && !light->steep && f->tier != SHD_EXACT)
        spot = from->strength * lit->fall_high *
               shd_spot_error(shd_rounding_of(f->tier, f->plan->isa), light, lit->axis_low,
                              lit->axis_high, position);
    shd_much *to = &f->much[from->term];
    const shd_term *term = &f->terms.list[from->term];
    for (int c = 0; c < 3; c++) seen[c] = term->color[c] * high * lit->facing_high;
    to->low += low * lit->facing_low;
    to->high += high * lit->facing_high;
    to->absolute +=
        (high * (e->facing + position) + spot) * spread + high * (nodes ? shd_nodes_room(0) : 0);
    to->limited += high * distance * lit->facing_high * spread;
    for (size_t k = 0; k < material->lobe_count; k++) {
        const double shininess = material->lobes[k].shininess;
        const shd_lobe_error *error = &f->lobes[k];
        const double most = shd_shine_most(lit->shine_high, shininess);
        const double turned = shd_lobe_turned(error, lit->shine_high, most, direction);
        const double functions = shd_lobe_functions(error, most);
        /* An error that is not in proportion to the lobe is absolute. */
        const bool relative = error->turned_ratio < INFINITY;
        const double wrong = relative ? shd_lobe_sum(turned, functions) : functions;
        const double faint =
            shd_lobe_faint(error, most) + shd_lobe_foot(error, lit->shine_high, most, direction);
        f->ratio = shd_larger(f->ratio, shd_lobe_ratio(error, direction) * spread);
        to++;
        term++;
        for (int c = 0; c < 3; c++) seen[c] += term->color[c] * high * most;
        if (low > 0 && lit->shine_low > 0)
            to->low += low * shd_shine_least(lit->shine_low, shininess);
        to->high += high * most;
        to->absolute +=
            (high * faint + spot) * spread + high * (nodes ? shd_nodes_room(shininess) : 0);
        to->limited += high * shd_smaller(wrong + distance * most, 1) * spread;
    }
    return shd_larger(shd_larger(seen[0], seen[1]), seen[2]);
}

void shd_add_light(shd_finding *f, const shd_plan_material *material, const shd_source *from,
                   uint32_t index, const shd_piece *piece, double *influences) {
    shd_lit lit;
    if (!shd_piece_lit(f->plan->scene, piece, from->light, from->least, &lit)) return;
    const double most = add_light_error(f, material, from, &lit);
    add_misplaced(f, material, from, piece, &lit);
    if (influences) influences[index] = shd_larger(influences[index], most);
}

/* Counts the errors of a cluster's lights at an object whose normals may be any, as if all were as
 * near as the nearest may be: nothing of what is added up falls where light comes nearer. */
static void add_cluster(shd_finding *f, const shd_plan_object *object, shd_cluster *cluster,
                        const shd_cluster_target *target, const shd_piece *piece) {
    const shd_plan_light as = {.directional = cluster->directional,
                               .attenuated = cluster->attenuated};
    shd_source from = {.light = &as,
                       .error = f->paths[path_of(&as)],
                       .term = f->terms.first[cluster->hue],
                       .strength = cluster->strength};
    if (!from.term) return;
    if (!as.directional) place_source(f, &as, cluster->away, &from);
    const double nearest = shd_cluster_distance(cluster, target),
                 fall = shd_cluster_fall(cluster, nearest) * (1 + SHD_PIECE_MARGIN);
    const shd_lit lit = {.nearest = nearest,
                         .fall_high = fall,
                         .factor_high = fall,
                         .facing_high = 1,
                         .shine_high = 1};
    const shd_plan_material *material = &f->plan->materials[object->material];
    const double most = add_light_error(f, material, &from, &lit);
    add_misplaced(f, material, &from, piece, &lit);
    cluster->most = shd_larger(cluster->most, most / cluster->strength * (1 + SHD_PIECE_MARGIN));
}

void shd_add_cut(shd_finding *f, const shd_plan_object *bounds, const shd_cluster_target *target,
                 const shd_piece *piece) {
    shd_clusters *all = &f->clusters;
    for (size_t i = 0; i < all->cut_count; i++)
        add_cluster(f, bounds, &all->list[all->cut[i]], target, piece);
}

void shd_add_clusters(shd_finding *f, const shd_plan_object *object, const shd_piece *piece,
                      double *influences) {
    shd_clusters *all = &f->clusters;
    const shd_plan_material *material = &f->plan->materials[object->material];
    const shd_cluster_target target = {object->center, object->radius,
                                       f->place.object->interpolation == SHD_PHONG};
    shd_clusters_cut(all, &target);
    shd_add_cut(f, object, &target, piece);
    for (size_t i = 0; i < all->single_count; i++) {
        const shd_source from = shd_source_of(f, all->single[i]);
        shd_add_light(f, material, &from, all->single[i], piece, influences);
    }
}
