#include "config.h"

#include <assert.h>
#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <ini.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/regular.h"
#include "shaded.h"

typedef enum option_kind {
    TEXT,   /* printable ASCII that fits its field; min 1: not blank */
    LIST,   /* the same; as a flag several times, whose values are then joined by blanks */
    SWITCH, /* on, off */
    WHOLE,  /* digits */
    BYTES   /* digits, then perhaps K, M or G (1024s) */
} option_kind;

typedef struct option_info {
    const char *name; /* of the flag, and of the key in the file */
    option_kind kind;
    bool fixed;          /* until the next start */
    size_t offset, size; /* of the field in shd_config */
    uint64_t min, max;
    const char *argument, *help;
} option_info;

#define FIELD(name) offsetof(shd_config, name), sizeof((shd_config *)0)->name

static const option_info options[] = {
    {"listen", LIST, true, FIELD(listen), 0, 0, "ADDR:PORT",
     "where to serve; [::1]:8080 for IPv6, port 0 for any free port, unix:/path; or a list"},
    {"admin", TEXT, true, FIELD(admin), 0, 0, "ADDR:PORT",
     "where to answer /healthz, /readyz and /metrics; or off"},
    {"threads", WHOLE, true, FIELD(threads), 0, 1024, "N",
     "rendering threads; 0: as many processors as affinity and CPU quota allow"},
    {"kernel", TEXT, true, FIELD(kernel), 1, 0, "NAME",
     "portable, avx2, avx512 or neon: instructions to render with; auto: the widest there are"},
    {"queue", WHOLE, true, FIELD(queue), 1, 1000000, "N",
     "requests that may wait for a thread; one more is answered 429"},
    {"ocio", TEXT, false, FIELD(ocio), 0, 0, "FILE",
     "OpenColorIO configuration (.ocio, .ocioz or ocio://NAME); none: the one that is built in. "
     "$OCIO and OCIO_* are not looked at"},
    {"materials", LIST, false, FIELD(materials), 0, 0, "FILE",
     "materials that `preset` may name beside those that are built in; or a list"},
    {"assets", TEXT, false, FIELD(assets), 0, 0, "FOLDER",
     "pictures that documents may name: the files of a folder, which are only read"},
    {"timeout", WHOLE, false, FIELD(timeout), 1, 86400, "SECONDS",
     "longest time from a request's last byte to its picture"},
    {"idle-timeout", WHOLE, true, FIELD(idle_timeout), 1, 86400, "SECONDS",
     "connections silent for this long are closed"},
    {"head-time", WHOLE, false, FIELD(head_time), 1, 86400, "SECONDS",
     "longest time for a request's head to come"},
    {"body-time", WHOLE, false, FIELD(body_time), 1, 86400, "SECONDS",
     "longest time for a request's body to come"},
    {"send-time", WHOLE, false, FIELD(send_time), 1, 86400, "SECONDS",
     "longest time for an answer to be taken"},
    {"drain-time", WHOLE, false, FIELD(drain_time), 0, 86400, "SECONDS",
     "longest time from SIGTERM to the end; 5 s before, or halfway, what is left is cancelled"},
    {"max-connections", WHOLE, true, FIELD(connections), 1, 1000000, "N", "connections at a time"},
    {"max-connections-each", WHOLE, true, FIELD(connections_each), 0, 1000000, "N",
     "of them from one address that is no trusted proxy; 0: any number"},
    {"trusted-proxies", TEXT, false, FIELD(trusted_proxies), 0, 0, "NETWORKS",
     "proxies whose X-Forwarded-For is believed: 127.0.0.1, 10.0.0.0/8, unix"},
    {"max-body", BYTES, false, FIELD(limits.body), 1, 1ull << 40, "BYTES",
     "size of a scene document, or of a mesh or a picture that is kept"},
    {"max-pixels", WHOLE, false, FIELD(limits.pixels), 1, 1ull << 40, "N", "pixels of a picture"},
    {"max-samples", WHOLE, false, FIELD(limits.samples), 1, 1ull << 46, "N",
     "samples of a picture: its pixels times `samples`"},
    {"max-lights", WHOLE, false, FIELD(limits.lights), 0, 1ull << 40, "N", "lights of a scene"},
    {"max-objects", WHOLE, false, FIELD(limits.objects), 0, 1ull << 40, "N", "objects of a scene"},
    {"max-triangles", WHOLE, false, FIELD(limits.triangles), 0, 1ull << 40, "N",
     "triangles of a scene, those of tessellated shapes too; a kept mesh counts once"},
    {"max-light-samples", WHOLE, false, FIELD(limits.light_samples), 1, 1ull << 62, "N",
     "samples of a picture times lights times terms: diffuse, and each specular lobe"},
    {"max-object-lights", WHOLE, false, FIELD(limits.object_lights), 0, 1ull << 62, "N",
     "objects of a scene times its lights"},
    {"max-work", WHOLE, false, FIELD(limits.work), 1, 1ull << 40, "SECONDS",
     "time that a picture is expected to take on one processor"},
    {"memory", BYTES, true, FIELD(budget), 0, 1ull << 46, "BYTES",
     "memory of the whole process; 0: three quarters of what machine and control groups leave"},
    {"max-memory", BYTES, false, FIELD(limits.memory), 1 << 20, 1ull << 46, "BYTES",
     "memory of one request"},
    {"reuse", BYTES, true, FIELD(reuse), 0, 1ull << 46, "BYTES",
     "memory for what later pictures share with earlier ones; 0: nothing is kept"},
    {"mesh-store", BYTES, true, FIELD(mesh_store), 0, 1ull << 46, "BYTES",
     "memory for meshes, scenes and pictures that are named by their digest; 0: none are kept"},
    {"scenes-folder", TEXT, true, FIELD(scenes_folder), 0, 0, "FOLDER",
     "where scenes that are named by their digest are kept as files, too; none: in memory alone"},
    {"response-cache", BYTES, true, FIELD(response_cache), 0, 1ull << 46, "BYTES",
     "memory for finished pictures, for who asks for the same ones; 0: none are kept"},
    {"tokens", TEXT, false, FIELD(tokens), 0, 0, "FILE",
     "bearer tokens, or their hashes with names, ends and rates, for /v1/; none: all are served"},
    {"admin-tokens", TEXT, false, FIELD(admin_tokens), 0, 0, "FILE",
     "such tokens that /metrics asks for; none: everybody at the admin port is told"},
    {"preview-keys", TEXT, false, FIELD(preview_keys), 0, 0, "FILE",
     "keys, one a line, one of which must have signed a link to a picture"},
    {"cors-origins", TEXT, false, FIELD(cors_origins), 0, 0, "ORIGINS",
     "origins whose pages may ask, such as https://a.example; or *"},
    {"cache-control", TEXT, false, FIELD(cache_control), 1, 0, "TEXT", "Cache-Control of pictures"},
    {"log-requests", SWITCH, false, FIELD(log_requests), 0, 0, "on|off",
     "a log line for each request"},
};

enum { OPTION_COUNT = sizeof options / sizeof options[0] };

/* What getopt_long gives for flags; for those of `options`, FLAG_OPTION and their index. */
enum { FLAG_CONFIG = 1000, FLAG_READY, FLAG_HELP, FLAG_VERSION, FLAG_OPTION };

enum { LINE_SIZE = 200 }; /* of the file, with newline and end; libinih reads up to that */

shd_config shd_config_defaults(void) {
    shd_engine_options engine = shd_engine_defaults();
    return (shd_config){
        .listen = "127.0.0.1:8080",
        .admin = "127.0.0.1:9090",
        .kernel = "auto",
        /* The same request gives the same bytes until the version or the configuration change. */
        .cache_control = "public, max-age=3600",
        .log_requests = true,
        .threads = engine.threads,
        .queue = engine.queue,
        .connections = 1000,
        .connections_each = 100,
        .limits = engine.limits,
        .reuse = engine.reuse,
        .mesh_store = engine.mesh_store,
        .response_cache = (uint64_t)64 << 20,
        .timeout = 30,
        .idle_timeout = 30,
        .head_time = 15,
        .body_time = 60,
        .send_time = 60,
        .drain_time = 30,
    };
}

/* ---- One value ---- */

static bool parse_whole(const option_info *option, const char *text, uint64_t *out) {
    if (!isdigit((unsigned char)*text)) return false;
    char *end;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10), unit = 1;
    if (option->kind == BYTES && *end) {
        const char *units = "KMG", *found = strchr(units, toupper((unsigned char)*end++));
        if (!found) return false;
        unit = 1ull << (10 * (found - units + 1));
    }
    if (errno || *end || value > option->max / unit) return false;
    *out = value * unit;
    return *out >= option->min;
}

static bool is_printable(const char *text) {
    for (; *text; text++)
        if (*text < 0x20 || *text > 0x7e) return false;
    return true;
}

static bool is_text(const option_info *option) {
    return option->kind == TEXT || option->kind == LIST;
}

/* `place` names the source of the value in the message. */
static bool set_option(shd_config *config, const option_info *option, const char *text,
                       const char *place, char *message, size_t size) {
    char *field = (char *)config + option->offset;
    if (is_text(option)) {
        const bool fits = strlen(text) < option->size && is_printable(text);
        const bool is_blank = option->min && !text[strspn(text, " ")];
        if (fits && !is_blank) {
            strcpy(field, text);
            return true;
        }
        if (fits)
            snprintf(message, size, "%s: it is empty", place);
        else
            snprintf(message, size, "%s: up to %zu printable ASCII characters are possible", place,
                     option->size - 1);
    } else if (option->kind == SWITCH) {
        *(bool *)(void *)field = !strcmp(text, "on");
        if (!strcmp(text, "on") || !strcmp(text, "off")) return true;
        snprintf(message, size, "%s: '%s' is neither on nor off", place, text);
    } else {
        if (parse_whole(option, text, (uint64_t *)(void *)field)) return true;
        snprintf(message, size, "%s: '%s' is not a whole number from %llu to %llu%s", place, text,
                 (unsigned long long)option->min, (unsigned long long)option->max,
                 option->kind == BYTES ? " (K, M or G may follow)" : "");
    }
    return false;
}

/* ---- The file ---- */

typedef struct file_reader {
    FILE *file;
    const char *path;
    shd_config *config;
    int line;
    bool failed;
    char *message;
    size_t size;
} file_reader;

/* Returns false. */
SHD_PRINTF(2, 3)
static bool file_error(file_reader *reader, const char *format, ...) {
    assert(!reader->failed); /* lines end with the first one */
    reader->failed = true;
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    snprintf(reader->message, reader->size, "%s:%d: %s", reader->path, reader->line, text);
    return false;
}

/* Lines for libinih, which does not number them, cuts long ones in two, and takes an indented one
 * for more of the last value. */
static char *read_line(char *line, int size, void *context) {
    file_reader *reader = context;
    char text[LINE_SIZE];
    if (reader->failed || !fgets(text, sizeof text, reader->file)) return NULL;
    reader->line++;
    if (!strchr(text, '\n') && !feof(reader->file)) {
        file_error(reader, "the line is longer than %d characters", LINE_SIZE - 2);
        return NULL;
    }
    snprintf(line, (size_t)size, "%s", text + strspn(text, " \t"));
    return line;
}

static int read_pair(void *context, const char *section, const char *name, const char *value) {
    file_reader *reader = context;
    if (*section) return file_error(reader, "there are no sections: '[%s]'", section);
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        if (strcmp(options[i].name, name)) continue;
        char message[512];
        return set_option(reader->config, &options[i], value, name, message, sizeof message) ||
               file_error(reader, "%s", message);
    }
    return file_error(reader, "unknown key '%s' (shaded --help lists all)", name);
}

static bool read_file(const char *path, shd_config *config, char *message, size_t size) {
    shd_error error;
    int fd = shd_open_regular(path, &error);
    file_reader reader = {.file = fd < 0 ? NULL : fdopen(fd, "r"),
                          .path = path,
                          .config = config,
                          .message = message,
                          .size = size};
    if (!reader.file) {
        snprintf(message, size, "%s: %s", path, fd < 0 ? error.text : strerror(errno));
        if (fd >= 0) close(fd);
        return false;
    }
    int bad_line = ini_parse_stream(read_line, &reader, read_pair, &reader);
    if (!reader.failed && ferror(reader.file)) {
        snprintf(message, size, "%s: %s", path, strerror(errno));
        reader.failed = true;
    }
    if (!reader.failed && bad_line) {
        reader.line = bad_line;
        file_error(&reader, "not of the form key = value");
    }
    fclose(reader.file);
    return !reader.failed;
}

/* ---- All sources ---- */

/* Of each LIST. What does not fit is cut, and then too long for its field. */
enum { JOINED_SIZE = 2304 };

/* What a flag stands for that may have been there before. */
static const char *join_values(const option_info *option, const char *value,
                               char joined[JOINED_SIZE]) {
    if (option->kind != LIST) return value;
    const size_t length = strlen(joined);
    snprintf(joined + length, JOINED_SIZE - length, "%s%s", length ? " " : "", value);
    return joined;
}

static shd_config_result read_flags(int argc, char **argv, const char *values[OPTION_COUNT],
                                    char joined[OPTION_COUNT][JOINED_SIZE], const char **path,
                                    char *message, size_t size) {
    struct option flags[OPTION_COUNT + 5] = {
        [OPTION_COUNT] = {"config", required_argument, NULL, FLAG_CONFIG},
        {"help", no_argument, NULL, FLAG_HELP},
        {"version", no_argument, NULL, FLAG_VERSION},
        {"ready", no_argument, NULL, FLAG_READY}};
    shd_config_result result = SHD_CONFIG_RUN;
    for (int i = 0; i < OPTION_COUNT; i++)
        flags[i] = (struct option){options[i].name, required_argument, NULL, FLAG_OPTION + i};
    int flag;
    while ((flag = getopt_long(argc, argv, ":", flags, NULL)) != -1) { /* ":": it prints nothing */
        const int i = flag - FLAG_OPTION;
        if (flag == FLAG_HELP) return SHD_CONFIG_HELP;
        if (flag == FLAG_VERSION) return SHD_CONFIG_VERSION;
        if (flag == '?' || flag == ':') {
            char letter[] = {'-', (char)optopt, 0}; /* optopt is set for one-letter flags only */
            bool is_short = flag == '?' && optopt > 0 && optopt < FLAG_CONFIG;
            snprintf(message, size, "%s %s (shaded --help lists all flags)",
                     flag == ':' ? "no value after" : "unknown flag",
                     is_short ? letter : argv[optind - 1]);
            return SHD_CONFIG_BAD_FLAGS;
        }
        if (flag == FLAG_CONFIG)
            *path = optarg;
        else if (flag == FLAG_READY)
            result = SHD_CONFIG_READY;
        else
            values[i] = join_values(&options[i], optarg, joined[i]);
    }
    if (optind < argc) {
        snprintf(message, size, "unexpected argument '%s'", argv[optind]);
        return SHD_CONFIG_BAD_FLAGS;
    }
    return result;
}

shd_config_result shd_config_read(int argc, char **argv, shd_config *config, char *message,
                                  size_t message_size) {
    *config = shd_config_defaults();
    optind = 0; /* read again from the start, for SIGHUP */
    const char *values[OPTION_COUNT] = {NULL}, *path = getenv("SHADED_CONFIG");
    static char joined[OPTION_COUNT][JOINED_SIZE]; /* the main thread's */
    memset(joined, 0, sizeof joined);
    shd_config_result result = read_flags(argc, argv, values, joined, &path, message, message_size);
    if (result != SHD_CONFIG_RUN && result != SHD_CONFIG_READY) return result;

    if (path && *path && !read_file(path, config, message, message_size)) return SHD_CONFIG_BAD;

    for (size_t i = 0; i < OPTION_COUNT; i++) {
        char name[64];
        snprintf(name, sizeof name, "SHADED_%s", options[i].name);
        for (char *c = name; *c; c++) *c = *c == '-' ? '_' : (char)toupper((unsigned char)*c);
        const char *value = getenv(name);
        if (!value || !*value) continue; /* an empty variable is none, as in compose files */
        if (!set_option(config, &options[i], value, name, message, message_size))
            return SHD_CONFIG_BAD;
    }
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        char name[64];
        snprintf(name, sizeof name, "--%s", options[i].name);
        if (values[i] && !set_option(config, &options[i], values[i], name, message, message_size))
            return SHD_CONFIG_BAD_FLAGS;
    }
    return result;
}

bool shd_config_keep(shd_config *config, const shd_config *running, char *names, size_t size) {
    size_t length = 0;
    *names = 0;
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        const option_info *option = &options[i];
        char *field = (char *)config + option->offset;
        const char *old = (const char *)running + option->offset;
        bool same = is_text(option) ? !strcmp(field, old) : !memcmp(field, old, option->size);
        if (!option->fixed || same) continue;
        memcpy(field, old, option->size);
        if (length < size)
            length += (size_t)snprintf(names + length, size - length, "%s%s", length ? ", " : "",
                                       option->name);
    }
    return *names;
}

/* ---- Help ---- */

static void print_default(FILE *out, const option_info *option, const shd_config *defaults) {
    static const char *const units[] = {"", "K", "M", "G"};
    const char *field = (const char *)defaults + option->offset;
    if (is_text(option)) {
        if (*field) fprintf(out, " [%s]", field);
    } else if (option->kind == SWITCH) {
        fprintf(out, " [%s]", *(const bool *)(const void *)field ? "on" : "off");
    } else {
        uint64_t value = *(const uint64_t *)(const void *)field, unit = 0;
        if (option->kind == BYTES)
            for (; unit < 3 && value && value % 1024 == 0; unit++) value /= 1024;
        fprintf(out, " [%llu%s]", (unsigned long long)value, units[unit]);
    }
}

void shd_config_help(FILE *out) {
    shd_config defaults = shd_config_defaults();
    fputs("Usage: shaded [--config FILE] [--OPTION VALUE]...\n"
          "Serves pictures of JSON scenes over HTTP.\n\n"
          "Each option may also be set as SHADED_OPTION (upper case, _ for -) in the environment\n"
          "or as `option = value` in the file. Flags win over the environment, it over the file,\n"
          "the file over the defaults in brackets.\n\n",
          out);
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        char flag[64];
        snprintf(flag, sizeof flag, "--%s %s", options[i].name, options[i].argument);
        fprintf(out, "  %-24s  %s", flag, options[i].help);
        print_default(out, &options[i], &defaults);
        fputc('\n', out);
    }
    fputs(
        "  --config FILE             configuration file (or SHADED_CONFIG)\n"
        "  --ready                   ask the daemon that runs with these options whether it is\n"
        "                            ready, instead of being one\n"
        "  --help, --version\n\n"
        "SIGHUP reads the options, the tokens, the keys, the materials, the list of pictures and\n"
        "the color configuration again; what is bad leaves everything as it was.\n"
        "SIGTERM and SIGINT finish what is accepted and exit 0; a second one exits at once.\n"
        "Exit status: 0 stopped, or ready; 1 could not start or finish, or not ready; 2 wrong "
        "flags.\n",
        out);
}
