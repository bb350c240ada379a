/* A scene and its variants, as POST /v1/batch has them:
 *
 *     {"scene": {...}, "variants": [merge patches (RFC 7396)]}
 *     {"scene": {...}, "sweep": {JSON Pointer (RFC 6901): [values], ...}}
 *     {"scene": {...}}: itself
 *
 * `name` may stand beside the scene. Each variant is a document of its own, made of the text when
 * it is asked for. */
#pragma once

#include "base/arena.h"
#include "base/cancel.h"
#include "base/limits.h"
#include "base/report.h"

enum { SHD_VARIANTS_MOST = 10000, SHD_AXES_MOST = 32 };

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
