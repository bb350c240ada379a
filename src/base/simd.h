/* Vectors of the width that this file is compiled for: SHD_W floats (16, 8 or 4), or half as many
 * doubles. Only *.simd.c use it, which are compiled once for each instruction set (base/cpu.h).
 *
 * Every operation gives the same bits on every machine: + - * / and shd_vf_sqrt round as IEEE 754
 * says, shd_vf_fma rounds once everywhere, and operations that differ by machine (estimates of 1/x,
 * maxima of NaN) are not here. GCC's and clang's vector types have + - * / & | ^ ~ << >>
 * themselves, and casts between types of equal size keep the bits.
 *
 *     shd_vf  floats         shd_vi  int32_t      shd_mf  truth of each float lane
 *     shd_vd  doubles        shd_vl  int64_t      shd_md  truth of each double lane
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#define SHD_W 16
#elif defined(__AVX2__) && defined(__FMA__)
#define SHD_W 8
#else
#define SHD_W 4
#endif
/* As shd_isa_fuses says. */
#if SHD_W > 4 || defined(__aarch64__)
#define SHD_FUSES 1
#else
#define SHD_FUSES 0
#endif
#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

#define SHD_INLINE static inline __attribute__((always_inline))

typedef float shd_vf __attribute__((vector_size(4 * SHD_W)));
typedef int32_t shd_vi __attribute__((vector_size(4 * SHD_W)));
typedef uint32_t shd_vu __attribute__((vector_size(4 * SHD_W)));
typedef double shd_vd __attribute__((vector_size(4 * SHD_W)));
typedef int64_t shd_vl __attribute__((vector_size(4 * SHD_W)));
typedef uint64_t shd_vul __attribute__((vector_size(4 * SHD_W)));
/* Half a vector of floats: as many as a vector has doubles. */
typedef float shd_vh __attribute__((vector_size(2 * SHD_W)));

/* ---- Memory of any alignment, though whole cache lines are faster. ---- */

SHD_INLINE shd_vf shd_vf_load(const float *from) {
    shd_vf v;
    memcpy(&v, from, sizeof v);
    return v;
}

SHD_INLINE void shd_vf_store(float *to, shd_vf v) {
    memcpy(to, &v, sizeof v);
}

SHD_INLINE shd_vd shd_vd_load(const double *from) {
    shd_vd v;
    memcpy(&v, from, sizeof v);
    return v;
}

SHD_INLINE void shd_vd_store(double *to, shd_vd v) {
    memcpy(to, &v, sizeof v);
}

/* ---- Operations that each instruction set spells in its own way. ---- */

#if SHD_W == 16

#define SHD_X86(name) _mm512_##name
typedef __mmask16 shd_mf;
typedef __mmask8 shd_md;

SHD_INLINE shd_mf shd_vf_gt(shd_vf a, shd_vf b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_GT_OQ);
}
SHD_INLINE shd_mf shd_vu_ge(shd_vu a, shd_vu b) {
    return _mm512_cmpge_epu32_mask((__m512i)a, (__m512i)b);
}
SHD_INLINE shd_md shd_vd_gt(shd_vd a, shd_vd b) {
    return _mm512_cmp_pd_mask(a, b, _CMP_GT_OQ);
}
/* Bit i is lane i. */
SHD_INLINE unsigned shd_mf_bits(shd_mf m) {
    return m;
}
SHD_INLINE unsigned shd_md_bits(shd_md m) {
    return m;
}
/* a in the lanes of m, b elsewhere. */
SHD_INLINE shd_vf shd_vf_select(shd_mf m, shd_vf a, shd_vf b) {
    return _mm512_mask_blend_ps(m, b, a);
}
SHD_INLINE shd_vd shd_vd_select(shd_md m, shd_vd a, shd_vd b) {
    return _mm512_mask_blend_pd(m, b, a);
}
/* a b in the lanes of m, +0 elsewhere. */
SHD_INLINE shd_vf shd_vf_mul_in(shd_mf m, shd_vf a, shd_vf b) {
    return _mm512_maskz_mul_ps(m, a, b);
}
SHD_INLINE shd_vd shd_vd_mul_in(shd_md m, shd_vd a, shd_vd b) {
    return _mm512_maskz_mul_pd(m, a, b);
}
SHD_INLINE shd_vh shd_vf_half(shd_vf a, int high) {
    return high ? _mm512_extractf32x8_ps(a, 1) : _mm512_castps512_ps256(a);
}
SHD_INLINE shd_vf shd_vf_join(shd_vh low, shd_vh high) {
    return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}

#else /* masks are vectors of zeros and ones */

typedef shd_vi shd_mf;
typedef shd_vl shd_md;

SHD_INLINE shd_mf shd_vf_gt(shd_vf a, shd_vf b) {
    return (shd_mf)(a > b);
}
SHD_INLINE shd_mf shd_vu_ge(shd_vu a, shd_vu b) {
    return (shd_mf)(a >= b);
}
SHD_INLINE shd_md shd_vd_gt(shd_vd a, shd_vd b) {
    return (shd_md)(a > b);
}
SHD_INLINE shd_vf shd_vf_mul_in(shd_mf m, shd_vf a, shd_vf b) {
    return (shd_vf)(m & (shd_vi)(a * b));
}
SHD_INLINE shd_vd shd_vd_mul_in(shd_md m, shd_vd a, shd_vd b) {
    return (shd_vd)(m & (shd_vl)(a * b));
}

#if SHD_W == 8

#define SHD_X86(name) _mm256_##name

SHD_INLINE shd_vf shd_vf_select(shd_mf m, shd_vf a, shd_vf b) {
    return _mm256_blendv_ps(b, a, (__m256)m);
}
SHD_INLINE shd_vd shd_vd_select(shd_md m, shd_vd a, shd_vd b) {
    return _mm256_blendv_pd(b, a, (__m256d)m);
}
SHD_INLINE shd_vh shd_vf_half(shd_vf a, int high) {
    return high ? _mm256_extractf128_ps(a, 1) : _mm256_castps256_ps128(a);
}
SHD_INLINE shd_vf shd_vf_join(shd_vh low, shd_vh high) {
    return _mm256_set_m128(high, low);
}

#else

#define SHD_X86(name) _mm_##name

SHD_INLINE shd_vf shd_vf_select(shd_mf m, shd_vf a, shd_vf b) {
    return (shd_vf)((m & (shd_vi)a) | (~m & (shd_vi)b));
}
SHD_INLINE shd_vd shd_vd_select(shd_md m, shd_vd a, shd_vd b) {
    return (shd_vd)((m & (shd_vl)a) | (~m & (shd_vl)b));
}
SHD_INLINE shd_vh shd_vf_half(shd_vf a, int high) {
    return high ? (shd_vh){a[2], a[3]} : (shd_vh){a[0], a[1]};
}
SHD_INLINE shd_vf shd_vf_join(shd_vh low, shd_vh high) {
    return (shd_vf){low[0], low[1], high[0], high[1]};
}

#endif
#endif

/* GCC makes vectors of most operations that are written lane by lane here, but not of all. */
#if SHD_W > 4

SHD_INLINE shd_vf shd_vf_fma(shd_vf a, shd_vf b, shd_vf c) {
    return SHD_X86(fmadd_ps)(a, b, c);
}
SHD_INLINE shd_vh shd_vh_narrow(shd_vd a) {
    return SHD_X86(cvtpd_ps)(a);
}
SHD_INLINE shd_vd shd_vd_widen(shd_vh a) {
    return SHD_X86(cvtps_pd)(a);
}

#elif defined(__aarch64__)

SHD_INLINE shd_vf shd_vf_fma(shd_vf a, shd_vf b, shd_vf c) {
    return (shd_vf)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b);
}
SHD_INLINE shd_vh shd_vh_narrow(shd_vd a) {
    return (shd_vh)vcvt_f32_f64((float64x2_t)a);
}
SHD_INLINE shd_vd shd_vd_widen(shd_vh a) {
    return (shd_vd)vcvt_f64_f32((float32x2_t)a);
}

#else

/* Done by the C library, slowly: kernels do without it if this is all there is (shd_isa_fuses). */
SHD_INLINE shd_vf shd_vf_fma(shd_vf a, shd_vf b, shd_vf c) {
    for (int i = 0; i < SHD_W; i++) c[i] = __builtin_fmaf(a[i], b[i], c[i]);
    return c;
}
SHD_INLINE shd_vh shd_vh_narrow(shd_vd a) {
    return (shd_vh){(float)a[0], (float)a[1]};
}
SHD_INLINE shd_vd shd_vd_widen(shd_vh a) {
    return (shd_vd){a[0], a[1]};
}

#endif

#ifdef __SSE2__

SHD_INLINE shd_vf shd_vf_sqrt(shd_vf a) {
    return SHD_X86(sqrt_ps)(a);
}
SHD_INLINE shd_vd shd_vd_sqrt(shd_vd a) {
    return SHD_X86(sqrt_pd)(a);
}
/* a > b ? a : b, and a < b ? a : b: b is the one that may not be NaN. */
SHD_INLINE shd_vf shd_vf_max(shd_vf a, shd_vf b) {
    return SHD_X86(max_ps)(a, b);
}
SHD_INLINE shd_vf shd_vf_min(shd_vf a, shd_vf b) {
    return SHD_X86(min_ps)(a, b);
}
SHD_INLINE shd_vd shd_vd_max(shd_vd a, shd_vd b) {
    return SHD_X86(max_pd)(a, b);
}
SHD_INLINE shd_vd shd_vd_min(shd_vd a, shd_vd b) {
    return SHD_X86(min_pd)(a, b);
}
#if SHD_W < 16
SHD_INLINE unsigned shd_mf_bits(shd_mf m) {
    return (unsigned)SHD_X86(movemask_ps)((shd_vf)m);
}
SHD_INLINE unsigned shd_md_bits(shd_md m) {
    return (unsigned)SHD_X86(movemask_pd)((shd_vd)m);
}
#endif

#else /* not x86 */

#if defined(__aarch64__)

SHD_INLINE shd_vf shd_vf_sqrt(shd_vf a) {
    return (shd_vf)vsqrtq_f32((float32x4_t)a);
}
SHD_INLINE shd_vd shd_vd_sqrt(shd_vd a) {
    return (shd_vd)vsqrtq_f64((float64x2_t)a);
}
SHD_INLINE unsigned shd_mf_bits(shd_mf m) {
    return vaddvq_u32((uint32x4_t)(m & (shd_vi){1, 2, 4, 8}));
}
SHD_INLINE unsigned shd_md_bits(shd_md m) {
    return (unsigned)vaddvq_u64((uint64x2_t)(m & (shd_vl){1, 2}));
}

#else

SHD_INLINE shd_vf shd_vf_sqrt(shd_vf a) {
    for (int i = 0; i < SHD_W; i++) a[i] = __builtin_sqrtf(a[i]);
    return a;
}
SHD_INLINE shd_vd shd_vd_sqrt(shd_vd a) {
    for (int i = 0; i < SHD_W / 2; i++) a[i] = __builtin_sqrt(a[i]);
    return a;
}
SHD_INLINE unsigned shd_mf_bits(shd_mf m) {
    return (unsigned)((m[0] & 1) | (m[1] & 2) | (m[2] & 4) | (m[3] & 8));
}
SHD_INLINE unsigned shd_md_bits(shd_md m) {
    return (unsigned)((m[0] & 1) | (m[1] & 2));
}

#endif

SHD_INLINE shd_vf shd_vf_max(shd_vf a, shd_vf b) {
    return shd_vf_select((shd_mf)(a > b), a, b);
}
SHD_INLINE shd_vf shd_vf_min(shd_vf a, shd_vf b) {
    return shd_vf_select((shd_mf)(a < b), a, b);
}
SHD_INLINE shd_vd shd_vd_max(shd_vd a, shd_vd b) {
    return shd_vd_select((shd_md)(a > b), a, b);
}
SHD_INLINE shd_vd shd_vd_min(shd_vd a, shd_vd b) {
    return shd_vd_select((shd_md)(a < b), a, b);
}

#endif

/* ---- Operations that are the same on all of them. ---- */

/* x - 0 is x, whatever its sign. */
SHD_INLINE shd_vf shd_vf_set(float x) {
    return x - (shd_vf){0};
}
SHD_INLINE shd_vi shd_vi_set(int32_t x) {
    return x - (shd_vi){0};
}
SHD_INLINE shd_vd shd_vd_set(double x) {
    return x - (shd_vd){0};
}
SHD_INLINE shd_vl shd_vl_set(int64_t x) {
    return x - (shd_vl){0};
}
SHD_INLINE shd_mf shd_mf_and(shd_mf a, shd_mf b) {
    return (shd_mf)(a & b);
}
SHD_INLINE shd_mf shd_mf_or(shd_mf a, shd_mf b) {
    return (shd_mf)(a | b);
}
SHD_INLINE shd_mf shd_mf_not(shd_mf a) {
    return (shd_mf)~a;
}
SHD_INLINE shd_md shd_md_and(shd_md a, shd_md b) {
    return (shd_md)(a & b);
}
SHD_INLINE shd_md shd_md_or(shd_md a, shd_md b) {
    return (shd_md)(a | b);
}
SHD_INLINE shd_md shd_md_not(shd_md a) {
    return (shd_md)~a;
}
/* a > b, in the lanes of m. */
SHD_INLINE shd_mf shd_vf_gt_in(shd_mf m, shd_vf a, shd_vf b) {
    return shd_mf_and(m, shd_vf_gt(a, b));
}
SHD_INLINE shd_md shd_vd_gt_in(shd_md m, shd_vd a, shd_vd b) {
    return shd_md_and(m, shd_vd_gt(a, b));
}
SHD_INLINE shd_vf shd_vf_from_vi(shd_vi a) {
    return __builtin_convertvector(a, shd_vf);
}
SHD_INLINE shd_vu shd_vu_set(uint32_t x) {
    return (shd_vu)shd_vi_set((int32_t)x);
}

SHD_INLINE bool shd_mf_any(shd_mf m) {
    return shd_mf_bits(m) != 0;
}
SHD_INLINE bool shd_md_any(shd_md m) {
    return shd_md_bits(m) != 0;
}
