#include <stdlib.h>
#include <string.h>

#include "cli/cli.h"

enum { LONGEST = 8000 }; /* bytes of a request's target that the daemon takes */

static int print_link(const char *name, char *path) {
    const size_t length = strlen(path);
    if (length > LONGEST) {
        cli_say(
            "%s: the link has %zu bytes, and %d is the most that a daemon takes: PUT the scene to "
            "/v1/scenes, which makes a short one",
            name, length, LONGEST);
        return CLI_FAILED;
    }
    path[length] = '\n'; /* replaces the final 0, which nobody needs any more */
    return cli_write_stdout(path, length + 1) ? CLI_DONE : CLI_FAILED;
}

static int link_text(shd_request *request, const char *name, const char *text, size_t length) {
    shd_error error;
    char *path;
    const shd_status status = shd_request_read(request, text, length, SHD_PNG);
    cli_print_report(name, 0, shd_request_report(request));
    if (status != SHD_OK) return CLI_FAILED;
    if (shd_request_link(request, text, length, &path, &error) != SHD_OK) {
        cli_print_error(name, &error);
        return CLI_FAILED;
    }
    const int result = print_link(name, path);
    free(path);
    return result;
}

int cli_link(const char *scene, const shd_engine_options *options) {
    shd_engine *engine = NULL;
    shd_request *request = NULL;
    shd_error error;
    char *text = NULL;
    size_t length;
    int result = CLI_FAILED;
    if (!cli_read_file(scene, (size_t)options->limits.body, &text, &length)) return CLI_FAILED;
    if (shd_engine_new(options, &engine, &error) || shd_request_new(engine, &request, &error))
        cli_say("%s%s%s", error.path, *error.path ? ": " : "", error.text);
    else
        result = link_text(request, cli_name_of(scene), text, length);
    shd_request_drop(request);
    shd_engine_drop(engine);
    free(text);
    return result;
}
