#include "descriptors.h"

#include <errno.h>
#include <stdbool.h>
#include <string.h>
#include <sys/resource.h>

shd_status shd_descriptors_claim(uint64_t wanted, uint64_t *connections, shd_error *error) {
    const rlim_t needed = wanted + SHD_RESERVED;
    struct rlimit limit;
    bool is_told = !getrlimit(RLIMIT_NOFILE, &limit);
    if (is_told && limit.rlim_cur < needed) {
        limit.rlim_cur = limit.rlim_max < needed ? limit.rlim_max : needed;
        is_told = !setrlimit(RLIMIT_NOFILE, &limit);
    }
    if (!is_told)
        return shd_fail(error, SHD_EXHAUSTED, "", "the limit of open files: %s", strerror(errno));
    if (limit.rlim_cur <= SHD_RESERVED)
        return shd_fail(error, SHD_CONFIG, "",
                        "the limit of open files is %llu: more than %d are needed",
                        (unsigned long long)limit.rlim_cur, SHD_RESERVED);
    *connections = limit.rlim_cur < needed ? limit.rlim_cur - SHD_RESERVED : wanted;
    return SHD_OK;
}
