/* Shapes as polygons, for flat and gouraud, anew from docs/model.md. */
#ifndef SHD_ATTACK_FACETS_H
#define SHD_ATTACK_FACETS_H

#include "attack/document.h"

/* Makes a mesh of a placed shape, in slices around its axis. False: memory, or a plane. */
bool facets_cut(thing *t, int slices);

#endif
