/* The plan in words. */
#pragma once

#include <jansson.h>

#include "plan/occluders.h"
#include "plan/paths.h"
#include "render/show/shown.h"

/* What a plan costs, roughly, in milliseconds of one core. */
typedef struct shd_cost {
    double build, visibility, shade, shadow, trace, color, encode, total;
} shd_cost;

/* Trees over triangles: those that a picture builds, and objects for which there is one. */
typedef struct shd_trees {
    size_t built, reused;
    size_t triangles, nodes, bytes; /* of those that are built; nodes: at most */
} shd_trees;

/* A tier, as if it had been asked for. */
typedef struct shd_told_tier {
    const char *name;
    shd_bound bound;
    shd_cost cost;
} shd_told_tier;

typedef struct shd_explained {
    const shd_plan *plan;
    const shd_shown *shown; /* [output_count] */
    const bool *codes;      /* [output_count]: colors go straight to codes */
    shd_cost cost;
    shd_occlusion occlusion; /* if there are shadows */
    /* Pairs of which shadows have no bound, and the first of them: {light, object}. */
    size_t unbounded_count, (*unbounded)[2];
    shd_paths paths;
    double cut;      /* of linear components, by what is not traced further; infinite: not known */
    double estimate; /* shd_linear_estimate's */
    shd_told_tier tiers[SHD_EXACT + 2]; /* those that differ, the cheapest first */
    int tier_count;
    shd_trees trees;
} shd_explained;

enum { SHD_UNBOUNDED_TOLD = 100 };

/* The first reason why a light is left out. NULL: it is not. */
const char *shd_drop_reason(unsigned drops);

/* The plan in sentences, one a line: the last member of the answer. NULL: memory. */
json_t *shd_explain_words(const shd_explained *e);

/* Why bounds of codes and CIEDE2000 are not known, if they are not. */
const char *shd_no_shown_bound(const shd_plan *plan);
