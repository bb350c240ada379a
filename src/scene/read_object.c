/* Objects: shapes, their transforms and materials. */
#include <math.h>
#include <string.h>

#include "scene/read.h"

typedef struct raw_object {
    shd_object object;
    int interpolation, segments;
    shd_mesh_source mesh;
    const json_t *data;
} raw_object;

/* Bits of shd_field.kinds, one for each shape. */
#define KIND(shape) (1u << (shape))

enum {
    SPHERE = KIND(SHD_SPHERE),
    PLANE = KIND(SHD_PLANE),
    DISC = KIND(SHD_DISC),
    BOX = KIND(SHD_BOX),
    CYLINDER = KIND(SHD_CYLINDER),
    CONE = KIND(SHD_CONE),
    TORUS = KIND(SHD_TORUS),
    MESH = KIND(SHD_MESH),
    ANY = KIND(SHD_SHAPE_COUNT) - 1,
    ROUND = SPHERE | DISC | CYLINDER | CONE | TORUS
};

enum {
    TYPE,
    RADIUS,
    TUBE,
    HEIGHT,
    SIZE,
    POSITIONS,
    INDICES,
    NORMALS,
    DATA,
    TRANSFORM,
    INTERPOLATION,
    SEGMENTS,
    MATERIAL,
    NAME,
    FIELDS
};

static void read_material(shd_reader *r, const shd_node *node, void *out) {
    *(size_t *)out = shd_use_material(r, node);
}

#define IN_OBJECT(member) (offsetof(raw_object, object) + offsetof(shd_object, member))
#define IN_MESH(member)   (offsetof(raw_object, mesh) + offsetof(shd_mesh_source, member))

static const shd_range segments = {3, 1024, .text = "3 to 1024"};

static const shd_field fields[FIELDS] = {
    [TYPE] = {"type", .read = NULL},
    [RADIUS] = {"radius", shd_read_number, IN_OBJECT(radius), ROUND, .range = &shd_positive},
    [TUBE] = {"tube", shd_read_number, IN_OBJECT(tube), TORUS, .range = &shd_positive},
    [HEIGHT] = {"height", shd_read_number, IN_OBJECT(height), CYLINDER | CONE,
                .range = &shd_positive},
    [SIZE] = {"size", shd_read_vector, IN_OBJECT(size), BOX, .range = &shd_positive},
    /* A mesh is checked as a whole, after its members are known. */
    [POSITIONS] = {"positions", shd_keep_value, IN_MESH(positions), .kinds = MESH},
    [INDICES] = {"indices", shd_keep_value, IN_MESH(indices), .kinds = MESH},
    [NORMALS] = {"normals", shd_keep_value, IN_MESH(normals), .kinds = MESH},
    [DATA] = {"data", shd_keep_value, offsetof(raw_object, data), .kinds = MESH},
    [TRANSFORM] = {"transform", shd_read_transform, .offset = IN_OBJECT(transform)},
    [INTERPOLATION] = {"interpolation", shd_read_choice, offsetof(raw_object, interpolation),
                       .choices = shd_interpolation_names},
    [SEGMENTS] = {"segments", shd_read_integer, offsetof(raw_object, segments), ROUND | BOX,
                  .range = &segments},
    [MATERIAL] = {"material", read_material, IN_OBJECT(material), .always = true},
    [NAME] = {"name", .read = shd_read_label},
};

/* The shape of an object. SHD_SHAPE_COUNT, and an error, if it has none. */
static shd_shape read_shape(shd_reader *r, const shd_node *node) {
    const char *names[SHD_SHAPE_COUNT + 1] = {NULL};
    for (int i = 0; i < SHD_SHAPE_COUNT; i++) names[i] = shd_shape_name((shd_shape)i);
    shd_node type = shd_node_member(node, "type");
    if (!type.value) {
        shd_wrong(r, node, "the member \"type\" is missing%s",
                  shd_suggest(r->report, "", names, SHD_SHAPE_COUNT).text);
        return SHD_SHAPE_COUNT;
    }
    int index = shd_read_name(r, &type, names);
    return index < 0 ? SHD_SHAPE_COUNT : (shd_shape)index;
}

static raw_object default_object(const shd_reader *r, shd_shape shape) {
    return (raw_object){.object = {.shape = shape,
                                   .radius = 1,
                                   .tube = 0.25,
                                   .height = 2,
                                   .size = {1, 1, 1},
                                   .transform = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}},
                        .interpolation = r->interpolation,
                        .segments = SHD_SEGMENTS_DEFAULT};
}

/* A mesh's arrays, or a name for them. */
static const shd_mesh *read_mesh(shd_reader *r, const shd_node *node, const raw_object *raw) {
    const shd_mesh_source *arrays = &raw->mesh;
    const bool inlined = arrays->positions || arrays->indices || arrays->normals;
    const shd_node data = {node, "data", 0, raw->data};
    if (raw->data && inlined) {
        shd_wrong(r, &data, "give either `data` or `positions`, `indices` and `normals`, not both");
        return NULL;
    }
    if (raw->data) return shd_find_mesh(r, &data, node->index);
    /* Only a mesh has arrays, whatever `type` says. */
    if (!arrays->positions && raw->object.shape == SHD_MESH)
        shd_wrong(r, node, "the member \"positions\" is missing");
    return inlined ? shd_make_mesh(r, node, arrays) : NULL;
}

static void read_object(shd_reader *r, const shd_node *node, shd_object *out) {
    if (!shd_is_object(r, node)) return;
    shd_shape shape = read_shape(r, node);
    bool known = shape != SHD_SHAPE_COUNT;
    char what[16] = "an object";
    if (known) {
        strcpy(what, "a ");
        strcat(what, shd_shape_name(shape));
    }
    raw_object raw = default_object(r, shape);
    shd_read_fields(r, node, fields, FIELDS, known ? KIND(shape) : ANY, what, &raw);
    uint32_t wrong = r->wrong;
    shd_object *object = &raw.object;
    object->mesh = read_mesh(r, node, &raw);
    if (!known) return;

    object->interpolation = (shd_interpolation)raw.interpolation;
    object->segments = raw.segments;
    bool faces = object->interpolation != SHD_PHONG && !(wrong >> INTERPOLATION & 1);
    if (shape == SHD_PLANE && faces)
        shd_wrong(r, node,
                  "an infinite plane has no faces: use disc or box, or interpolation phong");
    else if (faces && !(wrong >> SEGMENTS & 1))
        r->triangles += shd_tessellation_triangles(shape, raw.segments);
    shd_affine to_world, from_world;
    bool sized = !(wrong & (1u << RADIUS | 1u << HEIGHT | 1u << SIZE));
    if (sized && !isnan(object->transform.linear[0][0]) &&
        !shd_object_frame(object, &to_world, &from_world))
        shd_wrong(r, node,
                  "the object's size and transform together have no inverse: their numbers are "
                  "too far apart");
    *out = *object;
}

void shd_read_objects(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    if (!node->value) {
        shd_wrong(r, node->parent, "the member \"objects\" is missing");
        return;
    }
    if (!shd_is_array(r, node, 0, SIZE_MAX, "an array of objects")) return;
    size_t count = json_array_size(node->value);
    count = shd_hold_to_limit(r, node, "the scene asks for", count, SHD_LIMIT_OBJECTS,
                              r->limits->objects);
    /* Every object has one material, so there are at most as many materials. */
    shd_object *objects = shd_take(r, count, sizeof *objects);
    r->materials = shd_take(r, count, sizeof *r->materials);
    if (!objects || !r->materials) return;
    for (size_t i = 0; i < count && !shd_is_cancelled(r->cancelled); i++) {
        shd_node object = shd_node_item(node, i);
        read_object(r, &object, &objects[i]);
    }
    shd_hold_to_limit(r, node, "the scene asks for", r->triangles, SHD_LIMIT_TRIANGLES,
                      r->limits->triangles);
    r->scene->objects = objects;
    r->scene->object_count = count;
    r->scene->materials = r->materials;
    r->scene->material_count = r->material_count;
}
