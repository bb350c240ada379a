#include "render/show/conversion.h"

shd_status shd_output_transform(const shd_rendering *r, const shd_scene *scene,
                                const shd_output *output, const shd_color_transform **out,
                                shd_error *error) {
    shd_color_config *color = r->engine->color;
    const char *from = scene->working_space->name;
    const shd_space_info *space = output->color_space;
    if (space && space->file && (output->depth == SHD_U8 || output->depth == SHD_U16))
        space = space->file;
    if (shd_adjusts(&output->adjust))
        return shd_color_adjusted(color, from, space ? space->name : NULL, output->display,
                                  output->view, &output->adjust, r->lease, out, error);
    if (space) return shd_color_to_space(color, from, space->name, r->lease, out, error);
    return shd_color_to_view(color, from, output->display, output->view, r->lease, out, error);
}

bool shd_output_is_flat(const shd_scene *scene, const shd_output *output) {
    return scene->transparent && !shd_format_get(output->format)->alpha && output->channel != 3;
}

void shd_output_flatten(const double matte[3], float *rgba, size_t pixels) {
    for (size_t i = 0; i < pixels; i++) {
        const float alpha = rgba[4 * i + 3];
        for (size_t c = 0; c < 3; c++)
            rgba[4 * i + c] = rgba[4 * i + c] * alpha + (float)matte[c] * (1 - alpha);
        rgba[4 * i + 3] = 1;
    }
}
