/* Lights: every type in both frames, carried over to the world. */
#include <string.h>

#include "scene/read.h"

/* A light's kind is its shd_light_type. A bare light has no type, only a homogeneous position. */
enum { BARE_KIND = SHD_LIGHT_ENVIRONMENT + 1, KINDS };

/* The kinds as bits of shd_field.kinds. */
enum {
    DIRECTIONAL = 1 << SHD_LIGHT_DIRECTIONAL,
    SPOT = 1 << SHD_LIGHT_SPOT,
    RECT = 1 << SHD_LIGHT_RECT,
    ROUND = 1 << SHD_LIGHT_DISC | 1 << SHD_LIGHT_SPHERE,
    SHAPED = RECT | ROUND,
    FACING = RECT | 1 << SHD_LIGHT_DISC,
    PLACED = 1 << SHD_LIGHT_POINT | SPOT | 1 << BARE_KIND,
    NOT_AMBIENT = PLACED | DIRECTIONAL | SHAPED,
    AROUND = 1 << SHD_LIGHT_ENVIRONMENT,
    NOT_AROUND = NOT_AMBIENT | 1 << SHD_LIGHT_AMBIENT,
    ANY = (1 << KINDS) - 1
};

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
    position->good = shd_get_numbers(r, node, 3, 4, "an array of 3 or 4 numbers", at);
    /* Which item is w is known only if there are four. */
    if (count > 4) at[3] = NAN;
    memcpy(position->at, at, sizeof at);
}

static void read_attenuation(shd_reader *r, const shd_node *node, void *out) {
    shd_vec3 terms = {-1, -1, -1};
    shd_read_vector(r, node, &terms);
    if (terms.x < 0) return;
    if (shd_max_abs(terms) > 0)
        memcpy(out, (double[]){terms.x, terms.y, terms.z}, 3 * sizeof(double));
    else
        shd_wrong(r, node, "the terms must not all be 0: the light would be infinite");
}

static void read_size(shd_reader *r, const shd_node *node, void *out) {
    double size[2];
    if (shd_get_numbers(r, node, 2, 2, "an array of 2 numbers: width, height", size))
        memcpy(out, size, sizeof size);
}

static void read_visible(shd_reader *r, const shd_node *node, void *out) {
    if (json_is_boolean(node->value))
        *(bool *)out = json_is_true(node->value);
    else
        shd_wrong(r, node, "expected true or false");
}

enum { WITH_DIRECTION = 1, COLOR = 2, INTENSITY = 4, WITH_UP = 8, WITH_MAP = 16 }; /* marks */

#define AT(member) offsetof(raw_light, member)

static const shd_range half_angle = {0, 180, true, false, "more than 0 and up to 180 degrees"};
static const shd_range share = {0, 1, false, false, "0 to 1"};

static const shd_field light_fields[] = {
    {"type", .read = NULL},
    {"position", read_position, AT(position), .kinds = NOT_AMBIENT},
    {"direction", shd_read_direction, AT(light.direction), DIRECTIONAL | SPOT | FACING,
     .mark = WITH_DIRECTION},
    {"color", shd_read_color_or_spectrum, AT(light.color), NOT_AROUND, .mark = COLOR,
     .curve = AT(light.color_curve), .lamp = true},
    {"intensity", shd_read_number, AT(intensity), .mark = INTENSITY},
    {"ambient", shd_read_color_or_spectrum, AT(light.ambient), .kinds = NOT_AMBIENT,
     .curve = AT(light.ambient_curve), .lamp = true},
    {"attenuation", read_attenuation, AT(light.attenuation), PLACED, .range = &shd_not_negative},
    {"minDistance", shd_read_number, AT(light.min_distance), PLACED, .range = &shd_not_negative},
    {"angle", shd_read_degrees, AT(light.angle), SPOT, .range = &half_angle},
    {"penumbra", shd_read_number, AT(light.penumbra), SPOT, .range = &share},
    {"exponent", shd_read_number, AT(light.exponent), SPOT, .range = &shd_not_negative},
    {"up", shd_read_direction, AT(light.up), RECT, .mark = WITH_UP},
    {"size", read_size, AT(light.size), RECT, .range = &shd_positive},
    {"radius", shd_read_number, AT(light.radius), ROUND, .range = &shd_positive},
    {"visible", read_visible, AT(light.visible), .kinds = SHAPED | AROUND},
    {"map", shd_read_map, AT(light.map), AROUND, .mark = WITH_MAP},
    {"rotate", shd_read_degrees, AT(light.turn), .kinds = AROUND},
    {"frame", shd_read_choice, AT(frame), NOT_AMBIENT, .choices = frames},
    {"name", .read = shd_read_label},
};

static shd_vec3 from_camera(const shd_camera *camera, shd_vec3 v) {
    return shd_madd(shd_madd(shd_scale(camera->right, v.x), camera->up, v.y), camera->back, v.z);
}

/* What a homogeneous or plain position means for each type of light. */
static void place_light(shd_reader *r, const shd_node *node, raw_light *raw) {
    shd_light *light = &raw->light;
    shd_node position = shd_node_member(node, "position");
    bool directional = light->type == SHD_LIGHT_DIRECTIONAL;
    if (directional && position.value && r->seen & WITH_DIRECTION)
        shd_wrong(r, &position, "give either `direction` or `position`, not both");
    const double w = raw->position.at[3];
    const shd_vec3 from = shd_vec3_at(raw->position.at, 0);
    const shd_vec3 at = {from.x / w, from.y / w, from.z / w}; /* in the light's frame */
    if (!directional && w == 0)
        shd_wrong(r, &position, "a %s light cannot be at infinity (w is 0): leave out `type`",
                  shd_light_names[light->type]);
    else if (directional && !isnan(w) && w != 0)
        shd_wrong(r, &position, "a directional light has no position, but a `direction`");
    else if (!raw->position.good)
        return;
    else if (directional && !shd_normalize(shd_scale(from, -1), &light->direction))
        shd_wrong(r, &position, "must not be zero: with w = 0 it is a direction");
    else if (!directional && !shd_is_finite(at))
        shd_wrong(r, &position, "the position divided by w is not finite");
    else if (!directional)
        light->position = at;
}

static void to_world(shd_reader *r, const shd_node *node, shd_light *light) {
    const shd_camera *camera = &r->scene->camera;
    light->position = shd_add(camera->position, from_camera(camera, light->position));
    if (!shd_is_finite(light->position))
        shd_wrong(r, node, "its position in the camera frame is too far away to be a number");
    if (light->type != SHD_LIGHT_POINT)
        shd_normalize(from_camera(camera, light->direction), &light->direction);
    if (!shd_has_shape(light->type)) return;
    light->across = from_camera(camera, light->across);
    light->up = from_camera(camera, light->up);
}

/* Sets color * intensity, which goes to the ambient share of an ambient light. It is NAN if it is
 * not known. */
static void scale_color(shd_reader *r, const shd_node *node, raw_light *raw) {
    shd_light *light = &raw->light;
    for (int c = 0; c < 3; c++) light->color[c] *= raw->intensity;
    if (isinf(light->color[0]) || isinf(light->color[1]) || isinf(light->color[2]))
        shd_wrong(r, node, "`color` times `intensity` is not finite");
    light->color_curve = shd_scale_curve(r, light->color_curve, raw->intensity);
    if (light->type != SHD_LIGHT_AMBIENT) return;
    light->ambient_curve = light->color_curve;
    light->color_curve = NULL;
    memcpy(light->ambient, light->color, sizeof light->ambient);
    memset(light->color, 0, sizeof light->color);
}

static raw_light default_light(shd_reader *r, shd_light_type type) {
    static const shd_vec3 places[] = {
        [SHD_LIGHT_POINT] = {3, 3, 3},  [SHD_LIGHT_SPOT] = {0, 4, 0},
        [SHD_LIGHT_RECT] = {0, 4, 0},   [SHD_LIGHT_DISC] = {0, 4, 0},
        [SHD_LIGHT_SPHERE] = {3, 3, 3}, [SHD_LIGHT_ENVIRONMENT] = {0, 0, 0}};
    raw_light raw = {.position.at[3] = NAN,
                     .intensity = 1,
                     .frame = WORLD,
                     .light = {.type = type,
                               .position = places[type],
                               .direction = {0, -1, 0},
                               .attenuation = {1, 0, 0},
                               .angle = 30 * (SHD_PI / 180),
                               .penumbra = 0.2,
                               .size = {1, 1},
                               .radius = 0.5}};
    /* Far away, a shape is like a point whose light falls off by the square. */
    if (shd_has_shape(type))
        memcpy(raw.light.attenuation, (double[]){0, 0, 1}, sizeof raw.light.attenuation);
    if (type == SHD_LIGHT_DIRECTIONAL) shd_normalize((shd_vec3){0, -1, -1}, &raw.light.direction);
    shd_default_color(r, 1, raw.light.color);
    if (type == SHD_LIGHT_ENVIRONMENT) /* the map has the color */
        memcpy(raw.light.color, (double[]){1, 1, 1}, sizeof raw.light.color);
    return raw;
}

/* The light's kind; -1, and an error, if it has none. */
static int read_kind(shd_reader *r, const shd_node *node) {
    const shd_node type = shd_node_member(node, "type"),
                   position = shd_node_member(node, "position");
    if (type.value) return shd_read_name(r, &type, shd_light_names);
    if (json_is_array(position.value) && json_array_size(position.value) != 3) return BARE_KIND;
    shd_wrong(r, node,
              "a light needs a `type` (ambient, directional, point, spot, rect, disc, sphere or "
              "environment), or a `position` of four components");
    return -1;
}

static void read_light(shd_reader *r, const shd_node *node, shd_light *out) {
    static const char *const names[KINDS] = {
        "an ambient light", "a directional light", "a point light",
        "a spot light",     "a rect light",        "a disc light",
        "a sphere light",   "an environment",      "a light without `type`"};
    if (!shd_is_object(r, node)) return;
    const int kind = read_kind(r, node);
    const bool known = kind >= 0, bare = kind == BARE_KIND;
    raw_light raw = default_light(r, known && !bare ? (shd_light_type)kind : SHD_LIGHT_POINT);
    shd_read_fields(r, node, light_fields, SHD_LENGTH(light_fields), known ? 1u << kind : ANY,
                    known ? names[kind] : "a light", &raw);
    if (!(r->wrong & (COLOR | INTENSITY))) scale_color(r, node, &raw);
    if (raw.intensity < 0)
        shd_warn(r, node, "the intensity is negative: the light takes light away");
    if (!known) return;

    /* A wrong value has its default here, which passes the checks below. */
    const bool bare_direction = bare && raw.position.at[3] == 0;
    if (bare_direction) raw.light.type = SHD_LIGHT_DIRECTIONAL;
    place_light(r, node, &raw);
    if (shd_has_shape(raw.light.type)) {
        const bool right = !(r->wrong & (WITH_DIRECTION | WITH_UP));
        shd_turn_shape(r, node, right && r->seen & WITH_UP, &raw.light);
    }
    if (bare_direction) {
        /* Distance means nothing for a directional light. */
        memcpy(raw.light.attenuation, (double[]){1, 0, 0}, sizeof raw.light.attenuation);
        raw.light.min_distance = 0;
    }
    if (raw.light.type == SHD_LIGHT_ENVIRONMENT) {
        if (!(r->seen & WITH_MAP)) shd_wrong(r, node, "the member \"map\" is missing");
        shd_finish_surroundings(r, node, &raw.light);
    }
    if (raw.frame == CAMERA) to_world(r, node, &raw.light);
    *out = raw.light;
}

void shd_read_lights(shd_reader *r, const shd_node *node, void *out) {
    shd_scene *scene = out;
    size_t count = r->lights = 1;
    if (node->value) {
        r->lights = SIZE_MAX;
        if (!shd_is_array(r, node, 0, SIZE_MAX, "an array of lights")) return;
        r->lights = json_array_size(node->value);
        count = shd_hold_to_limit(r, node, "the scene asks for", r->lights, SHD_LIMIT_LIGHTS,
                                  r->limits->lights);
    }
    shd_light *lights = shd_take(r, count, sizeof *lights);
    if (!lights) return;
    if (!node->value) { /* OpenGL's default light shines along the view. */
        *lights = default_light(r, SHD_LIGHT_DIRECTIONAL).light;
        lights->direction = shd_scale(scene->camera.back, -1);
    }
    for (size_t i = 0; node->value && i < count && !shd_is_cancelled(r->cancelled); i++) {
        shd_node light = shd_node_item(node, i);
        read_light(r, &light, &lights[i]);
    }
    scene->lights = lights;
    scene->light_count = count;
}
