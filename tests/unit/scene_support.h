/* Reading scenes in tests: text in, scene and report out, and what there is to ask of them.
 * Single quotes stand for double ones, so that documents stay readable in C. */
#ifndef SHD_TEST_SCENE_SUPPORT_H
#define SHD_TEST_SCENE_SUPPORT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "scene/scene.h"
#include "unit/scene_catalog.h"

typedef struct reading {
    shd_arena *arena;
    shd_report report;
    const shd_scene *scene;
    shd_status status;
} reading;

static const shd_limits scene_limits = {.pixels = 1 << 24,
                                        .samples = 1 << 30,
                                        .lights = 64,
                                        .objects = 1000,
                                        .triangles = 1 << 20,
                                        .body = 1 << 24,
                                        .memory = 1 << 28};

static reading read_bytes(const char *text, size_t length, const shd_limits *limits) {
    reading out = {.arena = shd_arena_new(limits->memory)};
    assert_non_null(out.arena);
    shd_report_init(&out.report, out.arena);
    out.status = shd_scene_read(text, length, &scene_catalog, limits, NULL, SHD_PNG, NULL,
                                out.arena, &out.scene, &out.report);
    assert_int_equal(out.status, out.report.status);
    assert_true((out.status == SHD_OK) == (out.scene != NULL));
    assert_true((out.status == SHD_OK) == (out.report.error_count == 0));
    return out;
}

static inline reading read_with(const char *text, const shd_limits *limits) {
    size_t length = strlen(text);
    char *quoted = malloc(length + 1);
    assert_non_null(quoted);
    for (size_t i = 0; i <= length; i++) quoted[i] = text[i] == '\'' ? '"' : text[i];
    reading out = read_bytes(quoted, length, limits);
    free(quoted);
    return out;
}

static inline reading read_scene(const char *text) {
    reading out = read_with(text, &scene_limits);
    for (size_t i = 0; i < shd_report_errors_kept(&out.report); i++)
        print_error("%s: %s\n", out.report.errors[i].pointer, out.report.errors[i].detail);
    assert_int_equal(out.status, SHD_OK);
    return out;
}

static inline void drop(reading *r) {
    shd_arena_drop(r->arena);
}

static inline void assert_vec(shd_vec3 v, double x, double y, double z) {
    assert_float_equal(v.x, x, 1e-12);
    assert_float_equal(v.y, y, 1e-12);
    assert_float_equal(v.z, z, 1e-12);
}

static inline void assert_rgb(const double rgb[3], double r, double g, double b) {
    assert_vec((shd_vec3){rgb[0], rgb[1], rgb[2]}, r, g, b);
}

/* Whether one of the problems is at the pointer and says the words. */
static inline bool has_problem(const shd_problem *problems, size_t count, const char *pointer,
                               const char *words) {
    for (size_t i = 0; i < count; i++)
        if (!strcmp(problems[i].pointer, pointer) && strstr(problems[i].detail, words)) return true;
    return false;
}

static inline bool has_error(const reading *r, const char *pointer, const char *words) {
    return has_problem(r->report.errors, shd_report_errors_kept(&r->report), pointer, words);
}

static inline bool has_warning(const reading *r, const char *pointer, const char *words) {
    return has_problem(r->report.warnings, shd_report_warnings_kept(&r->report), pointer, words);
}

typedef struct refusal {
    const char *text, *pointer, *words;
} refusal;

/* Each document is refused for exactly one reason. */
static inline void assert_refused(const refusal *cases, size_t count) {
    for (size_t i = 0; i < count; i++) {
        reading r = read_with(cases[i].text, &scene_limits);
        if (!has_error(&r, cases[i].pointer, cases[i].words) || r.report.error_count != 1) {
            print_error("%s\n  wanted one error %s: %s\n", cases[i].text, cases[i].pointer,
                        cases[i].words);
            for (size_t e = 0; e < shd_report_errors_kept(&r.report); e++)
                print_error("  got %s: %s\n", r.report.errors[e].pointer,
                            r.report.errors[e].detail);
            fail();
        }
        drop(&r);
    }
}

#define ASSERT_REFUSED(cases) assert_refused(cases, sizeof(cases) / sizeof(cases)[0])

/* A scene of one sphere with further members before it. */
#define WITH(members)   "{" members ", 'objects': [{'type': 'sphere'}]}"
#define OBJECT(members) "{'objects': [{" members "}]}"
#define LIGHT(members)  WITH("'lights': [{" members "}]")
#define OUTPUT(members) WITH("'output': {" members "}")
#define MESH(members)   OBJECT("'type': 'mesh', " members)

#endif
