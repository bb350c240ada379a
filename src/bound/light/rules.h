/* How far a pixel's mean by few nodes is from that of its samples. */
#pragma once

#include <stdint.h>

#include "plan/bend.h"
#include "plan/nodes.h"
#include "plan/plan.h"

/* Of each rule the pixels of the block or part, as bits row by row, whose mean by it is within
 * `room` times shd_nodes_room of that of all samples: for each weight of each light on the object
 * of `a`, of the least attenuation that the light has there. Colors do not matter. The plan is not
 * extended and the material has no pattern. `pixels` is [count]. False: there are none. It
 * takes some 100 ns a light. Any thread. The proof is in rules.c. */
bool shd_find_rules(const shd_plan *plan, const shd_analytic *a, const shd_rule *rules,
                    size_t count, double room, uint64_t *pixels);
