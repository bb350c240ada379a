#include <stdlib.h>
#include <string.h>

#include "cli/cli.h"

static void on_progress(void *request, double share) {
    if (cli_interrupted()) shd_request_cancel(request);
    cli_progress_draw(share);
}

/* An error without a place in the scene is about the photo. */
static void print_error(const char *photo, const char *scene, shd_error *error) {
    if (strcmp(error->path, "/object") != 0) {
        cli_print_error(*error->path ? cli_name_of(scene) : photo, error);
        return;
    }
    *error->path = 0;
    cli_print_error("--object", error);
}

static int fit_request(shd_request *request, const char *photo, shd_format format,
                       const char *scene, const cli_options *options) {
    const shd_render_options render = {.progress = on_progress, .context = request};
    shd_error error;
    char *json = NULL;
    cli_catch_interrupts();
    cli_progress_begin();
    const shd_status status =
        shd_request_fit(request, photo, format, options->object, &render, &json, &error);
    cli_progress_end();
    cli_end_if_interrupted();
    if (status != SHD_OK) {
        print_error(photo, scene, &error);
        return CLI_FAILED;
    }
    const size_t length = strlen(json);
    json[length] = '\n'; /* replaces the final 0, which nobody needs any more */
    const bool written = cli_write_stdout(json, length + 1);
    free(json);
    return written ? CLI_DONE : CLI_FAILED;
}

int cli_fit(const char *photo, const char *scene, const cli_options *options) {
    return cli_on_picture(photo, scene, options, fit_request);
}
