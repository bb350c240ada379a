/* Objects: shapes, their transforms and materials. */
#include <assert.h>
#include <string.h>

#include "scene/builtin.h"
#include "scene/read.h"

typedef struct raw_object {
    shd_object object;
    int interpolation, segments;
    shd_mesh_source mesh;
    json_t *shared;
} raw_object;

/* Bits of shd_field.kinds, one for each shape. */
#define KIND(shape) (1u << (shape))

enum {
    TORUS = KIND(SHD_TORUS),
    BOX = KIND(SHD_BOX),
    TALL = KIND(SHD_CYLINDER) | KIND(SHD_CONE),
    ROUND = KIND(SHD_SPHERE) | KIND(SHD_DISC) | TALL | TORUS,
    MESH = KIND(SHD_MESH),
    TYPES = SHD_SHAPE_COUNT + SHD_BUILTIN_COUNT,
    ANY = KIND(TYPES) - 1
};

enum { DIMENSIONS = 1, INTERPOLATION = 2, SEGMENTS = 4 }; /* marks */

static void read_material(shd_reader *r, const shd_node *node, void *out) {
    *(size_t *)out = shd_use_material(r, node);
}

static void read_name(shd_reader *r, const shd_node *node, void *out) {
    const char *name = shd_get_text(r, node, "a string");
    if (name && *name) *(const char **)out = shd_take_text(r, name);
}

#define AT(member) offsetof(raw_object, member)

static const shd_range segments = {3, 1024, .text = "3 to 1024"};

static const shd_field object_fields[] = {
    {"type", .read = NULL},
    {"radius", shd_read_number, AT(object.radius), ROUND, .range = &shd_positive,
     .mark = DIMENSIONS},
    {"tube", shd_read_number, AT(object.tube), TORUS, .range = &shd_positive},
    {"height", shd_read_number, AT(object.height), TALL, .range = &shd_positive,
     .mark = DIMENSIONS},
    {"size", shd_read_vector, AT(object.size), BOX, .range = &shd_positive, .mark = DIMENSIONS},
    /* A mesh is checked as a whole, after its members are known. */
    {"positions", shd_keep_value, AT(mesh.positions), .kinds = MESH},
    {"indices", shd_keep_value, AT(mesh.indices), .kinds = MESH},
    {"normals", shd_keep_value, AT(mesh.normals), .kinds = MESH},
    {"uvs", shd_keep_value, AT(mesh.uvs), .kinds = MESH},
    {"data", shd_keep_value, AT(mesh.data), .kinds = MESH},
    {"mesh", shd_keep_value, AT(shared), .kinds = MESH},
    {"transform", shd_read_transform, .offset = AT(object.transform)},
    {"interpolation", shd_read_choice, AT(interpolation), .choices = shd_interpolation_names,
     .mark = INTERPOLATION},
    {"segments", shd_read_integer, AT(segments), ROUND | BOX, .range = &segments, .mark = SEGMENTS},
    {"material", read_material, AT(object.material), .always = true},
    {"name", .read = read_name, .offset = AT(object.name)},
};

/* The type of an object: a shape, or one after these. TYPES, and an error, if it has none. */
static int read_type(shd_reader *r, const shd_node *node) {
    const shd_node type = shd_node_member(node, "type");
    const int index = type.value ? shd_read_name(r, &type, shd_shape_names) : -1;
    if (!type.value)
        shd_wrong(r, node, "the member \"type\" is missing%s",
                  shd_suggest(r->report, "", shd_shape_names, TYPES).text);
    return index < 0 ? TYPES : index;
}

static raw_object default_object(const shd_reader *r, shd_shape shape) {
    return (raw_object){.object = {.shape = shape,
                                   .radius = 1,
                                   .tube = 0.25,
                                   .height = 2,
                                   .size = {1, 1, 1},
                                   .transform = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}},
                        .interpolation = r->interpolation,
                        .segments = 32};
}

/* A mesh's arrays, or a name for them. */
static const shd_mesh *read_mesh(shd_reader *r, const shd_node *node, const raw_object *raw) {
    const shd_mesh_source *source = &raw->mesh;
    const shd_node shared = {node, "mesh", 0, raw->shared};
    const bool alone =
        source->positions || source->indices || source->normals || source->uvs || source->data;
    shd_mesh *own;
    if (raw->shared && alone)
        shd_wrong(r, &shared,
                  "give either `mesh` or `data` or `positions`, `indices`, `normals` and `uvs`, "
                  "not both");
    if (raw->shared) return shd_use_mesh(r, &shared, node->index);
    /* Only a mesh has arrays, whatever `type` says. */
    if (!source->positions && !source->data && raw->object.shape == SHD_MESH)
        shd_wrong(r, node, "the member \"positions\" is missing");
    return alone ? shd_read_mesh(r, node, source, &own) : NULL;
}

/* It is kept under the digest of its name, which no mesh that a client puts can have: that is one
 * of the mesh's bytes. */
static const shd_mesh *make_builtin(shd_reader *r, shd_builtin which) {
    const char *name = shd_shape_names[SHD_SHAPE_COUNT + which];
    const shd_digest digest = shd_digest_of(name, strlen(name));
    const bool finds = r->shelf && r->shelf->find;
    const shd_mesh *mesh = finds ? r->shelf->find(r->shelf->context, &digest) : NULL;
    if (!mesh) {
        mesh = shd_builtin_mesh(which, r->arena);
        const bool keeps = mesh && r->shelf && r->shelf->keep;
        const shd_mesh *kept = keeps ? r->shelf->keep(r->shelf->context, mesh, &digest) : NULL;
        if (kept) mesh = kept;
    }
    if (!mesh) shd_take(r, SIZE_MAX, 1); /* which tells that memory is short */
    return mesh;
}

static void read_object(shd_reader *r, const shd_node *node, shd_object *out) {
    if (!shd_is_object(r, node)) return;
    const int type = read_type(r, node);
    const bool known = type != TYPES, builtin = known && type >= SHD_SHAPE_COUNT;
    const shd_shape shape = builtin ? SHD_MESH : known ? (shd_shape)type : SHD_SHAPE_COUNT;
    char what[16] = "an object";
    if (known) strcat(strcpy(what, "a "), shd_shape_names[type]);
    raw_object raw = default_object(r, shape);
    shd_read_fields(r, node, object_fields, SHD_LENGTH(object_fields), known ? KIND(type) : ANY,
                    what, &raw);
    shd_object *object = &raw.object;
    object->mesh =
        builtin ? make_builtin(r, (shd_builtin)(type - SHD_SHAPE_COUNT)) : read_mesh(r, node, &raw);
    if (!known) return;

    object->interpolation = (shd_interpolation)raw.interpolation;
    object->segments = raw.segments;
    bool faces = object->interpolation != SHD_PHONG && !(r->wrong & INTERPOLATION);
    if (shape == SHD_PLANE && faces)
        shd_wrong(r, node,
                  "an infinite plane has no faces: use disc or box, or interpolation phong");
    else if (faces && !(r->wrong & SEGMENTS))
        r->triangles += shd_tessellation_triangles(shape, raw.segments);
    shd_affine to_world, from_world;
    if (!(r->wrong & DIMENSIONS) && !isnan(object->transform.linear[0][0]) &&
        !shd_object_frame(object, &to_world, &from_world))
        shd_wrong(r, node,
                  "the object's size and transform together have no inverse: their numbers are "
                  "too far apart");
    if (!(r->wrong & SHD_SOME_FIELD)) shd_check_textured(r, node, object);
    *out = *object;
}

static int compare_meshes(const void *one, const void *other) {
    const uintptr_t a = (uintptr_t) * (const shd_mesh *const *)one,
                    b = (uintptr_t) * (const shd_mesh *const *)other;
    return (a > b) - (a < b);
}

/* Adds the triangles of meshes that are not counted yet: those that the document has were, as they
 * were read. One that is kept counts once, however many objects have it, as one that they share
 * does, unless their faces are shaded alone, which is made for each. False: memory. */
static bool count_meshes(shd_reader *r, const shd_object *objects, size_t count, uint64_t *all) {
    const shd_mesh **named = shd_take(r, count, sizeof *named);
    size_t names = 0;
    if (!named) return false;
    for (size_t i = 0; i < count; i++) {
        const shd_mesh *mesh = objects[i].mesh;
        if (mesh) *all += mesh->triangle_count;
        if (mesh && mesh->shared && objects[i].interpolation != SHD_PHONG)
            r->triangles += mesh->triangle_count;
        if (!mesh || (!mesh->kept && !mesh->type)) continue;
        if (mesh->kept && objects[i].interpolation == SHD_PHONG)
            named[names++] = mesh;
        else
            r->triangles += mesh->triangle_count;
    }
    qsort(named, names, sizeof *named, compare_meshes);
    for (size_t i = 0; i < names; i++)
        if (!i || named[i] != named[i - 1]) r->triangles += named[i]->triangle_count;
    return true;
}

void shd_read_objects(shd_reader *r, const shd_node *node, void *out) {
    if (!shd_is_array(r, node, 0, SIZE_MAX, "an array of objects")) return;
    const size_t count =
        shd_hold_to_limit(r, node, "the scene asks for", json_array_size(node->value),
                          SHD_LIMIT_OBJECTS, r->limits->objects);
    /* Every object has one material, so there are at most as many materials. */
    const size_t emitters = shd_count_emitters(out);
    shd_object *objects = shd_take(r, count + emitters, sizeof *objects);
    r->materials = shd_take(r, count + emitters, sizeof *r->materials);
    if (!objects || !r->materials) return;
    for (size_t i = 0; i < count && !shd_is_cancelled(r->cancelled); i++) {
        shd_node object = shd_node_item(node, i);
        read_object(r, &object, &objects[i]);
    }
    if (emitters) shd_add_emitters(r, node, objects + count);
    if (!count_meshes(r, objects, count, &((shd_scene *)out)->mesh_triangles)) return;
    shd_hold_to_limit(r, node, "the scene asks for", r->triangles, SHD_LIMIT_TRIANGLES,
                      r->limits->triangles);
    assert(r->material_count <= count + emitters);
    shd_scene *scene = out;
    scene->objects = objects;
    scene->object_count = count + emitters;
    scene->materials = r->materials;
    scene->material_count = r->material_count;
}
