/* Environments: the maps that lights name, and what scenes with them cannot have. */
#include <string.h>

#include "scene/read.h"
#include "scene/surroundings.h"

void shd_read_map(shd_reader *r, const shd_node *node, void *out) {
    const char *name = shd_get_text(r, node, "the name of a map: \"sky\" or \"studio\"");
    if (!name) return;
    for (int k = 0; shd_surroundings_names[k]; k++) {
        if (strcmp(name, shd_surroundings_names[k])) continue;
        const shd_surroundings *map = shd_surroundings_find(name);
        if (!map) shd_node_report(r->report, node, SHD_EXHAUSTED, "out of memory");
        *(const shd_surroundings **)out = map;
        return;
    }
    shd_wrong(r, node, "there is no map \"%s\": expected \"sky\" or \"studio\"",
              shd_quote(name).text);
}

/* What linear Rec.709 becomes in the working space. */
static void find_colors(shd_reader *r, const shd_node *node, shd_light *light) {
    const shd_space_info *from = r->catalog->rec709, *to = r->scene->working_space;
    if (!from) {
        shd_wrong(r, node, "the color configuration has no linear Rec.709, in which maps are");
        return;
    }
    for (int c = 0; c < 3; c++) {
        double rgb[3] = {c == 0, c == 1, c == 2};
        if (to != from) shd_convert_color(r, node, from, rgb);
        for (int k = 0; k < 3; k++) light->of_map[k][c] = rgb[k];
    }
}

void shd_finish_surroundings(shd_reader *r, const shd_node *node, shd_light *light) {
    if (r->scene->spectral.channels)
        shd_wrong(r, node, "a spectral scene has no environment: its map has no spectrum");
    find_colors(r, node, light);
}

void shd_check_surroundings(shd_reader *r, const shd_node *root) {
    shd_scene *scene = r->scene;
    const shd_node lights = shd_node_member(root, "lights");
    size_t count = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        if (scene->lights[i].type != SHD_LIGHT_ENVIRONMENT) continue;
        const shd_node at = shd_node_item(&lights, i);
        if (scene->lights[i].visible && scene->backdrop)
            shd_wrong(r, &at, "only one environment of a scene can be visible");
        if (scene->lights[i].visible && scene->lights[i].map) scene->backdrop = &scene->lights[i];
        if (count++ == SHD_ENVIRONMENTS_MOST)
            shd_wrong(r, &at, "a scene has at most %d environments", SHD_ENVIRONMENTS_MOST);
        if (count > 1) continue;
        for (size_t m = 0; m < scene->material_count; m++) {
            const shd_material *material = &scene->materials[m];
            if (material->model == SHD_MODEL_PHONG) continue;
            shd_wrong(r, &at,
                      "an environment lights Phong's materials only, and the material \"%s\" is %s",
                      shd_quote(material->name).text, shd_model_names[material->model]);
            break;
        }
    }
    if (!scene->backdrop) return;
    scene->transparent = false;
    scene->background_alpha = 0;
    memset(scene->background, 0, sizeof scene->background);
}
