/* When a request is cancelled, its work ends soon.
 *
 * Any thread may raise a request's flag: its client is gone, its deadline has passed, or the
 * process ends. All code that works for the request looks at the flag every few million
 * instructions at most, whatever the document says, and leaves if it is raised. What it leaves
 * behind is then not what it promises, and nobody uses it: the stage says SHD_CANCELLED, or its
 * caller does. tests/property/cancel.c holds every stage to that. */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

/* Whether the flag is raised. NULL: nobody raises it. As cheap as a call. */
bool shd_is_cancelled(const atomic_bool *flag);

/* For loops with short steps: looks at the flag in one step of 1024, the first one among them. */
static inline bool shd_is_cancelled_at(const atomic_bool *flag, size_t step) {
    return step % 1024 == 0 && shd_is_cancelled(flag);
}
