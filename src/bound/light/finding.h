/* What excesses (excess.h) are made of while they are found. Inside of excess.c and sources.c. */
#pragma once

#include "bound/light/clusters.h"
#include "bound/light/crowd.h"
#include "bound/light/error.h"
#include "bound/light/misplaced.h"

/* A light as it comes to an object. */
typedef struct shd_source {
    const shd_plan_light *light;
    const shd_path_error *error;
    size_t term;     /* the first of its terms */
    double strength; /* these times it are the light */
    double least;    /* no point of the object is nearer */
    /* near / distance + far is the direction's error, and half the distance's relative error. */
    double near, far;
} shd_source;

typedef struct shd_finding {
    const shd_plan *plan;
    shd_tier tier;
    shd_excess_list *list;
    shd_influences *influences; /* or NULL */
    shd_hues hues;
    double *beside; /* [light_count]: no point that is seen is nearer to the light */
    int fineness;
    bool nodes;   /* means may be of few nodes (plan/nodes.h) */
    bool crowded; /* pairs are many: lights are in clusters */
    shd_clusters clusters;
    shd_crowds crowd;
    /* Of the object in question: */
    shd_terms terms;
    const shd_term *kept; /* a copy of the terms that stays; NULL: they are too many */
    shd_place place;
    shd_source *sources; /* [light_count]; not of an object whose lights are in clusters */
    shd_misplaced misplaced;
    const shd_path_error *paths[SHD_PATHS];
    shd_lobe_error *lobes; /* [max_lobes] */
    shd_piece *pieces;     /* [SHD_MOST_PIECES] */
    /* Of its piece in question: */
    shd_much *much;         /* [terms] */
    double ratio, distance; /* relative errors of highlights, and of what depends on distances */
} shd_finding;

/* Whether the object's lights are looked at by clusters of all lights. */
static inline bool shd_is_clustered(const shd_finding *f, const shd_plan_object *object) {
    return f->crowded && object->bounded && object->light_count == f->plan->light_count;
}

/* Sets the errors of all paths to the object that is at f->place. */
void shd_set_path_errors(shd_finding *f);

/* A light as it comes to an object that is at f->place. */
shd_source shd_source_of(const shd_finding *f, uint32_t index);

/* Counts the errors of an object's light. `influences` ([light_count]) or NULL. */
void shd_add_light(shd_finding *f, const shd_plan_material *material, const shd_source *from,
                   uint32_t index, const shd_piece *piece, double *influences);

/* Counts the errors of the clusters that the target was cut to. `bounds` has its material. */
void shd_add_cut(shd_finding *f, const shd_plan_object *bounds, const shd_cluster_target *target,
                 const shd_piece *piece);

/* Counts the errors of all lights that are near to an object whose normals may be any, by clusters.
 */
void shd_add_clusters(shd_finding *f, const shd_plan_object *object, const shd_piece *piece,
                      double *influences);
