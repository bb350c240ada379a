/* What a scene is seen by: its camera and its lights. */
#include <float.h>
#include <math.h>

#include "base/vec3.h"
#include "import/writing.h"

/* The box around all objects: those around their meshes, carried to the world. */
static void find_box(const shd_scene_writer *w, shd_vec3 *low, shd_vec3 *high) {
    const shd_model_object *objects = shd_span_items(w->model, w->model->objects);
    const shd_model_mesh *meshes = shd_span_items(w->model, w->model->meshes);
    *low = (shd_vec3){DBL_MAX, DBL_MAX, DBL_MAX};
    *high = (shd_vec3){-DBL_MAX, -DBL_MAX, -DBL_MAX};
    for (size_t i = 0; i < w->model->objects.count; i++) {
        if (!w->object_used[i]) continue;
        const shd_span span = meshes[objects[i].mesh].positions;
        const float *p = shd_span_items(w->model, span);
        const double *m = objects[i].matrix;
        for (size_t v = 0; v + 2 < span.count; v += 3) {
            const double x = p[v], y = p[v + 1], z = p[v + 2];
            const shd_vec3 at = {m[0] * x + m[4] * y + m[8] * z + m[12],
                                 m[1] * x + m[5] * y + m[9] * z + m[13],
                                 m[2] * x + m[6] * y + m[10] * z + m[14]};
            *low = shd_vec3_min(at, *low);
            *high = shd_vec3_max(at, *high);
        }
    }
}

/* How far a target has to be from a position at least, so that floats tell them apart. */
static double reach_at(shd_vec3 at) {
    return 1e-5 * fmax(fabs(at.x), fmax(fabs(at.y), fabs(at.z)));
}

/* A view from the front, the right and above that holds the box. */
static void put_framing_camera(const shd_scene_writer *w) {
    enum { FOV = 30 };
    shd_vec3 low, high, back = {0.45, 0.35, 1}, right = {1, 0, 0}, up;
    find_box(w, &low, &high);
    if (!(low.x <= high.x)) low = high = (shd_vec3){0, 0, 0};
    const shd_vec3 middle = shd_scale(shd_add(low, high), 0.5);
    shd_normalize(back, &back);
    shd_normalize(shd_cross((shd_vec3){0, 1, 0}, back), &right);
    up = shd_cross(back, right);
    double distance = 0;
    const double slope = tan(FOV / 2.0 * SHD_PI / 180);
    for (int corner = 0; corner < 8; corner++) {
        const shd_vec3 p =
            shd_sub((shd_vec3){corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                               corner & 4 ? high.z : low.z},
                    middle);
        const double aside = fmax(fabs(shd_dot(p, right)), fabs(shd_dot(p, up)));
        distance = fmax(distance, shd_dot(p, back) + 1.05 * aside / slope);
    }
    if (!(distance > 0)) distance = 1;
    distance = fmax(distance, reach_at(middle));
    const shd_vec3 at = shd_add(middle, shd_scale(back, distance));
    fputs("  \"camera\": {\"position\": ", w->out);
    shd_put_numbers(w->out, (const double[]){at.x, at.y, at.z}, 3);
    fputs(", \"target\": ", w->out);
    shd_put_numbers(w->out, (const double[]){middle.x, middle.y, middle.z}, 3);
    fprintf(w->out, ", \"fov\": %d},\n", FOV);
}

static shd_vec3 vec_of(const double v[3]) {
    return (shd_vec3){v[0], v[1], v[2]};
}

static bool is_camera(const shd_model_camera *c) {
    shd_vec3 forward, up, across;
    return shd_normalize(vec_of(c->forward), &forward) && shd_normalize(vec_of(c->up), &up) &&
           shd_normalize(shd_cross(forward, up), &across) &&
           shd_length(shd_cross(forward, up)) > 1e-6 &&
           (c->fov > 0 ? c->fov < 179 : isnormal(c->height) && c->height > 0);
}

static void put_camera(const shd_scene_writer *w, const shd_model_camera *c) {
    shd_vec3 forward = {0, 0, -1};
    shd_normalize(vec_of(c->forward), &forward);
    const double reach = fmax(1, reach_at(vec_of(c->position)));
    const shd_vec3 target = shd_add(vec_of(c->position), shd_scale(forward, reach));
    fprintf(w->out, "  \"camera\": {\"type\": \"%s\", \"position\": ",
            c->fov > 0 ? "perspective" : "orthographic");
    shd_put_numbers(w->out, c->position, 3);
    fputs(", \"target\": ", w->out);
    shd_put_numbers(w->out, (const double[]){target.x, target.y, target.z}, 3);
    fputs(", \"up\": ", w->out);
    shd_put_numbers(w->out, c->up, 3);
    if (c->fov > 0)
        fprintf(w->out, ", \"fov\": %.7g},\n", c->fov);
    else
        fprintf(w->out, ", \"height\": %.7g},\n", c->height);
}

/* The first camera, in the shape that it has. */
void shd_put_view(const shd_scene_writer *w) {
    enum { WIDTH = 512 };
    const shd_model_camera *cameras = shd_span_items(w->model, w->model->cameras), *first = NULL;
    size_t sound = 0;
    for (size_t i = 0; i < w->model->cameras.count; i++) {
        if (!is_camera(&cameras[i])) continue;
        if (!sound++) first = &cameras[i];
    }
    if (sound > 1) shd_import_note(w->options, "the first of %zu cameras is taken", sound);
    double aspect = first && first->aspect > 0 ? first->aspect : 1;
    aspect = fmin(fmax(aspect, 0.25), 4);
    if (first)
        put_camera(w, first);
    else
        put_framing_camera(w);
    fprintf(w->out, "  \"image\": {\"width\": %d, \"height\": %d},\n", WIDTH,
            (int)lround(WIDTH / aspect));
}

/* Light of E lux upon a surface of diffuse 1 leaves it as E / pi, which is Il. */
static void put_light(const shd_scene_writer *w, const shd_model_light *l) {
    static const char *const types[] = {[SHD_MODEL_POINT] = "point",
                                        [SHD_MODEL_DIRECTIONAL] = "directional",
                                        [SHD_MODEL_SPOT] = "spot"};
    const double most = fmax(l->color[0], fmax(l->color[1], l->color[2]));
    double color[3];
    for (int c = 0; c < 3; c++) color[c] = most > 0 ? fmax(l->color[c], 0) / most : 0;
    fprintf(w->out, "{\"type\": \"%s\", \"color\": ", types[l->type]);
    shd_put_numbers(w->out, color, 3);
    fprintf(w->out, ", \"intensity\": %.7g", fmax(most, 0) / SHD_PI);
    if (l->type != SHD_MODEL_DIRECTIONAL) {
        fputs(", \"position\": ", w->out);
        shd_put_numbers(w->out, l->position, 3);
        fputs(", \"attenuation\": [0, 0, 1]", w->out);
    }
    if (l->type != SHD_MODEL_POINT) {
        fputs(", \"direction\": ", w->out);
        shd_put_numbers(w->out, l->direction, 3);
    }
    if (l->type == SHD_MODEL_SPOT) {
        const double outer = fmin(fmax(l->outer, 0.01), 180);
        fprintf(w->out, ", \"angle\": %.7g, \"penumbra\": %.7g", outer,
                1 - fmin(fmax(l->inner, 0) / outer, 1));
    }
    fputc('}', w->out);
}

static bool is_light(const shd_model_light *l) {
    shd_vec3 direction;
    return l->type == SHD_MODEL_POINT || shd_normalize(vec_of(l->direction), &direction);
}

/* Without any there is the headlight, which is the default. */
void shd_put_lights(const shd_scene_writer *w) {
    const shd_model_light *lights = shd_span_items(w->model, w->model->lights);
    bool first = true;
    for (size_t i = 0; i < w->model->lights.count; i++) {
        if (!is_light(&lights[i])) continue;
        fputs(first ? "  \"lights\": [\n    " : ",\n    ", w->out);
        first = false;
        put_light(w, &lights[i]);
    }
    if (!first) fputs("\n  ],\n", w->out);
    if (w->model->ranged_lights)
        shd_import_note(w->options, "the range of %llu lights is left out",
                        (unsigned long long)w->model->ranged_lights);
}
