#include "render/request.h"

shd_status shd_request_room_for(const shd_request *request, const char *what, uint64_t bytes,
                                shd_error *error) {
    const uint64_t limit = request->limits.memory,
                   used = shd_arena_used(request->rendering.arena) + request->held_bytes;
    if (used <= limit && bytes <= limit - used) return SHD_OK;
    shd_fail(error, SHD_LIMIT, "", "the %s takes %llu bytes; the limit `memory` is %llu", what,
             (unsigned long long)bytes, (unsigned long long)limit);
    return shd_fail_limit(error, SHD_LIMIT_MEMORY);
}
