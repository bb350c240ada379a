/* A hash of what a scene is, however its document says it. It is SHA-256, so that nobody can find
 * another scene that is answered by this one's picture.
 *
 * The hash is fed every value that a picture depends on, in one order: numbers as their double (-0
 * as 0), strings behind their length, lists behind their count. A material stands at each object
 * that has it, without its name. */
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <string.h>

#include "base/bits.h"
#include "scene/read.h"
#include "scene/surroundings.h"

/* Hashing works best on long pieces; a mesh has a million short ones. */
typedef struct sink {
    const atomic_bool *cancelled;
    struct sha256_ctx hash;
    size_t used;
    unsigned char bytes[4096];
} sink;

static void flush_sink(sink *s) {
    sha256_update(&s->hash, s->used, s->bytes);
    s->used = 0;
}

static void put_count(sink *s, uint64_t bits) {
    if (sizeof bits > sizeof s->bytes - s->used) flush_sink(s);
    memcpy(s->bytes + s->used, &bits, sizeof bits);
    s->used += sizeof bits;
}

static void put_numbers(sink *s, const double *values, size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (count > 1024 && shd_is_cancelled_at(s->cancelled, i)) return;
        put_count(s, shd_bits64_of(values[i] + 0.0)); /* -0 + 0 is 0 */
    }
}

/* As put_count puts each. */
static void put_indices(sink *s, const uint32_t *indices, size_t count) {
    enum { SOME = 512 };
    uint64_t wide[SOME];
    flush_sink(s);
    for (size_t first = 0; first < count; first += SOME) {
        const size_t left = count - first, some = left < SOME ? left : SOME;
        if (shd_is_cancelled(s->cancelled)) return;
        for (size_t i = 0; i < some; i++) wide[i] = indices[first + i];
        sha256_update(&s->hash, some * sizeof *wide, (const unsigned char *)wide);
    }
}

static void put_vector(sink *s, shd_vec3 v) {
    put_numbers(s, (double[]){v.x, v.y, v.z}, 3);
}

/* NULL differs from the empty text. */
static void put_text(sink *s, const char *text) {
    put_count(s, text ? strlen(text) : SIZE_MAX);
    flush_sink(s);
    if (text) sha256_update(&s->hash, strlen(text), (const unsigned char *)text);
}

static void put_view(sink *s, const shd_scene *scene) {
    const shd_camera *camera = &scene->camera;
    put_count(s, camera->projection);
    put_vector(s, camera->position);
    put_vector(s, camera->right);
    put_vector(s, camera->up);
    put_vector(s, camera->back);
    put_numbers(s, camera->projection == SHD_PERSPECTIVE ? &camera->fov : &camera->height, 1);
    const shd_raster *raster = &scene->raster;
    const int sizes[] = {raster->width, raster->height, raster->x,      raster->y,
                         raster->w,     raster->h,      raster->samples};
    for (size_t i = 0; i < SHD_LENGTH(sizes); i++) put_count(s, (uint64_t)sizes[i]);
    put_numbers(s, scene->ambient, 3);
    const bool partial = scene->transparent && scene->background_alpha > 0;
    put_count(s, (uint64_t)scene->transparent + partial);
    put_numbers(s, scene->background, 3);
    if (partial) put_numbers(s, &scene->background_alpha, 1);
    put_text(s, scene->working_space->name);
}

static void put_light(sink *s, const shd_light *light) {
    put_count(s, light->type);
    put_vector(s, light->position);
    put_vector(s, light->direction);
    put_numbers(s, light->color, 3);
    put_numbers(s, light->ambient, 3);
    put_numbers(s, light->attenuation, 3);
    put_numbers(s, (double[]){light->min_distance, light->angle, light->penumbra, light->exponent},
                4);
    if (light->type == SHD_LIGHT_ENVIRONMENT) {
        put_text(s, light->map->key);
        put_numbers(s, &light->turn, 1);
        put_count(s, light->visible);
    }
    if (!shd_has_shape(light->type)) return;
    put_vector(s, light->across);
    put_vector(s, light->up);
    put_numbers(s, light->size, 2);
    put_numbers(s, &light->radius, 1);
    put_count(s, light->visible);
}

/* What only extended scenes have stands behind a count that no list of lobes has, so that others
 * keep their digest. */
static void put_extension(sink *s, const shd_material *m) {
    const double usual[10] = {1, 1, 1, 0, 0, 0, 0, 0, 0, 1.5};
    const double values[10] = {m->opacity[0],      m->opacity[1],
                               m->opacity[2],      m->reflection[0],
                               m->reflection[1],   m->reflection[2],
                               m->transmission[0], m->transmission[1],
                               m->transmission[2], m->ior};
    if (m->model != SHD_MODEL_PHONG) {
        put_count(s, SIZE_MAX);
        put_count(s, m->model);
        put_numbers(s, &m->sigma, 1);
        put_numbers(s, m->fresnel.n, 3);
        put_numbers(s, m->fresnel.k, 3);
    }
    if (m->antialiased) put_count(s, SIZE_MAX - 16);
    const shd_microgeometry *micro = m->microgeometry;
    if (micro) {
        put_count(s, micro->type);
        put_numbers(s, (double[]){micro->angle, micro->warp, micro->weft, micro->slope}, 4);
    }
    if (memcmp(values, usual, sizeof values) != 0) {
        put_count(s, SIZE_MAX - 1);
        put_numbers(s, values, SHD_LENGTH(values));
    }
}

static void put_texture(sink *s, const shd_texture *texture, size_t which) {
    if (!texture) return;
    const shd_pattern *p = &texture->pattern;
    put_count(s, SIZE_MAX - 6);
    put_count(s, which);
    put_count(s, p->kind);
    put_numbers(s, &p->map[0][0], 6);
    put_count(s, p->wrap);
    put_numbers(s, &p->width, 1);
    put_count(s, (uint64_t)p->octaves);
    put_numbers(s, texture->low, 3);
    put_numbers(s, texture->high, 3);
    if (!p->picture) return;
    const shd_digest *key = &p->picture->texels->key;
    put_count(s, (uint64_t)p->channel);
    flush_sink(s);
    sha256_update(&s->hash, sizeof key->bytes, key->bytes);
}

/* As above: behind a count that no list of lobes has. */
static void put_textures(sink *s, const shd_material *m) {
    put_texture(s, m->emissive_texture, 0);
    put_texture(s, m->ambient_texture, 1);
    put_texture(s, m->diffuse_texture, 2);
    put_texture(s, m->opacity_texture, SIZE_MAX);
    put_texture(s, m->normal_texture, SIZE_MAX - 1);
    put_texture(s, m->reflection_texture, SIZE_MAX - 2);
    put_texture(s, m->transmission_texture, SIZE_MAX - 3);
    put_texture(s, m->fresnel.f0_texture, SIZE_MAX - 4);
    for (size_t k = 0; m->lobe_textures && k < m->lobe_count; k++)
        put_texture(s, m->lobe_textures[k], 3 + k);
    for (size_t k = 0; m->lobe_gloss && k < m->lobe_count; k++)
        put_texture(s, m->lobe_gloss[k], SIZE_MAX / 2 + k);
}

static void put_material(sink *s, const shd_material *material) {
    put_numbers(s, material->emissive, 3);
    put_numbers(s, material->ambient, 3);
    put_numbers(s, material->diffuse, 3);
    put_count(s, material->front_only);
    put_extension(s, material);
    put_textures(s, material);
    put_count(s, material->lobe_count);
    for (size_t i = 0; i < material->lobe_count; i++) {
        put_numbers(s, material->lobes[i].specular, 3);
        put_numbers(s, &material->lobes[i].shininess, 1);
    }
}

/* A built-in or kept mesh is hashed by its name, which spares its numbers, and one that an earlier
 * object has by that object's index. They stand behind counts that no mesh has. */
static void put_mesh(sink *s, const shd_mesh *mesh, size_t object) {
    if (mesh->shared && mesh->first < object) {
        put_count(s, SIZE_MAX - 1);
        put_count(s, mesh->first);
        return;
    }
    if (mesh->type) {
        put_count(s, SIZE_MAX);
        put_text(s, mesh->type);
        return;
    }
    if (mesh->kept) {
        char text[SHD_DIGEST_TEXT];
        shd_digest_write(&mesh->kept->digest, text);
        put_count(s, SIZE_MAX);
        put_text(s, text);
        return;
    }
    put_count(s, mesh->vertex_count);
    put_count(s, mesh->triangle_count);
    put_count(s, mesh->normals != NULL);
    if (mesh->uvs) { /* others keep their digest */
        put_count(s, SIZE_MAX);
        put_numbers(s, mesh->uvs, 2 * mesh->vertex_count);
    }
    put_numbers(s, mesh->positions, 3 * mesh->vertex_count);
    if (mesh->normals) put_numbers(s, mesh->normals, 3 * mesh->vertex_count);
    put_indices(s, mesh->indices, 3 * mesh->triangle_count);
}

static void put_object(sink *s, const shd_object *object, size_t index) {
    put_count(s, object->shape);
    put_numbers(s, (double[]){object->radius, object->tube, object->height}, 3);
    put_vector(s, object->size);
    if (object->mesh) put_mesh(s, object->mesh, index);
    put_numbers(s, &object->transform.linear[0][0], 9);
    put_vector(s, object->transform.origin);
    put_count(s, object->interpolation);
    /* Slices mean nothing for a shape that is not cut into them. */
    put_count(s, object->interpolation == SHD_PHONG ? 0 : (uint64_t)object->segments);
}

static void put_output(sink *s, const shd_output *output) {
    put_text(s, output->name);
    put_count(s, output->format);
    put_text(s, output->display);
    put_text(s, output->view);
    put_text(s, output->color_space ? output->color_space->name : NULL);
    put_count(s, (uint64_t)(output->channel + 1));
    put_count(s, output->depth);
    put_count(s, (uint64_t)output->quality);
    put_count(s, (uint64_t)output->effort);
    put_numbers(s, &output->adjust.exposure, 1);
    put_numbers(s, &output->adjust.gamma, 1);
    put_text(s, output->adjust.looks);
    put_count(s, output->dither);
    put_numbers(s, output->matte, 3);
    put_text(s, output->compression);
    put_count(s, output->layer_count);
    for (size_t i = 0; i < output->layer_count; i++) put_text(s, output->layers[i].name);
    if (output->scope) put_text(s, shd_scope_names[output->scope]);
}

static void put_trace(sink *s, const shd_trace *trace) {
    if (!trace->shadows && !trace->depth) return;
    put_count(s, SIZE_MAX);
    put_count(s, trace->shadows);
    put_count(s, (uint64_t)trace->shadow_samples);
    put_count(s, (uint64_t)trace->depth);
    put_numbers(s, &trace->min_contribution, 1);
}

static void put_curve(sink *s, const shd_curve *curve) {
    put_count(s, curve ? 1 : 0);
    if (!curve) return;
    put_text(s, curve->name);
    put_numbers(s, &curve->scale, 1);
    if (curve->name) return;
    put_count(s, curve->count);
    if (curve->at) put_numbers(s, curve->at, curve->count);
    put_numbers(s, curve->values, curve->count);
}

/* Others keep their digest. */
static void put_curve_of_rays(sink *s, const shd_curve *curve, size_t which) {
    if (!curve) return;
    put_count(s, SIZE_MAX - 2 - which);
    put_curve(s, curve);
}

/* Without `spectral`, spectra are their RGB. */
static void put_spectra(sink *s, const shd_scene *scene) {
    if (!scene->spectral.channels) return;
    put_count(s, SIZE_MAX - 2);
    put_count(s, (uint64_t)scene->spectral.channels);
    put_numbers(s, (double[]){scene->spectral.from, scene->spectral.to}, 2);
    put_curve(s, scene->ambient_curve);
    for (size_t i = 0; i < scene->light_count; i++) {
        put_curve(s, scene->lights[i].color_curve);
        put_curve(s, scene->lights[i].ambient_curve);
    }
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_material *m = &scene->materials[scene->objects[i].material];
        put_curve(s, m->emissive_curve);
        put_curve(s, m->ambient_curve);
        put_curve(s, m->diffuse_curve);
        put_curve_of_rays(s, m->opacity_curve, 1);
        put_curve_of_rays(s, m->reflection_curve, 2);
        put_curve_of_rays(s, m->transmission_curve, 3);
        for (size_t k = 0; m->lobe_curves && k < m->lobe_count; k++)
            put_curve(s, m->lobe_curves[k]);
        if (m->model != SHD_MODEL_COOK_TORRANCE) continue;
        put_curve(s, m->fresnel.n_curve);
        put_curve(s, m->fresnel.k_curve);
        put_curve(s, m->fresnel.f0_curve);
    }
}

void shd_scene_digest(const shd_scene *scene, const atomic_bool *cancelled, char digest[33]) {
    enum { BYTES = 16 };
    sink s = {.cancelled = cancelled, .used = 0};
    unsigned char bytes[BYTES];
    sha256_init(&s.hash);
    put_view(&s, scene);
    put_count(&s, scene->light_count);
    for (size_t i = 0; i < scene->light_count; i++) put_light(&s, &scene->lights[i]);
    put_count(&s, scene->object_count);
    for (size_t i = 0; i < scene->object_count; i++) {
        put_object(&s, &scene->objects[i], i);
        put_material(&s, &scene->materials[scene->objects[i].material]);
    }
    put_trace(&s, &scene->trace);
    put_spectra(&s, scene);
    put_count(&s, scene->accuracy.tier);
    put_count(&s, scene->accuracy.draft); /* the plan, which is told with the picture, has it */
    put_count(&s, scene->accuracy.budget);
    put_numbers(&s, &scene->accuracy.max_error, 1);
    put_count(&s, scene->accuracy.metric);
    put_count(&s, scene->multipart);
    put_count(&s, scene->output_count);
    for (size_t i = 0; i < scene->output_count; i++) put_output(&s, &scene->outputs[i]);
    flush_sink(&s);
    sha256_digest(&s.hash, BYTES, bytes);
    base16_encode_update(digest, BYTES, bytes);
    digest[2 * BYTES] = 0;
}
