/* A scene and its variants, as POST /v1/batch has them:
 *
 *     {"scene": {...}, "variants": [merge patches (RFC 7396)]}
 *     {"scene": {...}, "sweep": {JSON Pointer (RFC 6901): [values], ...}}
 *     {"scene": {...}}: itself
 *
 * `name` may stand beside the scene, and `sheet`: {"columns": 4, "labels": true}, which makes one
 * picture of all variants. Instead of both lists there may be a `turntable`: {"frames": 36}, whose
 * variants are the frames of an animation. Each variant is a document of its own, made of the text
 * when it is asked for. */
#pragma once

#include "base/arena.h"
#include "base/cancel.h"
#include "base/format.h"
#include "base/limits.h"
#include "base/report.h"

enum {
    SHD_VARIANTS_MOST = 10000,
    SHD_AXES_MOST = 32,
    SHD_CELLS_MOST = 1000,
    SHD_FRAMES_MOST = 360
};

/* How variants become one picture, if that is wanted. */
typedef struct shd_sheet_wish {
    bool wanted, labels;
    int columns; /* 0: about as many as rows */
} shd_sheet_wish;

/* The camera goes around its target once, counterclockwise as seen from where `up` points. The
 * first frame is the scene's own picture. */
typedef struct shd_turn {
    int frames;       /* 0: none are wanted */
    int format;       /* SHD_WEBP or SHD_PNG */
    int milliseconds; /* that a frame is shown */
    double position[3], target[3], up[3];
} shd_turn;

typedef struct shd_variants shd_variants;

/* Reads the text, of which the variants are until they are dropped. The scene may need them to be
 * complete: what is wrong with variants is found when they are read. Returns the report's status.
 */
shd_status shd_variants_read(const char *text, size_t length, const shd_limits *limits,
                             const atomic_bool *cancelled, shd_arena *arena, shd_variants **out,
                             shd_report *report);
void shd_variants_drop(shd_variants *variants); /* NULL is fine */

/* Whether a text, which need not be sound, is an object with a member `scene`: no scene is. */
bool shd_variants_are(const char *text, size_t length);

/* The name, or "" if there is none. */
const char *shd_variants_name(const shd_variants *variants);

size_t shd_variants_count(const shd_variants *variants);
size_t shd_variants_size(const shd_variants *variants); /* of the scene's text, in bytes */

/* The document of a variant, which the caller frees. Of a sweep, the last list goes on fastest.
 * SHD_SCENE: a pointer leads nowhere; SHD_EXHAUSTED, SHD_CANCELLED. Any thread. */
shd_status shd_variants_document(const shd_variants *variants, size_t index,
                                 const atomic_bool *cancelled, char **text, size_t *length,
                                 shd_error *error);

shd_sheet_wish shd_variants_sheet(const shd_variants *variants);
shd_turn shd_variants_turn(const shd_variants *variants);

/* What a variant is called on a sheet, in lines: the sheet's own label, or what is changed, such as
 * "shininess 30". The caller frees it. NULL: memory is short. */
char *shd_variants_label(const shd_variants *variants, size_t index);

/* Where the mistake of a variant at `pointer` of its document stands in the batch: at the value of
 * a list that was put there, or in the scene; "/variants/3" of merge patches. The caller frees it.
 * NULL: memory is short. */
char *shd_variants_place(const shd_variants *variants, size_t index, const char *pointer);
