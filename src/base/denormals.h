/* Denormal numbers count as zero on threads that run kernels: highlights fade through them, and
 * processors take a hundred cycles for each. That changes only numbers below 1e-37 (f32) or 1e-307
 * (f64). The setting is the thread's own. */
#pragma once

#include <stdint.h>

/* The bits of the processor's control register: results, and operands, are zero. */
typedef uint64_t shd_denormals;

#if defined(__SSE2__)
#include <immintrin.h>
static const shd_denormals SHD_NO_DENORMALS = 0x8040; /* FTZ, DAZ */
#elif defined(__aarch64__)
static const shd_denormals SHD_NO_DENORMALS = 1 << 24; /* FZ */
#else
static const shd_denormals SHD_NO_DENORMALS = 0; /* the processor cannot */
#endif

/* Sets what happens on this thread: SHD_NO_DENORMALS, 0 for IEEE 754's numbers, or what this
 * function has returned, which is what was set before. */
static inline shd_denormals shd_denormals_set(shd_denormals bits) {
    uint64_t now = 0;
#if defined(__SSE2__)
    now = _mm_getcsr();
    _mm_setcsr((unsigned)((now & ~SHD_NO_DENORMALS) | bits));
#elif defined(__aarch64__)
    __asm__ volatile("mrs %0, fpcr" : "=r"(now));
    __asm__ volatile("msr fpcr, %0" : : "r"((now & ~SHD_NO_DENORMALS) | bits));
#else
    (void)bits;
#endif
    return now & SHD_NO_DENORMALS;
}
