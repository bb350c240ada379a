#include "process.h"

#include <dirent.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

static void print_head(FILE *out, const char *name, const char *type, const char *help) {
    fprintf(out, "# HELP process_%s %s\n# TYPE process_%s %s\n", name, help, name, type);
}

static void print_whole(FILE *out, const char *name, const char *type, const char *help,
                        uint64_t value) {
    print_head(out, name, type, help);
    fprintf(out, "process_%s %" PRIu64 "\n", name, value);
}

/* Whole and fraction apart: %f would follow the locale. */
static void print_seconds(FILE *out, const char *name, const char *type, const char *help,
                          uint64_t milliseconds) {
    print_head(out, name, type, help);
    fprintf(out, "process_%s %" PRIu64 ".%03u\n", name, milliseconds / 1000,
            (unsigned)(milliseconds % 1000));
}

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

void shd_process_print(FILE *out) {
    const uint64_t tick = (uint64_t)sysconf(_SC_CLK_TCK), page = (uint64_t)sysconf(_SC_PAGESIZE);
    uint64_t descriptors = count_descriptors();
    struct rlimit limit;
    state now;
    if (read_state(&now)) {
        /* The start is told since the machine's. */
        uint64_t machine = milliseconds_of(CLOCK_REALTIME) - milliseconds_of(CLOCK_BOOTTIME);
        print_seconds(out, "cpu_seconds_total", "counter", "Processor time of all threads.",
                      (now.user + now.kernel) * 1000 / tick);
        print_whole(out, "resident_memory_bytes", "gauge", "Memory in use.", now.resident * page);
        print_whole(out, "virtual_memory_bytes", "gauge", "Addresses in use.", now.virtual_bytes);
        print_whole(out, "threads", "gauge", "Threads.", now.threads);
        print_seconds(out, "start_time_seconds", "gauge", "When it started, since 1970.",
                      machine + now.start * 1000 / tick);
    }
    if (descriptors) print_whole(out, "open_fds", "gauge", "Descriptors in use.", descriptors);
    if (!getrlimit(RLIMIT_NOFILE, &limit) && limit.rlim_cur != RLIM_INFINITY)
        print_whole(out, "max_fds", "gauge", "Descriptors that may be in use.", limit.rlim_cur);
}
