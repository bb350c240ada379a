/* Lights: every type in both frames, carried over to the world. */
#include <math.h>
#include <string.h>

#include "scene/read.h"

/* Bits of shd_field.kinds. A bare light has no type, only a homogeneous position. */
enum { AMBIENT = 1, DIRECTIONAL = 2, POINT = 4, SPOT = 8, BARE = 16, ANY = 31 };

static const char *const frames[] = {"world", "camera", NULL};
enum { WORLD, CAMERA };

typedef struct raw_position {
    double at[4]; /* w NAN: absent or wrong */
    bool good;    /* whether all items are right */
} raw_position;

typedef struct raw_light {
    raw_position position;
    double intensity;
    int frame;
    shd_light light;
} raw_light;

static void read_position(shd_reader *r, const shd_node *node, void *out) {
    raw_position *position = out;
    size_t count = json_array_size(node->value);
    double at[4] = {0, 0, 0, count == 3 ? 1 : NAN};
    position->good =
        shd_get_numbers(r, node, 3, 4, "an array of 3 or 4 numbers", &shd_any_number, at);
    /* Which item is w is known only if there are four. */
    if (count > 4) at[3] = NAN;
    memcpy(position->at, at, sizeof at);
}

static void read_attenuation(shd_reader *r, const shd_node *node, void *out) {
    shd_vec3 terms = {-1, -1, -1};
    shd_read_vector(r, node, &terms);
    if (terms.x < 0) return;
    if (!(shd_max_abs(terms) > 0)) {
        shd_wrong(r, node, "the terms must not all be 0: the light would be infinite");
        return;
    }
    memcpy(out, (double[]){terms.x, terms.y, terms.z}, 3 * sizeof(double));
}

enum {
    TYPE,
    POSITION,
    DIRECTION,
    COLOR,
    INTENSITY,
    OWN_AMBIENT,
    ATTENUATION,
    MIN_DISTANCE,
    ANGLE,
    PENUMBRA,
    EXPONENT,
    FRAME,
    NAME,
    FIELDS
};

#define IN_LIGHT(member) (offsetof(raw_light, light) + offsetof(shd_light, member))

static const shd_range half_angle = {0, 180, true, false, "more than 0 and up to 180 degrees"};
static const shd_range share = {0, 1, false, false, "0 to 1"};

static const shd_field fields[FIELDS] = {
    [TYPE] = {"type", .read = NULL},
    [POSITION] = {"position", read_position, offsetof(raw_light, position),
                  .kinds = ANY & ~AMBIENT},
    [DIRECTION] = {"direction", shd_read_direction, IN_LIGHT(direction),
                   .kinds = DIRECTIONAL | SPOT},
    [COLOR] = {"color", shd_read_color, .offset = IN_LIGHT(color)},
    [INTENSITY] = {"intensity", shd_read_number, .offset = offsetof(raw_light, intensity)},
    [OWN_AMBIENT] = {"ambient", shd_read_color, IN_LIGHT(ambient), .kinds = ANY & ~AMBIENT},
    [ATTENUATION] = {"attenuation", read_attenuation, IN_LIGHT(attenuation), POINT | SPOT | BARE,
                     .range = &shd_not_negative},
    [MIN_DISTANCE] = {"minDistance", shd_read_number, IN_LIGHT(min_distance), POINT | SPOT | BARE,
                      .range = &shd_not_negative},
    [ANGLE] = {"angle", shd_read_degrees, IN_LIGHT(angle), SPOT, .range = &half_angle},
    [PENUMBRA] = {"penumbra", shd_read_number, IN_LIGHT(penumbra), SPOT, .range = &share},
    [EXPONENT] = {"exponent", shd_read_number, IN_LIGHT(exponent), SPOT,
                  .range = &shd_not_negative},
    [FRAME] = {"frame", shd_read_choice, offsetof(raw_light, frame), ANY & ~AMBIENT,
               .choices = frames},
    [NAME] = {"name", .read = shd_read_label},
};

static shd_vec3 from_camera(const shd_camera *camera, shd_vec3 v) {
    return shd_madd(shd_madd(shd_scale(camera->right, v.x), camera->up, v.y), camera->back, v.z);
}

/* The light's place in its frame. */
static void divide_by_w(shd_reader *r, const shd_node *node, const raw_position *position,
                        shd_vec3 *out) {
    double w = position->at[3];
    shd_vec3 at = {position->at[0] / w, position->at[1] / w, position->at[2] / w};
    if (shd_is_finite(at))
        *out = at;
    else
        shd_wrong(r, node, "the position divided by w is not finite");
}

/* What a homogeneous or plain position means for each type of light. */
static void place_light(shd_reader *r, const shd_node *node, raw_light *raw, bool has_direction) {
    shd_light *light = &raw->light;
    shd_node position = shd_node_member(node, "position");
    bool directional = light->type == SHD_LIGHT_DIRECTIONAL;
    if (directional && position.value && has_direction)
        shd_wrong(r, &position, "give either `direction` or `position`, not both");
    double w = raw->position.at[3];
    shd_vec3 from = {raw->position.at[0], raw->position.at[1], raw->position.at[2]};
    if (!directional && w == 0)
        shd_wrong(r, &position, "a %s light cannot be at infinity (w is 0): leave out `type`",
                  shd_light_names[light->type]);
    else if (directional && !isnan(w) && w != 0)
        shd_wrong(r, &position, "a directional light has no position, but a `direction`");
    else if (!raw->position.good)
        return;
    else if (!directional)
        divide_by_w(r, &position, &raw->position, &light->position);
    else if (!shd_normalize(shd_scale(from, -1), &light->direction))
        shd_wrong(r, &position, "must not be zero: with w = 0 it is a direction");
}

static void to_world(shd_reader *r, const shd_node *node, shd_light *light) {
    const shd_camera *camera = &r->scene->camera;
    light->position = shd_add(camera->position, from_camera(camera, light->position));
    if (!shd_is_finite(light->position))
        shd_wrong(r, node, "its position in the camera frame is too far away to be a number");
    if (light->type == SHD_LIGHT_DIRECTIONAL || light->type == SHD_LIGHT_SPOT)
        shd_normalize(from_camera(camera, light->direction), &light->direction);
}

/* Sets color * intensity, which goes to the ambient share of an ambient light. It is NAN if it is
 * not known. */
static void scale_color(shd_reader *r, const shd_node *node, raw_light *raw) {
    shd_light *light = &raw->light;
    for (int c = 0; c < 3; c++) light->color[c] *= raw->intensity;
    if (isinf(light->color[0]) || isinf(light->color[1]) || isinf(light->color[2]))
        shd_wrong(r, node, "`color` times `intensity` is not finite");
    if (light->type != SHD_LIGHT_AMBIENT) return;
    memcpy(light->ambient, light->color, sizeof light->ambient);
    memset(light->color, 0, sizeof light->color);
}

static raw_light default_light(shd_reader *r, shd_light_type type) {
    raw_light raw = {.position.at[3] = NAN, .intensity = 1, .frame = WORLD};
    shd_light *light = &raw.light;
    light->type = type;
    light->attenuation[0] = 1;
    light->direction = (shd_vec3){0, -1, 0};
    if (type == SHD_LIGHT_DIRECTIONAL) shd_normalize((shd_vec3){0, -1, -1}, &light->direction);
    if (type == SHD_LIGHT_POINT) light->position = (shd_vec3){3, 3, 3};
    if (type == SHD_LIGHT_SPOT) light->position = (shd_vec3){0, 4, 0};
    light->angle = 30 * (SHD_PI / 180);
    light->penumbra = 0.2;
    shd_default_color(r, 1, light->color);
    return raw;
}

/* The kind of a light as bits. 0, and an error, if it has none. */
static unsigned read_kind(shd_reader *r, const shd_node *node) {
    shd_node type = shd_node_member(node, "type");
    if (type.value) {
        int index = shd_read_name(r, &type, shd_light_names);
        return index < 0 ? 0 : 1u << index;
    }
    shd_node position = shd_node_member(node, "position");
    if (json_is_array(position.value) && json_array_size(position.value) != 3) return BARE;
    shd_wrong(r, node,
              "a light needs a `type` (ambient, directional, point or spot), or a `position` "
              "of four components");
    return 0;
}

static void read_light(shd_reader *r, const shd_node *node, shd_light *out) {
    static const char *const names[] = {"an ambient light", "a directional light", "a point light",
                                        "a spot light"};
    if (!shd_is_object(r, node)) return;
    unsigned kind = read_kind(r, node);
    shd_light_type type = kind & DIRECTIONAL ? SHD_LIGHT_DIRECTIONAL
                          : kind & SPOT      ? SHD_LIGHT_SPOT
                          : kind & AMBIENT   ? SHD_LIGHT_AMBIENT
                                             : SHD_LIGHT_POINT;
    const char *what = kind == BARE ? "a light without `type`" : kind ? names[type] : "a light";
    raw_light raw = default_light(r, type);
    uint32_t seen = shd_read_fields(r, node, fields, FIELDS, kind ? kind : ANY, what, &raw);
    if (!(r->wrong & (1u << COLOR | 1u << INTENSITY))) scale_color(r, node, &raw);
    if (raw.intensity < 0)
        shd_node_warn(r->report, node, "the intensity is negative: the light takes light away");
    if (!kind) return;

    /* A wrong value has its default here, which passes the checks below. */
    bool bare_direction = kind == BARE && raw.position.at[3] == 0;
    if (bare_direction) raw.light.type = SHD_LIGHT_DIRECTIONAL;
    place_light(r, node, &raw, seen >> DIRECTION & 1);
    if (bare_direction) {
        /* Distance means nothing for a directional light. */
        memcpy(raw.light.attenuation, (double[]){1, 0, 0}, sizeof raw.light.attenuation);
        raw.light.min_distance = 0;
    }
    if (raw.frame == CAMERA) to_world(r, node, &raw.light);
    *out = raw.light;
}

/* OpenGL's default light shines along the view. */
static void add_default_light(shd_reader *r) {
    shd_light *light = shd_take(r, 1, sizeof *light);
    if (!light) return;
    *light = default_light(r, SHD_LIGHT_DIRECTIONAL).light;
    light->direction = shd_scale(r->scene->camera.back, -1);
    r->scene->lights = light;
    r->scene->light_count = 1;
}

void shd_read_lights(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    r->lights = 1;
    if (!node->value) {
        add_default_light(r);
        return;
    }
    r->lights = SIZE_MAX;
    if (!shd_is_array(r, node, 0, SIZE_MAX, "an array of lights")) return;
    size_t count = r->lights = json_array_size(node->value);
    count = shd_hold_to_limit(r, node, "the scene asks for", count, SHD_LIMIT_LIGHTS,
                              r->limits->lights);
    shd_light *lights = shd_take(r, count, sizeof *lights);
    if (!lights) return;
    for (size_t i = 0; i < count && !shd_is_cancelled(r->cancelled); i++) {
        shd_node light = shd_node_item(node, i);
        read_light(r, &light, &lights[i]);
    }
    r->scene->lights = lights;
    r->scene->light_count = count;
}
