/* Changes to documents, as text: what is not changed is copied as it is written, so that a mesh
 * costs no more than its bytes. Only for scene/. Documents and patches are known to be sound JSON.
 */
#pragma once

#include "base/cancel.h"
#include "base/status.h"
#include "scene/span.h"

/* A text under construction. All zero is an empty one; its owner frees `data`. */
typedef struct shd_draft {
    char *data;
    size_t size, capacity;
    const atomic_bool *cancelled; /* or NULL */
    size_t steps;                 /* that looked at it */
    shd_status status;            /* SHD_OK, SHD_EXHAUSTED, SHD_CANCELLED: the text is of no use */
} shd_draft;

/* Adds the document with a merge patch applied (RFC 7396). */
void shd_patch_merge(shd_draft *draft, shd_span document, shd_span patch);

/* Adds the document with a value at the place of a JSON Pointer (RFC 6901). Members that are not
 * there are made, as are objects around them; items of arrays must be there. SHD_SCENE: there is no
 * such place; also the draft's own status. */
shd_status shd_patch_replace(shd_draft *draft, shd_span document, const char *pointer,
                             shd_span value, shd_error *error);
