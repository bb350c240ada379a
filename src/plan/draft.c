/* What `draft` may do. */
#include "plan/plan.h"

/* Whether there is nothing beyond Phong's model, and no layer beside the picture. */
static bool is_plain(const shd_plan *plan) {
    if (plan->extended || plan->plane_count > 1) return false;
    for (int k = SHD_LAYER_NORMAL; k < SHD_LAYER_KINDS; k++)
        if (plan->wants[k]) return false;
    return true;
}

static bool is_for_drafts(const shd_plan *plan, size_t index) {
    const shd_object *object = &plan->scene->objects[index];
    return (object->shape == SHD_SPHERE || object->shape == SHD_PLANE) &&
           object->interpolation == SHD_PHONG && !plan->materials[object->material].textures;
}

bool shd_plan_may_thin(const shd_plan *plan) {
    if (plan->scene->raster.samples == 1 || !is_plain(plan)) return false;
    for (size_t o = 0; o < plan->scene->object_count; o++)
        if (is_for_drafts(plan, o)) return true;
    return false;
}

static bool adds_light(const double color[3]) {
    return color[0] >= 0 && color[1] >= 0 && color[2] >= 0;
}

bool shd_plan_sketches(const shd_plan *plan, const shd_plan_group *group) {
    const shd_plan_material *material = &plan->materials[group->material];
    if (group->light_count > SHD_SKETCH_LIGHTS || material->lobe_count > SHD_SKETCH_LOBES ||
        !adds_light(material->constant) || !adds_light(material->diffuse))
        return false;
    for (size_t k = 0; k < material->lobe_count; k++)
        if (shd_is_sheer(material->lobes[k].shininess) || !adds_light(material->lobes[k].specular))
            return false;
    for (size_t k = 0; k < group->light_count; k++) {
        const shd_plan_light *light = &plan->lights[group->lights[k]];
        if (light->spot || !adds_light(light->color) ||
            (plan->sheets && plan->sheets[group->lights[k]].count))
            return false;
    }
    return true;
}

/* An ellipsoid may be so much longer one way than another: where it is flatter than half of that,
 * no block is sketched (shade/sketch.c). */
static bool is_plump(const shd_object *object) {
    static const double MOST = 4;
    shd_affine to_world, from_world;
    double axes[3];
    if (object->shape != SHD_SPHERE) return true;
    to_world = shd_object_to_world(object);
    if (shd_is_similar(&to_world, axes)) return true;
    return shd_object_frame(object, &to_world, &from_world) &&
           shd_norm(&to_world) * shd_norm(&from_world) < MOST;
}

/* Meshes whose triangles are so small that blocks see many are drawn as fast by the standard tier,
 * which leaves something for later requests. */
static bool is_coarse(const shd_raster *raster, const shd_mesh *mesh) {
    enum { SMALL = 32 }; /* pixels of the whole picture for each triangle */
    const double pixels = (double)raster->width * raster->height;
    return SMALL * (double)mesh->triangle_count <= pixels;
}

static bool may_sketch_object(const shd_plan *plan, size_t index) {
    const shd_object *object = &plan->scene->objects[index];
    if (object->shape != SHD_MESH) return is_for_drafts(plan, index) && is_plump(object);
    return object->interpolation == SHD_PHONG && !plan->materials[object->material].textures &&
           is_coarse(&plan->scene->raster, object->mesh);
}

/* What is sketched leaves nothing for later requests, so that a picture in which other things are
 * seen, too, would be drawn anew as a whole wherever a color changes. */
bool shd_plan_may_sketch(const shd_plan *plan) {
    const size_t count = plan->scene->object_count;
    if (plan->split_positions || !is_plain(plan)) return false;
    for (size_t g = 0; g < plan->group_count; g++)
        if (!shd_plan_sketches(plan, &plan->groups[g])) return false;
    for (size_t o = 0; o < count; o++)
        if (!may_sketch_object(plan, o)) return false;
    return count > 0;
}
