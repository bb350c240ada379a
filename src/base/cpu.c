#include "base/cpu.h"

#include <string.h>

bool shd_cpu_has(shd_isa isa) {
    if (isa == SHD_PORTABLE) return true;
#ifdef SHD_HAS_X86_VARIANTS
    if (isa == SHD_AVX2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (isa == SHD_AVX512)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
#endif
    return false;
}

#if defined(__aarch64__)
enum { BASELINE_FUSES = true };
#define BASELINE "neon"
#else
enum { BASELINE_FUSES = false };
#define BASELINE "portable"
#endif

bool shd_isa_fuses(shd_isa isa) {
    return isa != SHD_PORTABLE || BASELINE_FUSES;
}

shd_isa shd_cpu_best(void) {
    shd_isa isa = SHD_ISA_COUNT - 1;
    while (!shd_cpu_has(isa)) isa--;
    return isa;
}

const char *shd_isa_name(shd_isa isa) {
    static const char *const names[SHD_ISA_COUNT] = {BASELINE, "avx2", "avx512"};
    return names[isa];
}

bool shd_isa_find(const char *name, shd_isa *out) {
    shd_isa isa = SHD_PORTABLE;
    if (!strcmp(name, "auto"))
        isa = shd_cpu_best();
    else if (strcmp(name, "portable"))
        while (isa < SHD_ISA_COUNT && strcmp(name, shd_isa_name(isa))) isa++;
    if (isa == SHD_ISA_COUNT || !shd_cpu_has(isa)) return false;
    *out = isa;
    return true;
}
