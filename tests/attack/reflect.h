/* What the models of reflection make of light, anew from docs/model.md. */
#ifndef SHD_ATTACK_REFLECT_H
#define SHD_ATTACK_REFLECT_H

#include "attack/document.h"

/* pi f_r (N.L) of each channel, for unit vectors with N.L > 0. `cases` gets other bits where the
 * model is about to jump. */
void reflect_light(const stuff *m, point n, point v, point l, unsigned *cases, real out[3]);

/* The same of all of a light with a shape, times its color, to some 1e-8 of what it adds. */
void reflect_shape(const stuff *m, const lamp *l, point at, point n, point v, real out[3]);

#endif
