/* Environments: the maps that lights name, and what scenes with them cannot have. */
#include <string.h>

#include "scene/read.h"
#include "scene/surroundings.h"

/* Light is made of what has no more rows than this; what is seen may have more. */
static const shd_surroundings *take_picture(shd_reader *r, const shd_node *node, const char *name,
                                            int rows) {
    const shd_space_info *working = r->scene->working_space;
    const shd_surroundings *map = NULL;
    shd_error error = {.limit = SHD_LIMIT_NONE};
    if (!working) return NULL; /* which is wrong itself */
    const shd_status status =
        r->shelf->surround(r->shelf->context, name, working, rows, &map, &error);
    if (status == SHD_OK) return map;
    if (status == SHD_MISSING) {
        shd_note_missing(r, node, "asset", name);
    } else {
        shd_node_report(r->report, node, status, "%s", error.text);
        if (error.limit != SHD_LIMIT_NONE) shd_report_limit(r->report, error.limit);
    }
    return NULL;
}

static void warn_of_held(shd_reader *r, const shd_node *node, const shd_surroundings *map) {
    if (map->held)
        shd_warn(r, node,
                 "%zu components of the map's texels are no radiance: what is below 0 or no number "
                 "counts as 0, and what is endless as 65504",
                 map->held);
}

void shd_read_map(shd_reader *r, const shd_node *node, void *out) {
    const char *name = shd_get_text(r, node, "\"sky\", \"studio\", or the name of a picture");
    if (!name) return;
    for (int k = 0; shd_surroundings_names[k]; k++) {
        if (strcmp(name, shd_surroundings_names[k])) continue;
        const shd_surroundings *map = shd_surroundings_find(name);
        if (!map) shd_node_report(r->report, node, SHD_EXHAUSTED, "out of memory");
        *(const shd_surroundings **)out = map;
        return;
    }
    /* Names of files end in what they are. */
    const bool file = strchr(name, '.') || !strncmp(name, "sha256-", 7);
    if (!file || !r->shelf || !r->shelf->surround) {
        shd_wrong(r, node,
                  "there is no map \"%s\": expected \"sky\", \"studio\", the name of a picture, or "
                  "\"sha256-\" and the digits of one that was put",
                  shd_quote(name).text);
    } else if (r->maps++ < SHD_ENVIRONMENTS_MOST) { /* no scene has more */
        const shd_surroundings *map = take_picture(r, node, name, SHD_SURROUNDINGS_MOST);
        if (map) warn_of_held(r, node, map);
        *(const shd_surroundings **)out = map;
    }
}

/* As many rows as half a turn has pixels in the middle of the picture, or up to half as many more,
 * so that pictures of about the same view share a map: seen texels are then a pixel wide or less,
 * and not so small that pixels miss some. */
static int rows_of_view(const shd_scene *scene) {
    enum { MOST = 1024 };
    const shd_camera *camera = &scene->camera;
    if (camera->projection == SHD_ORTHOGRAPHIC) return SHD_SURROUNDINGS_MOST;
    const double pixel = 2 * tan(camera->fov / 2) / scene->raster.height, wanted = SHD_PI / pixel;
    int rows = SHD_SURROUNDINGS_MOST;
    for (; rows < wanted && rows < MOST; rows *= 2)
        if (rows + rows / 2 >= wanted) return rows + rows / 2;
    return rows;
}

/* What is seen of a map. One whose picture has no more texels is that itself. */
static const shd_surroundings *find_seen(shd_reader *r, const shd_node *node,
                                         const shd_surroundings *map) {
    const int rows = rows_of_view(r->scene);
    if (!map->working || map->height < SHD_SURROUNDINGS_MOST || rows == SHD_SURROUNDINGS_MOST)
        return map;
    const shd_node at = shd_node_member(node, "map");
    return take_picture(r, &at, json_string_value(at.value), rows);
}

/* What the map's colors become in the working space. */
static void find_colors(shd_reader *r, const shd_node *node, shd_light *light) {
    const shd_space_info *from = r->catalog->rec709, *to = r->scene->working_space;
    if (light->map && light->map->working) from = to;
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
    find_colors(r, node, light);
    if (light->map && light->visible) light->seen = find_seen(r, node, light->map);
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
        if (scene->lights[i].seen) scene->backdrop = &scene->lights[i];
        if (count++ == SHD_ENVIRONMENTS_MOST)
            shd_wrong(r, &at, "a scene has at most %d environments", SHD_ENVIRONMENTS_MOST);
        if (count > 1) continue;
        for (size_t m = 0; m < scene->material_count; m++) {
            const shd_material *material = &scene->materials[m];
            if (material->model != SHD_MODEL_WESTIN) continue;
            const bool named = *material->name;
            shd_wrong(r, &at, "an environment lights no microgeometry, and %s%s%s is westin",
                      named ? "the material \"" : "a material", shd_quote(material->name).text,
                      named ? "\"" : "");
            break;
        }
    }
    if (!scene->backdrop) return;
    scene->transparent = false;
    scene->background_alpha = 0;
    memset(scene->background, 0, sizeof scene->background);
}
