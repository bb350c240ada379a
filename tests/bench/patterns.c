/* Makes the sample patterns: build/bench_patterns > src/base/pattern_rows.inc; with -v each
 * one's error. A minute of one core; the same numbers in every run.
 *
 * A pattern of n is n rooks: sample i lies in column i and in a row of its own, in the middle of
 * both, so that its mean is the pixel's centre. Which rows is decided by how well it tells the
 * share of a pixel that lies on one side of a straight edge. The square of that error, summed over
 * all places of the edge and averaged over all of its directions, is 1/pi of the energy distance of
 * the samples P and the pixel's area U (Szekely and Rizzo, "Energy statistics", 2013),
 *
 *     2 E|P - U| - E|P - P'| - E|U - U'|
 *
 * which wants no edges to be drawn. Nothing is better than a regular grid on glints, which are
 * smooth and smaller than a pixel: the pattern of 64 comes near to it by having a sample in each
 * of its cells, and by counting the error on glints as well (energy.h). Rows are
 * exchanged at random, also for the worse at first (threshold accepting, Dueck and Scheuer 1990),
 * and then as long as any exchange is for the better. Of a pattern's mirror images the one whose
 * rows are last in order is taken. */
#include "energy.h"

enum { STARTS = 40, TRIALS = 2000 };

static double uniform(uint64_t *random) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return (double)(*random >> 11) * 0x1p-53;
}

static void exchange(int *rows, int a, int b) {
    const int row = rows[a];
    rows[a] = rows[b];
    rows[b] = row;
}

static void search(const distances *d, uint64_t *random, int *rows) {
    const int n = d->n, strata = strata_of(n), trials = TRIALS * n * (strata ? 4 : 1);
    const double begin = (strata ? 0.08 : 0.05) / (n * sqrt(n));
    for (int i = 0; i < n; i++) rows[i] = strata ? i % strata * strata + i / strata : i;
    for (int i = n - 1; i > 0 && !strata; i--) exchange(rows, i, (int)(uniform(random) * (i + 1)));
    for (int t = 0; n > 1 && t < trials; t++) {
        const int a = (int)(uniform(random) * n), other = (int)(uniform(random) * (n - 1)),
                  b = other < a ? other : other + 1;
        const double left = 1 - (double)t / trials, room = begin * left * left * left * left;
        if (!may_exchange(strata, rows, a, b)) continue;
        if (exchange_gain(d, rows, a, b) < room * uniform(random)) exchange(rows, a, b);
    }
    for (bool better = true; better;) {
        better = false;
        for (int a = 0; a < n; a++)
            for (int b = a + 1; b < n; b++)
                if (may_exchange(strata, rows, a, b) && exchange_gain(d, rows, a, b) < -ALIKE)
                    exchange(rows, a, b), better = true;
    }
}

/* The image of a pattern that is mirrored: in x, in y and in the diagonal, as bits. */
static void mirror(const int *rows, int n, int how, int *out) {
    for (int i = 0; i < n; i++) {
        const int x = how & 1 ? n - 1 - i : i, y = how & 2 ? n - 1 - rows[i] : rows[i];
        out[how & 4 ? y : x] = how & 4 ? x : y;
    }
}

static bool is_after(const int *a, const int *b, int n) {
    int i = 0;
    while (i < n - 1 && a[i] == b[i]) i++;
    return a[i] > b[i];
}

int main(int argc, char **argv) {
    const bool tell = argc > 1 && !strcmp(argv[1], "-v");
    static distances d;
    uint64_t random = 1, other = 1; /* of patterns without and with strata */
    int column = 0;
    puts("/* Made by tests/bench/patterns.c: the rows of patterns of 1, 2, 3 ... 64 samples; "
         "'0' is row 0. */");
    for (int n = 1; n <= MOST; n++) {
        int best[MOST], rows[MOST], image[MOST];
        double least = INFINITY;
        find_distances(n, &d);
        for (int k = 0; k < STARTS; k++) {
            search(&d, strata_of(n) ? &other : &random, rows);
            const double energy = energy_of(&d, rows);
            if (energy < least - ALIKE) memcpy(best, rows, sizeof best);
            least = fmin(least, energy);
        }
        memcpy(rows, best, sizeof rows);
        for (int how = 1; how < 8; how++) {
            mirror(rows, n, how, image);
            if (is_after(image, best, n)) memcpy(best, image, sizeof best);
        }
        if (tell) fprintf(stderr, "%d: %.6f\n", n, sqrt(least / SHD_PI));
        for (int i = 0; i < n; i++) {
            const char row = (char)('0' + best[i]);
            const int length = row == '\\' ? 2 : 1;
            if (column + length > 94) puts("\""), column = 0;
            if (column == 0) putchar('"');
            column += printf("%s%c", row == '\\' ? "\\" : "", row);
        }
    }
    puts("\"");
    return 0;
}
