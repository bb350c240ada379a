/* Reads scene documents, one a line, and answers each with a line of JSON:
 *     {"status": 2, "errors": [["/objects/0/radius", "must be ..."], ...], "warnings": [...]}
 * so that a test in another language may ask about hundreds of them in one run. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>

#include "scene/scene.h"
#include "unit/scene_catalog.h"

static json_t *list(const shd_problem *problems, size_t count) {
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(array, json_pack("[ss]", problems[i].pointer, problems[i].detail));
    return array;
}

static void answer(const char *text, size_t length) {
    static const shd_limits limits = {.pixels = 1 << 24,
                                      .samples = 1 << 30,
                                      .lights = 100,
                                      .objects = 100,
                                      .triangles = 1 << 22,
                                      .body = 1 << 26,
                                      .memory = 1 << 28};
    shd_arena *arena = shd_arena_new(limits.memory);
    if (!arena) abort();
    shd_report report;
    const shd_scene *scene = NULL;
    shd_report_init(&report, arena);
    shd_status status = shd_scene_read(text, length, &scene_catalog, &limits, NULL, SHD_PNG, NULL,
                                       arena, &scene, &report);
    json_t *line = json_pack("{sisoso}", "status", (int)status, "errors",
                             list(report.errors, shd_report_errors_kept(&report)), "warnings",
                             list(report.warnings, shd_report_warnings_kept(&report)));
    if (!line) abort();
    json_dumpf(line, stdout, JSON_COMPACT);
    putchar('\n');
    json_decref(line);
    shd_arena_drop(arena);
}

int main(void) {
    char *line = NULL;
    size_t size = 0;
    for (ssize_t length; (length = getline(&line, &size, stdin)) > 0;) {
        if (line[length - 1] == '\n') length--;
        answer(line, (size_t)length);
    }
    free(line);
    return 0;
}
