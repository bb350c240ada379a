#include "render/engine.h"

#include <stdlib.h>
#include <string.h>

#include "assets/folder.h"
#include "assets/store.h"
#include "base/machine.h"
#include "color/file.h"
#include "image/image.h"
#include "render/glow_tables.h"
#include "render/tiles/reuse.h"
#include "render/westin_tables.h"

/* Bytes that are kept between requests for each thread: a picture of 1920 x 1080 fits. And those
 * that are kept even if nobody asks for them for long: a picture of 512 x 512. */
enum { SPARE_BYTES = 64 << 20, REST_BYTES = 8 << 20 };

/* Tables of some 15 microgeometries. */
enum { TABLE_BYTES = 32 << 20 };

enum { MATERIAL_BYTES = 16 << 20 }; /* the longest file of materials */

const char *shd_version(void) {
    return SHADED_VERSION;
}

shd_engine_options shd_engine_defaults(void) {
    return (shd_engine_options){
        .queue = 64,
        .reuse = (size_t)256 << 20,
        .mesh_store = (size_t)256 << 20,
        .limits = {.pixels = 1u << 24,
                   .samples = 1u << 28,
                   .lights = 10000,
                   .objects = 10000,
                   .triangles = 4000000,
                   .light_samples = UINT64_C(1) << 36,
                   .object_lights = 1u << 24,
                   .work = 300,
                   .body = 32u << 20,
                   .memory = 1u << 30},
    };
}

static size_t give_spares(void *spares, size_t bytes) {
    return shd_spares_trim(spares, bytes);
}

static size_t give_meshes(void *store, size_t bytes) {
    const size_t kept = shd_store_load_of(store).bytes;
    return shd_store_shrink(store, kept > bytes ? kept - bytes : 0);
}

/* First what is made in less time: of colors, then of environments. */
static size_t give_tables(void *context, size_t bytes) {
    const shd_engine *engine = context;
    size_t given = shd_color_trim(engine->color, bytes);
    if (given < bytes) given += give_meshes(engine->glows, bytes - given);
    return given < bytes ? given + shd_westin_tables_trim(engine->westin, bytes - given) : given;
}

void shd_engine_rest(shd_engine *engine) {
    shd_spares_rest(engine->spares, (shd_pool_slots(engine->pool) - 1) * (size_t)REST_BYTES);
}

static size_t spare_bytes(const shd_engine_options *options, unsigned threads) {
    const uint64_t all = (uint64_t)threads * SPARE_BYTES,
                   share = shd_budget_most(options->budget) / 8, most = all < share ? all : share;
    return most < options->limits.memory ? most : options->limits.memory;
}

static shd_status add_materials(shd_engine *engine, const char *path, shd_error *error) {
    char *text = NULL;
    size_t length = 0;
    shd_status status = shd_color_read_file(path, MATERIAL_BYTES, &text, &length, error);
    if (status == SHD_OK)
        status = shd_library_add(engine->library, path, text, length,
                                 shd_color_catalog(engine->color), error);
    free(text);
    return status;
}

static const shd_library *find_library(const shd_catalog *catalog) {
    /* The catalog is a member of an engine, which alone changes. */
    shd_engine *engine =
        (shd_engine *)(void *)((char *)(uintptr_t)catalog - offsetof(shd_engine, catalog));
    shd_error error;
    pthread_mutex_lock(&engine->reading);
    if (!engine->library) shd_library_new(&engine->catalog, &engine->library, &error);
    const shd_library *library = engine->library;
    pthread_mutex_unlock(&engine->reading);
    return library;
}

const shd_library *shd_engine_library(const shd_engine *engine) {
    return find_library(&engine->catalog);
}

/* What is built in is read when somebody asks for it, and files of operators now. */
static shd_status load_materials(shd_engine *engine, const char *paths, shd_error *error) {
    engine->catalog = *shd_color_catalog(engine->color);
    engine->catalog.library = find_library;
    if (!paths || !*paths) return SHD_OK;
    shd_status status = shd_library_new(&engine->catalog, &engine->library, error);
    char *list = strdup(paths), *rest = list;
    if (!list) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    for (char *path; status == SHD_OK && (path = strsep(&rest, " "));)
        if (*path) status = add_materials(engine, path, error);
    free(list);
    return status;
}

static shd_status load_colors(shd_engine *engine, const char *path, const shd_engine *first,
                              shd_error *error) {
    const shd_status status = shd_color_config_load(path, &engine->color, error);
    return status != SHD_OK ? status
                            : shd_color_config_join(engine->color, engine->budget,
                                                    first ? first->color : NULL, error);
}

static shd_status open_assets(const shd_engine_options *options, shd_engine *engine,
                              shd_error *error) {
    if (!options->assets || !*options->assets) return SHD_OK;
    return shd_asset_folder_open(options->assets, &engine->assets, error);
}

shd_status shd_engine_new(const shd_engine_options *options, shd_engine **out, shd_error *error) {
    unsigned threads = options->threads;
    if (!threads) {
        const shd_machine machine = shd_machine_look("");
        threads = shd_machine_threads(&machine);
    }
    shd_isa isa;
    if (!shd_isa_find(options->kernel ? options->kernel : "auto", &isa))
        return shd_fail(error, SHD_CONFIG, "", "this machine has no kernel '%.64s'",
                        options->kernel);
    shd_engine *engine = calloc(1, sizeof *engine);
    if (!engine) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    *engine = (shd_engine){
        .limits = options->limits,
        .tiles = calloc(2, sizeof *engine->tiles),
        .isa = isa,
        .scenes_elsewhere = options->scenes_elsewhere,
        .budget = options->budget,
        .spares = shd_spares_new(spare_bytes(options, threads), options->budget),
    };
    pthread_mutex_init(&engine->reading, NULL);
    shd_status status = engine->spares && engine->tiles
                            ? load_colors(engine, options->ocio_config, NULL, error)
                            : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (status == SHD_OK) status = load_materials(engine, options->materials, error);
    if (status == SHD_OK) status = open_assets(options, engine, error);
    if (status == SHD_OK)
        status = shd_reuse_new(options->reuse, options->budget, &engine->reuse, error);
    if (status == SHD_OK)
        status = shd_store_new(options->mesh_store, options->budget, &engine->store, error);
    if (status == SHD_OK)
        status = shd_westin_tables_new(TABLE_BYTES, options->budget, &engine->westin, error);
    if (status == SHD_OK)
        status = shd_store_new(SHD_GLOW_BYTES, options->budget, &engine->glows, error);
    if (status == SHD_OK) status = shd_pool_new(threads, options->queue, &engine->pool, error);
    if (status != SHD_OK) {
        shd_engine_drop(engine);
        return status;
    }
    shd_budget_yield(engine->budget, SHD_RANK_SPARE, give_spares, engine->spares);
    shd_budget_yield(engine->budget, SHD_RANK_RECORDS, shd_reuse_trim, engine->reuse);
    shd_budget_yield(engine->budget, SHD_RANK_TABLES, give_tables, engine);
    shd_budget_yield(engine->budget, SHD_RANK_MESHES, give_meshes, engine->store);
    if (options->reuse) shd_pool_when_idle(engine->pool, shd_reuse_touch, engine->reuse);
    *out = engine;
    return SHD_OK;
}

shd_status shd_engine_renew(const shd_engine *first, const shd_engine_options *options,
                            shd_engine **out, shd_error *error) {
    shd_engine *engine = calloc(1, sizeof *engine);
    if (!engine) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    *engine = *first;
    engine->borrows = true;
    engine->limits = options->limits;
    engine->color = NULL;
    engine->library = NULL;
    engine->assets = NULL;
    pthread_mutex_init(&engine->reading, NULL);
    shd_status status = load_colors(engine, options->ocio_config, first, error);
    if (status == SHD_OK) status = load_materials(engine, options->materials, error);
    if (status == SHD_OK) status = open_assets(options, engine, error);
    if (status == SHD_OK)
        *out = engine;
    else
        shd_engine_drop(engine);
    return status;
}

void shd_engine_drop(shd_engine *engine) {
    if (!engine) return;
    if (!engine->borrows) {
        shd_pool_drop(engine->pool);
        shd_reuse_drop(engine->reuse);
        shd_store_drop(engine->store);
        shd_westin_tables_drop(engine->westin);
        shd_store_drop(engine->glows);
        shd_spares_drop(engine->spares);
        free(engine->tiles);
    }
    shd_asset_folder_drop(engine->assets);
    shd_library_drop(engine->library);
    pthread_mutex_destroy(&engine->reading);
    shd_color_config_drop(engine->color);
    free(engine);
}

bool shd_engine_submit(shd_engine *engine, void (*run)(void *context), void *context) {
    return shd_pool_submit(engine->pool, run, context);
}

void shd_engine_defer(shd_engine *engine, void (*run)(void *context), void *context) {
    shd_pool_defer(engine->pool, run, context);
}

void shd_engine_between(shd_engine *engine, void (*step)(void *context), void *context) {
    shd_pool_between(engine->pool, step, context);
}

bool shd_engine_withdraw(shd_engine *engine, const void *context) {
    return shd_pool_withdraw(engine->pool, context);
}

shd_load shd_engine_load(shd_engine *engine) {
    const shd_pool_load load = shd_pool_load_of(engine->pool);
    return (shd_load){load.queued,
                      load.busy,
                      shd_pool_slots(engine->pool) - 1,
                      load.lent,
                      shd_image_abandoned(),
                      atomic_load(&engine->tiles[0]),
                      atomic_load(&engine->tiles[1])};
}

shd_reuse_load shd_engine_reuse(shd_engine *engine) {
    return shd_reuse_load_of(engine->reuse);
}
