/* A tree of boxes over a mesh's triangles. Inside of sight/.
 *
 * It is in the mesh's own frame, so that it does not depend on the camera, scaled by a power of 2
 * to coordinates of at most 1. Boxes are in f32, from the middle of all triangles, and larger by
 * more than rounding: what they leave undecided, triangles decide in f64. Around triangles that are
 * long and thin, and lie much alike, they are turned to where they are small (S. Woop et al.,
 * "Exploiting local orientation similarity for efficient ray traversal of hair and fur", 2014).
 * Triangles decide what a ray meets. A tree only leaves out what no ray of a bundle may meet, so
 * that no hit depends on how it was built. */
#pragma once

#include <stdatomic.h>

#include "sight/mesh.h"

typedef struct shd_branch {
    float low[3], high[3]; /* of the coordinates from the middle that its turn gives */
    /* count > 0: leaves [first, first + count). 0: branches first and first + 1. */
    uint32_t first;
    uint16_t count;
    uint16_t turn; /* of the tree's; 0: not turned */
} shd_branch;

/* Unit vectors at right angles, to rounding: a point's coordinates are its products with them. */
typedef struct shd_turn {
    shd_vec3 axis[3];
} shd_turn;

/* A triangle. Its corners ascend by x, then y, then z, so that triangles with the same corners, in
 * any order, are met by the same arithmetic. */
typedef struct shd_leaf {
    uint32_t corner[3]; /* vertices */
    /* 16 triangle + 4 first + second: the triangle's index, and which of these corners (0 to 2) its
     * first and its second corner are. */
    uint32_t name;
} shd_leaf;

/* A path from the root to a leaf has no more branches. A leaf's name is an int32_t, so that a tree
 * has no more triangles. */
enum { SHD_TREE_DEPTH = 96, SHD_TREE_TRIANGLES = 1 << 27 };

struct shd_mesh_tree {
    double scale; /* 2^-exponent */
    int exponent;
    shd_vec3 middle; /* of what boxes enclose, in this frame */
    /* [branch_count]: the root, one that is not used, then pairs, each of which is a cache line. */
    shd_branch *branches;
    uint32_t branch_count;
    shd_leaf *leaves;  /* triangles with an area, but for repeated ones */
    size_t leaf_count; /* 0: there are no branches */
    shd_turn *turns;   /* [turn_count]; the first is not used. NULL: there are none */
    uint32_t turn_count;
};

/* Bytes of an arena that a tree over so many triangles takes, with what building it takes for as
 * long as that lasts. */
size_t shd_mesh_tree_bytes(size_t triangles);

/* Triangles without an area are not met. If several have their corners at the same places, the
 * first is kept, and if there are many, it alone. SHD_MEMORY or SHD_CANCELLED. */
shd_status shd_mesh_tree_new(const shd_triangles *triangles, const atomic_bool *cancelled,
                             shd_arena *arena, const shd_mesh_tree **out, shd_error *error);
