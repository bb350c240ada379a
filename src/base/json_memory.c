#include "base/json_memory.h"

#include <jansson.h>
#include <pthread.h>
#include <stdlib.h>

static _Thread_local bool is_short;

static void *allocate_json(size_t size) {
    void *memory = malloc(size);
    if (!memory) is_short = true;
    return memory;
}

static void set_functions(void) {
    json_set_alloc_funcs(allocate_json, free);
}

void shd_json_memory_watch(void) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, set_functions);
    is_short = false;
}

bool shd_json_memory_short(void) {
    return is_short;
}
