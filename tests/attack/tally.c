#include "attack/tally.h"

#include <math.h>

void tally_add(counts *to, const counts *by) {
    to->scenes += by->scenes;
    to->pictures += by->pictures;
    to->pixels += by->pixels;
    to->samples += by->samples;
    to->undecided += by->undecided;
    to->unbounded += by->unbounded;
    to->refused += by->refused;
    to->findings += by->findings;
    for (int k = 0; k < 4; k++) to->share[k] = fmax(to->share[k], by->share[k]);
    for (int i = 0; i < LOOSE * EIGHTHS; i++) (&to->loose[0][0])[i] += (&by->loose[0][0])[i];
}

uint64_t tally_findings(const tally *a) {
    uint64_t sum = 0;
    for (int i = 0; i < a->chosen_count; i++) sum += a->counts[i].findings;
    return sum;
}

void tally_print_table(FILE *out, const tally *a) {
    fprintf(
        out,
        "| scenes of | what | scenes | pictures | samples against the model | undecided | "
        "exact | linear | code | deltaE2000 | no bound | findings |\n"
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
    counts all = {0};
    for (int i = 0; i <= a->chosen_count; i++) {
        const counts *c = i < a->chosen_count ? &a->counts[i] : &all;
        fprintf(out, "| %s | %s | %llu | %llu | %llu | %llu |",
                i < a->chosen_count ? a->chosen[i]->name : "all",
                i < a->chosen_count ? a->chosen[i]->about : "", (unsigned long long)c->scenes,
                (unsigned long long)c->pictures, (unsigned long long)c->samples,
                (unsigned long long)c->undecided);
        for (int k = 0; k < 4; k++) fprintf(out, " %.2g |", c->share[k]);
        fprintf(out, " %llu | %llu |\n", (unsigned long long)c->unbounded,
                (unsigned long long)c->findings);
        if (i < a->chosen_count) tally_add(&all, c);
    }
}

/* So many of these are at most that. */
static double share_of(const uint64_t by[EIGHTHS], double share) {
    uint64_t all = 0, below = 0;
    int i = 0;
    for (int k = 0; k < EIGHTHS; k++) all += by[k];
    while (i < EIGHTHS && (double)(below += by[i]) < share * (double)all) i++;
    return all ? exp2((i + 0.5) / 8) : NAN;
}

void tally_print_looseness(FILE *out, const tally *a) {
    counts all = {0};
    for (int i = 0; i < a->chosen_count; i++) tally_add(&all, &a->counts[i]);
    fprintf(
        out,
        "Bounds of the standard tier over what is measured, median and 95 %% of the pictures with "
        "4 samples:\n");
    static const char *const of[LOOSE] = {"linear", "deltaE2000 by planning",
                                          "deltaE2000 by the picture's colors"};
    for (int k = 0; k < LOOSE; k++)
        fprintf(out, "%.3g and %.3g %s%s\n", share_of(all.loose[k], 0.5),
                share_of(all.loose[k], 0.95), of[k], k + 1 < LOOSE ? "," : ".");
}

bool tally_write_page(const tally *a, const char *path, double seconds, int threads,
                      uint64_t first) {
    FILE *out = fopen(path, "w");
    if (!out) return false;
    fprintf(
        out,
        "# Attacks\n\n"
        "`./dev attack SECONDS` wrote this page. It draws random scenes of the families below, "
        "which are made to be hard,\nin every tier and under budgets in every metric. The exact "
        "tier's picture is held against\n`tests/attack/model.c`, an evaluation of "
        "[the model](model.md) in long double or 113 bits that shares no\ncode with `src/`. "
        "Every other picture is held against the exact tier's, which takes the full pattern of\n"
        "samples. All three metrics are held to the bound that was stated, and to the budget: the "
        "exact tier to an\nestimate where that is less, and to what the rays of mirrors and glass "
        "tell of a picture. A finding is told with\nits seed; `./dev attack --seed FAMILY:N` makes "
        "it again.\n\n"
        "%.0f seconds on %d thread%s, seeds from %llu: %llu findings.\n\n",
        seconds, threads, threads == 1 ? "" : "s", (unsigned long long)first,
        (unsigned long long)tally_findings(a));
    tally_print_table(out, a);
    fprintf(out,
            "\nThe columns `exact` to `deltaE2000` are the largest error that was measured, over "
            "its bound: `exact` compares the\nexact tier with the model, the others compare all "
            "other pictures with the exact one. CIEDE2000's bound is\nthat of the picture's own "
            "colors. A sample is undecided if the model jumps within rounding of it\n"
            "(`tests/attack/model.h` says when); any of the values there counts as right. `no "
            "bound` counts\n"
            "scenes of which the exact tier tells that no bound in linear components is known.\n");
    return fclose(out) == 0;
}
