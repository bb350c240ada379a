/* shaded: a scene document in, shaded and color-converted pictures out.
 *
 *     shd_engine *engine;
 *     shd_engine_options options = shd_engine_defaults();
 *     if (shd_engine_new(&options, &engine, &error)) ...
 *     shd_request *request;
 *     if (shd_request_new(engine, &request, &error)) ...
 *     if (shd_request_read(request, json, length, SHD_PNG)) ... shd_request_report(request)
 *     if (shd_request_render(request, NULL, &error)) ...
 *     shd_request_pictures(request, &count)[0].data
 *     shd_request_drop(request);
 *     shd_engine_drop(engine);
 *
 * Ownership: what `new` gives, `drop` ends; everything else is borrowed from it.
 * Threads: an engine may be used by any number of threads at once, a request by one at a time
 * (except shd_request_cancel). Errors: see base/status.h. */
#ifndef SHADED_H
#define SHADED_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/budget.h"
#include "base/digest.h"
#include "base/format.h"
#include "base/limits.h"
#include "base/report.h"
#include "base/status.h"

typedef struct shd_engine shd_engine;
typedef struct shd_request shd_request;

typedef struct shd_engine_options {
    const char *ocio_config; /* path; NULL: the embedded configuration */
    /* Paths of files of materials, parted by blanks, beside the built-in ones; NULL: none. */
    const char *materials;
    const char *assets; /* path of a folder of pictures that documents may name; NULL: none */
    const char *kernel; /* "portable", "avx2", "avx512", "neon"; NULL or "auto": the widest */
    unsigned threads;   /* workers; 0: as many as affinity and quota allow */
    size_t queue;       /* jobs that may wait in shd_engine_submit; 0: none is taken */
    /* Bytes of G-buffers and sums of light that are kept between requests; 0: none. Pictures are
     * the same, to the byte. */
    size_t reuse;
    size_t mesh_store;     /* bytes of meshes, scenes and pictures that are kept; 0: none */
    bool scenes_elsewhere; /* its owner keeps scenes beside that; it is told, and nothing else */
    /* All memory of requests and between them is taken from it; it outlives the engine; NULL:
     * endless. */
    shd_budget *budget;
    shd_limits limits;
} shd_engine_options;

/* The defaults of the daemon: a worker for each processor that it may have, 64 queued jobs, 256 MiB
 * for reuse and as much for meshes, and the limits that config/shaded.conf shows. */
shd_engine_options shd_engine_defaults(void);

/* Loads the color configuration and the materials, and starts the workers. SHD_CONFIG if a file of
 * the operator's is wrong, or if this machine lacks the kernel's instructions. */
shd_status shd_engine_new(const shd_engine_options *options, shd_engine **out, shd_error *error);

/* An engine with other limits, another color configuration, other materials and other pictures of
 * the operator, all read again. It
 * has the workers, the queue and the kernel of the first engine, which outlives its requests.
 * Requests of both engines may run side by side; each keeps to its own engine, which outlives it.
 */
shd_status shd_engine_renew(const shd_engine *first, const shd_engine_options *options,
                            shd_engine **out, shd_error *error);

/* Finishes queued jobs first. No request may be left, of the engine or of one that renewed it. NULL
 * is fine. */
void shd_engine_drop(shd_engine *engine);

/* Runs run(context) on a worker, later. False: the queue is full, and nothing was queued. */
bool shd_engine_submit(shd_engine *engine, void (*run)(void *context), void *context);

/* To be called from a job: runs run(context) later, as the large rest of that job. Deferred work
 * takes turns with new jobs, and lets them pass between its tiles: small work does not wait for
 * large work. */
void shd_engine_defer(shd_engine *engine, void (*run)(void *context), void *context);

/* Calls step(context) on each worker with deferred work, between two of its tiles, whose own work
 * goes on when it returns. Once, before there is any. */
void shd_engine_between(shd_engine *engine, void (*step)(void *context), void *context);

/* Takes a waiting job back. False: it runs, or has run. */
bool shd_engine_withdraw(shd_engine *engine, const void *context);

/* To be called every so often: gives memory back that no request has asked for of late. */
void shd_engine_rest(shd_engine *engine);

typedef struct shd_load {
    size_t queued; /* jobs that wait */
    unsigned busy; /* workers that run a job */
    unsigned threads;
    uint64_t lent;      /* jobs that have run between the tiles of a deferred one */
    unsigned abandoned; /* threads of the process that encode for nobody any more */
    uint64_t tiles;     /* of 32 by 32 pixels that were made, */
    uint64_t unwanted;  /* and those whose request was cancelled meanwhile: one a thread at most */
} shd_load;

shd_load shd_engine_load(shd_engine *engine);

/* JSON texts of what there is, as the HTTP routes of the same names answer them. The caller frees
 * *json. */
typedef enum shd_topic {
    SHD_TOPIC_MATERIALS,
    SHD_TOPIC_SHAPES,
    SHD_TOPIC_COLORSPACES,
    SHD_TOPIC_VERSION
} shd_topic;

shd_status shd_engine_describe(const shd_engine *engine, shd_topic topic, char **json,
                               shd_error *error);

const char *shd_version(void); /* "0.1.0" */

/* Whether pictures of the format are made here. TIFF, EXR and HDR take OpenImageIO, whose module
 * need not be installed; without it, scenes that ask for them are refused. Any thread. */
bool shd_writes(shd_format format);

/* ---- A request: one scene document and its pictures. ---- */

/* SHD_EXHAUSTED if the system refuses memory. */
shd_status shd_request_new(shd_engine *engine, shd_request **out, shd_error *error);

/* Before it is read: it may take `bytes` bytes at most, if the limit `memory` is higher. */
void shd_request_hold(shd_request *request, uint64_t bytes);
void shd_request_drop(shd_request *request); /* NULL is fine */

/* Reads and checks the scene document. `fallback` is the format if the document names none. Returns
 * the report's status. Call it once. */
shd_status shd_request_read(shd_request *request, const char *json, size_t length,
                            shd_format fallback);

/* Reads and checks a mesh instead of a scene, and keeps it for later scenes. Their objects name it:
 * {"type": "mesh", "data": "sha256-..."} with the digest of these bytes, which the caller has made.
 * `binary`: the mesh is not JSON; scene/scene.h tells both forms. `client` is whose mesh it is:
 * things of the client that has most of the store are forgotten first. Returns the report's status,
 * SHD_LIMIT if the mesh does not fit into the store, or SHD_CANCELLED. `known`: the mesh was kept
 * already. */
shd_status shd_request_keep_mesh(shd_request *request, const void *data, size_t length, bool binary,
                                 const shd_digest *digest, const char *client, bool *known);

/* Decodes a file of a picture, and keeps it for later documents, which name it by "sha256-..." with
 * the digest of these bytes. PNG, JPEG and WebP are read and, where OpenImageIO is installed, TIFF,
 * OpenEXR and Radiance HDR; a process of its own does that, which needs shaded-decode to be
 * installed. Returns the report's status: SHD_SCENE if it is no such picture. Otherwise as
 * shd_request_keep_mesh. */
shd_status shd_request_keep_asset(shd_request *request, const void *data, size_t length,
                                  const shd_digest *digest, const char *client, bool *known);

/* What of a scene document is kept for links to it: its bytes without the blanks between tokens,
 * and *digest is the SHA-256 of that. `json` is what was read. The text lives as long as the
 * request. SHD_MEMORY. */
shd_status shd_request_condense(shd_request *request, const char *json, size_t length,
                                const char **text, size_t *size, shd_digest *digest,
                                shd_error *error);

/* After a successful read: what links to the scene's picture end in, "png", "jpg" or "webp".
 * SHD_SCENE: it has several pictures, or one that no link shows. */
shd_status shd_request_suffix(const shd_request *request, const char **suffix, shd_error *error);

/* After a successful read: the path of the link that holds the scene, which the caller frees.
 * `json` is what was read. SHD_SCENE as above; SHD_EXHAUSTED. */
shd_status shd_request_link(const shd_request *request, const char *json, size_t length,
                            char **path, shd_error *error);

/* A document that is kept, which lives until it is dropped. NULL: none is, by that digest. If one
 * is, it becomes the last to be forgotten. */
typedef struct shd_stored shd_kept_scene;
shd_kept_scene *shd_engine_find_scene(shd_engine *engine, const shd_digest *digest,
                                      const char **json, size_t *length);

/* A scene that is not kept yet: the caller fills its `length` bytes at *text, keeps it, and drops
 * it. SHD_CROWDED or SHD_EXHAUSTED. */
shd_status shd_engine_new_scene(shd_engine *engine, const shd_digest *digest, size_t length,
                                shd_kept_scene **out, char **text, shd_error *error);

/* Keeps it beside the meshes, for links to it; `client` as above. SHD_LIMIT if it does not fit into
 * the store; SHD_EXHAUSTED. `known`: one was kept already by its digest, and stays. */
shd_status shd_engine_keep_scene(shd_engine *engine, shd_kept_scene *scene, const char *client,
                                 bool *known, shd_error *error);
void shd_kept_scene_drop(shd_kept_scene *scene); /* before the engine; NULL is fine */

/* A scene and its variants: {"scene": {...}, "variants": [...]}, merge patches (RFC 7396), or
 * {"scene": {...}, "sweep": {...}}, lists of values by JSON Pointer (RFC 6901), of which all
 * combinations are taken, the last list going on fastest; or {"scene": {...}} alone. */
typedef struct shd_variants shd_batch;

/* Whether a text, which need not be sound, is a batch and no scene. */
bool shd_batch_is(const char *json, size_t length);

/* Reads a batch instead of a scene. `json` stays where it is until the batch is dropped, which the
 * caller does. What is wrong with a single variant is found when it is read. Returns the report's
 * status. */
shd_status shd_request_read_batch(shd_request *request, const char *json, size_t length,
                                  shd_batch **out);
void shd_batch_drop(shd_batch *batch); /* NULL is fine */

size_t shd_batch_count(const shd_batch *batch);     /* variants: 1 to 10,000 */
const char *shd_batch_name(const shd_batch *batch); /* its member `name`, or "" */
size_t shd_batch_size(const shd_batch *batch);      /* bytes of the scene that they vary */

/* The scene document of a variant, which the caller frees; any thread. `request` is the one that
 * reads it next, whose cancelling ends this, or NULL. SHD_SCENE: a pointer of the sweep leads
 * nowhere in it; SHD_EXHAUSTED, SHD_CANCELLED. */
shd_status shd_batch_document(const shd_batch *batch, size_t index, const shd_request *request,
                              char **json, size_t *length, shd_error *error);

/* Whether the batch asks for one picture of all variants: a sheet, or a turntable. */
bool shd_batch_is_one(const shd_batch *batch);

/* After shd_request_read_batch, of a batch that asks for one picture: reads each variant, and makes
 * that picture what the request renders. The batch is the request's from then on, whatever comes of
 * it. Returns the report's status. */
shd_status shd_request_read_one(shd_request *request, shd_batch *batch, shd_format fallback);

/* Errors and warnings so far; never NULL. */
const shd_report *shd_request_report(const shd_request *request);

/* After a successful read: a strong entity tag without its quotes, which is a hash of the document,
 * the formats, the color configuration and the version; and whether the answer is multipart. */
const char *shd_request_etag(const shd_request *request);
bool shd_request_multipart(const shd_request *request);

/* After a successful read: how much there is to compute, right to a factor of a few. One unit is
 * about one light on one sample in single precision. */
uint64_t shd_request_work(const shd_request *request);

/* The part of it that a plan alone takes; 0 without a scene. */
uint64_t shd_request_planning_work(const shd_request *request);

/* After a successful read: bytes that its pictures take at least. */
uint64_t shd_request_needs(const shd_request *request);

/* After a successful read: the format of picture `index`, as the document or `fallback` has it.
 * A document without `outputs` has one picture. */
shd_format shd_request_format(const shd_request *request, size_t index);

typedef struct shd_render_options {
    /* Called every so often on the thread that called shd_request_render, with the share of tiles
     * that are done, in [0,1]. May be NULL. */
    void (*progress)(void *context, double share);
    void *context;
} shd_render_options;

/* Renders and encodes. Call it once, after a successful read. `options` may be NULL. SHD_SCENE: no
 * tier meets the scene's budget. SHD_LIMIT or SHD_MEMORY: the limit `memory` is reached.
 * SHD_CROWDED: the budget has too little left just now. Also SHD_EXHAUSTED, SHD_CANCELLED and
 * SHD_INTERNAL. */
shd_status shd_request_render(shd_request *request, const shd_render_options *options,
                              shd_error *error);

/* Renders the scene in every tier, whatever its own `accuracy` is. Tells as JSON what each tier
 * cost and how far it is from the exact one, as the HTTP route of the same name answers it. Only
 * the first output counts, without its layers, and nothing is encoded. Call it once, after a
 * successful read, instead of shd_request_render; the caller frees *json. The pictures of two tiers
 * are kept at once, within the limit `memory`. `options` may be NULL. */
shd_status shd_request_compare(shd_request *request, const shd_render_options *options, char **json,
                               shd_error *error);

/* Renders the scene and tells as JSON what each of its outputs displays: extremes, means,
 * percentiles and histograms of its channels, in HSV, YIQ and CIELAB, and what is clipped, as the
 * HTTP route of the same name answers it. Layers are left out and nothing is encoded. Otherwise as
 * shd_request_compare. */
shd_status shd_request_analyze(shd_request *request, const shd_render_options *options, char **json,
                               shd_error *error);

/* Holds the picture in a file against the scene. Random pixels of it must lie within what the exact
 * tier's picture, the bounds of both, rounding and the codec admit; the exact tier renders all of
 * it. Of several outputs it is the first one of `format`. *json tells which pixels fail, up to 64
 * samples. Otherwise as shd_request_compare. SHD_SCENE: also if the file cannot be read, or has
 * another form than the scene asks for. */
typedef struct shd_verify_options {
    size_t pixels; /* how many; no more than there are */
    uint64_t seed;
    double tolerance; /* what a lossy format may lose, in codes. Negative: it is measured */
} shd_verify_options;

/* SHD_UNDECIDED: none of the pixels has a bound, so that nothing could be held against it. */
typedef enum shd_verdict { SHD_VERIFIED, SHD_REFUTED, SHD_UNDECIDED } shd_verdict;

shd_status shd_request_verify(shd_request *request, const char *path, shd_format format,
                              const shd_verify_options *options,
                              const shd_render_options *render_options, shd_verdict *verdict,
                              char **json, shd_error *error);

/* How far apart two pictures are, for an eye that sees them side by side, and in turns. */
typedef struct shd_apart {
    double mean, p50, p95, p99, max; /* percentiles of the nearest rank */
    int x, y;                        /* where the most is, first of several in rows */
} shd_apart;

typedef struct shd_diff {
    int width, height;
    uint64_t pixels;   /* that have another color or alpha */
    double alpha;      /* the most that alphas differ, in [0,1] */
    shd_apart delta_e; /* CIEDE2000 */
    shd_apart flip;    /* LDR-FLIP, in [0,1] */
} shd_diff;

/* Makes a picture the request's instead of a scene: that of a file. Its samples, of 8 or 16 bits,
 * are taken for sRGB, over black. SHD_SCENE: it cannot be read, or has other samples. SHD_LIMIT,
 * SHD_MEMORY. */
shd_status shd_request_read_picture(shd_request *request, const char *path, shd_format format,
                                    shd_error *error);

/* Makes the picture of a scene that was read, as the codes of its output have it before any codec,
 * over black. Call it before shd_request_diff, once; a picture is there already. SHD_SCENE: the
 * output shows no color. Otherwise as shd_request_compare. */
shd_status shd_request_show(shd_request *request, const shd_render_options *options,
                            shd_error *error);

typedef struct shd_diff_options {
    double density; /* pixels a degree of sight, 10 to 400; 0: 67 */
    bool map;       /* *map is made, a PNG of FLIP's errors; it must not be NULL */
} shd_diff_options;

/* Compares the pictures of two requests. *json tells what *out has; the caller frees it
 * and the map. Memory is of `a`, whose cancelling ends it.
 * SHD_SCENE: the sizes differ. */
shd_status shd_request_diff(shd_request *a, const shd_request *b, const shd_diff_options *options,
                            shd_diff *out, char **json, unsigned char **map, size_t *map_size,
                            shd_error *error);

/* Reads two scenes instead of one: {"a": {...}, "b": {...}, "pixelsPerDegree": 67}, or pictures
 * that are kept or have a name: {"a": "sha256-...", ...}. Each may take half of the limit `memory`.
 * Returns the report's status. */
shd_status shd_request_read_pair(shd_request *request, const char *json, size_t length);

/* After that: compares their pictures, and tells how far they are apart, as JSON or as the map. */
shd_status shd_request_diff_pair(shd_request *request, bool map, unsigned char **data, size_t *size,
                                 shd_error *error);

/* Finds the coefficients of an object's material from a photo: of Phong's model, Blinn's or the
 * normalized one, as the scene has it. Geometry, camera, lights and the output, whose colors are
 * undone, are the scene's. `object`: a name, or a number from 0 on; NULL: all objects, which then
 * share one material. *json tells the coefficients with their covariance, and which of them this
 * light does not tell; the caller frees it. It renders 12 to 18 times. Call it once, after a
 * successful read with the photo's format. SHD_SCENE at "/object": it is not there, or not seen, or
 * has another model. At "": the photo cannot be read, is of another size, or has no pixel that
 * tells anything. Otherwise as shd_request_compare. */
shd_status shd_request_fit(shd_request *request, const char *path, shd_format format,
                           const char *object, const shd_render_options *options, char **json,
                           shd_error *error);

/* Reads a scene and the name of its photo, which is kept or the operator's: {"scene": {...},
 * "photo": "sha256-...", "object": "ball"}. Returns the report's status. */
shd_status shd_request_read_fit(shd_request *request, const char *json, size_t length);

/* After that: as shd_request_fit. What is wrong with the photo is told at "/photo", and the rest at
 * "/object" or within "/scene". */
shd_status shd_request_fit_kept(shd_request *request, char **json, shd_error *error);

/* Plans the scene and tells the plan, without rendering anything: what is used, what is left out
 * and why, upper bounds of the picture's error, and an estimate of what it costs. The text is JSON,
 * as the HTTP route of the same name answers it, or words, a sentence a line. Call it once, after a
 * successful read, instead of shd_request_render; the caller frees *text. */
typedef enum shd_telling { SHD_IN_JSON, SHD_IN_WORDS } shd_telling;

shd_status shd_request_explain(shd_request *request, shd_telling telling, char **text,
                               shd_error *error);

/* Tells what the materials of the scene's objects are as functions f_r(L, V): their values, albedo,
 * reciprocity, and a verdict, as JSON; or the figure of the first six of them, as SVG or PNG.
 * Nothing is rendered. Call it once, after a successful read, instead of shd_request_render; the
 * caller frees *data. */
typedef enum shd_brdf_form { SHD_BRDF_JSON, SHD_BRDF_SVG, SHD_BRDF_PNG } shd_brdf_form;

shd_status shd_request_brdf(shd_request *request, shd_brdf_form form, unsigned char **data,
                            size_t *size, shd_error *error);

/* Makes all work for the request, present or later, end with SHD_CANCELLED, within some millions of
 * instructions and the libraries' calls (docs/deadlines.md). Any thread. */
void shd_request_cancel(shd_request *request);
bool shd_request_is_cancelled(const shd_request *request);

typedef struct shd_picture {
    const char *name; /* of the entry of `outputs`; NULL if the document has one `output` */
    shd_format format;
    unsigned char *data;
    size_t size;
    bool animated; /* several frames, of a turntable: in PNG, what is called APNG */
} shd_picture;

/* After a successful render. The bytes live as long as the request. */
const shd_picture *shd_request_pictures(const shd_request *request, size_t *count);

/* Gives the bytes of picture `index` to the caller, who frees them and then gives as many bytes as
 * the picture's size to the budget. The picture is empty then. */
unsigned char *shd_request_take(shd_request *request, size_t index);

/* Seconds by stage, summed over the threads that worked on it. They are processor time. In tiles
 * (visibility, shade, shadow, trace, and color if it goes straight to samples) they are wall time.
 * `build` is what makes objects ready for rays, if trees over triangles are built for it; else it
 * is 0, and visibility has that. `shadow` is what finds how much of each light arrives: rays to
 * lights, and proofs that none is needed. `trace` is what follows from mirrors and glass: their
 * rays, and the light on what these meet, with its shadows. */
typedef struct shd_times {
    double parse, plan, build, visibility, shade, shadow, trace, color, encode;
} shd_times;

const shd_times *shd_request_times(const shd_request *request);

/* After a successful render: what was known of the picture from earlier ones. */
typedef enum shd_reused {
    SHD_REUSED_NOTHING,
    SHD_REUSED_GEOMETRY, /* what rays hit: no ray was cast, or only those of new samples */
    SHD_REUSED_LIGHT     /* what light falls there: only colors were left to do */
} shd_reused;

shd_reused shd_request_reused(const shd_request *request);

/* What the engine has kept for later pictures since it was made. */
typedef struct shd_reuse_load {
    size_t bytes, cap;
    uint64_t light_hits, light_misses, geometry_hits, geometry_misses;
} shd_reuse_load;

shd_reuse_load shd_engine_reuse(shd_engine *engine);

/* Whether a mesh is kept. If so, it becomes the last to be forgotten. */
bool shd_engine_has_mesh(shd_engine *engine, const shd_digest *digest);

/* The same of a picture. */
bool shd_engine_has_asset(shd_engine *engine, const shd_digest *digest);

typedef struct shd_mesh_load {
    size_t cap, bytes, meshes; /* what is kept */
    size_t held;               /* bytes of meshes that were forgotten while pictures need them */
    uint64_t hits, misses, evictions;
} shd_mesh_load;

shd_mesh_load shd_engine_meshes(shd_engine *engine);

/* After a successful render: the plan in a line, for the Shaded-Plan header. */
const char *shd_request_plan(const shd_request *request);

/* After a successful render: what lossy formats lost under a budget, for the Shaded-Codec header;
 * NULL: there was no budget, or no lossy format. */
const char *shd_request_codec(const shd_request *request);

/* Whether shaded-decode ran for it without the kernel's filter of the system calls that it may use:
 * files of strangers are decoded all the same. */
bool shd_request_was_loose(const shd_request *request);

/* The most bytes that the request's arena has held so far, which the limit `memory` bounds. */
size_t shd_request_memory(const shd_request *request);

/* Samples that were saturated because they were not finite or beyond the output's range. */
uint64_t shd_request_saturated(const shd_request *request);

/* Color samples of integer pictures whose nearest code would be beyond the sample's range. */
uint64_t shd_request_clipped(const shd_request *request);

/* Mirrored, refracted and straight rays that were followed beyond the eye's. *cut: the most that
 * was left out of a sample, as a factor of the radiance that such rays would have met. */
uint64_t shd_request_rays(const shd_request *request, double *cut);

/* How far linear components of the picture are off at most, by the paths that these rays took: the
 * plan's bound is of all paths. Samples with a path that meets a silhouette, or the edge of total
 * reflection, to within what it is off by are not counted: *edges is their number. 0: there were no
 * such rays. Infinite: it is not known. */
double shd_request_ray_error(const shd_request *request, uint64_t *edges);

#endif
