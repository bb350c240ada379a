#include "sight/mesh.h"

#include <embree3/rtcore.h>
#include <float.h>
#include <pthread.h>
#include <stdlib.h>

struct shd_tracer {
    pthread_mutex_t mutex;
    RTCDevice device; /* NULL until the first mesh */
};

/* Embree works in f32, in a frame of the mesh's own where it fills [-1, 1]. */
struct shd_mesh_tree {
    RTCScene scene;
    shd_vec3 center;
    double scale, radius; /* radius of a sphere around the mesh, in that frame */
    shd_triangles triangles;
};

shd_tracer *shd_tracer_new(void) {
    shd_tracer *tracer = calloc(1, sizeof *tracer);
    if (tracer) pthread_mutex_init(&tracer->mutex, NULL);
    return tracer;
}

void shd_tracer_drop(shd_tracer *tracer) {
    if (!tracer) return;
    if (tracer->device) rtcReleaseDevice(tracer->device);
    pthread_mutex_destroy(&tracer->mutex);
    free(tracer);
}

/* One thread a device: pictures run side by side on the pool already. */
static RTCDevice get_device(shd_tracer *tracer) {
    pthread_mutex_lock(&tracer->mutex);
    if (!tracer->device) tracer->device = rtcNewDevice("threads=1,set_affinity=0");
    RTCDevice device = tracer->device;
    pthread_mutex_unlock(&tracer->mutex);
    return device;
}

static const char *error_text(enum RTCError code) {
    switch (code) {
    case RTC_ERROR_NONE:
        return "no error";
    case RTC_ERROR_INVALID_ARGUMENT:
        return "invalid argument";
    case RTC_ERROR_INVALID_OPERATION:
        return "invalid operation";
    case RTC_ERROR_OUT_OF_MEMORY:
        return "out of memory";
    case RTC_ERROR_UNSUPPORTED_CPU:
        return "this processor is not supported";
    case RTC_ERROR_CANCELLED:
        return "cancelled";
    case RTC_ERROR_UNKNOWN:
        break;
    }
    return "unknown error";
}

static shd_status embree_error(enum RTCError code, shd_error *error) {
    if (code == RTC_ERROR_CANCELLED)
        return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    return shd_fail(error, code == RTC_ERROR_OUT_OF_MEMORY ? SHD_EXHAUSTED : SHD_INTERNAL, "",
                    "Embree cannot take this mesh: %s", error_text(code));
}

static shd_vec3 vertex(const double *values, size_t i) {
    return (shd_vec3){values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

shd_vec3 shd_triangle_corner(const shd_triangles *triangles, size_t triangle, int k) {
    return vertex(triangles->positions, triangles->indices[3 * triangle + (size_t)k]);
}

shd_vec3 shd_triangle_normal(const shd_triangles *triangles, size_t triangle) {
    shd_vec3 a = shd_triangle_corner(triangles, triangle, 0);
    shd_vec3 ab = shd_sub(shd_triangle_corner(triangles, triangle, 1), a);
    shd_vec3 ac = shd_sub(shd_triangle_corner(triangles, triangle, 2), a);
    return shd_cross(ab, ac);
}

static void fit_frame(shd_mesh_tree *tree) {
    const shd_triangles *t = &tree->triangles;
    shd_vec3 low = vertex(t->positions, 0), high = low;
    for (size_t i = 1; i < t->vertex_count; i++) {
        shd_vec3 p = vertex(t->positions, i);
        low = (shd_vec3){fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z)};
        high = (shd_vec3){fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z)};
    }
    tree->center = shd_madd(shd_scale(low, 0.5), high, 0.5);
    shd_vec3 half = shd_sub(shd_scale(high, 0.5), shd_scale(low, 0.5));
    double size = shd_max_abs(half);
    tree->scale = size > DBL_MIN ? 1 / size : 1; /* below it the quotient would not be finite */
    tree->radius = shd_length(shd_scale(half, tree->scale));
}

static bool fill_geometry(const shd_mesh_tree *tree, RTCGeometry geometry) {
    const shd_triangles *t = &tree->triangles;
    float *vertices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof *vertices, t->vertex_count);
    uint32_t *indices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof *indices, t->triangle_count);
    if (!vertices || !indices) return false;
    for (size_t i = 0; i < t->vertex_count; i++) {
        shd_vec3 p = shd_scale(shd_sub(vertex(t->positions, i), tree->center), tree->scale);
        vertices[3 * i] = (float)p.x;
        vertices[3 * i + 1] = (float)p.y;
        vertices[3 * i + 2] = (float)p.z;
    }
    for (size_t i = 0; i < 3 * t->triangle_count; i++) indices[i] = t->indices[i];
    return true;
}

static bool attach_triangles(const shd_mesh_tree *tree, RTCDevice device) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!geometry) return false;
    bool filled = fill_geometry(tree, geometry);
    if (filled) {
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(tree->scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    return filled;
}

/* Embree asks it now and then while it builds. */
static bool goes_on(void *cancelled, double share) {
    (void)share;
    return !atomic_load_explicit((const atomic_bool *)cancelled, memory_order_relaxed);
}

shd_status shd_mesh_tree_new(const shd_triangles *triangles, shd_tracer *tracer,
                             const atomic_bool *cancelled, shd_arena *arena, shd_mesh_tree **out,
                             shd_error *error) {
    RTCDevice device = get_device(tracer);
    if (!device) return shd_fail(error, SHD_INTERNAL, "", "Embree does not start");
    shd_mesh_tree *tree = shd_arena_zalloc(arena, 1, sizeof *tree);
    if (!tree) return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached by a mesh");
    tree->triangles = *triangles;
    fit_frame(tree);
    tree->scene = rtcNewScene(device);
    if (!tree->scene) return embree_error(rtcGetDeviceError(device), error);
    rtcSetSceneFlags(tree->scene, RTC_SCENE_FLAG_ROBUST);
    /* A shape whose every face is degenerate has no triangle, which Embree's buffers cannot be. */
    if (tree->triangles.triangle_count && !attach_triangles(tree, device)) {
        rtcReleaseScene(tree->scene);
        return embree_error(rtcGetDeviceError(device), error);
    }
    if (cancelled)
        rtcSetSceneProgressMonitorFunction(tree->scene, goes_on, (void *)(size_t)cancelled);
    rtcCommitScene(tree->scene);
    enum RTCError code = rtcGetDeviceError(device);
    if (code != RTC_ERROR_NONE) {
        /* Where the system refused memory in mid-build the scene is left: Embree 3.13 breaks its
         * allocator when such a scene is released or built again; then later pictures are wrong,
         * and its threads do not end. */
        if (code != RTC_ERROR_OUT_OF_MEMORY) rtcReleaseScene(tree->scene);
        return embree_error(code, error);
    }
    *out = tree;
    return SHD_OK;
}

void shd_mesh_tree_drop(shd_mesh_tree *tree) {
    if (tree) rtcReleaseScene(tree->scene);
}

/* How far out of its triangle f64 may find a hit that f32 found in it. At an edge between two
 * triangles f32 may take the neighbour: the point on the neighbour's plane, a little outside, is
 * nearer to the truth than the nearest point of the edge. Slivers are held closer. */
static const double OUTSIDE = 1e-3;

static double hold(double weight) {
    double least = weight > -OUTSIDE ? weight : -OUTSIDE;
    return least < 1 + OUTSIDE ? least : 1 + OUTSIDE;
}

/* Where the ray meets the plane of a triangle that it is known to hit (Moeller and Trumbore
 * 1997), in f64. */
static bool place(const shd_triangles *triangles, uint32_t triangle, const shd_ray *ray, double *t,
                  double *u, double *v) {
    shd_vec3 a = shd_triangle_corner(triangles, triangle, 0);
    shd_vec3 ab = shd_sub(shd_triangle_corner(triangles, triangle, 1), a);
    shd_vec3 ac = shd_sub(shd_triangle_corner(triangles, triangle, 2), a);
    shd_vec3 from = shd_sub(ray->origin, a);
    shd_vec3 h = shd_cross(ray->direction, ac);
    double volume = shd_dot(ab, h);
    if (volume == 0) return false;
    shd_vec3 q = shd_cross(from, ab);
    *t = shd_dot(ac, q) / volume;
    *u = hold(shd_dot(from, h) / volume);
    *v = hold(shd_dot(ray->direction, q) / volume);
    return isfinite(*t) && isfinite(*u) && isfinite(*v);
}

/* How often a ray looks past triangles that are behind the eye after all, and how far each time,
 * in the tree's frame. */
enum { MOST_BEHIND = 8 };
static const float BEYOND = 1e-6f;

bool shd_mesh_tree_intersect(const shd_mesh_tree *tree, const shd_ray *ray, double *t,
                             uint32_t *triangle, double *u, double *v) {
    /* Start where the ray enters the mesh's sphere: f32 then has digits for the mesh alone. In
     * the tree's frame, where the mesh's size is 1. Comparisons are such that what is not a number
     * misses: Embree may abort on it. */
    const double square = shd_dot(ray->direction, ray->direction);
    const bool safe = square > 1e-280 && square < 1e280;
    const double length = safe ? sqrt(square) : shd_length(ray->direction);
    if (!(length > 0)) return false;
    const shd_vec3 unit = shd_scale(ray->direction, 1 / length);
    const shd_vec3 from = shd_scale(shd_sub(ray->origin, tree->center), tree->scale);
    const double closest = -shd_dot(from, unit), margin = 1.001 * tree->radius;
    const shd_vec3 foot = shd_madd(from, unit, closest);
    if (!(shd_dot(foot, foot) <= margin * margin)) return false;
    const double first = closest - margin, near = ray->near * length * tree->scale;
    const double begin = first > near ? first : near;
    if (!(begin <= closest + margin)) return false;
    const shd_vec3 origin = shd_madd(from, unit, begin);
    const double start = begin / tree->scale;

    struct RTCRayHit hit = {
        .ray = {.org_x = (float)origin.x,
                .org_y = (float)origin.y,
                .org_z = (float)origin.z,
                .dir_x = (float)unit.x,
                .dir_y = (float)unit.y,
                .dir_z = (float)unit.z,
                .tnear = 0,
                .tfar = INFINITY,
                .mask = -1u},
    };
    const shd_ray moved = {shd_madd(ray->origin, unit, start), unit, 0};
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (int behind = 0; behind < MOST_BEHIND; behind++) {
        hit.ray.tfar = INFINITY;
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        /* Alone: coherent packets are five times as fast, but where two triangles share an edge
         * the one that they find depends on the packet. */
        rtcIntersect1(tree->scene, &context, &hit);
        if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;

        if (place(&tree->triangles, hit.hit.primID, &moved, t, u, v) &&
            (*t + start) * tree->scale > near + SHD_BLIND) {
            *t = (*t + start) / length;
            *triangle = hit.hit.primID;
            return true;
        }
        /* By f32's rounding, of a size of 1, it took what the eye has behind itself. */
        hit.ray.tnear = hit.ray.tfar + BEYOND;
    }
    return false;
}
