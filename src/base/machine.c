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

/* Sets the mount by a line "36 35 98:0 /top /mount options [more] - type source options". */
static bool read_mount(tree *t, char *line) {
    char top[PATH_MAX], mount[PATH_MAX], type[16], options[PATH_MAX], *rest = strstr(line, " - ");
    if (!rest || sscanf(rest, " - %15s %*s %4095s", type, options) != 2) return false;
    *rest = 0;
    if (sscanf(line, "%*s %*s %*s %4095s %4095s", top, mount) != 2) return false;
    const bool is_v1 = *t->controller;
    if (strcmp(type, is_v1 ? "cgroup" : "cgroup2")) return false;
    if (is_v1 && !has_word(options, t->controller)) return false;
    set_mount(t, top, mount);
    return true;
}

/* Reads a file of the group into `text`, and its path without the root into `path`. */
static bool read_of(const tree *t, const char *name, char path[PATH_MAX], char text[64]) {
    const int length = snprintf(path, PATH_MAX, "%s%s/%s", t->mount, t->group, name);
    FILE *file = length < PATH_MAX ? open_below(t->root, path) : NULL;
    const bool read = file && fgets(text, 64, file);
    if (file) fclose(file);
    return read;
}

static void bound_memory(shd_machine *machine, uint64_t bytes, const char *path) {
    if (bytes >= machine->memory) return;
    machine->memory = bytes;
    snprintf(machine->memory_source, SHD_MACHINE_SOURCE, "%.*s", SHD_MACHINE_SOURCE - 1, path);
}

static void bound_quota(shd_machine *machine, double time, double period, const char *path) {
    if (!(time > 0) || !(period > 0) || time / period >= machine->quota) return;
    machine->quota = time / period;
    snprintf(machine->quota_source, SHD_MACHINE_SOURCE, "%.*s", SHD_MACHINE_SOURCE - 1, path);
}

/* Counts the bounds of a controller's tree. Files of other controllers are not in it. */
static void bound_by_tree(shd_machine *machine, const char *root, const char *controller) {
    static const char *const files[] = {"memory.limit_in_bytes", "memory.max", "memory.high"};
    tree t = {.root = root, .controller = controller};
    if (!find_line(&t, "/proc/self/cgroup", read_group)) return;
    if (!find_line(&t, "/proc/self/mountinfo", read_mount)) return;
    /* The group itself, and then those above that can be seen. */
    for (char *last = t.group + strlen(t.group); last; last = strrchr(t.group, '/')) {
        char path[PATH_MAX], text[64], time[64], *end;
        *last = 0;
        for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
            if (!read_of(&t, files[i], path, text)) continue;
            const uint64_t bytes = strtoull(text, &end, 10);
            if (end != text) bound_memory(machine, bytes, path); /* otherwise "max" */
        }
        if (read_of(&t, "cpu.cfs_period_us", path, text) &&
            read_of(&t, "cpu.cfs_quota_us", path, time)) /* -1: none */
            bound_quota(machine, strtod(time, NULL), strtod(text, NULL), path);
        if (!read_of(&t, "cpu.max", path, text)) continue;
        const double quota = strtod(text, &end);
        if (end != text) bound_quota(machine, quota, strtod(end, NULL), path);
    }
}

static void read_memory(shd_machine *machine, const char *root) {
    FILE *file = open_below(root, "/proc/meminfo");
    char line[256];
    unsigned long long kilobytes;
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "MemTotal: %llu kB", &kilobytes) == 1)
            bound_memory(machine, kilobytes * 1024, "/proc/meminfo");
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
    read_memory(&machine, root);
    bound_by_tree(&machine, root, "memory");
    bound_by_tree(&machine, root, "cpu");
    bound_by_tree(&machine, root, "");
    return machine;
}

unsigned shd_machine_threads(const shd_machine *machine) {
    enum { MOST = 1024 };
    const double quota = ceil(machine->quota);
    const unsigned threads = quota < machine->processors ? (unsigned)quota : machine->processors;
    return threads < 1 ? 1 : threads > MOST ? MOST : threads;
}
