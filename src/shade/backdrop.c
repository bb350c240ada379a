#include "shade/backdrop.h"

#include "scene/surroundings.h"

void shd_backdrop_at(const shd_light *environment, shd_vec3 direction, double rgb[3]) {
    double at[3];
    shd_surroundings_at(environment->seen, shd_to_map(environment, direction), at);
    shd_from_map(environment, at, rgb);
    for (int c = 0; c < 3; c++) rgb[c] *= environment->color[0];
}
