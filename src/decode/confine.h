/* What the kernel lets shaded-decode do from here on. */
#pragma once

#include <stdbool.h>

/* Leaves the process no system calls but those that decoding takes: it can open, start, connect and
 * signal nothing else, whatever code runs in it, and cannot take that back. Of all of its threads;
 * PR_SET_NO_NEW_PRIVS is set. False: nothing has changed, because the kernel or a filter around the
 * process refuses, or the build does without: sanitizers, other machines than x86-64 and arm64.
 * seccomp(2). */
bool shd_confine(void);
