/* `shade render`, `shade explain`, `shade compare` and `shade check`. */
#ifndef SHD_CLI_RENDER_H
#define SHD_CLI_RENDER_H

#include "shaded.h"

typedef struct cli_options {
    const char *output; /* -o; NULL: not given */
    bool json;          /* --json */
    shd_engine_options engine;
} cli_options;

/* What one scene may take on the command line, whose user owns the machine too. */
shd_limits cli_limits(void);

/* All return the program's exit status. */
int cli_render(const char *scene, const cli_options *options);
int cli_explain(const char *scene, const cli_options *options);
int cli_compare(const char *scene, const cli_options *options);
int cli_check(const char *const *scenes, size_t count, const cli_options *options);

#endif
