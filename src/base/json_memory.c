#include "base/json_memory.h"

#include <jansson.h>
#include <pthread.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

static _Thread_local bool is_short;

/* The block that jansson allocates in, and the part that is left. NULL: there is none. */
static _Thread_local char *block_begin, *block_at, *block_end;

static void *allocate_in_block(size_t size) {
    enum { ALIGNMENT = _Alignof(max_align_t) };
    const size_t left = (size_t)(block_end - block_at);
    if (size > left || ALIGNMENT - 1 > left - size) return NULL;
    char *memory = block_at;
    block_at += (size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    return memory;
}

static void *allocate_json(size_t size) {
    if (block_begin) return allocate_in_block(size);
    void *memory = malloc(size);
    if (!memory) is_short = true;
    return memory;
}

static void free_json(void *memory) {
    const uintptr_t at = (uintptr_t)memory;
    if (!(at >= (uintptr_t)block_begin && at < (uintptr_t)block_end)) free(memory);
}

static void set_functions(void) {
    json_set_alloc_funcs(allocate_json, free_json);
}

void shd_json_memory_watch(void) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, set_functions);
    is_short = false;
}

bool shd_json_memory_short(void) {
    return is_short;
}

void shd_json_memory_enter(void *block, size_t size) {
    block_begin = block_at = block;
    block_end = block_begin + size;
}

void shd_json_memory_leave(void) {
    block_begin = block_at = block_end = NULL;
}
