#include "process.h"

#include <assert.h>
#include <dirent.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

/* Of /proc/self/stat (proc(5)): times in ticks, memory in bytes and pages. */
typedef struct state {
    uint64_t user, kernel, threads, start, virtual_bytes, resident;
} state;

static bool read_state(state *out) {
    char text[1024];
    FILE *file = fopen("/proc/self/stat", "re");
    if (!file) return false;
    size_t length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[length] = 0;
    const char *rest = strrchr(text, ')'); /* of the name, which may hold anything */
    return rest && sscanf(rest + 1,
                          " %*c %*d %*d %*d %*d %*d %*u %*u %*u %*u %*u %" SCNu64 " %" SCNu64
                          " %*d %*d %*d %*d %" SCNu64 " %*d %" SCNu64 " %" SCNu64 " %" SCNu64,
                          &out->user, &out->kernel, &out->threads, &out->start, &out->virtual_bytes,
                          &out->resident) == 6;
}

static uint64_t milliseconds_of(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (uint64_t)now.tv_sec * 1000 + (uint64_t)now.tv_nsec / 1000000;
}

/* Open descriptors, without that of the folder which tells them; 0: the system refuses to. */
static uint64_t count_descriptors(void) {
    DIR *folder = opendir("/proc/self/fd");
    uint64_t count = 0;
    if (!folder) return 0;
    for (const struct dirent *entry; (entry = readdir(folder));) count += entry->d_name[0] != '.';
    closedir(folder);
    return count ? count - 1 : 0;
}

size_t shd_process_metrics(shd_metric out[SHD_PROCESS_METRICS]) {
    const uint64_t tick = (uint64_t)sysconf(_SC_CLK_TCK), page = (uint64_t)sysconf(_SC_PAGESIZE),
                   descriptors = count_descriptors();
    struct rlimit limit;
    state now;
    size_t count = 0;
    if (read_state(&now)) {
        /* The start is told since the machine's. */
        const uint64_t machine = milliseconds_of(CLOCK_REALTIME) - milliseconds_of(CLOCK_BOOTTIME);
        const shd_metric told[] = {
            {"cpu_seconds_total", "", "Processor time of all threads.",
             (now.user + now.kernel) * 1000 / tick},
            {"resident_memory_bytes", "", "Memory in use.", now.resident * page},
            {"virtual_memory_bytes", "", "Addresses in use.", now.virtual_bytes},
            {"threads", "", "Threads.", now.threads},
            {"start_time_seconds", "", "When it started, since 1970.",
             machine + now.start * 1000 / tick}};
        memcpy(out, told, sizeof told);
        count = sizeof told / sizeof told[0];
    }
    if (descriptors)
        out[count++] = (shd_metric){"open_fds", "", "Descriptors in use.", descriptors};
    if (!getrlimit(RLIMIT_NOFILE, &limit) && limit.rlim_cur != RLIM_INFINITY)
        out[count++] =
            (shd_metric){"max_fds", "", "Descriptors that may be in use.", limit.rlim_cur};
    assert(count <= SHD_PROCESS_METRICS);
    return count;
}
