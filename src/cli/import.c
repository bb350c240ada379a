#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "cli/cli.h"
#include "import/import.h"

enum { SECONDS = 120, LEAST_MEMORY = 1 << 30 };

typedef struct importing {
    const char *model;             /* as messages call it */
    const char *meshes, *pictures; /* folders */
    size_t kept, shown;            /* meshes and pictures that were written */
    size_t largest;                /* of these, in bytes */
} importing;

static void print_note(void *context, const char *text) {
    const importing *it = context;
    fprintf(stderr, "note: %s: %s\n", it->model, text);
}

/* Files are named by what they hold: one that is there is the same. */
static bool write_into(const char *folder, const char *digest, const char *suffix,
                       const void *bytes, size_t size) {
    cli_file file;
    char *path;
    const size_t length = strlen(folder);
    const char *slash = length && folder[length - 1] == '/' ? "" : "/";
    if (asprintf(&path, "%s%s%s%s%s", folder, slash, digest, *suffix ? "." : "", suffix) < 0) {
        cli_say("out of memory");
        return false;
    }
    const bool written = cli_file_write(path, bytes, size, &file) && cli_file_commit(&file);
    free(path);
    return written;
}

static bool write_mesh(void *context, const void *bytes, size_t size, const char *digest) {
    importing *it = context;
    const bool written = write_into(it->meshes, digest, "", bytes, size);
    it->kept += written;
    if (size > it->largest) it->largest = size;
    return written;
}

static bool write_picture(void *context, const void *bytes, size_t size, const char *digest,
                          const char *suffix) {
    importing *it = context;
    const bool written = write_into(it->pictures, digest, suffix, bytes, size);
    it->shown += written;
    if (size > it->largest) it->largest = size;
    return written;
}

static void tell_how_to_put_meshes(const importing *it) {
    fprintf(
        stderr,
        "note: %s: its meshes are in '%s', for a daemon to keep:\n"
        "  for mesh in '%s'/*; do curl -fT \"$mesh\" -H 'Content-Type: application/octet-stream' "
        "http://127.0.0.1:8080/v1/meshes/${mesh##*/}; done\n",
        it->model, it->meshes, it->meshes);
}

static void tell_how_to_put_pictures(const importing *it) {
    fprintf(
        stderr,
        "note: %s: its pictures are in '%s', for --assets, or for a daemon to keep:\n"
        "  for picture in '%s'/*; do name=${picture##*/} name=${name%%.*}; "
        "[ ${#name} = 64 ] && curl -fT \"$picture\" -H 'Content-Type: application/octet-stream' "
        "http://127.0.0.1:8080/v1/assets/$name; done\n",
        it->model, it->pictures, it->pictures);
}

/* Maps of normals that are made are larger than the pictures of heights that they come of. */
static void tell_of_large_files(const importing *it) {
    const uint64_t taken = shd_engine_defaults().limits.body;
    if (it->largest <= taken) return;
    fprintf(stderr,
            "note: %s: a file of these has %zu bytes: a daemon takes %llu in a request, unless its "
            "--max-body says more\n",
            it->model, it->largest, (unsigned long long)taken);
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
    importing it = {.model = path, .meshes = options->meshes, .pictures = options->engine.assets};
    const shd_import_options import = {.phong = options->phong,
                                       .keep = it.meshes ? write_mesh : NULL,
                                       .picture = it.pictures ? write_picture : NULL,
                                       .note = print_note,
                                       .context = &it};
    if (!is_model && (it.meshes || it.pictures))
        return cli_usage("--meshes and --assets are for models");
    if (it.meshes && !cli_make_folder(it.meshes)) return CLI_FAILED;
    if (it.pictures && !cli_make_folder(it.pictures)) return CLI_FAILED;
    const int result =
        is_model ? import_model(path, options, &import) : import_material(path, options, &import);
    if (result == CLI_DONE && it.kept) tell_how_to_put_meshes(&it);
    if (result == CLI_DONE && it.shown) tell_how_to_put_pictures(&it);
    if (result == CLI_DONE) tell_of_large_files(&it);
    return result;
}
