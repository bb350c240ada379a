/* Lights with a shape: how they are turned, and the objects that show them. */
#include <string.h>

#include "scene/read.h"

void shd_turn_shape(shd_reader *r, const shd_node *node, bool given_up, shd_light *light) {
    const shd_vec3 toward = light->direction;
    shd_vec3 up = {0, 1, 0}, across;
    if (given_up)
        up = light->up;
    else if (fabs(toward.x) < 1e-9 && fabs(toward.z) < 1e-9)
        up = (shd_vec3){0, 0, -1};
    const shd_vec3 product = shd_cross(up, toward);
    if (!(shd_length(product) >= 1e-9) || !shd_normalize(product, &across)) {
        const shd_node given = shd_node_member(node, "up");
        shd_wrong(r, given.value ? &given : node, "`up` is parallel to `direction`: turn it aside");
        across = (shd_vec3){1, 0, 0};
    }
    light->across = across;
    shd_normalize(shd_cross(toward, across), &light->up);
}

size_t shd_count_emitters(const shd_scene *scene) {
    size_t count = 0;
    for (size_t i = 0; i < scene->light_count; i++)
        count += shd_has_shape(scene->lights[i].type) && scene->lights[i].visible;
    return count;
}

/* Whether the camera is before the light's face, so that it sees what shines. */
static bool shines_at_camera(const shd_camera *camera, const shd_light *light) {
    if (light->type == SHD_LIGHT_SPHERE) return true;
    const shd_vec3 toward = camera->projection == SHD_ORTHOGRAPHIC
                                ? camera->back
                                : shd_sub(camera->position, light->position);
    return shd_dot(toward, light->direction) > 0;
}

/* A square of side 1 around the origin, in z = 0. */
static const shd_mesh *make_square(shd_reader *r) {
    static const double corners[] = {-0.5, -0.5, 0, 0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, 0.5, 0};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    shd_mesh *mesh = shd_take(r, 1, sizeof *mesh);
    if (!mesh) return NULL;
    *mesh = (shd_mesh){.vertex_count = 4,
                       .triangle_count = 2,
                       .positions = corners,
                       .indices = indices,
                       .low = {-0.5, -0.5, 0},
                       .high = {0.5, 0.5, 0}};
    r->triangles += mesh->triangle_count;
    return mesh;
}

static shd_affine columns_of(shd_vec3 x, shd_vec3 y, shd_vec3 z, shd_vec3 origin) {
    return (shd_affine){{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}, origin};
}

/* The shape. Sizes are in the transform of a rectangle. False: memory. */
static bool make_shape(shd_reader *r, const shd_light *light, shd_object *out) {
    *out = (shd_object){.shape = SHD_SPHERE,
                        .radius = light->radius,
                        .tube = 0.25,
                        .height = 2,
                        .size = {1, 1, 1},
                        .interpolation = SHD_PHONG,
                        .segments = 32,
                        .emitter = light};
    const shd_vec3 x = light->across, y = light->up, out_of = light->direction;
    out->transform =
        columns_of((shd_vec3){1, 0, 0}, (shd_vec3){0, 1, 0}, (shd_vec3){0, 0, 1}, light->position);
    if (light->type == SHD_LIGHT_DISC) {
        out->shape = SHD_DISC;
        out->transform = columns_of(x, out_of, shd_scale(y, -1), light->position);
    } else if (light->type == SHD_LIGHT_RECT) {
        const double w = light->size[0], h = light->size[1];
        out->shape = SHD_MESH;
        out->mesh = make_square(r);
        out->transform = columns_of(shd_scale(x, w), shd_scale(y, h),
                                    shd_scale(out_of, shd_smaller(w, h)), light->position);
    }
    return out->shape != SHD_MESH || out->mesh;
}

void shd_add_emitters(shd_reader *r, const shd_node *node, shd_object *objects) {
    const shd_scene *scene = r->scene;
    const shd_node lights = shd_node_member(node->parent, "lights");
    for (size_t i = 0; i < scene->light_count; i++) {
        const shd_light *light = &scene->lights[i];
        const shd_node at = shd_node_item(&lights, i);
        if (!shd_has_shape(light->type) || !light->visible) continue;
        shd_material material = {.name = "",
                                 .lobes = shd_take(r, 1, sizeof(shd_lobe)),
                                 .lobe_count = 1,
                                 .opacity = {1, 1, 1},
                                 .ior = 1.5};
        if (!material.lobes || !make_shape(r, light, objects)) return;
        const double radiance = SHD_PI / shd_light_area(light);
        const double shines = shines_at_camera(&scene->camera, light) ? radiance : 0;
        bool finite = isfinite(radiance);
        for (int c = 0; finite && c < 3; c++) {
            material.emissive[c] = light->color[c] * shines;
            finite = isfinite(light->color[c] * radiance) || isnan(light->color[c]);
        }
        shd_affine to_world, from_world;
        if (!finite || !shd_object_frame(objects, &to_world, &from_world))
            shd_wrong(r, &at,
                      "it cannot be drawn: its size, or the radiance that it needs, is out of the "
                      "range of numbers");
        objects->material = r->material_count;
        r->materials[r->material_count++] = material;
        objects++;
    }
}
