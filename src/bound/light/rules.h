/* How far a pixel's mean by few nodes is from that of its samples. */
#pragma once

#include "plan/bend.h"
#include "plan/nodes.h"
#include "plan/plan.h"

/* The first of the rules ([count]) whose mean is within `room` times shd_nodes_room of that of all
 * samples in each pixel of the block: for each weight of each light on the object of `a`, of the
 * least attenuation that the light has there. `count`: none. Colors do not matter. The plan is not
 * extended and the material has no pattern. It takes some 100 ns a light. Any thread. The proof is
 * in rules.c. */
size_t shd_find_rule(const shd_plan *plan, const shd_analytic *a, const shd_rule *rules,
                     size_t count, double room);
