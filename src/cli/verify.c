#include <stdlib.h>
#include <string.h>

#include "cli/cli.h"

static void on_progress(void *request, double share) {
    if (cli_interrupted()) shd_request_cancel(request);
    cli_progress_draw(share);
}

static int verify_request(shd_request *request, const char *picture, shd_format format,
                          const char *scene, const cli_options *options) {
    const shd_render_options render = {.progress = on_progress, .context = request};
    shd_error error;
    char *json = NULL;
    shd_verdict verdict;
    cli_catch_interrupts();
    cli_progress_begin();
    const shd_status status = shd_request_verify(request, picture, format, &options->verify,
                                                 &render, &verdict, &json, &error);
    cli_progress_end();
    cli_end_if_interrupted();
    if (status != SHD_OK) {
        /* Without a place in the scene it is about the picture. */
        cli_print_error(*error.path ? cli_name_of(scene) : picture, &error);
        return CLI_FAILED;
    }
    const size_t length = strlen(json);
    json[length] = '\n'; /* replaces the final 0, which nobody needs any more */
    const bool written = cli_write_stdout(json, length + 1);
    free(json);
    if (verdict == SHD_REFUTED) cli_say("%s is not the picture of %s", picture, cli_name_of(scene));
    if (verdict == SHD_UNDECIDED)
        cli_say("%s may be the picture of %s: no bound is known to hold it against", picture,
                cli_name_of(scene));
    return written && verdict == SHD_VERIFIED ? CLI_DONE : CLI_FAILED;
}

int cli_verify(const char *picture, const char *scene, const cli_options *options) {
    return cli_on_picture(picture, scene, options, verify_request);
}
