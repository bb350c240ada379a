/* The light of environments on what the picture's cells see of one object, from walks at few of
 * its points.
 *
 * By most models an environment is walked over for each point (shade/around_quick.h), which takes
 * tens of microseconds. But what a lobe makes of it is no sharper than the lobe, and over a few
 * pixels of a smooth object it is a smooth function of the place in the picture. A cell, of 32 to 8
 * pixels a side in a grid that begins at the picture's (0,0), has 4 by 4 nodes, near to those of
 * Chebyshev: rays through the middles of these pixels, cast at the object alone. Walks at them take
 * half of the share, and the polynomial through the logarithms of what they make tells the rest. A
 * cell holds for a light and a term if
 *
 * - all nodes, one in the middle and four places between them meet the object, and normals and
 *   views of nodes turn together by less than one of the lobe's widths;
 * - the third differences along all rows and columns of nodes are small;
 * - and walks at these four places make what the polynomial does.
 *
 * A sample reads the cell only if its own normal and view are those that the cell's polynomials
 * say, to a small part of the lobe's width: not across edges of meshes, or on another side of the
 * object. Else smaller cells are asked, and at last the sample is walked for itself.
 *
 * So a sample's light depends on itself and the cell of the picture's grid that it is in, and on
 * nothing else: not on tiles, regions, other objects, the order of samples, or threads. Materials
 * whose lobes or normals differ from point to point, spectral scenes, and the exact tier have no
 * cells. */
#pragma once

#include "render/tiles/tile.h"

/* One thread's working memory. */
typedef struct shd_smooth shd_smooth;

/* NULL if it is only counted, or the arena is full, or the plan has no use for cells. `length`: of
 * a run's hits, and what lies behind them. */
shd_smooth *shd_smooth_lay_out(const shd_plan *plan, size_t length, shd_scratch *memory);

/* Forgets all cells: another tile begins. */
void shd_smooth_begin(shd_smooth *smooth);

/* Hits that follow each other and see one material. */
typedef struct shd_smooth_run {
    const shd_hits *hits;
    size_t first, count;
    const shd_plan_material *material;
    const uint32_t *which; /* [lights]: in plan->lights */
    size_t lights;
} shd_smooth_run;

/* What is known of the run's hits, by their places in `hits`; until the next call. NULL: nothing.
 */
const shd_known *shd_smooth_know(const shd_scenery *scenery, const shd_smooth_run *run,
                                 const shd_tile_scratch *s);
