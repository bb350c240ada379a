#include "render/show/route.h"

shd_route shd_route_of(const shd_scene *scene, const shd_output *output, bool apart) {
    const bool integers = output->depth == SHD_U8 || output->depth == SHD_U16;
    const bool mixed = scene->transparent && shd_format_get(output->format)->premultiplied;
    const bool codes = apart && integers && !mixed && !output->layer_count;
    return (shd_route){codes, !codes || scene->transparent || scene->output_count > 1};
}
