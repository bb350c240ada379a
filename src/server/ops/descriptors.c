#include "descriptors.h"

#include <errno.h>
#include <string.h>
#include <sys/resource.h>

shd_status shd_descriptors_claim(uint64_t wanted, uint64_t *connections, shd_error *error) {
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit))
        return shd_fail(error, SHD_EXHAUSTED, "", "the limit of open files: %s", strerror(errno));
    const rlim_t needed = wanted + SHD_RESERVED;
    const rlim_t may_be = limit.rlim_max < needed ? limit.rlim_max : needed;
    if (limit.rlim_cur < may_be) {
        limit.rlim_cur = may_be;
        if (setrlimit(RLIMIT_NOFILE, &limit))
            return shd_fail(error, SHD_EXHAUSTED, "", "the limit of open files: %s",
                            strerror(errno));
    }
    if (limit.rlim_cur <= SHD_RESERVED)
        return shd_fail(error, SHD_CONFIG, "",
                        "the limit of open files is %llu: more than %d are needed",
                        (unsigned long long)limit.rlim_cur, SHD_RESERVED);
    *connections = limit.rlim_cur < needed ? limit.rlim_cur - SHD_RESERVED : wanted;
    return SHD_OK;
}
