/* How far a pixel's mean by few nodes is from that of its samples. */
#pragma once

#include "plan/bend.h"
#include "plan/nodes.h"
#include "plan/plan.h"

/* Those of the rules ([count]), as bits, whose mean is within `room` times shd_nodes_room of that
 * of all samples in each pixel of the block or part: for each weight of each light on the object of
 * `a`, of the least attenuation that the light has there. Colors do not matter. The plan is not
 * extended and the material has no pattern. It takes some 100 ns a light. Any thread. The proof is
 * in rules.c. */
unsigned shd_find_rules(const shd_plan *plan, const shd_analytic *a, const shd_rule *rules,
                        size_t count, double room);
