/* When a request is cancelled, its work ends soon.
 *
 * Any thread may raise a request's flag: its client is gone, its deadline has passed, the process
 * ends. Whatever works for the request looks at the flag between pieces of work that are bounded
 * whatever the document says, of some millions of instructions at most, and leaves when it is
 * raised. What it leaves behind is then not what it promises, and nobody uses it: the stage says
 * SHD_CANCELLED, or the one that called it does. tests/property/cancel.c holds every stage to
 * that. */
#ifndef SHD_BASE_CANCEL_H
#define SHD_BASE_CANCEL_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

/* Whether the flag is raised. NULL: nobody raises it. As cheap as a call. */
bool shd_is_cancelled(const atomic_bool *flag);

/* For loops whose steps are short: looks at the flag in one step of 1024, the first among them. */
static inline bool shd_is_cancelled_at(const atomic_bool *flag, size_t step) {
    return step % 1024 == 0 && shd_is_cancelled(flag);
}

#endif
