/* Commands about a picture of a scene. */
#include <stdlib.h>
#include <string.h>

#include "cli/cli.h"

int cli_on_picture(const char *picture, const char *scene, const cli_options *options,
                   cli_work_on_picture *work) {
    shd_engine *engine = NULL;
    shd_request *request = NULL;
    shd_error error;
    shd_format format;
    char *text = NULL;
    size_t length;
    int result = CLI_FAILED;
    const char *dot = strrchr(picture, '.');
    if (!dot || !shd_format_find(dot + 1, &format))
        return cli_usage("unknown suffix in '%s': png, jpg, webp, tif, exr and hdr are known",
                         picture);
    if (!cli_read_file(scene, (size_t)options->engine.limits.body, &text, &length))
        return CLI_FAILED;
    if (shd_engine_new(&options->engine, &engine, &error) ||
        shd_request_new(engine, &request, &error)) {
        cli_say("%s%s%s", error.path, *error.path ? ": " : "", error.text);
    } else {
        const shd_status status = shd_request_read(request, text, length, format);
        cli_print_report(cli_name_of(scene), 0, shd_request_report(request));
        if (status == SHD_OK) result = work(request, picture, format, scene, options);
    }
    shd_request_drop(request);
    shd_engine_drop(engine);
    free(text);
    return result;
}
