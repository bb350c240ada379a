/* Lights of one color that lie together, and count as one for objects that are far enough from all
 * of them: a bound of each object's errors costs as many looks as its cut through the tree has
 * clusters. For scenes with so many pairs of objects and lights that each object is a sphere whose
 * normals may be any. Inside of bound/. */
#pragma once

#include "bound/light/terms.h"
#include "plan/parts.h"

typedef struct shd_cluster {
    shd_vec3 low, high; /* of the box around them; directional lights have none */
    double width;       /* of that, from corner to corner */
    double strength;    /* the sum of the lights' strengths times their gains */
    double beside;      /* no point that is seen is nearer to any of them */
    double away;        /* from the frame's origin to the farthest */
    /* No light's attenuation, divided by its gain, is more at any distance. */
    double a, b, c, min_distance;
    double most;         /* the most that a strength of 1 adds to any channel of what it was at */
    uint32_t hue;        /* of all of them */
    uint32_t first, end; /* in shd_clusters.lights */
    uint32_t parts;      /* the first of two in the list; 0: it is a leaf */
    bool directional, attenuated;
} shd_cluster;

/* A forest: roots come first, and parts after what they are parts of. */
typedef struct shd_clusters {
    size_t count, roots;
    shd_cluster *list;
    uint32_t *lights; /* indices in plan->lights */
    uint32_t *alone;  /* lights that are in no cluster: spots, whose light is not the same around */
    size_t alone_count;
    /* Where cuts begin, and lights that they have alone: all, but of objects in a crowd (crowd.h).
     */
    uint32_t *near, *near_alone;
    size_t near_count, near_alone_count;
    uint32_t *cut, *single; /* of the object that was looked at last */
    size_t cut_count, single_count;
} shd_clusters;

/* `beside`: [light_count], as in shd_cluster. False: memory, or cancelled. */
bool shd_clusters_new(const shd_plan *plan, const shd_hues *hues, const double *beside,
                      shd_arena *arena, shd_clusters *out);

/* What an object is to clusters: a sphere, and whether only points of it are lit that are seen. */
typedef struct shd_cluster_target {
    shd_vec3 center;
    double radius;
    bool seen;
} shd_cluster_target;

/* No light of the cluster is nearer to any point that is lit. */
double shd_cluster_distance(const shd_cluster *cluster, const shd_cluster_target *target);

/* The largest attenuation of any of them at that distance or farther away, divided by its gain. */
double shd_cluster_fall(const shd_cluster *cluster, double distance);

/* Fills `cut` with clusters that are far enough from the target, which holds several, to be counted
 * as one for all of these, and `near` with those from which the cut of each of them has to begin.
 */
void shd_clusters_part(shd_clusters *clusters, const shd_cluster_target *target);

/* Fills `cut` with clusters that are far enough from the target to be counted as one, and `single`
 * with all other lights, of those that are near. */
void shd_clusters_cut(shd_clusters *clusters, const shd_cluster_target *target);

/* Raises influences ([light_count]) to the most that lights added where they were in clusters. */
void shd_clusters_influence(const shd_plan *plan, const shd_hues *hues,
                            const shd_clusters *clusters, double *influences);
