/* Whether a light is behind all that is seen of an object.
 *
 * An affine map takes normals by its inverse transposed, so that N.(l - p) keeps its sign: all is
 * decided in the object's own frame. A convex solid is seen from outside at points p with n.(e - p)
 * > 0, where e is the eye. Normals are not turned there, and belong to some of its faces and to an
 * arc of its curved part. A light l is behind if n.(l - p) < 0 for all of these. Eyes and lights at
 * infinity are directions, for which p drops out. */
#include "plan/parts.h"

/* A point of the object's frame (weight 1) or a direction (weight 0). */
typedef struct place {
    shd_vec3 at;
    double weight;
} place;

static place eye_of(const shd_scene *scene, const shd_back *back) {
    const shd_camera *camera = &scene->camera;
    bool far = camera->projection == SHD_ORTHOGRAPHIC;
    shd_vec3 at = far ? camera->back : shd_sub(camera->position, back->origin);
    return (place){shd_linear(&back->inverse, at), !far};
}

static void add_seen_face(shd_back *back, shd_vec3 normal, double offset) {
    back->faces[back->face_count] = normal;
    back->offsets[back->face_count++] = offset;
}

/* How far the eye is in front of a plane. *size tells whether that is much. */
static double height_before(const place *eye, shd_vec3 normal, double offset, double *size) {
    *size = shd_length(eye->at) + fabs(offset) * eye->weight;
    return shd_dot(normal, eye->at) - offset * eye->weight;
}

/* Adds a face of a solid if the eye may see it. Returns whether the eye is clearly in front. */
static bool see_face(shd_back *back, const place *eye, shd_vec3 normal, double offset) {
    double size, height = height_before(eye, normal, offset, &size);
    if (height > -1e-9 * size) add_seen_face(back, normal, offset);
    return height > 1e-6 * size;
}

/* Adds the curved part of a sphere (not `flat_circle`), cylinder or cone that the eye may see,
 * where n.x = radial |x| cos(angle between n and x) + axial x.y - reach is above 0. Returns whether
 * the eye is clearly in front of some of it. */
static bool see_arc(shd_back *back, const place *eye, bool flat_circle, double radial, double axial,
                    double reach) {
    shd_vec3 across = eye->at;
    if (flat_circle) across.y = 0;
    double out = radial * shd_length(across), rest = axial * eye->at.y - reach * eye->weight;
    double size = out + fabs(rest);
    if (!(out + rest > -1e-9 * size)) return false;
    back->round = true;
    back->flat_circle = flat_circle;
    back->slope_radial = radial;
    back->slope_axial = axial;
    back->reach = reach;
    /* It is seen where cos > -rest / out. */
    double cosine = out > 0 ? -rest / out : -1;
    back->arc_cosine = cosine > 1 ? 1 : cosine;
    if (!(back->arc_cosine > -1) || !shd_normalize(across, &back->arc)) back->arc_cosine = -1;
    return out + rest > 1e-6 * size;
}

/* Adds a surface without inside. Its normal is turned to the eye, wherever that is. */
static bool see_sheet(shd_back *back, const place *eye, bool front_only) {
    shd_vec3 up = {0, 1, 0};
    double size, height = height_before(eye, up, 0, &size);
    add_seen_face(back, !front_only && height < 0 ? shd_scale(up, -1) : up, 0);
    return front_only || fabs(height) > 1e-6 * size;
}

/* Whether rays begin outside of the object. An orthographic camera's rays begin on a plane. */
static bool begins_outside(const shd_camera *camera, const shd_plan_object *bounds) {
    if (camera->projection == SHD_PERSPECTIVE) return true;
    double depth = shd_dot(shd_sub(camera->position, bounds->center), camera->back);
    return depth > bounds->radius * (1 + 1e-9);
}

/* Adds the parts of a shape that the eye may see. Returns whether the eye is clearly outside. */
static bool see_shape(shd_back *back, const place *eye, const shd_object *object, bool front_only) {
    const double r = object->radius, h = object->height / 2;
    bool outside = false;
    switch (object->shape) {
    case SHD_PLANE:
    case SHD_DISC:
        return see_sheet(back, eye, front_only);
    case SHD_SPHERE:
        return see_arc(back, eye, false, 1, 0, r);
    case SHD_BOX:
        for (int f = 0; f < 6; f++) {
            double sign = f % 2 ? -1 : 1,
                   half[3] = {object->size.x, object->size.y, object->size.z};
            shd_vec3 n = {f / 2 == 0 ? sign : 0, f / 2 == 1 ? sign : 0, f / 2 == 2 ? sign : 0};
            outside |= see_face(back, eye, n, half[f / 2] / 2);
        }
        break;
    case SHD_CYLINDER:
        outside |= see_face(back, eye, (shd_vec3){0, 1, 0}, h);
        outside |= see_face(back, eye, (shd_vec3){0, -1, 0}, h);
        outside |= see_arc(back, eye, true, 1, 0, r);
        break;
    case SHD_CONE: {
        double slant = hypot(r, 2 * h), radial = 2 * h / slant, axial = r / slant;
        outside |= see_face(back, eye, (shd_vec3){0, -1, 0}, h);
        outside |= see_arc(back, eye, true, radial, axial, axial * h);
        break;
    }
    case SHD_TORUS: /* not convex */
    case SHD_MESH:  /* normals are what its author wants */
    case SHD_SHAPE_COUNT:
        break;
    }
    return outside;
}

shd_back shd_back_of(const shd_scene *scene, const shd_object *object,
                     const shd_plan_object *bounds) {
    shd_back back = {.origin = object->transform.origin};
    shd_affine linear = object->transform;
    linear.origin = (shd_vec3){0, 0, 0};
    /* Faceted objects are lit at vertices of the far side, too, and maps turn normals anywhere. */
    if (scene->materials[object->material].normal_texture) return back;
    if (object->interpolation != SHD_PHONG || !shd_invert(&linear, &back.inverse)) return back;
    back.norm = shd_norm(&back.inverse);
    back.center = bounds->center;
    back.radius = bounds->radius;
    const place eye = eye_of(scene, &back);
    const bool front_only = scene->materials[object->material].front_only;
    if (object->shape == SHD_PLANE) { /* rays may begin on either side of it */
        if (scene->camera.projection == SHD_ORTHOGRAPHIC && !front_only) return back;
        back.center = scene->camera.position;
        back.radius = shd_length(shd_sub(scene->camera.position, back.origin));
    }
    const bool outside = see_shape(&back, &eye, object, front_only);
    back.known = outside && (object->shape == SHD_PLANE || begins_outside(&scene->camera, bounds));
    return back;
}

/* The largest n.(l - p) on the curved part. */
static double most_before_arc(const shd_back *back, const place *light) {
    shd_vec3 across = light->at;
    if (back->flat_circle) across.y = 0;
    double length = shd_length(across), cosine = back->arc_cosine, most = length;
    double along = cosine > -1 ? shd_dot(across, back->arc) : length;
    if (along < length * cosine) {
        double away = sqrt(fmax(0, length * length - along * along));
        most = along * cosine + away * sqrt(1 - cosine * cosine);
    }
    return back->slope_radial * most + back->slope_axial * light->at.y -
           back->reach * light->weight;
}

bool shd_is_behind(const shd_back *back, const shd_plan_light *light) {
    if (!back->known) return false;
    const bool far = light->directional;
    const shd_vec3 way = far ? light->toward : shd_sub(light->position, back->origin);
    const place at = {shd_linear(&back->inverse, way), far ? 0 : 1};
    double most = back->round ? most_before_arc(back, &at) : -INFINITY; /* of n.(l - p) */
    for (int f = 0; f < back->face_count && most <= 0; f++) {
        const double height = shd_dot(back->faces[f], at.at) - back->offsets[f] * at.weight;
        most = height <= most ? most : height;
    }
    if (!(most <= 0)) return false; /* as of most lights */
    /* n.(l - p) = |n| |l - p| N.L, and |n| and |l - p| are at most these: */
    const double distance =
        far ? 1 : shd_length(shd_sub(light->position, back->center)) + back->radius;
    return most <= -SHD_PLAN_MARGIN * back->norm * distance;
}
