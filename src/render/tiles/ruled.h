/* Which of a block's pixels take the few nodes of rules (plan/nodes.h) instead of all samples. */
#pragma once

#include "render/tiles/tile.h"

/* Pixels of a block that take a rule. */
typedef struct shd_ruled {
    uint16_t rule;   /* of s->rules, plus 1 */
    uint32_t object; /* that all nodes hit */
    uint64_t pixels; /* as bits row by row */
} shd_ruled;

/* What a block's pixels take. */
typedef struct shd_block_rules {
    size_t count;
    shd_ruled ruled[SHD_RULED];
    uint64_t all; /* pixels that take all samples */
    bool inside;  /* all rays of the block hit `object` first */
    uint32_t object;
} shd_block_rules;

/* Finds the rules of a block of the survey, of which nothing is known: all of its pixels are in
 * out->all. Those that no ray needs to be cast through are then in nothing. */
void shd_find_block_rules(const shd_scenery *scenery, size_t block, const shd_tile_scratch *s,
                          shd_block_rules *out);
