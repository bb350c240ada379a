/* Whether a picture is the sum of its layers, in each of the ways in which it is said to be, and
 * each of its pixels within its layer `bound` of the exact tier's. */
#ifndef SHD_ATTACK_LAYERS_H
#define SHD_ATTACK_LAYERS_H

#include "attack/same.h"
#include "shaded.h"

void layers_check(shd_engine *engine, const family *f, uint64_t seed, same_teller *tell,
                  void *context);

#endif
