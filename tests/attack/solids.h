/* Where rays meet shapes, in the shapes' own frames. */
#ifndef SHD_ATTACK_SOLIDS_H
#define SHD_ATTACK_SOLIDS_H

#include <stdbool.h>

#include "attack/real.h"

typedef enum form { SPHERE, PLANE, DISC, BOX, CYLINDER, CONE, TORUS, MESH, FORMS } form;

/* `size`: of a box; radius, height or tube, as far as the form has them. */
typedef struct solid {
    form form;
    point size;
    real radius, height, tube;
} solid;

/* A place where a ray o + t d meets a surface. `part` tells smooth parts apart. */
typedef struct crossing {
    real t;
    int part;
    bool flat; /* the part is */
    point at;
    point normal; /* outward, of any length */
} crossing;

enum { MOST_CROSSINGS = 8 };

/* All crossings with t > 0, in no order; their number. Not of meshes. */
int cross_solid(const solid *s, point o, point d, crossing out[MOST_CROSSINGS]);

#endif
