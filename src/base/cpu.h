/* Instruction sets that the kernels are compiled for.
 *
 * Files named *.simd.c are compiled once for each (see CMakeLists.txt), each time with another
 * SHD_ISA. Their exported names end with SHD_VARIANT. Every variant gives the same bits, but one
 * without an instruction that fuses (base/simd.h): it rounds f32 products of lights by themselves.
 */
#pragma once

#include <stdbool.h>

typedef enum shd_isa {
    SHD_PORTABLE, /* what every machine of the build's kind has: SSE2 or NEON, of four floats */
    SHD_AVX2,     /* and FMA */
    SHD_AVX512,   /* F, DQ, BW and VL */
    SHD_ISA_COUNT
} shd_isa;

/* Whether the variant was compiled in and this machine can run it. */
bool shd_cpu_has(shd_isa isa);

/* Whether the variant has an instruction that fuses f32 products into sums. Without it,
 * kernels round products by themselves, or are in f64, for emulation would take longer than that.
 */
bool shd_isa_fuses(shd_isa isa);

/* The widest variant that this machine has. */
shd_isa shd_cpu_best(void);

/* "avx2", "avx512" or "portable", which is "neon" on 64-bit ARM. */
const char *shd_isa_name(shd_isa isa);

/* False: no variant has that name, or this machine cannot run it. "auto" is the widest one, and
 * "portable" SHD_PORTABLE on every machine. */
bool shd_isa_find(const char *name, shd_isa *out);

#define SHD_JOIN_(name, isa) name##_##isa
#define SHD_JOIN(name, isa)  SHD_JOIN_(name, isa)
#define SHD_VARIANT(name)    SHD_JOIN(name, SHD_ISA)

/* The initializer of an array [SHD_ISA_COUNT] of pointers to the variants of an object. Variants
 * that were not compiled in are NULL. */
#ifdef SHD_HAS_X86_VARIANTS
#define SHD_VARIANTS(name)                                                                         \
    { &name##_portable, &name##_avx2, &name##_avx512 }
#else
#define SHD_VARIANTS(name)                                                                         \
    { &name##_portable, 0, 0 }
#endif
