/* For programs under valgrind, by LD_PRELOAD: libhwy, which OpenImageIO brings, executes RDTSCP as
 * it is loaded if the processor has it. Valgrind 3.19 always says so, but cannot execute it where
 * the machine's processor has none, as in some virtual machines. This is what does so. */

#include <stdint.h>

uint64_t _ZN3hwy8platform15TimerResolutionEv(void); /* hwy::platform::TimerResolution() */

uint64_t _ZN3hwy8platform15TimerResolutionEv(void) {
    return 1;
}
