/* This library beside Embree 3: a tree or what takes its place is made over a million triangles and
 * over 10,000 spheres, and one ray a pixel of 512 x 512 is cast, on one thread. Writes the page
 * docs/bench/embree.md to the standard output.
 *
 * Both get the same scenes and rays. Ours finds a G-buffer of each hit, in f64: position, normal
 * and mirror direction; Embree finds the triangle, a distance and a normal that is not unit, in
 * f32. Machines are noisy, so each figure is the least of several runs, which take turns. Usage:
 * bench_embree [RUNS [TRIANGLES]] */
#include <embree3/rtcore.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/cpu.h"
#include "render/planning.h"
#include "render/request.h"
#include "sight/sight.h"

enum { SIDE = 512, TILE = 32, BLOCK = 8, RAYS = BLOCK * BLOCK, SPHERES = 10000 };

static const double HALF = 0.25; /* of the image plane at distance 1: as tests/bench/growth.py */

static void quit(const char *what, const char *why) {
    fprintf(stderr, "bench_embree: %s: %s\n", what, why);
    exit(1);
}

static double milliseconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

/* ---- What is seen. ---- */

typedef enum sort { SHEET, CLOUD, BALLS } sort;

static const char *const names[] = {"a wavy sheet of triangles", "small triangles anywhere",
                                    "spheres anywhere"};

typedef struct model {
    sort kind;
    size_t count;                     /* triangles or spheres */
    size_t vertex_count, index_count; /* numbers of each; a sphere has 4 of the first */
    float *vertices;                  /* exact in f32, so that both get the same ones */
    uint32_t *indices;
} model;

static double draw(uint64_t *state) { /* -1 to 1 */
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 40) * 0x1p-23 - 1;
}

static void make_sheet(model *m, size_t wanted) {
    const size_t side = (size_t)sqrt((double)wanted / 2), row = side + 1;
    m->count = 2 * side * side;
    m->vertices = malloc(3 * row * row * sizeof *m->vertices);
    m->indices = malloc(3 * m->count * sizeof *m->indices);
    for (size_t k = 0; k < row * row; k++) {
        const double x = (double)(k % row) / (double)side * 2 - 1,
                     y = (double)(k / row) / (double)side * 2 - 1;
        m->vertices[m->vertex_count++] = (float)x;
        m->vertices[m->vertex_count++] = (float)y;
        m->vertices[m->vertex_count++] = (float)(0.2 * sin(7 * x) * cos(5 * y));
    }
    for (size_t k = 0; k < side * side; k++) {
        const uint32_t at = (uint32_t)(k / side * row + k % side), up = at + (uint32_t)row;
        const uint32_t corners[6] = {at, at + 1, up, at + 1, up + 1, up};
        memcpy(m->indices + m->index_count, corners, sizeof corners);
        m->index_count += 6;
    }
}

static void make_cloud(model *m, size_t wanted) {
    const double side = sqrt(0.5 * 4 / (double)wanted * 2);
    uint64_t state = 1;
    m->count = wanted;
    m->vertices = malloc(9 * wanted * sizeof *m->vertices);
    m->indices = malloc(3 * wanted * sizeof *m->indices);
    for (size_t i = 0; i < wanted; i++) {
        const double x = draw(&state), y = draw(&state), z = 0.3 * draw(&state);
        const double corners[9] = {x, y, z, x + side, y, z, x, y + side, z};
        for (int k = 0; k < 9; k++) m->vertices[m->vertex_count++] = (float)corners[k];
        for (int k = 0; k < 3; k++, m->index_count++)
            m->indices[m->index_count] = (uint32_t)m->index_count;
    }
}

static void make_balls(model *m, size_t wanted) {
    const double radius = sqrt(0.5 * 4 / (3.14159265 * (double)wanted));
    uint64_t state = 1;
    m->count = wanted;
    m->vertices = malloc(4 * wanted * sizeof *m->vertices);
    for (size_t i = 0; i < wanted; i++) {
        const double x = draw(&state), y = draw(&state), z = 0.3 * draw(&state);
        const double ball[4] = {x, y, z, radius};
        for (int k = 0; k < 4; k++) m->vertices[m->vertex_count++] = (float)ball[k];
    }
}

/* The scene's text; the caller frees it. */
static char *write_scene(const model *m) {
    char *text;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    if (!out) quit("scene", "out of memory");
    fprintf(
        out,
        "{\"image\":{\"width\":%d,\"height\":%d,\"samples\":1},\"camera\":{\"position\":[0,0,4],"
        "\"target\":[0,0,0],\"fov\":%.17g},\"objects\":[",
        SIDE, SIDE, 2 * atan(HALF) * 180 / 3.14159265358979323846);
    for (size_t i = 0; m->kind == BALLS && i < m->count; i++) {
        const float *v = m->vertices + 4 * i;
        fprintf(
            out,
            "%s{\"type\":\"sphere\",\"radius\":%.9g,\"transform\":{\"translate\":[%.9g,%.9g,%.9g]}"
            "}",
            i ? "," : "", (double)v[3], (double)v[0], (double)v[1], (double)v[2]);
    }
    if (m->kind != BALLS) {
        fputs("{\"type\":\"mesh\",\"positions\":[", out);
        for (size_t i = 0; i < m->vertex_count; i++)
            fprintf(out, "%s%.9g", i ? "," : "", (double)m->vertices[i]);
        fputs("],\"indices\":[", out);
        for (size_t i = 0; i < m->index_count; i++)
            fprintf(out, "%s%u", i ? "," : "", m->indices[i]);
        fputs("]}", out);
    }
    fputs("]}", out);
    fclose(out);
    return text;
}

/* ---- What was found. ---- */

enum { SINGLE, PACKET, STREAM, WAYS };

typedef struct found {
    double build, cast[WAYS]; /* milliseconds; ours casts in one way */
    size_t bytes, hits;
} found;

static void keep_least(double *least, double value) {
    if (!(*least > 0 && *least < value)) *least = value;
}

/* ---- Ours. ---- */

typedef struct scratch {
    int32_t x[RAYS], y[RAYS];
    uint8_t sample[RAYS]; /* 0 all of it */
    shd_survey survey;
    shd_hits hits;
} scratch;

static size_t cast_tile(const shd_sight *sight, scratch *s, int left, int top) {
    shd_sight_survey(sight, (shd_tile){left, top, TILE, TILE}, &s->survey);
    s->hits.count = 0;
    for (int i = 0; i < s->survey.across * s->survey.down; i++) {
        if (!s->survey.blocks[i].count) continue;
        for (int k = 0; k < RAYS; k++) {
            s->x[k] = left + i % s->survey.across * BLOCK + k % BLOCK;
            s->y[k] = top + i / s->survey.across * BLOCK + k / BLOCK;
        }
        const shd_shots shots = {RAYS, s->x, s->y, s->sample};
        shd_sight_shoot_block(sight, &s->survey, (size_t)i, &shots, &s->hits);
    }
    return s->hits.count;
}

static void run_ours(const shd_plan *plan, shd_arena *arena, found *f) {
    static scratch s;
    const shd_arena_mark mark = shd_arena_mark_here(arena);
    const size_t room = shd_arena_room(arena);
    shd_error error;
    shd_sight *sight;
    double start = milliseconds();
    if (shd_sight_new(plan, NULL, arena, &sight, &error)) quit(error.path, error.text);
    keep_least(&f->build, milliseconds() - start);
    f->bytes = room - shd_arena_room(arena);
    shd_scratch memory = {.arena = arena};
    shd_survey_lay_out(plan->scene->object_count, TILE, TILE, &memory, &s.survey);
    shd_hits_lay_out(plan, TILE * TILE, &memory, &s.hits);
    if (memory.full) quit("ours", "out of memory");
    start = milliseconds();
    f->hits = 0;
    for (int y = 0; y < SIDE; y += TILE)
        for (int x = 0; x < SIDE; x += TILE) f->hits += cast_tile(sight, &s, x, y);
    keep_least(&f->cast[SINGLE], milliseconds() - start);
    shd_arena_return(arena, mark);
}

/* ---- Embree. ---- */

static size_t taken; /* bytes that Embree has */

static bool note_memory(void *user, ssize_t bytes, bool after) {
    (void)user;
    (void)after;
    taken += (size_t)bytes;
    return true;
}

static RTCScene new_scene(RTCDevice device, const model *m, enum RTCSceneFlags flags) {
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, flags);
    const bool balls = m->kind == BALLS;
    RTCGeometry geometry =
        rtcNewGeometry(device, balls ? RTC_GEOMETRY_TYPE_SPHERE_POINT : RTC_GEOMETRY_TYPE_TRIANGLE);
    const size_t step = balls ? 4 : 3, bytes = step * sizeof(float);
    memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                   balls ? RTC_FORMAT_FLOAT4 : RTC_FORMAT_FLOAT3, bytes,
                                   m->vertex_count / step),
           m->vertices, m->vertex_count * sizeof(float));
    if (!balls)
        memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                       3 * sizeof(uint32_t), m->count),
               m->indices, m->index_count * sizeof(uint32_t));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    return scene;
}

/* The ray through the middle of a pixel. */
static void aim(int x, int y, float *dx, float *dy) {
    *dx = (float)(HALF * ((2 * x + 1) / (double)SIDE - 1));
    *dy = (float)(HALF * (1 - (2 * y + 1) / (double)SIDE));
}

static size_t cast_single(RTCScene scene, struct RTCIntersectContext *context) {
    size_t hits = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            struct RTCRayHit r = {.ray = {.org_z = 4, .dir_z = -1, .tfar = INFINITY, .mask = -1u},
                                  .hit.geomID = RTC_INVALID_GEOMETRY_ID};
            aim(x, y, &r.ray.dir_x, &r.ray.dir_y);
            rtcIntersect1(scene, context, &r);
            hits += r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
    return hits;
}

static size_t cast_packets(RTCScene scene, struct RTCIntersectContext *context) {
    size_t hits = 0;
    _Alignas(64) int valid[16];
    memset(valid, -1, sizeof valid);
    for (int y = 0; y < SIDE; y += 4)
        for (int x = 0; x < SIDE; x += 4) {
            _Alignas(64) struct RTCRayHit16 r;
            memset(&r, 0, sizeof r);
            for (int k = 0; k < 16; k++) {
                r.ray.org_z[k] = 4;
                r.ray.dir_z[k] = -1;
                r.ray.tfar[k] = INFINITY;
                r.ray.mask[k] = -1u;
                r.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
                aim(x + k % 4, y + k / 4, &r.ray.dir_x[k], &r.ray.dir_y[k]);
            }
            rtcIntersect16(valid, scene, context, &r);
            for (int k = 0; k < 16; k++) hits += r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
        }
    return hits;
}

static size_t cast_streams(RTCScene scene, struct RTCIntersectContext *context) {
    size_t hits = 0;
    for (int y = 0; y < SIDE; y += BLOCK)
        for (int x = 0; x < SIDE; x += BLOCK) {
            _Alignas(64) struct RTCRayHit r[RAYS];
            memset(r, 0, sizeof r);
            for (int k = 0; k < RAYS; k++) {
                r[k].ray.org_z = 4;
                r[k].ray.dir_z = -1;
                r[k].ray.tfar = INFINITY;
                r[k].ray.mask = -1u;
                r[k].hit.geomID = RTC_INVALID_GEOMETRY_ID;
                aim(x + k % BLOCK, y + k / BLOCK, &r[k].ray.dir_x, &r[k].ray.dir_y);
            }
            rtcIntersect1M(scene, context, r, RAYS, sizeof *r);
            for (int k = 0; k < RAYS; k++) hits += r[k].hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
    return hits;
}

static void run_embree(const model *m, enum RTCSceneFlags flags, found *f) {
    RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
    if (!device) quit("embree", "no device");
    RTCScene scene = new_scene(device, m, flags);
    taken = 0;
    rtcSetDeviceMemoryMonitorFunction(device, note_memory, NULL);
    double start = milliseconds();
    rtcCommitScene(scene);
    keep_least(&f->build, milliseconds() - start);
    f->bytes = taken;
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    size_t (*const ways[WAYS])(RTCScene, struct RTCIntersectContext *) = {cast_single, cast_packets,
                                                                          cast_streams};
    for (int way = 0; way < WAYS; way++) {
        start = milliseconds();
        f->hits = ways[way](scene, &context);
        keep_least(&f->cast[way], milliseconds() - start);
    }
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) quit("embree", "an error");
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
}

/* ---- The page. ---- */

static void print_row(const char *who, const found *f, int ways) {
    printf("| %s | %.*f | %.*f |", who, f->build < 100 ? 1 : 0, f->build,
           f->bytes < (size_t)100000000 ? 1 : 0, (double)f->bytes / 1e6);
    for (int way = 0; way < WAYS; way++) {
        if (way < ways)
            printf(" %.2f |", 1e-3 * SIDE * SIDE / f->cast[way]);
        else
            printf(" |");
    }
    printf(" %zu |\n", f->hits);
}

static void compare(sort kind, size_t count, shd_engine *engine, int runs) {
    model m = {.kind = kind};
    (kind == SHEET ? make_sheet : kind == CLOUD ? make_cloud : make_balls)(&m, count);
    char *text = write_scene(&m);
    shd_request *request;
    shd_error error;
    if (shd_request_new(engine, &request, &error)) quit(error.path, error.text);
    if (shd_request_read(request, text, strlen(text), SHD_PNG))
        quit(names[kind], shd_request_report(request)->errors[0].detail);
    const shd_plan *plan;
    shd_arena *arena = request->rendering.arena;
    if (shd_plan_make(request->scene, shd_cpu_best(), NULL, NULL, arena, &plan, &error))
        quit(error.path, error.text);
    found ours = {0}, plain = {0}, robust = {0};
    for (int i = 0; i < runs; i++) {
        run_ours(plan, arena, &ours);
        run_embree(&m, RTC_SCENE_FLAG_NONE, &plain);
        run_embree(&m, RTC_SCENE_FLAG_ROBUST, &robust);
    }
    printf(
        "\n%zu: %s\n\n| who | build, ms | memory, MB | million rays a second | in packets of 16 | "
        "in streams of 64 | hits |\n| --- | --- | --- | --- | --- | --- | --- |\n",
        m.count, names[kind]);
    print_row("`shaded`, 64 rays at once", &ours, 1);
    print_row("Embree", &plain, WAYS);
    print_row("Embree, robust", &robust, WAYS);
    shd_request_drop(request);
    free(text);
    free(m.vertices);
    free(m.indices);
}

int main(int argc, char **argv) {
    const int runs = argc > 1 ? atoi(argv[1]) : 5;
    const size_t triangles = argc > 2 ? (size_t)atol(argv[2]) : 1000000;
    shd_engine_options options = shd_engine_defaults();
    options.threads = 1;
    options.limits.body = 256u << 20; /* a million triangles are up to 136 MB of text */
    options.limits.memory = (uint64_t)4 << 30;
    shd_engine *engine;
    shd_error error;
    if (shd_engine_new(&options, &engine, &error)) quit(error.path, error.text);
    RTCDevice device = rtcNewDevice("threads=1");
    const ssize_t version = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION);
    rtcReleaseDevice(device);
    printf(
        "# A million triangles beside Embree\n\n"
        "What `./dev bench --embree` has measured (`tests/bench/peers/embree.c`): Embree "
        "%zd.%zd.%zd\n"
        "and this library (its %s kernels) on one thread, the least of %d runs, in time of the\n"
        "processor. Pictures are of %d x %d, with a ray through the middle of each pixel.\n\n"
        "Ours decides each triangle in f64, and makes positions, normals and mirror directions of\n"
        "hits within this time. Embree decides in f32, and makes the triangle's number, a "
        "distance\n"
        "and barycentric coordinates. Our figure of memory has all that rays need, Embree's is\n"
        "without the vertices and indices that it was given.\n",
        version / 10000, version / 100 % 100, version % 100, shd_isa_name(shd_cpu_best()), runs,
        SIDE, SIDE);
    compare(SHEET, triangles, engine, runs);
    compare(CLOUD, triangles, engine, runs);
    compare(BALLS, SPHERES, engine, runs);
    shd_engine_drop(engine);
    return 0;
}
