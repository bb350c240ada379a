#include "cli/cli.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- Where the pictures go ---- */

typedef enum target_kind { TARGET_STDOUT, TARGET_FILE, TARGET_DIRECTORY } target_kind;

typedef struct cli_target {
    const char *path;
    target_kind kind;
    bool suffixed;     /* whether a file has a suffix that names a format */
    shd_format format; /* that format; otherwise PNG, if the scene names none */
    bool words;        /* for a person, who reads words; programs read JSON */
} cli_target;

/* Tells before the work, and not after it, that a file cannot be written. */
static bool folder_is_writable(const char *path) {
    const char *slash = strrchr(path, '/');
    char *folder = slash ? strndup(path, (size_t)(slash - path) + 1) : strdup(".");
    bool writable = folder && !access(folder, W_OK | X_OK);
    if (!writable) cli_say("cannot write '%s': %s", path, strerror(errno));
    free(folder);
    return writable;
}

/* CLI_DONE, or the failure that was printed. */
static int find_target(const char *path, cli_target *out) {
    struct stat status;
    const size_t length = strlen(path);
    *out = (cli_target){.path = path, .kind = TARGET_FILE, .format = SHD_PNG};
    if (length == 0) return cli_usage("-o is empty");
    if (!strcmp(path, "-"))
        out->kind = TARGET_STDOUT;
    else if (path[length - 1] == '/' || (!stat(path, &status) && S_ISDIR(status.st_mode)))
        out->kind = TARGET_DIRECTORY;
    return CLI_DONE;
}

/* As find_target. A name without a suffix (/dev/null is one) leaves the format to the scene. */
static int find_picture_target(const char *path, cli_target *out) {
    const int result = find_target(path, out);
    if (result != CLI_DONE || out->kind != TARGET_FILE) return result;
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    out->suffixed = dot && dot != name;
    if (out->suffixed && !shd_format_find(dot + 1, &out->format))
        return cli_usage("unknown suffix in '%s': png, jpg, webp, tif, exr and hdr are known",
                         path);
    return folder_is_writable(path) ? CLI_DONE : CLI_FAILED;
}

/* As find_target, for a text, which goes to stdout by default. */
static int find_text_target(const char *path, cli_target *out) {
    const int result = find_target(path ? path : "-", out);
    if (result != CLI_DONE) return result;
    if (out->kind == TARGET_DIRECTORY)
        return cli_usage("'%s' is a directory: -o must be a file", path);
    return out->kind == TARGET_STDOUT || folder_is_writable(path) ? CLI_DONE : CLI_FAILED;
}

/* To the target, which is no directory. */
static bool write_bytes(const cli_target *target, const void *data, size_t size) {
    cli_file file;
    if (target->kind == TARGET_STDOUT) return cli_write_stdout(data, size);
    return cli_file_write(target->path, data, size, &file) && cli_file_commit(&file);
}

/* Writes the text and a line's end. */
static bool write_json(const cli_target *target, char *json) {
    const size_t length = strlen(json);
    json[length] = '\n'; /* replaces the final 0, which nobody needs any more */
    return write_bytes(target, json, length + 1);
}

/* ---- Reading and rendering ---- */

/* Reads a scene and prints what is wrong with it. False: the scene is of no use. */
static bool read_scene(const char *scene, const shd_limits *limits, shd_request *request,
                       shd_format fallback) {
    char *text;
    size_t length;
    if (!cli_read_file(scene, (size_t)limits->body, &text, &length)) return false;
    shd_status status = shd_request_read(request, text, length, fallback);
    free(text);
    cli_print_report(cli_name_of(scene), 0, shd_request_report(request));
    return status == SHD_OK;
}

static void on_progress(void *request, double share) {
    if (cli_interrupted()) shd_request_cancel(request);
    cli_progress_draw(share);
}

/* What tells of a rendered scene, as JSON. */
typedef shd_status tell_scene(shd_request *request, const shd_render_options *options, char **json,
                              shd_error *error);

/* Renders, or has it told if `tell` is there, with a progress bar. */
static int render_scene(const char *scene, shd_request *request, tell_scene *tell, char **json) {
    shd_render_options options = {.progress = on_progress, .context = request};
    shd_error error;
    cli_catch_interrupts();
    cli_progress_begin();
    shd_status status = tell ? tell(request, &options, json, &error)
                             : shd_request_render(request, &options, &error);
    cli_progress_end();
    cli_end_if_interrupted();
    if (status != SHD_OK) cli_print_error(cli_name_of(scene), &error);
    return status != SHD_OK ? CLI_FAILED : CLI_DONE;
}

/* What is done with a scene that was read. Returns the program's exit status. */
typedef int use_scene(const char *scene, const cli_target *target, shd_request *request);

static int write_pictures(const char *scene, const cli_target *target, shd_request *request) {
    bool multipart = shd_request_multipart(request);
    if (multipart && target->kind != TARGET_DIRECTORY)
        return cli_usage("the scene has `outputs`: -o must be a directory, '%s/' for example",
                         target->kind == TARGET_STDOUT ? "pictures" : target->path);
    if (!multipart && target->kind == TARGET_DIRECTORY)
        return cli_usage("'%s' is a directory, but the scene has one output: -o must be a file",
                         target->path);

    shd_format format = shd_request_format(request, 0);
    if (target->suffixed && format != target->format)
        return cli_usage("the scene asks for %s, but '%s' has the suffix of %s",
                         shd_format_get(format)->name, target->path,
                         shd_format_get(target->format)->name);

    int result = render_scene(scene, request, NULL, NULL);
    if (result != CLI_DONE) return result;

    size_t count;
    const shd_picture *pictures = shd_request_pictures(request, &count);
    if (shd_request_saturated(request) > 0)
        fprintf(stderr, "warning: %s: %llu samples were not finite or beyond the output's range\n",
                cli_name_of(scene), (unsigned long long)shd_request_saturated(request));
    const bool written = multipart ? cli_write_pictures(target->path, pictures, count)
                                   : write_bytes(target, pictures[0].data, pictures[0].size);
    return written ? CLI_DONE : CLI_FAILED;
}

static int write_told(const char *scene, const cli_target *target, shd_request *request,
                      tell_scene *tell) {
    char *json = NULL;
    int result = render_scene(scene, request, tell, &json);
    if (result == CLI_DONE && !write_json(target, json)) result = CLI_FAILED;
    free(json);
    return result;
}

static int write_comparison(const char *scene, const cli_target *target, shd_request *request) {
    return write_told(scene, target, request, shd_request_compare);
}

static int write_analysis(const char *scene, const cli_target *target, shd_request *request) {
    return write_told(scene, target, request, shd_request_analyze);
}

static int write_explanation(const char *scene, const cli_target *target, shd_request *request) {
    char *text = NULL;
    shd_error error;
    bool written = false;
    if (shd_request_explain(request, target->words ? SHD_IN_WORDS : SHD_IN_JSON, &text, &error))
        cli_print_error(cli_name_of(scene), &error);
    else
        written =
            target->words ? write_bytes(target, text, strlen(text)) : write_json(target, text);
    free(text);
    return written ? CLI_DONE : CLI_FAILED;
}

static bool ends_in(const char *text, const char *suffix) {
    const size_t length = strlen(text), tail = strlen(suffix);
    return length > tail && !strcasecmp(text + length - tail, suffix);
}

/* The suffix says what is written: a plot, or figures. */
static int write_brdf(const char *scene, const cli_target *target, shd_request *request) {
    const bool file = target->kind == TARGET_FILE;
    const shd_brdf_form form = file && ends_in(target->path, ".svg")   ? SHD_BRDF_SVG
                               : file && ends_in(target->path, ".png") ? SHD_BRDF_PNG
                                                                       : SHD_BRDF_JSON;
    unsigned char *data = NULL;
    size_t size;
    shd_error error;
    bool written = false;
    if (shd_request_brdf(request, form, &data, &size, &error))
        cli_print_error(cli_name_of(scene), &error);
    else
        written = form == SHD_BRDF_JSON ? write_json(target, (char *)data)
                                        : write_bytes(target, data, size);
    free(data);
    return written ? CLI_DONE : CLI_FAILED;
}

/* Reads each scene, and has it used (unless `use` is NULL). The status is the last failure's. */
static int use_scenes(const char *const *scenes, size_t count, const shd_engine_options *options,
                      const cli_target *target, use_scene *use) {
    shd_engine *engine;
    shd_error error;
    if (shd_engine_new(options, &engine, &error) != SHD_OK) {
        cli_say("%s%s%s", error.path, *error.path ? ": " : "", error.text);
        return CLI_FAILED;
    }
    int result = CLI_DONE;
    for (size_t i = 0; i < count; i++) {
        shd_request *request = NULL;
        int status = CLI_FAILED;
        if (shd_request_new(engine, &request, &error) != SHD_OK)
            cli_say("%s", error.text);
        else if (read_scene(scenes[i], &options->limits, request, target->format))
            status = use ? use(scenes[i], target, request) : CLI_DONE;
        if (status != CLI_DONE) result = status;
        shd_request_drop(request);
    }
    shd_engine_drop(engine);
    return result;
}

int cli_run(enum cli_command command, const char *const *scenes, size_t count,
            const cli_options *options) {
    static use_scene *const uses[] = {
        [CLI_RENDER] = write_pictures,    [CLI_EXPLAIN] = write_explanation,
        [CLI_COMPARE] = write_comparison, [CLI_ANALYZE] = write_analysis,
        [CLI_BRDF] = write_brdf,          [CLI_CHECK] = NULL};
    cli_target target = {.format = SHD_PNG};
    const int result = command == CLI_RENDER  ? find_picture_target(options->output, &target)
                       : command == CLI_CHECK ? CLI_DONE
                                              : find_text_target(options->output, &target);
    if (result != CLI_DONE) return result;
    target.words = !options->json && !options->output && isatty(STDOUT_FILENO);
    shd_engine_options engine = options->engine;
    if (command == CLI_EXPLAIN || command == CLI_BRDF || command == CLI_CHECK)
        engine.threads = 1; /* nothing is rendered */
    return use_scenes(scenes, count, &engine, &target, uses[command]);
}
