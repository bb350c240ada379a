/* The frames of a turntable, as changes to its scene. */
#include <stdio.h>
#include <string.h>

#include "scene/variants_parts.h"

void shd_read_turn(shd_reader *r, const shd_node *node, void *out) {
    static const shd_range frames = {2, SHD_FRAMES_MOST, .text = "2 to 360"},
                           durations = {10, 10000, .text = "10 to 10000 milliseconds"};
    static const char *const formats[] = {"webp", "apng", NULL};
    static const shd_field fields[] = {
        {"frames", shd_read_integer, offsetof(shd_turn, frames), .range = &frames,
         .required = true},
        {"format", shd_read_choice, offsetof(shd_turn, format), .choices = formats},
        {"duration", shd_read_integer, offsetof(shd_turn, milliseconds), .range = &durations},
    };
    shd_turn *turn = out;
    *turn = (shd_turn){.milliseconds = 50};
    if (!shd_is_object(r, node)) return;
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a turntable", turn);
    turn->format = turn->format ? SHD_PNG : SHD_WEBP;
}

/* What is wrong with it is found when the frames are read. */
static void find_vector(const json_t *camera, const char *name, double out[3]) {
    const json_t *value = json_object_get(camera, name);
    for (size_t i = 0; i < 3 && json_array_size(value) == 3; i++)
        out[i] = json_number_value(json_array_get(value, i));
}

void shd_find_orbit(const json_t *scene, shd_turn *turn) {
    const json_t *camera = json_object_get(scene, "camera");
    memcpy(turn->position, (const double[3]){0, 0, 4}, sizeof turn->position);
    memcpy(turn->target, (const double[3]){0, 0, 0}, sizeof turn->target);
    memcpy(turn->up, (const double[3]){0, 1, 0}, sizeof turn->up);
    find_vector(camera, "position", turn->position);
    find_vector(camera, "target", turn->target);
    find_vector(camera, "up", turn->up);
}

/* O. Rodrigues, "Des lois geometriques ...", 1840: d cos a + (u x d) sin a + u (u.d) (1 - cos a).
 */
static shd_vec3 turn_around(const shd_turn *t, double angle) {
    const shd_vec3 target = {t->target[0], t->target[1], t->target[2]},
                   from =
                       shd_sub((shd_vec3){t->position[0], t->position[1], t->position[2]}, target);
    shd_vec3 up = {0, 1, 0};
    shd_normalize((shd_vec3){t->up[0], t->up[1], t->up[2]}, &up);
    const shd_vec3 beside = shd_cross(up, from);
    const double c = cos(angle), s = sin(angle), along = shd_dot(up, from) * (1 - c);
    return shd_add(
        target, shd_add(shd_add(shd_scale(from, c), shd_scale(beside, s)), shd_scale(up, along)));
}

void shd_put_frame(const shd_turn *turn, size_t index, shd_draft *draft, shd_span scene) {
    char patch[256], position[128] = "";
    const shd_vec3 p = turn_around(turn, 2 * SHD_PI * (double)index / turn->frames);
    if (index)
        snprintf(position, sizeof position, "\"camera\":{\"position\":[%.17g,%.17g,%.17g]},", p.x,
                 p.y, p.z);
    const int length = snprintf(patch, sizeof patch, "{%s\"output\":{\"format\":\"%s\"}}", position,
                                turn->format == SHD_PNG ? "png" : "webp");
    shd_patch_merge(draft, scene, shd_span_of(patch, patch + length));
}
