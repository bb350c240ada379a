#include "attack/document.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "attack/facets.h"

static real number(const json_t *object, const char *name, double without) {
    const json_t *value = json_object_get(object, name);
    return json_is_number(value) ? (real)json_number_value(value) : (real)without;
}

static bool is(const json_t *object, const char *name, const char *text) {
    const char *value = json_string_value(json_object_get(object, name));
    return value && !strcmp(value, text);
}

static real item(const json_t *array, size_t i) {
    return (real)json_number_value(json_array_get(array, i));
}

/* A curve of one sample is a grey. */
static point vector(const json_t *object, const char *name, point without) {
    const json_t *value = json_object_get(object, name),
                 *samples = json_object_get(value, "values");
    const json_t *colors = json_object_get(value, "colors");
    if (colors && is(value, "pattern", "checker") &&
        json_is_number(json_object_get(json_object_get(value, "uv"), "scale"))) {
        /* Of a checker within one of its checks, which the offset tells. */
        const json_t *uv = json_object_get(value, "uv");
        const json_t *seen = json_array_get(colors, item(json_object_get(uv, "offset"), 0) > 1);
        return (point){item(seen, 0), item(seen, 1), item(seen, 2)};
    }
    if (samples) return times((point){1, 1, 1}, item(samples, 0));
    if (json_is_number(value)) return times((point){1, 1, 1}, (real)json_number_value(value));
    return json_is_array(value) ? (point){item(value, 0), item(value, 1), item(value, 2)} : without;
}

static void color(const json_t *object, const char *name, point without, real out[3]) {
    const point p = vector(object, name, without);
    out[0] = p.x, out[1] = p.y, out[2] = p.z;
}

static point grey(double v) {
    return (point){(real)v, (real)v, (real)v};
}

/* ---- Camera and lights. ---- */

static void read_camera(const json_t *camera, document *d) {
    d->orthographic = is(camera, "type", "orthographic");
    d->eye = vector(camera, "position", (point){0, 0, 4});
    d->back = unit(sub(d->eye, vector(camera, "target", (point){0, 0, 0})));
    d->right = unit(cross(unit(vector(camera, "up", (point){0, 1, 0})), d->back));
    d->up = cross(d->back, d->right);
    const real half = degrees(number(camera, "fov", 40)) / 2;
    d->half = d->orthographic ? number(camera, "height", 2) / 2 : SINE(half) / COSINE(half);
}

static point out_of_frame(const json_t *light, const document *d, point p) {
    if (!is(light, "frame", "camera")) return p;
    return add(add(times(d->right, p.x), times(d->up, p.y)), times(d->back, p.z));
}

/* Rectangles are turned by an `up`, which their documents have; discs are any way. */
static void read_shape(const json_t *light, lamp *out) {
    const json_t *size = json_object_get(light, "size");
    const point aside = SIZE(out->axis.x) < (real)0.5 ? (point){1, 0, 0} : (point){0, 1, 0};
    out->radius = number(light, "radius", 1);
    out->across = unit(cross(vector(light, "up", aside), out->axis));
    out->up = unit(cross(out->axis, out->across));
    const bool rectangle = out->kind == RECTANGLE;
    out->across = times(out->across, rectangle ? item(size, 0) / 2 : out->radius);
    out->up = times(out->up, rectangle ? item(size, 1) / 2 : out->radius);
}

static void read_lamp(const json_t *light, const document *d, lamp *out, real ambient[3]) {
    const real intensity = number(light, "intensity", 1);
    real share[3];
    color(light, "ambient", grey(0), share);
    color(light, "color", grey(1), out->color);
    for (int c = 0; c < 3; c++) out->color[c] *= intensity, ambient[c] += share[c];
    out->kind = is(light, "type", "ambient")       ? AMBIENT
                : is(light, "type", "directional") ? DIRECTIONAL
                : is(light, "type", "spot")        ? SPOT
                : is(light, "type", "rect")        ? RECTANGLE
                : is(light, "type", "disc")        ? ROUND
                : is(light, "type", "sphere")      ? BALL
                : is(light, "type", "environment") ? AROUND
                                                   : POINT;
    for (int c = 0; out->kind == AMBIENT && c < 3; c++) ambient[c] += out->color[c];
    out->axis = unit(out_of_frame(light, d, vector(light, "direction", (point){0, -1, 0})));
    out->toward = times(out->axis, -1);
    out->position = out_of_frame(light, d, vector(light, "position", grey(0)));
    if (is(light, "frame", "camera")) out->position = add(out->position, d->eye);
    color(light, "attenuation", (point){1, 0, 0}, out->attenuation);
    out->least = number(light, "minDistance", 0);
    out->angle = degrees(number(light, "angle", 30));
    out->inner = out->angle * (1 - number(light, "penumbra", 0.2));
    out->exponent = number(light, "exponent", 0);
    out->turn = degrees(number(light, "rotate", 0));
    if (out->kind >= RECTANGLE && out->kind <= BALL) read_shape(light, out);
}

static bool read_lamps(const json_t *lights, document *d, real ambient[3]) {
    /* The default light shines along the view. */
    d->lamp_count = lights ? json_array_size(lights) : 1;
    d->lamps = calloc(d->lamp_count + 1, sizeof *d->lamps);
    if (!d->lamps) return false;
    if (!lights) d->lamps[0] = (lamp){.kind = DIRECTIONAL, .toward = d->back, .color = {1, 1, 1}};
    for (size_t i = 0; lights && i < d->lamp_count; i++)
        read_lamp(json_array_get(lights, i), d, &d->lamps[i], ambient);
    return true;
}

/* ---- Objects. ---- */

static void read_reflection(const json_t *from, stuff *out) {
    static const char *const kinds[REFLECTIONS] = {
        [BLINN] = "blinn-phong",     [NORMALIZED] = "phong-normalized",
        [OREN_NAYAR] = "oren-nayar", [COOK_TORRANCE] = "cook-torrance",
        [TABLED] = "westin",
    };
    const json_t *fresnel = json_object_get(from, "fresnel");
    real f0[3];
    out->kind = PLAIN;
    for (int k = BLINN; k < REFLECTIONS; k++)
        if (is(from, "model", kinds[k])) out->kind = (reflection_kind)k;
    out->sigma = degrees(number(from, "sigma", 20));
    color(fresnel, "n", grey(1.5), out->index);
    color(fresnel, "k", grey(0), out->absorption);
    color(fresnel, "f0", grey(-1), f0);
    for (int c = 0; c < 3; c++)
        if (f0[c] >= 0)
            out->index[c] = f0[c] < 1 ? (1 + ROOT(f0[c])) / (1 - ROOT(f0[c])) : (real)INFINITY;
    color(from, "opacity", grey(1), out->opacity);
    color(from, "reflection", grey(0), out->reflection);
    color(from, "transmission", grey(0), out->transmission);
    out->ior = number(from, "ior", 1.5);
}

/* Where scales are two numbers, a pattern is what pixels see of it. */
static void read_print(const json_t *from, const char *name, stuff *s, int index) {
    static const char *const kinds[] = {"", "checker", "grid", "gradient", "noise"},
                             *const wraps[] = {"clamp", "repeat", "mirror"};
    const json_t *value = json_object_get(from, name), *uv = json_object_get(value, "uv"),
                 *scale = json_object_get(uv, "scale"), *offset = json_object_get(uv, "offset"),
                 *colors = json_object_get(value, "colors"),
                 *values = json_object_get(value, "values");
    if (!json_is_array(scale)) return;
    print *p = &s->prints[index];
    for (int k = CHECKER_PRINT; k <= NOISE_PRINT; k++)
        if (is(value, "pattern", kinds[k])) p->kind = (print_kind)k;
    for (int k = 0; k < 3; k++)
        if (is(uv, "wrap", wraps[k])) p->wrap = (print_wrap)k;
    p->width = number(value, "width", 0.1);
    const real turn = degrees(number(uv, "rotate", 0)), a = COSINE(turn), b = SINE(turn);
    p->map[0][0] = a * item(scale, 0), p->map[0][1] = -b * item(scale, 1);
    p->map[1][0] = b * item(scale, 0), p->map[1][1] = a * item(scale, 1);
    for (size_t k = 0; k < 2; k++) {
        p->map[k][2] = item(offset, k);
        for (size_t c = 0; c < 3; c++)
            p->colors[k][c] = values ? item(values, k) : item(json_array_get(colors, k), c);
    }
    s->printed = true;
}

static void read_prints(const json_t *from, const real ambient[3], stuff *out) {
    const json_t *lobes = json_object_get(from, "lobes");
    read_print(from, "emissive", out, EMISSIVE_PRINT);
    read_print(from, json_object_get(from, "ambient") ? "ambient" : "diffuse", out, AMBIENT_PRINT);
    read_print(from, "diffuse", out, DIFFUSE_PRINT);
    const size_t given = out->kind == COOK_TORRANCE ? 0 : 1;
    for (size_t k = given; k < out->lobe_count && k < MOST_LOBES; k++)
        read_print(json_array_get(lobes, k - given), "specular", out, (int)(LOBE_PRINTS + k));
    if (given) read_print(from, "specular", out, LOBE_PRINTS);
    for (size_t k = given; k < out->lobe_count && k < MOST_LOBES; k++)
        read_print(json_array_get(lobes, k - given), "shininess", out, (int)(GLOSS_PRINTS + k));
    if (given) read_print(from, "shininess", out, GLOSS_PRINTS);
    for (int c = 0; c < 3; c++) out->filled[c] = ambient[c];
}

static void read_stuff(const json_t *from, const real ambient[3], stuff *out) {
    const json_t *lobes = json_object_get(from, "lobes");
    real emissive[3], share[3];
    color(from, "emissive", grey(0), emissive);
    color(from, "diffuse", grey(0.8), out->diffuse);
    const point diffuse = {out->diffuse[0], out->diffuse[1], out->diffuse[2]};
    color(from, "ambient", diffuse, share);
    for (int c = 0; c < 3; c++) out->constant[c] = emissive[c] + share[c] * ambient[c];
    read_reflection(from, out);
    const size_t given = out->kind == COOK_TORRANCE ? 0 : 1;
    out->lobe_count = given + json_array_size(lobes);
    for (size_t k = 0; k < out->lobe_count && k < MOST_LOBES; k++) {
        const json_t *l = k < given ? from : json_array_get(lobes, k - given);
        color(l, given ? "specular" : "weight", grey(given ? 0 : 1), out->lobes[k].specular);
        out->lobes[k].shininess = number(l, given ? "shininess" : "roughness", 32);
    }
    out->front_only = is(from, "side", "front");
    memcpy(out->emissive, emissive, sizeof emissive);
    memcpy(out->ambient, share, sizeof share);
    read_prints(from, ambient, out);
}

/* m = turn m, about an axis. */
static void turn_about(real m[3][3], int axis, real angle) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const real s = SINE(degrees(angle)), c = COSINE(degrees(angle));
    for (int k = 0; k < 3; k++) {
        const real u = m[a][k], v = m[b][k];
        m[a][k] = c * u - s * v;
        m[b][k] = s * u + c * v;
    }
}

static void read_transform(const json_t *transform, thing *t) {
    const json_t *matrix = json_object_get(transform, "matrix");
    const point scale = vector(transform, "scale", grey(1)),
                turn = vector(transform, "rotate", grey(0));
    real m[3][3] = {{scale.x, 0, 0}, {0, scale.y, 0}, {0, 0, scale.z}};
    turn_about(m, 0, turn.x);
    turn_about(m, 1, turn.y);
    turn_about(m, 2, turn.z);
    t->origin = vector(transform, "translate", grey(0));
    for (size_t c = 0; matrix && c < 3; c++)
        for (size_t r = 0; r < 3; r++) m[r][c] = item(matrix, 4 * c + r);
    if (matrix) t->origin = (point){item(matrix, 12), item(matrix, 13), item(matrix, 14)};

    real det = 0;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int a = (r + 1) % 3, b = (r + 2) % 3, e = (c + 1) % 3, f = (c + 2) % 3;
            t->to_world[r][c] = m[r][c];
            t->cofactor[r][c] = m[a][e] * m[b][f] - m[a][f] * m[b][e];
        }
    for (int c = 0; c < 3; c++) det += m[0][c] * t->cofactor[0][c];
    t->mirrored = det < 0;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            t->from_world[c][r] = t->cofactor[r][c] / det;
            if (det < 0) t->cofactor[r][c] *= -1;
        }
}

static bool read_mesh(const json_t *from, thing *t) {
    const json_t *positions = json_object_get(from, "positions"),
                 *normals = json_object_get(from, "normals"),
                 *indices = json_object_get(from, "indices"), *uvs = json_object_get(from, "uvs");
    const size_t count = json_array_size(indices);
    t->triangles = count / 3;
    t->corners = calloc(count + 1, sizeof *t->corners);
    t->placed = calloc(count + 1, sizeof *t->placed);
    if (json_is_array(normals)) t->normals = calloc(count + 1, sizeof *t->normals);
    t->vertices = calloc(count + 1, sizeof *t->vertices);
    t->polygons = calloc(count + 1, sizeof *t->polygons);
    if (uvs) t->uvs = calloc(count + 1, sizeof *t->uvs);
    if ((uvs && !t->uvs) || !t->corners || !t->placed || !t->vertices || !t->polygons ||
        (json_is_array(normals) && !t->normals))
        return false;
    for (size_t i = 0; i < count; i++) {
        const size_t v = 3 * (size_t)json_integer_value(json_array_get(indices, i));
        t->vertices[i] = v / 3;
        t->polygons[i / 3] = i / 3;
        const point p = {item(positions, v), item(positions, v + 1), item(positions, v + 2)};
        t->corners[i] = p;
        t->placed[i] = place(t, p);
        t->reach = larger(t->reach, length(sub(t->placed[i], t->origin)));
        for (size_t k = 0; uvs && k < 2; k++) t->uvs[i][k] = item(uvs, v / 3 * 2 + k);
        if (t->normals)
            t->normals[i] =
                unit((point){item(normals, v), item(normals, v + 1), item(normals, v + 2)});
    }
    return true;
}

static bool read_thing(const json_t *from, way all, const json_t *materials, const real ambient[3],
                       thing *t) {
    static const char *const forms[] = {"sphere",   "plane", "disc",  "box",
                                        "cylinder", "cone",  "torus", "mesh"};
    const json_t *material = json_object_get(from, "material");
    if (json_is_string(material))
        material = json_object_get(materials, json_string_value(material));
    read_stuff(material, ambient, &t->stuff);
    solid *s = &t->solid;
    for (int f = 0; f < FORMS; f++)
        if (is(from, "type", forms[f])) s->form = (form)f;
    s->radius = number(from, "radius", 1);
    s->height = number(from, "height", 2);
    s->tube = number(from, "tube", 0.25);
    s->size = vector(from, "size", grey(1));
    t->way = is(from, "interpolation", "flat")      ? FLAT
             : is(from, "interpolation", "gouraud") ? GOURAUD
             : is(from, "interpolation", "phong")   ? PHONG
                                                    : all;
    read_transform(json_object_get(from, "transform"), t);
    if (s->form == MESH) return read_mesh(from, t);
    /* Reaches are of the largest that an axis becomes. */
    real most = 0;
    for (int c = 0; c < 3; c++)
        most =
            larger(most, length((point){t->to_world[0][c], t->to_world[1][c], t->to_world[2][c]}));
    const real form_reach[FORMS] = {[SPHERE] = s->radius,
                                    [DISC] = s->radius,
                                    [BOX] = length(s->size) / 2,
                                    [CYLINDER] = s->radius + s->height / 2,
                                    [CONE] = s->radius + s->height / 2,
                                    [TORUS] = s->radius + s->tube};
    t->reach = most * form_reach[s->form];
    return t->way == PHONG || facets_cut(t, (int)number(from, "segments", 32));
}

static bool read_all(const json_t *root, document *d) {
    const json_t *image = json_object_get(root, "image"),
                 *objects = json_object_get(root, "objects"),
                 *background = json_object_get(root, "background");
    d->width = (int)number(image, "width", 512);
    d->height = (int)number(image, "height", 512);
    d->samples = (int)number(image, "samples", 4);
    d->transparent = json_is_null(background);
    d->depth = (int)number(json_object_get(root, "trace"), "depth", 0);
    d->least = number(json_object_get(root, "trace"), "minContribution", 0.001);
    d->shadows = json_is_true(json_object_get(json_object_get(root, "trace"), "shadows"));
    d->shadow_samples = (int)number(json_object_get(root, "trace"), "shadowSamples", 16);
    color(root, "background", grey(0), d->background);
    read_camera(json_object_get(root, "camera"), d);
    real ambient[3];
    color(root, "ambient", grey(0), ambient);
    if (!read_lamps(json_object_get(root, "lights"), d, ambient)) return false;
    const way all = is(root, "interpolation", "flat")      ? FLAT
                    : is(root, "interpolation", "gouraud") ? GOURAUD
                                                           : PHONG;
    d->thing_count = json_array_size(objects);
    d->things = calloc(d->thing_count + 1, sizeof *d->things);
    if (!d->things) return false;
    for (size_t i = 0; i < d->thing_count; i++)
        if (!read_thing(json_array_get(objects, i), all, json_object_get(root, "materials"),
                        ambient, &d->things[i]))
            return false;
    return true;
}

bool document_read(const char *json, document *out) {
    memset(out, 0, sizeof *out);
    json_t *root = json_loads(json, 0, NULL);
    const bool good = root && read_all(root, out);
    json_decref(root);
    if (!good) document_drop(out);
    return good;
}

void document_drop(document *d) {
    for (size_t i = 0; d->things && i < d->thing_count; i++) {
        free(d->things[i].corners);
        free(d->things[i].placed);
        free(d->things[i].normals);
        free(d->things[i].vertices);
        free(d->things[i].polygons);
        free(d->things[i].uvs);
    }
    for (size_t j = 0; d->lamps && j < d->lamp_count; j++) {
        free(d->lamps[j].coarse);
        free(d->lamps[j].fine);
    }
    free(d->things);
    free(d->lamps);
    memset(d, 0, sizeof *d);
}
