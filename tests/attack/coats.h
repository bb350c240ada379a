/* What dressed scenes have on their surfaces. */
#ifndef SHD_ATTACK_COATS_H
#define SHD_ATTACK_COATS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* `"material": {...}`. */
void put_coat(FILE *out, uint64_t *random);

/* A light of type environment. `seen`: it may be visible, of which a scene has one. */
void put_sky(FILE *out, uint64_t *random, bool may_be_seen);

#endif
