/* Times the shading kernels alone: nanoseconds a pixel-light by tier, variant and shininess, four
 * attenuated point lights, one lobe, points in the order of a sphere's picture.
 *
 * Machines are noisy, so each figure is the least of several runs, and what to compare are the
 * ratios. Usage: bench_kernels [RUNS] */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "shade/lighting.h"

enum { SIDE = 64, MOST = SIDE * SIDE, LIGHTS = 4 };

/* A sphere of radius 1 seen from (0, 0, 4): what both kinds of points are made from. */
typedef struct surface {
    size_t count;
    double position[3][MOST], normal[3][MOST], view[3][MOST];
    _Alignas(64) float position32[3][MOST], normal32[3][MOST], mirror32[3][MOST];
} surface;

static double nanoseconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

static void make_surface(surface *s) {
    size_t n = 0;
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            double u = (2 * x + 1) / (double)SIDE - 1, w = 1 - (2 * y + 1) / (double)SIDE;
            if (u * u + w * w >= 1) continue;
            shd_vec3 p = {u, w, sqrt(1 - u * u - w * w)}, v = p;
            shd_normalize(shd_sub((shd_vec3){0, 0, 4}, p), &v);
            if (!(shd_dot(p, v) > 0)) continue;
            shd_vec3 m = shd_sub(shd_scale(p, 2 * shd_dot(p, v)), v);
            const double pa[3] = {p.x, p.y, p.z}, va[3] = {v.x, v.y, v.z}, ma[3] = {m.x, m.y, m.z};
            for (int c = 0; c < 3; c++) {
                s->position[c][n] = s->normal[c][n] = pa[c];
                s->position32[c][n] = s->normal32[c][n] = (float)pa[c];
                s->view[c][n] = va[c];
                s->mirror32[c][n] = (float)ma[c];
            }
            n++;
        }
    }
    s->count = n / SHD_LANES * SHD_LANES;
}

static double time_of(const surface *s, shd_tier tier, shd_isa isa, double shininess, int runs) {
    shd_arena *arena = shd_arena_new(1 << 20);
    static const shd_scene scene = {.light_count = LIGHTS, .material_count = 1};
    shd_plan_light lights[LIGHTS];
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (shd_plan_light){.index = (size_t)i,
                                     .attenuated = true,
                                     .position = {i - 1.5, 2 - i % 2, 3},
                                     .color = {1, 1, 1},
                                     .a = 1,
                                     .b = 0.1,
                                     .c = 0.05,
                                     .gain = 1};
    const shd_plan_lobe lobe = {{1, 1, 1}, shininess};
    const shd_plan_material material = {.lobes = &lobe, .lobe_count = 1};
    const shd_plan plan = {.scene = &scene,
                           .tier = tier,
                           .isa = isa,
                           .lights = lights,
                           .light_count = LIGHTS,
                           .materials = &material,
                           .grey_lights = true,
                           .scale = 1};
    const shd_lighting *lighting = shd_lighting_new(&plan, NULL, arena);
    if (!lighting) exit(1);
    static _Alignas(64) float diffuse[MOST], specular[MOST];
    static _Alignas(64) double diffuse64[MOST], specular64[MOST];
    float *const D[3] = {diffuse}, *const S[3] = {specular};
    double *const D64[3] = {diffuse64}, *const S64[3] = {specular64};
    static const uint32_t which[LIGHTS] = {0, 1, 2, 3};
    shd_points32 points = {.count = s->count};
    for (int c = 0; c < 3; c++) {
        points.position[c] = s->position32[c];
        points.normal[c] = s->normal32[c];
        points.mirror[c] = s->mirror32[c];
    }
    shd_points64 exact = {.count = s->count};
    for (int c = 0; c < 3; c++) {
        exact.position[c] = s->position[c];
        exact.normal[c] = s->normal[c];
        exact.view[c] = s->view[c];
    }
    double least = 1e30;
    for (int r = 0; r < runs; r++) {
        double start = nanoseconds();
        if (tier == SHD_EXACT)
            shd_light_sums64(lighting, &material, which, LIGHTS, &exact, D64, S64);
        else
            shd_light_sums32(lighting, &material, which, LIGHTS, &points, D, S, NULL);
        double took = nanoseconds() - start;
        if (took < least) least = took;
    }
    shd_arena_drop(arena);
    return least / (double)(s->count * LIGHTS);
}

static void print_times(const surface *s, int runs) {
    static const double shininess[] = {5, 50, 1e3, 1e5};
    printf("ns a pixel-light: %d lights, %zu points, least of %d runs\n\n%-9s %-9s", LIGHTS,
           s->count, runs, "tier", "variant");
    for (size_t i = 0; i < sizeof shininess / sizeof *shininess; i++)
        printf(" ns %-6g", shininess[i]);
    for (shd_tier tier = SHD_STANDARD; tier <= SHD_EXACT; tier++) {
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
            if (!shd_cpu_has(isa)) continue;
            printf("\n%-9s %-9s", shd_tier_names[tier], shd_isa_name(isa));
            for (size_t i = 0; i < sizeof shininess / sizeof *shininess; i++)
                printf(" %-9.3f", time_of(s, tier, isa, shininess[i], runs));
        }
    }
    putchar('\n');
}

static const char *name_processor(void) {
    static char line[256];
    FILE *f = fopen("/proc/cpuinfo", "r");
    while (f && fgets(line, sizeof line, f))
        if (!strncmp(line, "model name", 10) && strchr(line, ':')) break;
    if (f) fclose(f);
    line[strcspn(line, "\n")] = 0;
    const char *colon = strchr(line, ':');
    return colon ? colon + 2 : "an unknown one";
}

/* src/plan/kernel_costs.h, as plan/cost.h has it. Few points see a lobe of shininess 1e5; at 50
 * many do. */
static int print_table(const surface *s, int runs) {
    static const char *const isas[SHD_ISA_COUNT] = {
        [SHD_PORTABLE] = "SHD_PORTABLE", [SHD_AVX2] = "SHD_AVX2", [SHD_AVX512] = "SHD_AVX512"};
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++)
        if (!shd_cpu_has(isa)) {
            fprintf(stderr, "kernels: this machine has no %s\n", shd_isa_name(isa));
            return 1;
        }
    printf(
        "/* What lights cost on one processor, %s: `./dev bench --kernels` makes this file. Inside "
        "of plan/. */\n#pragma once\n\n",
        name_processor());
    puts("#include \"plan/cost.h\"\n\n"
         "static const shd_kernel_cost shd_kernel_costs[SHD_ISA_COUNT][SHD_EXACT + 1] = {");
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        double light[SHD_EXACT + 1], both[SHD_EXACT + 1];
        for (shd_tier tier = SHD_STANDARD; tier <= SHD_EXACT; tier++) {
            light[tier] = time_of(s, tier, isa, 1e5, runs);
            both[tier] = fmax(time_of(s, tier, isa, 50, runs), light[tier]);
        }
        printf("    [%s] = {[SHD_STANDARD] = {%.1f, %.1f}, [SHD_EXACT] = {%.1f, %.1f}},\n",
               isas[isa], light[SHD_STANDARD], both[SHD_STANDARD] - light[SHD_STANDARD],
               light[SHD_EXACT], both[SHD_EXACT] - light[SHD_EXACT]);
    }
    puts("};");
    return 0;
}

int main(int argc, char **argv) {
    static surface s;
    make_surface(&s);
    if (argc > 1 && !strcmp(argv[1], "--table")) return print_table(&s, 2000);
    print_times(&s, argc > 1 ? atoi(argv[1]) : 200);
    return 0;
}
