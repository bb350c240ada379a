#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "cli/cli.h"
#include "import/import.h"

enum { SECONDS = 120, LEAST_MEMORY = 1 << 30 };

typedef struct importing {
    const char *model; /* as messages call it */
    const char *folder;
    size_t kept; /* meshes that were written */
} importing;

static void print_note(void *context, const char *text) {
    const importing *it = context;
    fprintf(stderr, "note: %s: %s\n", it->model, text);
}

/* Meshes are named by what they hold: one that is there is the same. */
static bool write_mesh(void *context, const void *bytes, size_t size, const char *digest) {
    importing *it = context;
    cli_file file;
    char *path;
    const size_t length = strlen(it->folder);
    const char *slash = length && it->folder[length - 1] == '/' ? "" : "/";
    if (asprintf(&path, "%s%s%s", it->folder, slash, digest) < 0) {
        cli_say("out of memory");
        return false;
    }
    const bool written = cli_file_write(path, bytes, size, &file) && cli_file_commit(&file);
    it->kept += written;
    free(path);
    return written;
}

static void tell_how_to_put(const importing *it) {
    fprintf(
        stderr,
        "note: %s: its meshes are in '%s', for a daemon to keep:\n"
        "  for mesh in '%s'/*; do curl -fT \"$mesh\" -H 'Content-Type: application/octet-stream' "
        "http://127.0.0.1:8080/v1/meshes/${mesh##*/}; done\n",
        it->model, it->folder, it->folder);
}

static bool has_suffix(const char *path, const char *const *suffixes) {
    const char *dot = strrchr(path, '.');
    for (; dot && *suffixes; suffixes++)
        if (!strcasecmp(dot + 1, *suffixes)) return true;
    return false;
}

static int fail(const char *path, const shd_error *error) {
    cli_say("cannot import '%s': %s", path, error->text);
    return CLI_FAILED;
}

static int finish_scene(const char *output, char *json, size_t length) {
    cli_file file;
    const bool written = !strcmp(output, "-") ? cli_write_stdout(json, length)
                                              : cli_file_write(output, json, length, &file) &&
                                                    cli_file_commit(&file);
    free(json);
    return written ? CLI_DONE : CLI_FAILED;
}

static int import_model(const char *path, const cli_options *options,
                        const shd_import_options *import) {
    const size_t half = (size_t)options->engine.limits.memory / 2;
    const shd_model_limits limits = {half > LEAST_MEMORY ? half : LEAST_MEMORY, SECONDS};
    const shd_model *model = NULL;
    shd_error error;
    char *json;
    size_t length;
    if (shd_model_load(path, &limits, &model, &error) != SHD_OK) return fail(path, &error);
    const shd_status status = shd_import_scene(model, import, &json, &length, &error);
    shd_model_drop(model);
    if (status != SHD_OK) return status == SHD_CANCELLED ? CLI_FAILED : fail(path, &error);
    return finish_scene(options->output, json, length);
}

static int import_material(const char *path, const cli_options *options,
                           const shd_import_options *import) {
    char *text, *json, name[64], maps[256];
    size_t length;
    shd_error error;
    shd_import_material material;
    if (!cli_read_file(path, 1 << 20, &text, &length)) return CLI_FAILED;
    const shd_status status =
        shd_import_three(text, length, options->phong, name, maps, &material, &error);
    free(text);
    if (status != SHD_OK) return fail(path, &error);
    if (*maps) {
        char note[300];
        snprintf(note, sizeof note, "its textures are left out: %s", maps);
        import->note(import->context, note);
    }
    if (shd_import_sphere(name, &material, import, &json, &length, &error) != SHD_OK)
        return fail(path, &error);
    return finish_scene(options->output, json, length);
}

int cli_import(const char *path, const cli_options *options) {
    static const char *const models[] = {"obj", "gltf", "glb", "ply", "stl", NULL};
    static const char *const materials[] = {"json", NULL};
    const bool is_model = has_suffix(path, models);
    if (!is_model && !has_suffix(path, materials))
        return cli_usage("unknown suffix in '%s': obj, gltf, glb, ply, stl and json are known",
                         path);
    importing it = {.model = path, .folder = options->meshes};
    const shd_import_options import = {.phong = options->phong,
                                       .keep = it.folder ? write_mesh : NULL,
                                       .note = print_note,
                                       .context = &it};
    if (!is_model && it.folder) return cli_usage("--meshes is for models");
    if (it.folder && !cli_make_folder(it.folder)) return CLI_FAILED;
    const int result =
        is_model ? import_model(path, options, &import) : import_material(path, options, &import);
    if (result == CLI_DONE && it.kept) tell_how_to_put(&it);
    return result;
}
