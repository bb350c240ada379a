#include <ctype.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "cli/cli.h"

#define FIELD(member) offsetof(shd_diff, member)

/* What may be too much; a name alone is its mean. */
static const struct {
    const char *name;
    size_t offset;
} metrics[] = {
    {"deltaE2000", FIELD(delta_e.mean)},
    {"deltaE2000.mean", FIELD(delta_e.mean)},
    {"deltaE2000.p50", FIELD(delta_e.p50)},
    {"deltaE2000.p95", FIELD(delta_e.p95)},
    {"deltaE2000.p99", FIELD(delta_e.p99)},
    {"deltaE2000.max", FIELD(delta_e.max)},
    {"flip", FIELD(flip.mean)},
    {"flip.mean", FIELD(flip.mean)},
    {"flip.p50", FIELD(flip.p50)},
    {"flip.p95", FIELD(flip.p95)},
    {"flip.p99", FIELD(flip.p99)},
    {"flip.max", FIELD(flip.max)},
    {"alpha", FIELD(alpha)},
};

enum { METRICS = sizeof metrics / sizeof metrics[0] };

bool cli_take_above(const char *text, cli_options *options) {
    const size_t length = strcspn(text, "=");
    char *end;
    size_t m = 0;
    if (options->above_count == CLI_ABOVE_MOST || text[length] != '=') return false;
    while (m < METRICS &&
           (strlen(metrics[m].name) != length || memcmp(metrics[m].name, text, length)))
        m++;
    const char *number = text + length + 1;
    const double value = strtod(number, &end);
    if (m == METRICS || !isdigit((unsigned char)*number) || *end || !isfinite(value)) return false;
    options->above[options->above_count++] = (cli_above){metrics[m].name, metrics[m].offset, value};
    return true;
}

/* ---- Sides ---- */

static void on_progress(void *request, double share) {
    if (cli_interrupted()) shd_request_cancel(request);
    cli_progress_draw(share);
}

static bool is_scene(const char *path) {
    const char *dot = strrchr(path, '.');
    return !strcmp(path, "-") || (dot && !strcmp(dot, ".json"));
}

/* The scene of a request, rendered. */
static bool show_scene(const char *path, const cli_options *options, shd_request *request) {
    const shd_render_options render = {.progress = on_progress, .context = request};
    char *text;
    size_t length;
    shd_error error;
    if (!cli_read_file(path, (size_t)options->engine.limits.body, &text, &length)) return false;
    shd_status status = shd_request_read(request, text, length, SHD_PNG);
    cli_print_report(cli_name_of(path), 0, shd_request_report(request));
    free(text);
    if (status != SHD_OK) return false;
    cli_progress_begin();
    status = shd_request_show(request, &render, &error);
    cli_progress_end();
    cli_end_if_interrupted();
    if (status != SHD_OK) cli_print_error(cli_name_of(path), &error);
    return status == SHD_OK;
}

static bool show_side(const char *path, const cli_options *options, shd_engine *engine,
                      shd_request **out) {
    shd_error error;
    shd_format format;
    const char *dot = strrchr(path, '.');
    if (shd_request_new(engine, out, &error)) {
        cli_say("%s", error.text);
        return false;
    }
    if (is_scene(path)) return show_scene(path, options, *out);
    if (!dot || !shd_format_find(dot + 1, &format)) return false; /* as was checked */
    const shd_status status = shd_request_read_picture(*out, path, format, &error);
    if (status != SHD_OK) cli_print_error(path, &error);
    return status == SHD_OK;
}

/* ---- The whole ---- */

static bool write_map(const char *path, const unsigned char *data, size_t size) {
    cli_file file;
    if (!strcmp(path, "-")) return cli_write_stdout(data, size);
    return cli_file_write(path, data, size, &file) && cli_file_commit(&file);
}

/* False: something is above what it may be. */
static bool judge(const shd_diff *found, const cli_options *options) {
    bool good = true;
    for (const cli_above *a = options->above; a < options->above + options->above_count; a++) {
        const double value = *(const double *)(const void *)((const char *)found + a->offset);
        if (value <= a->value) continue;
        cli_say("%s is %.6g, above %.6g", a->name, value, a->value);
        good = false;
    }
    return good;
}

static int diff_sides(shd_request *sides[2], const cli_options *options) {
    const shd_diff_options how = {.density = options->density, .map = options->output};
    const bool takes_stdout = options->output && !strcmp(options->output, "-");
    shd_diff found;
    shd_error error;
    char *json;
    unsigned char *map = NULL;
    size_t size = 0;
    if (shd_request_diff(sides[0], sides[1], &how, &found, &json, &map, &size, &error)) {
        cli_say("%s", error.text);
        return CLI_FAILED;
    }
    const size_t length = strlen(json);
    json[length] = '\n'; /* replaces the final 0, which nobody needs any more */
    const bool written = (takes_stdout || cli_write_stdout(json, length + 1)) &&
                         (!options->output || write_map(options->output, map, size));
    free(json);
    free(map);
    return written && judge(&found, options) ? CLI_DONE : CLI_FAILED;
}

static bool is_map(const char *path) {
    shd_format format;
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    return !dot || (shd_format_find(dot + 1, &format) && format == SHD_PNG);
}

int cli_diff(const char *const paths[2], const cli_options *options) {
    shd_engine *engine = NULL;
    shd_request *sides[2] = {NULL, NULL};
    shd_error error;
    int result = CLI_FAILED;
    for (int i = 0; i < 2; i++) {
        shd_format format;
        const char *dot = strrchr(paths[i], '.');
        if (!is_scene(paths[i]) && (!dot || !shd_format_find(dot + 1, &format)))
            return cli_usage("unknown suffix in '%s': json is a scene; png, jpg, webp and tif are "
                             "pictures",
                             paths[i]);
    }
    if (options->output && !is_map(options->output))
        return cli_usage("unknown suffix in '%s': the map is a png", options->output);
    if (shd_engine_new(&options->engine, &engine, &error)) {
        cli_say("%s%s%s", error.path, *error.path ? ": " : "", error.text);
        return CLI_FAILED;
    }
    cli_catch_interrupts();
    if (show_side(paths[0], options, engine, &sides[0]) &&
        show_side(paths[1], options, engine, &sides[1]))
        result = diff_sides(sides, options);
    shd_request_drop(sides[0]);
    shd_request_drop(sides[1]);
    shd_engine_drop(engine);
    return result;
}
