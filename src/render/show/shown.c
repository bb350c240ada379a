#include "render/show/shown.h"

#include <math.h>
#include <string.h>

#include "base/primaries.h"
#include "render/show/conversion.h"

/* Whether bounds know the curve. */
static bool is_modelled(const shd_color_info *info) {
    return info->channels <= SHD_XYZ && info->transfer != SHD_TRANSFER_UNKNOWN &&
           info->transfer <= SHD_TRANSFER_REC1886;
}

/* The way from a known encoding to Lab. */
static bool find_lab(const shd_color_transform *transform, shd_lab_space *out) {
    const shd_color_info *info = shd_color_describe(transform);
    return is_modelled(info) && info->has_primaries &&
           shd_lab_space_make(info->transfer, info->primaries, out);
}

/* The way to the catalog's space of colors, with what is done to the output's light. */
static shd_status find_detour(const shd_rendering *r, const shd_scene *scene,
                              const shd_output *output, const shd_color_transform **out,
                              shd_error *error) {
    shd_output plain = {.color_space = shd_color_catalog(r->engine->color)->colors,
                        .depth = SHD_FLOAT,
                        .adjust = output->adjust};
    plain.adjust.gamma = 1;
    return shd_output_transform(r, scene, &plain, out, error);
}

static shd_status make_showing(const shd_rendering *r, const shd_scene *scene,
                               const shd_output *output, shd_depth depth, shd_showing *out,
                               shd_error *error) {
    static const double black[3] = {0};
    shd_showing showing = {.flatten = shd_output_is_flat(scene, output),
                           .matte = output->matte,
                           .exposure = output->adjust.exposure};
    shd_output coded = *output;
    coded.depth = depth;
    shd_status status = shd_output_transform(r, scene, &coded, &showing.transform, error);
    if (status != SHD_OK) return status;
    showing.bounded = !shd_color_describe(showing.transform)->looks &&
                      !(showing.flatten && memcmp(output->matte, black, sizeof black));

    const shd_image image = {.channel = output->channel,
                             .alpha = scene->transparent && shd_format_get(output->format)->alpha,
                             .depth = SHD_U8};
    showing.pack = shd_pack_plan(&image, false, true);

    if (!find_lab(showing.transform, &showing.lab)) {
        status = find_detour(r, scene, output, &showing.detour, error);
        if (status != SHD_OK) return status;
        /* If the configuration tells nothing, colors are linear Rec.709, as JSON's are. */
        if (!find_lab(showing.detour, &showing.lab))
            shd_lab_space_make(SHD_TRANSFER_LINEAR, shd_rec709, &showing.lab);
    }
    *out = showing;
    return SHD_OK;
}

shd_status shd_showing_make(const shd_rendering *r, const shd_scene *scene,
                            const shd_output *output, shd_showing *out, shd_error *error) {
    return make_showing(r, scene, output, SHD_U8, out, error); /* codes are told of 8 bits */
}

shd_status shd_showing_floats(const shd_rendering *r, const shd_scene *scene,
                              const shd_output *output, shd_showing *out, shd_error *error) {
    return make_showing(r, scene, output, SHD_FLOAT, out, error);
}

/* The matrix of a transform that is a curve of a matrix. Its columns are differences from a grey,
 * which keeps every channel in the curve's range. */
static void find_matrix(const shd_color_transform *transform, shd_transfer curve, double exposure,
                        double matrix[3][3]) {
    enum { GREY, COLUMNS };
    const double gain = exp2(exposure);
    const float base = (float)(0.25 / gain), step = (float)(0.125 / gain);
    float pixels[4 * (COLUMNS + 3)];
    for (int i = 0; i < COLUMNS + 3; i++) {
        for (int c = 0; c < 3; c++) pixels[4 * i + c] = i == COLUMNS + c ? base + step : base;
        pixels[4 * i + 3] = 1;
    }
    shd_color_apply(transform, pixels, COLUMNS + 3);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const double moved = shd_curve_decode(curve, (double)pixels[4 * (COLUMNS + c) + r]),
                         still = shd_curve_decode(curve, (double)pixels[4 * GREY + r]),
                         value = (moved - still) / (double)step;
            /* A channel that does not depend on another differs by rounding alone. */
            matrix[r][c] = fabs(value) < 2e-5 * gain ? 0 : value;
        }
}

/* Whether the transform is the curve of the matrix at colors in and around [0,1], some of them dark
 * and some saturated. Codes are held at 0 and 1, so that beyond these only the side counts. */
static bool is_curve_of_matrix(const shd_color_transform *transform, shd_transfer curve,
                               double exposure, double matrix[3][3]) {
    static const float values[] = {0, 1e-4f, 0.002f, 0.02f, 0.1f, 0.35f, 0.7f, 1, 1.7f};
    enum { VALUES = sizeof values / sizeof values[0], PROBES = 4 * VALUES };
    float in[PROBES][4], out[PROBES][4];
    for (int i = 0; i < PROBES; i++) {
        for (int c = 0; c < 3; c++)
            in[i][c] = values[(i + c * (i / VALUES) * 2) % VALUES] / (float)exp2(exposure);
        in[i][3] = 1;
    }
    memcpy(out, in, sizeof out);
    shd_color_apply(transform, out[0], PROBES);
    for (int i = 0; i < PROBES; i++)
        for (int r = 0; r < 3; r++) {
            double linear = 0;
            for (int c = 0; c < 3; c++) linear += matrix[r][c] * (double)in[i][c];
            double wanted = shd_curve_encode(curve, linear), got = (double)out[i][r];
            if (wanted > 1 - 1e-3 && got > 1 - 2e-3) continue;
            if (wanted < 1e-3 && got < 2e-3) continue;
            if (!(fabs(wanted - got) < 1e-4)) return false;
        }
    return true;
}

static bool find_curve(const shd_color_transform *transform, double exposure, shd_transfer *curve,
                       double matrix[3][3]) {
    const shd_color_info *info = shd_color_describe(transform);
    if (!is_modelled(info)) return false;
    *curve = info->transfer;
    find_matrix(transform, *curve, exposure, matrix);
    return is_curve_of_matrix(transform, *curve, exposure, matrix);
}

shd_shown shd_shown_of(const shd_showing *showing) {
    shd_shown out = {.coded = false};
    memcpy(out.to_xyz, showing->lab.to_xyz, sizeof out.to_xyz);
    if (!showing->bounded) return out;
    out.coded = find_curve(showing->transform, showing->exposure, &out.curve, out.matrix);
    if (showing->detour) {
        out.seen = find_curve(showing->detour, showing->exposure, &out.screen_curve, out.screen);
    } else {
        out.seen = out.coded;
        out.screen_curve = out.curve;
        memcpy(out.screen, out.matrix, sizeof out.screen);
    }
    out.seen = out.seen && out.screen_curve == showing->lab.transfer;
    return out;
}

shd_status shd_shown_make(const shd_rendering *r, const shd_scene *scene, const shd_shown **out,
                          shd_error *error) {
    shd_shown *shown = shd_arena_alloc(r->arena, scene->output_count, sizeof *shown);
    if (!shown) return shd_fail(error, SHD_MEMORY, "/outputs", "the limit `memory` is reached");
    for (size_t i = 0; i < scene->output_count; i++) {
        shd_showing showing;
        shd_status status = shd_showing_make(r, scene, &scene->outputs[i], &showing, error);
        if (status != SHD_OK) return status;
        shown[i] = shd_shown_of(&showing);
    }
    *out = shown;
    return SHD_OK;
}
