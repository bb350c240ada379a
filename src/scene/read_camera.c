/* Camera and image: where the eye is, and the raster before it. */
#include <math.h>

#include "scene/read.h"

/* ---- Camera ---- */

typedef struct raw_camera {
    shd_vec3 position, target, up;
    double fov, height;
} raw_camera;

enum { PERSPECTIVE = 1, ORTHOGRAPHIC = 2 };
enum {
    CAMERA_TYPE,
    CAMERA_POSITION,
    CAMERA_TARGET,
    CAMERA_UP,
    CAMERA_FOV,
    CAMERA_HEIGHT,
    CAMERA_FIELDS
};

/* The camera frame. Halving before the subtraction keeps 1e308 - -1e308 finite. */
static void build_frame(shd_reader *r, const shd_node *node, const raw_camera *raw, uint32_t seen,
                        uint32_t wrong) {
    if (wrong & (1u << CAMERA_POSITION | 1u << CAMERA_TARGET)) return;
    shd_camera *camera = &r->scene->camera;
    shd_vec3 back, right, up = {0, 1, 0};
    shd_node target = shd_node_member(node, "target"), position = shd_node_member(node, "position");
    shd_vec3 away = shd_sub(shd_scale(raw->position, 0.5), shd_scale(raw->target, 0.5));
    if (!shd_normalize(away, &back)) {
        shd_node_fail(r->report, seen >> CAMERA_TARGET & 1 ? &target : &position, SHD_SCENE,
                      "position and target are the same point: there is no direction to look in");
        return;
    }
    if (wrong >> CAMERA_UP & 1) return;
    shd_normalize(raw->up, &up);
    shd_vec3 across = shd_cross(up, back);
    if (!(shd_length(across) >= 1e-9) || !shd_normalize(across, &right)) {
        shd_node given = shd_node_member(node, "up");
        shd_node_fail(r->report, given.value ? &given : node, SHD_SCENE,
                      "`up` is parallel to the view: turn it aside");
        return;
    }
    camera->back = back;
    camera->right = right;
    /* Perpendicular unit vectors: the product is one already, up to rounding. */
    shd_normalize(shd_cross(back, right), &camera->up);
}

void shd_read_camera(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field, (void)out;
    static const char *const types[] = {
        [SHD_PERSPECTIVE] = "perspective", [SHD_ORTHOGRAPHIC] = "orthographic", NULL};
    static const shd_range fov = {0, 180, true, true, "between 0 and 180 degrees"};
    static const shd_field fields[CAMERA_FIELDS] = {
        [CAMERA_TYPE] = {.name = "type"},
        [CAMERA_POSITION] = {.name = "position",
                             .read = shd_read_vector,
                             .offset = offsetof(raw_camera, position)},
        [CAMERA_TARGET] = {.name = "target",
                           .read = shd_read_vector,
                           .offset = offsetof(raw_camera, target)},
        [CAMERA_UP] = {.name = "up",
                       .read = shd_read_direction,
                       .offset = offsetof(raw_camera, up)},
        [CAMERA_FOV] = {.name = "fov",
                        .read = shd_read_degrees,
                        .offset = offsetof(raw_camera, fov),
                        .kinds = PERSPECTIVE,
                        .range = &fov},
        [CAMERA_HEIGHT] = {.name = "height",
                           .read = shd_read_number,
                           .offset = offsetof(raw_camera, height),
                           .kinds = ORTHOGRAPHIC,
                           .range = &shd_positive},
    };
    raw_camera raw = {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 40 * (SHD_PI / 180), 2};
    int type = SHD_PERSPECTIVE;
    uint32_t seen = 0, wrong = 0;
    if (node->value) {
        if (!shd_is_object(r, node)) return;
        shd_node type_node = shd_node_member(node, "type");
        if (type_node.value) type = shd_read_name(r, &type_node, types);
        unsigned kinds = type < 0 ? PERSPECTIVE | ORTHOGRAPHIC : 1u << type;
        const char *what = type == SHD_ORTHOGRAPHIC ? "an orthographic camera" : "a camera";
        seen = shd_read_fields(r, node, fields, CAMERA_FIELDS, kinds, what, &raw);
        wrong = r->wrong;
    }
    shd_camera *camera = &r->scene->camera;
    camera->projection = type < 0 ? SHD_PERSPECTIVE : (shd_projection)type;
    camera->position = raw.position;
    camera->fov = raw.fov;
    camera->height = raw.height;
    build_frame(r, node, &raw, seen, wrong);
}

/* ---- Image ---- */

enum { WIDTH, HEIGHT, SAMPLES, REGION, COUNT };

typedef struct raw_image {
    shd_raster raster;
    double region[4]; /* NAN: wrong */
} raw_image;

static void read_region(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field;
    double *v = out;
    for (size_t i = 0; i < 4; i++) v[i] = NAN;
    if (!shd_is_array(r, node, 4, 4, "an array of 4 integers: x, y, width, height")) return;
    shd_get_numbers(r, node, 4, v);
    for (size_t i = 0; i < 4; i++) {
        shd_node item = shd_node_item(node, i);
        if (isnan(v[i]) || v[i] == floor(v[i])) continue;
        shd_node_fail(r->report, &item, SHD_SCENE, "expected an integer, got %.9g", v[i]);
        v[i] = NAN;
    }
}

/* Each item against the side that it is along, if that is known; extents where the corner is. */
static bool place_region(shd_reader *r, const shd_node *node, double v[4], uint32_t wrong,
                         shd_raster *raster) {
    bool good = true;
    for (size_t i = 0; i < 4; i++) {
        shd_node item = shd_node_item(node, i);
        bool known = !(wrong >> (i % 2 ? HEIGHT : WIDTH) & 1);
        double low = i < 2 ? 0 : 1, high = i % 2 ? raster->height : raster->width;
        /* Comparisons with NAN are false. */
        if (v[i] < low || (known && (v[i] > high || (i >= 2 && v[i - 2] + v[i] > high)))) {
            shd_node_fail(r->report, &item, SHD_SCENE,
                          "the region reaches out of the picture of %d x %d pixels", raster->width,
                          raster->height);
            v[i] = NAN;
        }
        good = good && known && !isnan(v[i]);
    }
    if (!good) return false;
    raster->x = (int)v[0];
    raster->y = (int)v[1];
    raster->w = (int)v[2];
    raster->h = (int)v[3];
    return true;
}

void shd_read_image(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field, (void)out;
    static const shd_range pixels = {1, 65535, .text = "1 to 65535"};
    static const shd_range samples = {1, 64, .text = "1 to 64"};
    static const shd_field fields[COUNT] = {
        [WIDTH] = {.name = "width",
                   .read = shd_read_integer,
                   .offset = offsetof(raw_image, raster.width),
                   .range = &pixels},
        [HEIGHT] = {.name = "height",
                    .read = shd_read_integer,
                    .offset = offsetof(raw_image, raster.height),
                    .range = &pixels},
        [SAMPLES] = {.name = "samples",
                     .read = shd_read_integer,
                     .offset = offsetof(raw_image, raster.samples),
                     .range = &samples},
        [REGION] = {.name = "region", .read = read_region, .offset = offsetof(raw_image, region)},
    };
    raw_image raw = {.raster = {.width = 512, .height = 512, .samples = 4}};
    uint32_t seen = 0, wrong = 0;
    if (node->value) {
        if (!shd_is_object(r, node)) return;
        seen = shd_read_fields(r, node, fields, COUNT, 0, "the image", &raw);
        wrong = r->wrong;
    }
    shd_raster raster = raw.raster;
    if (seen >> REGION & 1) {
        shd_node region = shd_node_member(node, "region");
        if (!place_region(r, &region, raw.region, wrong, &raster)) return;
    } else {
        if (wrong & (1u << WIDTH | 1u << HEIGHT)) return;
        raster.w = raster.width;
        raster.h = raster.height;
    }
    r->scene->raster = raster;
    uint64_t asked = (uint64_t)raster.w * (uint64_t)raster.h;
    if (asked > r->limits->pixels)
        shd_node_fail(r->report, node->value ? node : node->parent, SHD_LIMIT,
                      "the image asks for %llu pixels; the limit `pixels` is %llu",
                      (unsigned long long)asked, (unsigned long long)r->limits->pixels);
    if (wrong >> SAMPLES & 1) return;
    uint64_t rays = asked * (uint64_t)raster.samples;
    if (rays > r->limits->samples)
        shd_node_fail(r->report, node->value ? node : node->parent, SHD_LIMIT,
                      "the image asks for %llu samples (%llu pixels of %d); the limit `samples` "
                      "is %llu",
                      (unsigned long long)rays, (unsigned long long)asked, raster.samples,
                      (unsigned long long)r->limits->samples);
}
