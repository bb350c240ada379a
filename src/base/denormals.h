/* Denormal numbers count as zero on threads that run kernels: highlights fade through them, and
 * processors take a hundred cycles for each. That changes only numbers below 1e-37 (f32) or 1e-307
 * (f64). The setting is the thread's own. */
#pragma once

#include <stdint.h>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

typedef uint64_t shd_denormals;

/* Reads what is set on this thread, and sets it again. */
static inline shd_denormals shd_denormals_now(void) {
#if defined(__SSE2__)
    return _mm_getcsr();
#elif defined(__aarch64__)
    uint64_t now;
    __asm__ volatile("mrs %0, fpcr" : "=r"(now));
    return now;
#else
    return 0;
#endif
}

static inline void shd_denormals_restore(shd_denormals before) {
#if defined(__SSE2__)
    _mm_setcsr((unsigned)before);
#elif defined(__aarch64__)
    __asm__ volatile("msr fpcr, %0" : : "r"(before));
#else
    (void)before;
#endif
}

#if defined(__SSE2__)
enum { SHD_DENORMALS_BITS = 0x8040 }; /* FTZ, DAZ */
#elif defined(__aarch64__)
enum { SHD_DENORMALS_BITS = 1 << 24 }; /* FZ */
#else
enum { SHD_DENORMALS_BITS = 0 };
#endif

/* Makes denormal results and operands zero on this thread if the processor can, or lets them be.
 * Both return what was set before. */
static inline shd_denormals shd_denormals_flush(void) {
    const shd_denormals before = shd_denormals_now();
    shd_denormals_restore(before | SHD_DENORMALS_BITS);
    return before;
}

static inline shd_denormals shd_denormals_keep(void) {
    const shd_denormals before = shd_denormals_now();
    shd_denormals_restore(before & ~(shd_denormals)SHD_DENORMALS_BITS);
    return before;
}
