/* Camera and image: where the eye is, and the raster before it. */
#include <string.h>

#include "scene/read.h"

/* ---- Camera ---- */

typedef struct raw_camera {
    shd_vec3 position, target, up;
    double fov, height;
} raw_camera;

enum { PERSPECTIVE = 1, ORTHOGRAPHIC = 2 }; /* kinds */
enum { POSITION = 1, TARGET = 2, UP = 4 };  /* marks */

/* Makes the camera frame. Halving before the subtraction keeps 1e308 - -1e308 finite. */
static void build_frame(shd_reader *r, const shd_node *node, const raw_camera *raw,
                        shd_camera *camera) {
    if (r->wrong & (POSITION | TARGET)) return;
    shd_vec3 back, right, up = {0, 1, 0};
    shd_vec3 away = shd_sub(shd_scale(raw->position, 0.5), shd_scale(raw->target, 0.5));
    if (!shd_normalize(away, &back)) {
        const shd_node place = shd_node_member(node, r->seen & TARGET ? "target" : "position");
        shd_wrong(r, &place,
                  "position and target are the same point: there is no direction to look in");
        return;
    }
    if (r->wrong & UP) return;
    shd_normalize(raw->up, &up);
    shd_vec3 across = shd_cross(up, back);
    if (!(shd_length(across) >= 1e-9) || !shd_normalize(across, &right)) {
        shd_node given = shd_node_member(node, "up");
        shd_wrong(r, given.value ? &given : node, "`up` is parallel to the view: turn it aside");
        return;
    }
    camera->back = back;
    camera->right = right;
    /* The product of perpendicular unit vectors is a unit vector, up to rounding. */
    shd_normalize(shd_cross(back, right), &camera->up);
}

void shd_read_camera(shd_reader *r, const shd_node *node, void *out) {
    static const char *const types[] = {
        [SHD_PERSPECTIVE] = "perspective", [SHD_ORTHOGRAPHIC] = "orthographic", NULL};
    static const shd_range fov = {0, 180, true, true, "between 0 and 180 degrees"};
    static const shd_field fields[] = {
        {"type", .read = NULL},
        {"position", shd_read_vector, offsetof(raw_camera, position), .mark = POSITION},
        {"target", shd_read_vector, offsetof(raw_camera, target), .mark = TARGET},
        {"up", shd_read_direction, offsetof(raw_camera, up), .mark = UP},
        {"fov", shd_read_degrees, offsetof(raw_camera, fov), PERSPECTIVE, .range = &fov},
        {"height", shd_read_number, offsetof(raw_camera, height), ORTHOGRAPHIC,
         .range = &shd_positive},
    };
    raw_camera raw = {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 40 * (SHD_PI / 180), 2};
    const shd_node type_node = shd_node_member(node, "type");
    const int type = type_node.value ? shd_read_name(r, &type_node, types) : SHD_PERSPECTIVE;
    const unsigned kinds = type < 0 ? PERSPECTIVE | ORTHOGRAPHIC : 1u << type;
    const char *what = type == SHD_ORTHOGRAPHIC ? "an orthographic camera" : "a camera";
    if (!shd_read_fields(r, node, fields, SHD_LENGTH(fields), kinds, what, &raw)) return;
    shd_camera *camera = out;
    camera->projection = type < 0 ? SHD_PERSPECTIVE : (shd_projection)type;
    camera->position = raw.position;
    camera->fov = raw.fov;
    camera->height = raw.height;
    build_frame(r, node, &raw, camera);
}

/* ---- Image ---- */

enum { WIDTH = 1, HEIGHT = 2, SAMPLES = 4, REGION = 8 }; /* marks */
enum { LONGEST = 65535 };

typedef struct raw_image {
    shd_raster raster;
    double region[4]; /* NAN: wrong */
} raw_image;

static void read_region(shd_reader *r, const shd_node *node, void *out) {
    double v[4] = {NAN, NAN, NAN, NAN};
    shd_get_numbers(r, node, 4, 4, "an array of 4 integers: x, y, width, height", v);
    for (size_t i = 0; i < 4; i++) {
        shd_node item = shd_node_item(node, i);
        if (!isnan(v[i]) && v[i] != floor(v[i]))
            shd_wrong(r, &item, "expected an integer, got %.9g", v[i]);
    }
    /* Items belong to sides by their place only if there are four. */
    if (json_array_size(node->value) == 4) memcpy(out, v, sizeof v);
}

/* Holds each item against the side that it is along, or against the longest possible side if that
 * is not known. Extents are also checked with the corner if that is known. */
static void place_region(shd_reader *r, const shd_node *node, double v[4], shd_raster *raster) {
    for (size_t i = 0; i < 4; i++) {
        shd_node item = shd_node_item(node, i);
        const bool known = !(r->wrong & (i % 2 ? HEIGHT : WIDTH));
        double low = i < 2 ? 0 : 1;
        double high = !known ? LONGEST : i % 2 ? raster->height : raster->width;
        /* Comparisons with NAN are false. */
        const bool empty = i >= 2 && v[i] < 1;
        const bool out = v[i] < low || v[i] > high || (i >= 2 && v[i - 2] + v[i] > high);
        if (empty)
            shd_wrong(r, &item, "a region is at least 1 pixel %s, got %.9g",
                      i == 2 ? "wide" : "high", v[i]);
        else if (out)
            shd_wrong(r, &item,
                      "the region reaches out of the picture, which has %s%g pixels this way",
                      known ? "" : "at most ", high);
        if (out || v[i] != floor(v[i])) v[i] = NAN;
    }
    raster->x = isnan(v[0]) ? 0 : (int)v[0];
    raster->y = isnan(v[1]) ? 0 : (int)v[1];
    raster->w = isnan(v[2]) ? 0 : (int)v[2];
    raster->h = isnan(v[3]) ? 0 : (int)v[3];
}

void shd_read_image(shd_reader *r, const shd_node *node, void *out) {
    static const shd_range pixels = {1, LONGEST, .text = "1 to 65535"};
    static const shd_range samples = {1, 64, .text = "1 to 64"};
    static const shd_field fields[] = {
        {"width", shd_read_integer, offsetof(raw_image, raster.width), .range = &pixels,
         .mark = WIDTH},
        {"height", shd_read_integer, offsetof(raw_image, raster.height), .range = &pixels,
         .mark = HEIGHT},
        {"samples", shd_read_integer, offsetof(raw_image, raster.samples), .range = &samples,
         .mark = SAMPLES},
        {"region", read_region, offsetof(raw_image, region), .mark = REGION},
    };
    raw_image raw = {.raster = {.width = 512, .height = 512, .samples = 4},
                     .region = {NAN, NAN, NAN, NAN}};
    if (!shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "the image", &raw)) return;
    shd_raster raster = raw.raster;
    if (r->seen & REGION) {
        shd_node region = shd_node_member(node, "region");
        place_region(r, &region, raw.region, &raster);
    } else {
        raster.w = r->wrong & WIDTH ? 0 : raster.width;
        raster.h = r->wrong & HEIGHT ? 0 : raster.height;
    }
    /* A side that is not known is 0 here, and so within every limit. */
    *(shd_raster *)out = raster;
    uint64_t asked = (uint64_t)raster.w * (uint64_t)raster.h;
    const shd_node *place = node->value ? node : node->parent;
    shd_hold_to_limit(r, place, "the image asks for", asked, SHD_LIMIT_PIXELS, r->limits->pixels);
    if (r->wrong & SAMPLES) return;
    uint64_t rays = asked * (uint64_t)raster.samples;
    if (rays > r->limits->samples) {
        shd_node_report(r->report, place, SHD_LIMIT,
                        "the image asks for %llu samples (%llu pixels of %d); the limit `samples` "
                        "is %llu",
                        (unsigned long long)rays, (unsigned long long)asked, raster.samples,
                        (unsigned long long)r->limits->samples);
        shd_report_limit(r->report, SHD_LIMIT_SAMPLES);
    }
}
