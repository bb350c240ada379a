/* The module shaded_import.so: a file, by way of assimp, as a model. It runs in a process of its
 * own, so that what assimp does to it is done to nobody else. */
#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "import/block.h"
#include "import/files.h"
#include "import/gltf.h"
#include "import/maps.h"

/* What glTF 2.0 has beside what all materials have: assimp's header of it is C++ in some versions.
 */
#define BASE_COLOR   "$clr.base", 0, 0
#define METALLIC     "$mat.metallicFactor", 0, 0
#define ROUGHNESS    "$mat.roughnessFactor", 0, 0
#define GLOSSINESS   "$mat.glossinessFactor", 0, 0
#define TRANSMISSION "$mat.transmission.factor", 0, 0
#define UNLIT        "$mat.gltf.unlit", 0, 0
#define ALPHA_MODE   "$mat.gltf.alphaMode", 0, 0
#define ALPHA_CUTOFF "$mat.gltf.alphaCutoff", 0, 0
#define ILLUM        "$mat.illum", 0, 0
#define STRENGTH     "$tex.strength"

/* ---- Geometry ---- */

/* The first of its sets, of three numbers each. assimp has v upward in all formats. */
static shd_span put_uvs(shd_block *b, const struct aiMesh *mesh) {
    const struct aiVector3D *from = mesh->mTextureCoords[0];
    const size_t count = from ? mesh->mNumVertices : 0;
    const shd_span out = shd_block_items(b, NULL, 2 * count, sizeof(float));
    if (b->full) return out;
    float *to = (float *)(void *)(b->bytes + out.at);
    for (size_t i = 0; i < count; i++) {
        to[2 * i] = (float)from[i].x;
        to[2 * i + 1] = (float)from[i].y;
    }
    return out;
}

static shd_model_mesh put_mesh(shd_block *b, const struct aiMesh *mesh) {
    shd_model_mesh out = {.name = shd_block_text(b, mesh->mName.data),
                          .material = mesh->mMaterialIndex,
                          .colored = mesh->mColors[0] != NULL};
    out.positions = shd_block_items(b, mesh->mVertices, 3 * (size_t)mesh->mNumVertices, 4);
    out.normals = shd_block_items(b, mesh->mNormals, mesh->mNormals ? out.positions.count : 0, 4);
    out.uvs = put_uvs(b, mesh);
    out.indices = shd_block_items(b, NULL, 3 * (size_t)mesh->mNumFaces, 4);
    if (b->full) return out;
    uint32_t *at = (uint32_t *)(void *)(b->bytes + out.indices.at), *to = at;
    for (unsigned f = 0; f < mesh->mNumFaces; f++) {
        if (mesh->mFaces[f].mNumIndices != 3) continue;
        memcpy(to, mesh->mFaces[f].mIndices, 3 * sizeof *to);
        to += 3;
    }
    out.indices.count = (uint64_t)(to - at);
    return out;
}

/* ---- Materials ---- */

static bool get_float(const struct aiMaterial *m, const char *key, unsigned type, unsigned index,
                      float *out) {
    ai_real value;
    if (aiGetMaterialFloatArray(m, key, type, index, &value, NULL) != aiReturn_SUCCESS)
        return false;
    *out = (float)value;
    return true;
}

static bool get_color(const struct aiMaterial *m, const char *key, unsigned type, unsigned index,
                      float out[3]) {
    struct aiColor4D color;
    if (aiGetMaterialColor(m, key, type, index, &color) != aiReturn_SUCCESS) return false;
    out[0] = color.r, out[1] = color.g, out[2] = color.b;
    return true;
}

static bool has_flag(const struct aiMaterial *m, const char *key, unsigned type, unsigned index) {
    const struct aiMaterialProperty *found;
    return aiGetMaterialProperty(m, key, type, index, &found) == aiReturn_SUCCESS;
}

/* glTF: whether what is not opaque is seen through, or cut out as a whole. */
static void apply_alpha_mode(shd_map_reader *maps, const struct aiMaterial *m,
                             shd_model_material *out) {
    struct aiString mode;
    float cutoff = 0.5f;
    if (aiGetMaterialString(m, ALPHA_MODE, &mode) != aiReturn_SUCCESS) return;
    get_float(m, ALPHA_CUTOFF, &cutoff);
    const bool mask = !strcmp(mode.data, "MASK"),
               opaque = !strcmp(mode.data, "OPAQUE") || (mask && !cutoff); /* nothing is below 0 */
    out->cut_out = !opaque;
    if (opaque)
        out->opacity = 1;
    else if (mask) {
        const float factor = out->opacity;
        out->opacity = factor >= cutoff;
        out->cutoff = cutoff;
        if (out->opacity > 0) shd_put_cut_out(maps, factor, out);
    }
}

static void apply_strength(const json_t *gltf, const char *name, shd_model_material *out) {
    float strength;
    out->strength_lost = !shd_gltf_strength(gltf, name, &strength);
    for (int c = 0; c < 3 && !out->strength_lost; c++) out->emissive[c] *= strength;
}

static shd_model_material put_material(shd_block *b, shd_map_reader *maps, const json_t *gltf,
                                       const struct aiMaterial *m) {
    struct aiString name;
    int illum;
    shd_model_material out = {.kind = SHD_MODEL_PLAIN,
                              .opacity = 1,
                              .ior = 1.5f,
                              .roughness = 1,
                              .diffuse = {0.6f, 0.6f, 0.6f},
                              .through = {1, 1, 1}};
    const bool named = aiGetMaterialString(m, AI_MATKEY_NAME, &name) == aiReturn_SUCCESS;
    out.name = shd_block_text(b, named ? name.data : "");
    get_color(m, AI_MATKEY_COLOR_AMBIENT, out.ambient);
    get_color(m, AI_MATKEY_COLOR_DIFFUSE, out.diffuse);
    get_color(m, AI_MATKEY_COLOR_SPECULAR, out.specular);
    get_color(m, AI_MATKEY_COLOR_EMISSIVE, out.emissive);
    get_color(m, AI_MATKEY_COLOR_TRANSPARENT, out.through);
    get_float(m, AI_MATKEY_SHININESS, &out.shininess);
    get_float(m, AI_MATKEY_OPACITY, &out.opacity);
    get_float(m, AI_MATKEY_REFRACTI, &out.ior);
    get_float(m, TRANSMISSION, &out.transmission);
    float glossiness;
    if (aiGetMaterialIntegerArray(m, ILLUM, &illum, NULL) == aiReturn_SUCCESS) {
        out.kind = SHD_MODEL_MTL;
        out.illum = illum;
    } else if (get_float(m, GLOSSINESS, &glossiness)) {
        out.kind = SHD_MODEL_GLOSSY;
        out.roughness = 1 - glossiness;
    } else if (get_float(m, METALLIC, &out.metallic)) {
        out.kind = SHD_MODEL_METAL_ROUGH;
        get_float(m, ROUGHNESS, &out.roughness);
        get_color(m, BASE_COLOR, out.diffuse);
    }
    out.unlit = has_flag(m, UNLIT);
    apply_strength(gltf, named ? name.data : "", &out);
    out.occlusion = 1;
    get_float(m, STRENGTH, aiTextureType_LIGHTMAP, 0, &out.occlusion);
    shd_put_maps(maps, m, named ? name.data : "", &out);
    shd_put_metal(maps, &out);
    apply_alpha_mode(maps, m, &out);
    return out;
}

/* ---- Nodes ---- */

typedef struct walk {
    const struct aiScene *scene;
    shd_block *b;
    shd_model_object *objects; /* [capacity] */
    size_t count, capacity;
    bool full;
} walk;

/* Names are what leads from a light or a camera to its node. */
static struct aiMatrix4x4 world_of(const struct aiScene *scene, const struct aiString *name) {
    struct aiMatrix4x4 matrix;
    aiIdentityMatrix4(&matrix);
    const struct aiNode *node = scene->mRootNode;
    /* Breadth is bounded by the file; depth of nodes by what assimp's own recursion bears. */
    const struct aiNode *stack[4096];
    size_t top = 0;
    stack[top++] = node;
    while (top) {
        node = stack[--top];
        if (!strcmp(node->mName.data, name->data)) break;
        for (unsigned i = 0; i < node->mNumChildren && top < 4096; i++)
            stack[top++] = node->mChildren[i];
        node = NULL;
    }
    for (; node; node = node->mParent) {
        struct aiMatrix4x4 product = node->mTransformation;
        aiMultiplyMatrix4(&product, &matrix);
        matrix = product;
    }
    return matrix;
}

static void to_columns(const struct aiMatrix4x4 *m, double out[16]) {
    const double rows[16] = {m->a1, m->a2, m->a3, m->a4, m->b1, m->b2, m->b3, m->b4,
                             m->c1, m->c2, m->c3, m->c4, m->d1, m->d2, m->d3, m->d4};
    for (int r = 0; r < 4; r++)
        for (int c = 0; c < 4; c++) out[4 * c + r] = rows[4 * r + c];
    /* What a file has rounded is affine all the same. */
    const double rest = fabs(out[3]) + fabs(out[7]) + fabs(out[11]) + fabs(out[15] - 1);
    if (rest < 1e-5) out[3] = out[7] = out[11] = 0, out[15] = 1;
}

static void add_objects(walk *w, const struct aiNode *node, const struct aiMatrix4x4 *parent) {
    struct aiMatrix4x4 matrix = *parent;
    aiMultiplyMatrix4(&matrix, &node->mTransformation);
    for (unsigned i = 0; i < node->mNumMeshes && !w->full; i++) {
        if (w->count == w->capacity) {
            const size_t capacity = w->capacity ? 2 * w->capacity : 64;
            shd_model_object *more = realloc(w->objects, capacity * sizeof *more);
            w->full = !more;
            if (!more) return;
            w->objects = more;
            w->capacity = capacity;
        }
        shd_model_object *out = &w->objects[w->count++];
        *out = (shd_model_object){.name = shd_block_text(w->b, node->mName.data),
                                  .mesh = node->mMeshes[i]};
        to_columns(&matrix, out->matrix);
    }
    for (unsigned i = 0; i < node->mNumChildren; i++) add_objects(w, node->mChildren[i], &matrix);
}

static void turn(const struct aiMatrix4x4 *m, const struct aiVector3D *v, double out[3]) {
    out[0] = (double)m->a1 * v->x + (double)m->a2 * v->y + (double)m->a3 * v->z;
    out[1] = (double)m->b1 * v->x + (double)m->b2 * v->y + (double)m->b3 * v->z;
    out[2] = (double)m->c1 * v->x + (double)m->c2 * v->y + (double)m->c3 * v->z;
}

static void place(const struct aiMatrix4x4 *m, double out[3]) {
    out[0] = m->a4, out[1] = m->b4, out[2] = m->c4;
}

/* assimp up to 5.2 takes glTF's vertical angle times the aspect for the horizontal one; mPosition
 * repeats the node's translation. */
static double vertical_angle(const struct aiCamera *camera) {
    const double across = camera->mHorizontalFOV, aspect = camera->mAspect;
    if (!(aspect > 0)) return across;
    const unsigned version = 100 * aiGetVersionMajor() + aiGetVersionMinor();
    return version <= 502 ? across / aspect : 2 * atan(tan(across / 2) / aspect);
}

static shd_model_camera put_camera(shd_block *b, const struct aiScene *scene,
                                   const struct aiCamera *camera) {
    const struct aiMatrix4x4 matrix = world_of(scene, &camera->mName);
    shd_model_camera out = {.name = shd_block_text(b, camera->mName.data),
                            .aspect = camera->mAspect};
    place(&matrix, out.position);
    turn(&matrix, &camera->mLookAt, out.forward);
    turn(&matrix, &camera->mUp, out.up);
    if (camera->mOrthographicWidth > 0) /* which is half of the width, as in glTF */
        out.height = 2 * camera->mOrthographicWidth / (camera->mAspect > 0 ? camera->mAspect : 1);
    else
        out.fov = vertical_angle(camera) * 180 / M_PI;
    return out;
}

static shd_model_light put_light(shd_block *b, const struct aiScene *scene,
                                 const struct aiLight *light) {
    const struct aiMatrix4x4 matrix = world_of(scene, &light->mName);
    shd_model_light out = {
        .name = shd_block_text(b, light->mName.data),
        .type = light->mType == aiLightSource_POINT  ? SHD_MODEL_POINT
                : light->mType == aiLightSource_SPOT ? SHD_MODEL_SPOT
                                                     : SHD_MODEL_DIRECTIONAL,
        .color = {light->mColorDiffuse.r, light->mColorDiffuse.g, light->mColorDiffuse.b}};
    place(&matrix, out.position);
    turn(&matrix, &light->mDirection, out.direction);
    if (out.type == SHD_MODEL_SPOT) {
        out.inner = (double)light->mAngleInnerCone * 180 / M_PI;
        out.outer = (double)light->mAngleOuterCone * 180 / M_PI;
    }
    return out;
}

/* ---- The whole ---- */

static bool is_lamp(const struct aiLight *light) {
    return light->mType == aiLightSource_POINT || light->mType == aiLightSource_SPOT ||
           light->mType == aiLightSource_DIRECTIONAL;
}

/* Lists are put after what their items name, which is put first. */
static bool put_scene(shd_block *b, const struct aiScene *scene, const char *path) {
    static shd_losses losses;
    shd_mtl mtl = {.maps = NULL};
    shd_map_reader maps = {
        .scene = scene, .model = path, .block = b, .mtl = &mtl, .losses = &losses};
    const json_t *gltf = shd_gltf_open(path);
    shd_gltf_losses(gltf, &losses);
    shd_mtl_read(path, &mtl, &losses);
    walk w = {.scene = scene, .b = b};
    struct aiMatrix4x4 identity;
    aiIdentityMatrix4(&identity);
    shd_model_mesh *meshes = calloc(scene->mNumMeshes + 1, sizeof *meshes);
    shd_model_material *materials = calloc(scene->mNumMaterials + 1, sizeof *materials);
    shd_model_camera *cameras = calloc(scene->mNumCameras + 1, sizeof *cameras);
    shd_model_light *lights = calloc(scene->mNumLights + 1, sizeof *lights);
    if (!meshes || !materials || !cameras || !lights) return false;
    size_t lamps = 0;
    for (unsigned i = 0; i < scene->mNumMeshes; i++) meshes[i] = put_mesh(b, scene->mMeshes[i]);
    for (unsigned i = 0; i < scene->mNumMaterials; i++)
        materials[i] = put_material(b, &maps, gltf, scene->mMaterials[i]);
    for (unsigned i = 0; i < scene->mNumCameras; i++)
        cameras[i] = put_camera(b, scene, scene->mCameras[i]);
    for (unsigned i = 0; i < scene->mNumLights; i++)
        if (is_lamp(scene->mLights[i])) lights[lamps++] = put_light(b, scene, scene->mLights[i]);
    add_objects(&w, scene->mRootNode, &identity);
    shd_model model = {.magic = SHD_MODEL_MAGIC, .ranged_lights = shd_gltf_ranges(gltf)};
    model.pictures = shd_block_items(b, maps.pictures, maps.count, sizeof *maps.pictures);
    model.meshes = shd_block_items(b, meshes, scene->mNumMeshes, sizeof *meshes);
    model.materials = shd_block_items(b, materials, scene->mNumMaterials, sizeof *materials);
    model.objects = shd_block_items(b, w.objects, w.count, sizeof *w.objects);
    model.cameras = shd_block_items(b, cameras, scene->mNumCameras, sizeof *cameras);
    model.lights = shd_block_items(b, lights, lamps, sizeof *lights);
    if (losses.cut) memcpy(losses.text + losses.size - 4, "...\n", 4);
    model.losses = shd_block_text(b, losses.text);
    model.size = b->size;
    if (b->full || w.full || maps.full) return false;
    memcpy(b->bytes, &model, sizeof model);
    return true;
}

static bool write_all(int descriptor, const void *data, size_t size) {
    const char *next = data;
    while (size > 0) {
        const ssize_t wrote = write(descriptor, next, size);
        if (wrote <= 0) return false;
        next += wrote;
        size -= (size_t)wrote;
    }
    return true;
}

static bool write_failure(int descriptor, const char *why) {
    shd_model model = {.magic = SHD_MODEL_MAGIC, .size = sizeof model};
    if (strstr(why, "bad_alloc") || strstr(why, "length_error"))
        why = "it takes, or says that it takes, more memory than there is for it";
    snprintf(model.failure, sizeof model.failure, "%s", *why ? why : "assimp gives no reason");
    return write_all(descriptor, &model, sizeof model);
}

/* As the file has it, in triangles: vertices that are equal in all are one, so that meshes without
 * indices get some. */
static const struct aiScene *read_file(const char *path) {
    struct aiPropertyStore *options = aiCreatePropertyStore();
    if (!options) return NULL;
    aiSetImportPropertyInteger(options, AI_CONFIG_PP_SBP_REMOVE,
                               aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const unsigned steps = aiProcess_Triangulate | aiProcess_JoinIdenticalVertices |
                           aiProcess_SortByPType | aiProcess_ValidateDataStructure;
    return aiImportFileExWithProperties(path, steps, &shd_regular_files, options);
}

shd_import_fn shd_import_write;

bool shd_import_write(const char *path, int descriptor) {
    if (!shd_gltf_is_whole(path))
        return write_failure(descriptor, "the file ends before its first chunk does");
    const struct aiScene *scene = read_file(path);
    if (!scene) return write_failure(descriptor, aiGetErrorString());
    if (!scene->mNumMeshes || !scene->mRootNode)
        return write_failure(descriptor, "it has no triangles");
    shd_block b = {.bytes = NULL};
    shd_block_put(&b, NULL, sizeof(shd_model));
    if (!put_scene(&b, scene, path))
        return write_failure(descriptor, "there is too little memory for it");
    return write_all(descriptor, b.bytes, b.size);
}
