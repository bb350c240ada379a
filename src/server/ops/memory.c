#include "memory.h"

#include <malloc.h>

#include "log.h"
#include "server/server.h"

/* What the program takes beside what is kept, which is counted where it is mapped: with --reuse 0
 * 13 MB resident once it listens (docs/footprint.md) and 15 once it has made pictures, of which 11
 * are files; and what a thread's stack and small allocations come to. */
enum { PROGRAM = 20 << 20, THREAD = 512 << 10 };

enum { LEAST = 16 << 20 }; /* below, a picture of 512 x 512 pixels has no room */

void shd_memory_begin(void) {
    /* A threshold that is set stays: else it rises with each large block that is freed, up to 32
     * MB, and all below stays in heaps. */
    mallopt(M_MMAP_THRESHOLD, 256 << 10);
    mallopt(M_TRIM_THRESHOLD, 1 << 20);
    mallopt(M_ARENA_MAX, 2);
}

shd_status shd_memory_open(const shd_machine *machine, const shd_config *config, shd_budget **out,
                           shd_error *error) {
    const uint64_t size = config->budget ? config->budget : machine->memory / 4 * 3;
    const uint64_t threads = config->threads ? config->threads : shd_machine_threads(machine);
    const size_t fixed = PROGRAM + (size_t)threads * THREAD;
    if (size < fixed + LEAST)
        return shd_fail(error, SHD_CONFIG, "memory",
                        "%llu bytes are too few: the program takes %zu of them, and pictures want "
                        "%d at least",
                        (unsigned long long)size, fixed, LEAST);
    shd_budget *budget = shd_budget_new(size);
    if (!budget) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    shd_budget_fix(budget, fixed);
    *out = budget;
    return SHD_OK;
}

static void hold_below(uint64_t *value, uint64_t most) {
    if (*value > most) *value = most;
}

void shd_memory_clip(shd_config *config, shd_budget *budget) {
    const uint64_t most = shd_budget_most(budget), connections = most / 4 / SHD_CONNECTION_MEMORY;
    hold_below(&config->limits.memory, most);
    hold_below(&config->reuse, most / 4);
    hold_below(&config->mesh_store, most / 4);
    hold_below(&config->response_cache, most / 8);
    hold_below(&config->connections, connections);
}

static size_t give_answers(void *reaper, size_t bytes) {
    return shd_reaper_drop_answers(reaper, bytes);
}

static size_t give_pictures(void *cache, size_t bytes) {
    return shd_cache_trim(cache, bytes);
}

void shd_memory_connect(shd_server *server) {
    shd_budget_yield(server->budget, SHD_RANK_ANSWERS, give_answers, server->reaper);
    shd_budget_yield(server->budget, SHD_RANK_PICTURES, give_pictures, server->cache);
}

void shd_memory_log(const shd_server *server) {
    const shd_budget_load load = shd_budget_load_of(server->budget);
    const shd_config *config = &server->config;
    shd_log line;
    shd_log_begin(&line, SHD_LOG_INFO, "memory");
    shd_log_whole(&line, "budget", load.cap);
    shd_log_whole(&line, "program", load.fixed);
    shd_log_whole(&line, "request", config->limits.memory);
    shd_log_whole(&line, "reuse", config->reuse);
    shd_log_whole(&line, "mesh-store", config->mesh_store);
    shd_log_whole(&line, "response-cache", config->response_cache);
    shd_log_whole(&line, "connections", config->connections * SHD_CONNECTION_MEMORY);
    shd_log_end(&line);
}

uint64_t shd_memory_beside(const shd_server *server, size_t body_bytes) {
    const uint64_t most = shd_budget_most(server->budget),
                   held = body_bytes + SHD_CONNECTION_MEMORY;
    return most > held ? most - held : 0;
}

void shd_memory_return_body(shd_server *server, size_t bytes) {
    atomic_fetch_sub(&server->body_bytes, bytes);
    shd_budget_give(server->budget, bytes);
}

void shd_memory_rest(shd_server *server) {
    shd_engine_rest(server->engine);
    /* Between requests nobody waits for malloc's locks. */
    if (!atomic_load(&server->in_flight) && atomic_exchange(&server->worked, false)) malloc_trim(0);
}
