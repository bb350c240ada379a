#include "base/machine.h"

#include <limits.h>
#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A controller's tree, and this process's place in it. */
typedef struct tree {
    const char *root, *controller; /* "" in version 2, which has one tree for all controllers */
    char mount[PATH_MAX];          /* without `root` */
    char group[PATH_MAX];          /* below the mount; "" is the mount itself */
} tree;

static FILE *open_below(const char *root, const char *path) {
    char name[PATH_MAX];
    const int length = snprintf(name, sizeof name, "%s%s", root, path);
    return length < (int)sizeof name ? fopen(name, "re") : NULL;
}

/* Whether a list that commas part has the word. */
static bool has_word(const char *list, const char *word) {
    const size_t length = strlen(word);
    for (const char *at = list; (at = strstr(at, word)); at += length) {
        const bool begins = at == list || at[-1] == ',';
        if (begins && (!at[length] || at[length] == ',')) return true;
    }
    return false;
}

/* Decodes the octal escapes that /proc/self/mountinfo writes for blanks and the like. */
static void unescape_mount(char *text) {
    char *to = text;
    for (const char *from = text; *from; to++) {
        unsigned code;
        if (*from == '\\' && sscanf(from, "\\%3o", &code) == 1 && strlen(from) >= 4) {
            *to = (char)code;
            from += 4;
        } else {
            *to = *from++;
        }
    }
    *to = 0;
}

/* Calls use(t, line) for the lines of a file until one is the right one. */
static bool find_line(tree *t, const char *path, bool (*use)(tree *t, char *line)) {
    FILE *file = open_below(t->root, path);
    if (!file) return false;
    char *line = NULL;
    size_t room = 0;
    bool found = false;
    while (!found && getline(&line, &room, file) > 0) {
        line[strcspn(line, "\n")] = 0;
        found = use(t, line);
    }
    free(line);
    fclose(file);
    return found;
}

/* Sets this process's group by a line such as "4:memory:/a/b" or "0::/a/b". */
static bool read_group(tree *t, char *line) {
    char *list = strchr(line, ':'), *path = list ? strchr(list + 1, ':') : NULL;
    if (!path) return false;
    *path++ = 0;
    list++;
    const bool found = *t->controller ? has_word(list, t->controller) : !*list;
    if (found) snprintf(t->group, sizeof t->group, "%s", path);
    return found;
}

/* Sets the mount, and makes the group relative to it. A group that does not lie below the top of
 * the mount cannot be looked at: a container that sees only its own tree has such groups. The group
 * is then the mount itself. */
static void set_mount(tree *t, char *top, char *mount) {
    unescape_mount(top);
    unescape_mount(mount);
    snprintf(t->mount, sizeof t->mount, "%s", mount);
    size_t length = strcmp(top, "/") ? strlen(top) : 0;
    const bool within = !strncmp(t->group, top, length) &&
                        (t->group[length] == '/' || !t->group[length]) && !strstr(t->group, "/..");
    if (!within || !strcmp(t->group + length, "/")) length = strlen(t->group);
    memmove(t->group, t->group + length, strlen(t->group + length) + 1);
}

/* Sets the mount by a line of the form "36 35 98:0 /top /mount options [more ...] - type source
 * options" (proc(5)). */
static bool read_mount(tree *t, char *line) {
    char *rest = strstr(line, " - ");
    if (!rest) return false;
    *rest = 0;
    char *end, *type = strtok_r(rest + 3, " ", &end);
    const bool is_v2 = type && !strcmp(type, "cgroup2"), is_v1 = type && !strcmp(type, "cgroup");
    strtok_r(NULL, " ", &end);
    const char *options = strtok_r(NULL, " ", &end);
    if (*t->controller ? !is_v1 || !options || !has_word(options, t->controller) : !is_v2)
        return false;
    char *top = NULL, *mount = NULL, *field = strtok_r(line, " ", &end);
    for (int i = 0; field && i < 5; i++, field = strtok_r(NULL, " ", &end)) {
        if (i == 3) top = field;
        if (i == 4) mount = field;
    }
    if (mount) set_mount(t, top, mount);
    return mount;
}

static bool find_tree(tree *t) {
    return find_line(t, "/proc/self/cgroup", read_group) &&
           find_line(t, "/proc/self/mountinfo", read_mount);
}

/* Reads a file of the group into `text`, and its path without the root into `path`. */
static bool read_of(const tree *t, const char *name, char path[PATH_MAX], char text[64]) {
    const int length = snprintf(path, PATH_MAX, "%s%s/%s", t->mount, t->group, name);
    FILE *file = length < PATH_MAX ? open_below(t->root, path) : NULL;
    const bool read = file && fgets(text, 64, file);
    if (file) fclose(file);
    return read;
}

/* Goes to the group above. False: none can be seen. */
static bool go_up(tree *t) {
    char *last = strrchr(t->group, '/');
    if (!last) return false;
    *last = 0;
    return true;
}

static void bound_memory(shd_machine *machine, const tree *t, const char *name) {
    char path[PATH_MAX], text[64], *end;
    if (!read_of(t, name, path, text)) return;
    const unsigned long long bytes = strtoull(text, &end, 10);
    if (end == text || bytes >= machine->memory) return; /* "max", or more than there is */
    machine->memory = bytes;
    snprintf(machine->memory_source, SHD_MACHINE_SOURCE, "%.*s", SHD_MACHINE_SOURCE - 1, path);
}

static void bound_quota(shd_machine *machine, const char *path, double time, double period) {
    if (!(time > 0) || !(period > 0) || time / period >= machine->quota) return;
    machine->quota = time / period;
    snprintf(machine->quota_source, SHD_MACHINE_SOURCE, "%.*s", SHD_MACHINE_SOURCE - 1, path);
}

static void bound_quota_v1(shd_machine *machine, const tree *t) {
    char path[PATH_MAX], time[64], period[64];
    if (!read_of(t, "cpu.cfs_period_us", path, period)) return;
    if (!read_of(t, "cpu.cfs_quota_us", path, time)) return; /* -1: none */
    bound_quota(machine, path, strtod(time, NULL), strtod(period, NULL));
}

static void bound_quota_v2(shd_machine *machine, const tree *t) {
    char path[PATH_MAX], text[64], *end;
    if (!read_of(t, "cpu.max", path, text)) return;
    const double time = strtod(text, &end);
    if (end != text) bound_quota(machine, path, time, strtod(end, NULL)); /* otherwise "max" */
}

static void read_machine(shd_machine *machine, const char *root) {
    FILE *file = open_below(root, "/proc/meminfo");
    char line[256];
    unsigned long long kilobytes;
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "MemTotal: %llu kB", &kilobytes) == 1) {
            machine->memory = kilobytes * 1024;
            snprintf(machine->memory_source, sizeof machine->memory_source, "/proc/meminfo");
        }
    if (file) fclose(file);
}

static unsigned count_processors(void) {
    enum { MOST = 1 << 16 };
    const size_t size = CPU_ALLOC_SIZE(MOST);
    cpu_set_t *set = CPU_ALLOC(MOST);
    const bool known = set && !sched_getaffinity(0, size, set);
    const long count = known ? CPU_COUNT_S(size, set) : sysconf(_SC_NPROCESSORS_ONLN);
    CPU_FREE(set);
    return count < 1 ? 1 : (unsigned)count;
}

shd_machine shd_machine_look(const char *root) {
    shd_machine machine = {
        .memory = UINT64_MAX, .processors = count_processors(), .quota = INFINITY};
    read_machine(&machine, root);
    tree t = {.root = root, .controller = "memory"};
    if (find_tree(&t)) do
            bound_memory(&machine, &t, "memory.limit_in_bytes");
        while (go_up(&t));
    t = (tree){.root = root, .controller = "cpu"};
    if (find_tree(&t)) do
            bound_quota_v1(&machine, &t);
        while (go_up(&t));
    t = (tree){.root = root, .controller = ""};
    if (find_tree(&t)) do {
            bound_memory(&machine, &t, "memory.max");
            bound_memory(&machine, &t, "memory.high");
            bound_quota_v2(&machine, &t);
        } while (go_up(&t));
    return machine;
}

unsigned shd_machine_threads(const shd_machine *machine) {
    enum { MOST = 1024 };
    const double quota = ceil(machine->quota);
    const unsigned threads = quota < machine->processors ? (unsigned)quota : machine->processors;
    return threads < 1 ? 1 : threads > MOST ? MOST : threads;
}
