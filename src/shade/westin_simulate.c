/* The simulation: paths over the microgeometry, and what of them each direction sees.
 *
 * A path begins anywhere on the surface and goes from facet to facet as light is scattered by
 * Lambertian ones (by the cosine), until it leaves. With c_k(d) = (n_k.d)+ where point k of a path
 * sees the direction d, and 0 where the surface hides it, and w the area of the surface over that
 * of its plane,
 *
 *     kappa_n(L, V) = E[w c_0(V) c_{n-1}(L)],    E[w c_0(V)] = N.V.
 *
 * The second expectation is exact for any microgeometry: all that is seen covers what is seen of
 * the plane. So kappa is divided by its estimates instead of cosines, which cancels most of the
 * noise near the horizon. kappa is symmetric (facets that see each other see each other's way
 * back), so both orders are averaged. Last, rho becomes s(L) rho s(V) with the s near 1 that lets
 * all light leave if kd = 1 (Sinkhorn and Knopp 1967, who scale matrices to given sums). */
#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "shade/westin_relief.h"
#include "shade/westin_table.h"

enum {
    BATCHES = 8,
    PATHS = 512, /* of a batch */
    RISES = SHD_WESTIN_RISES,
    TURNS = SHD_WESTIN_TURNS,
    WAYS = SHD_WESTIN_WAYS,
    QUARTER = SHD_WESTIN_QUARTER,
    BOUNCES = SHD_WESTIN_BOUNCES,
    TRIES = 2,
    ROW = TURNS / 4 /* turns of the first quarter */
};

typedef float layers[BOUNCES][QUARTER][WAYS];

typedef struct simulation {
    const atomic_bool *cancelled; /* once it is raised, loops end, and nothing is what it means */
    shd_relief relief;
    double sine[RISES], cosine[RISES], slope[RISES]; /* of rises; slope = cosine / sine */
    double x[TURNS], y[TURNS];                       /* of turns */
    double share[RISES]; /* of the light of a uniform sky, in N.L, that a node stands for */
    layers batch, folded;
    double seen[WAYS], seen_batch[WAYS];                             /* E[w c_0] */
    double total[QUARTER][WAYS];                                     /* rho with kd = 1 */
    double sum[TRIES][QUARTER][WAYS], squares[TRIES][QUARTER][WAYS]; /* of batches' pi f_r */
} simulation;

static_assert(sizeof(simulation) <= SHD_WESTIN_SCRATCH, "as much as is promised");

/* ---- Directions. ---- */

/* Integrates each rise's spline, with the one across the pole and those beyond the horizon. */
static void find_shares(simulation *s) {
    enum { STEPS = 64 * RISES };
    double all = 0;
    for (int k = 0; k < STEPS; k++) {
        const double u = (k + 0.5) * RISES / STEPS - 0.5, near = floor(u + 0.5), f = u - near;
        double sine, cosine;
        shd_relief_turn((k + 0.5) / (4. * STEPS), &sine, &cosine);
        const double weight[3] = {0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f,
                                  0.5 * (0.5 + f) * (0.5 + f)};
        for (int a = 0; a < 3; a++) {
            int at = (int)near + a - 1;
            at = at < 0 ? -1 - at : at >= RISES ? RISES - 1 : at;
            s->share[at] += weight[a] * sine * cosine;
        }
        all += sine * cosine;
    }
    for (int r = 0; r < RISES; r++) s->share[r] /= all * TURNS;
}

static void prepare(simulation *s, const shd_microgeometry *micro) {
    memset(s, 0, sizeof *s);
    shd_relief_make(micro, &s->relief);
    for (int r = 0; r < RISES; r++) {
        shd_relief_turn((r + 0.5) / (4 * RISES), &s->sine[r], &s->cosine[r]);
        s->slope[r] = s->cosine[r] / s->sine[r];
    }
    for (int t = 0; t < TURNS; t++) shd_relief_turn((t + 0.5) / TURNS, &s->y[t], &s->x[t]);
    find_shares(s);
}

/* ---- Paths. ---- */

/* c of all ways, which are turned about the normal by the angle of (cosine, sine). */
static void look_around(const simulation *s, const shd_relief_point *at, const double turned[2],
                        float c[WAYS]) {
    const shd_vec3 n = at->normal;
    for (int t = 0; t < TURNS; t++) {
        const double dx = s->x[t] * turned[0] - s->y[t] * turned[1],
                     dy = s->x[t] * turned[1] + s->y[t] * turned[0],
                     hidden =
                         shd_relief_horizon(&s->relief, at, dx, dy, 0.999 * s->slope[RISES - 1]),
                     level = n.x * dx + n.y * dy;
        for (int r = 0; r < RISES; r++) {
            const double facing = s->sine[r] * level + s->cosine[r] * n.z;
            c[r * TURNS + t] = s->slope[r] > hidden && facing > 0 ? (float)facing : 0;
        }
    }
}

/* A direction before the facet, by the cosine to its normal. */
static shd_vec3 scatter(shd_vec3 n, double u, double v) {
    double sine, cosine;
    shd_relief_turn(v, &sine, &cosine);
    const double r = sqrt(u), x = r * cosine, y = r * sine, z = sqrt(1 - u);
    /* Duff et al. 2017, "Building an orthonormal basis, revisited", for n.z > 0. */
    const double a = -1 / (1 + n.z), b = n.x * n.y * a;
    const shd_vec3 t = {1 + n.x * n.x * a, b, -n.x}, q = {b, 1 + n.y * n.y * a, -n.y};
    return shd_add(shd_madd(shd_scale(t, x), q, y), shd_scale(n, z));
}

/* Adds what the first point sees of views, times what the last one sees of lights. */
static void add_product(float (*layer)[WAYS], const float *first, const float *last, float weight) {
    for (int q = 0; q < QUARTER; q++) {
        const float c = weight * first[q / ROW * TURNS + q % ROW];
        if (!(c > 0)) continue;
        float *row = layer[q];
        for (int i = 0; i < WAYS; i++) row[i] += c * last[i];
    }
}

static void follow_path(simulation *s, uint64_t batch, uint64_t path) {
    /* Points that fill the surface evenly (Roberts 2018, "The unreasonable effectiveness of
     * quasirandom sequences"), set off by batch. */
    static const double PLASTIC[3] = {0.81917251339616447, 0.67104360670378926,
                                      0.54970047790197026},
                        GOLDEN[3] = {0.75487766624669276, 0.61803398874989485, 0};
    const double *step = s->relief.size > 2 ? PLASTIC : GOLDEN; /* for grooves, y is all */
    double numbers[3];
    for (int k = 0; k < 3; k++) {
        const double u = shd_relief_random(batch, (uint64_t)k) + step[k] * (double)(path + 1);
        numbers[k] = u - floor(u);
    }
    shd_relief_point at = shd_relief_pick(&s->relief, numbers);
    const uint64_t draws = 3 + path * (2 * BOUNCES + 1);
    double turned[2] = {1, 0};
    if (s->relief.isotropic)
        shd_relief_turn(shd_relief_random(batch, draws), &turned[1], &turned[0]);
    float first[WAYS], last[WAYS];
    const int triangles = 2 * s->relief.size * s->relief.size;
    const double weight = s->relief.area[triangles - 1] / (0.5 * triangles * PATHS);
    look_around(s, &at, turned, first);
    for (int i = 0; i < WAYS; i++) s->seen_batch[i] += weight * (double)first[i];
    add_product(s->batch[0], first, first, (float)weight);
    for (uint64_t n = 1; n < BOUNCES; n++) {
        const shd_vec3 way = scatter(at.normal, shd_relief_random(batch, draws + 2 * n - 1),
                                     shd_relief_random(batch, draws + 2 * n));
        if (!shd_relief_cast(&s->relief, &at, way, &at)) return;
        look_around(s, &at, turned, last);
        add_product(s->batch[n], first, last, (float)weight);
    }
}

/* ---- Symmetries. ---- */

/* The mean over turns of both ways, mirrored ones among them: what depends on rises and the turn
 * between them. */
static void fold_turns(float (*layer)[WAYS], float (*out)[WAYS]) {
    for (int v = 0; v < RISES; v++)
        for (int l = 0; l < RISES; l++) {
            double mean[TURNS] = {0};
            for (int t = 0; t < ROW; t++)
                for (int d = 0; d < TURNS; d++)
                    mean[d] += (double)layer[v * ROW + t][l * TURNS + (t + d) % TURNS] / ROW;
            for (int t = 0; t < ROW; t++)
                for (int d = 0; d < TURNS; d++)
                    out[v * ROW + t][l * TURNS + (t + d) % TURNS] =
                        (float)(0.5 * (mean[d] + mean[(TURNS - d) % TURNS]));
        }
}

/* The mean of both orders of the ways. */
static void fold_orders(float (*layer)[WAYS], float (*out)[WAYS]) {
    for (int q = 0; q < QUARTER; q++)
        for (int i = 0; i < WAYS; i++) {
            int view = i, light = q / ROW * TURNS + q % ROW;
            shd_westin_fold_ways(&view, &light);
            out[q][i] = 0.5F * (layer[q][i] + layer[view][light]);
        }
}

static void fold_layers(simulation *s) {
    for (int n = 0; n < BOUNCES && !shd_is_cancelled(s->cancelled); n++) {
        if (s->relief.isotropic) {
            fold_turns(s->batch[n], s->folded[n]);
            memcpy(s->batch[n], s->folded[n], sizeof s->batch[n]);
        }
        fold_orders(s->batch[n], s->folded[n]);
    }
}

/* The mean of `seen` over ways that are images of each other. */
static void fold_seen(const simulation *s, const double seen[WAYS], double out[WAYS]) {
    for (int r = 0; r < RISES; r++) {
        double all = 0;
        for (int t = 0; t < TURNS; t++) all += seen[r * TURNS + t] / TURNS;
        for (int t = 0; t < TURNS; t++) {
            double mean = 0;
            for (int k = 0; k < 4; k++) mean += 0.25 * seen[r * TURNS + shd_westin_fold(k, t)];
            if (s->relief.isotropic) mean = all;
            /* Where so little was seen, nothing is known of it. */
            out[r * TURNS + t] = shd_larger(mean, 0.25 * s->cosine[r]);
        }
    }
}

/* ---- Tables, of batches and of all. ---- */

/* Of the energies of all bounces. */
static double tail_of(const double energy[BOUNCES]) {
    const double before = energy[BOUNCES - 4] + energy[BOUNCES - 3],
                 last = energy[BOUNCES - 2] + energy[BOUNCES - 1];
    /* Of less there are only some paths, and nearly nothing follows. */
    return before > 1e-4 ? shd_smaller(sqrt(last / before), 0.95) : 0;
}

/* Makes rho of kappa and of what is seen: out[q][i] is its sum over the bounces with kd = 1.
 * Returns the tail. `entry` and `bounce` are the steps from one to the next in `kappa`. */
static double divide(const simulation *s, const double all_seen[WAYS], float *kappa, size_t entry,
                     size_t bounce, double (*out)[WAYS]) {
    double seen[WAYS], energy[BOUNCES] = {0};
    fold_seen(s, all_seen, seen);
    for (int q = 0; q < QUARTER; q++)
        for (int i = 0; i < WAYS; i++) {
            float *at = kappa + ((size_t)q * WAYS + (size_t)i) * entry;
            const double over = 1 / (seen[q / ROW * TURNS + q % ROW] * seen[i]);
            double sum = 0;
            for (size_t n = 0; n < BOUNCES; n++) {
                const double rho = (double)at[n * bounce] * over;
                at[n * bounce] = (float)rho;
                sum += rho;
                energy[n] += 4 * s->share[q / ROW] * s->share[i / TURNS] * rho;
            }
            out[q][i] = sum;
        }
    const double tail = tail_of(energy);
    for (int q = 0; q < QUARTER; q++)
        for (int i = 0; i < WAYS; i++)
            out[q][i] +=
                (double)kappa[((size_t)q * WAYS + (size_t)i) * entry + (BOUNCES - 1) * bounce] *
                (tail / (1 - tail));
    return tail;
}

static int image_of(int way) {
    int image = way, unused = 0;
    shd_westin_fold_ways(&image, &unused);
    return image;
}

/* The scales of ways by which all light leaves. */
static void balance(const simulation *s, double (*total)[WAYS], double scale[QUARTER]) {
    enum { ROUNDS = 24 };
    for (int q = 0; q < QUARTER; q++) scale[q] = 1;
    for (int k = 0; k < ROUNDS && !shd_is_cancelled(s->cancelled); k++) {
        double weight[WAYS], next[QUARTER];
        for (int i = 0; i < WAYS; i++) weight[i] = s->share[i / TURNS] * scale[image_of(i)];
        for (int q = 0; q < QUARTER; q++) {
            double albedo = 0;
            for (int i = 0; i < WAYS; i++) albedo += weight[i] * total[q][i];
            next[q] = sqrt(scale[q] / albedo);
        }
        memcpy(scale, next, sizeof next);
    }
}

/* ---- Batches. ---- */

/* kd of the reflectances whose noise is told: the worst of them. */
static const double TRIED[TRIES] = {1, 0.5};

/* Adds the batch's own table to those whose spread is the noise. */
static void try_batch(simulation *s, double tail) {
    double scale[QUARTER];
    balance(s, s->total, scale);
    for (int k = 0; k < TRIES && !shd_is_cancelled(s->cancelled); k++)
        for (int q = 0; q < QUARTER; q++)
            for (int i = 0; i < WAYS; i++) {
                double rho = (double)s->folded[BOUNCES - 1][q][i] / (1 - tail * TRIED[k]);
                for (int n = BOUNCES - 2; n >= 0; n--)
                    rho = rho * TRIED[k] + (double)s->folded[n][q][i];
                rho *= TRIED[k] * scale[q] * scale[image_of(i)];
                s->sum[k][q][i] += rho;
                s->squares[k][q][i] += rho * rho;
            }
}

static void keep_batch(simulation *s, shd_westin *out) {
    fold_layers(s);
    for (int q = 0; q < QUARTER; q++)
        for (int i = 0; i < WAYS; i++)
            for (int n = 0; n < BOUNCES; n++) out->rho[q][i][n] += s->folded[n][q][i] / BATCHES;
    for (int i = 0; i < WAYS; i++) s->seen[i] += s->seen_batch[i] / BATCHES;
    try_batch(s, divide(s, s->seen_batch, s->folded[0][0], 1, (size_t)QUARTER * WAYS, s->total));
    memset(s->batch, 0, sizeof s->batch);
    memset(s->seen_batch, 0, sizeof s->seen_batch);
}

static void find_noise(const simulation *s, shd_westin_error *out) {
    *out = (shd_westin_error){0, 0};
    for (int k = 0; k < TRIES; k++) {
        double squares = 0;
        for (int q = 0; q < QUARTER; q++)
            for (int i = 0; i < WAYS; i++) {
                const double mean = s->sum[k][q][i] / BATCHES,
                             spread = s->squares[k][q][i] / BATCHES - mean * mean,
                             error = shd_larger(spread, 0) / (BATCHES - 1);
                squares += 4 * s->share[q / ROW] * s->share[i / TURNS] * error;
                out->max = shd_larger(out->max, sqrt(error));
            }
        out->rms = shd_larger(out->rms, sqrt(squares));
    }
}

static void finish(simulation *s, shd_westin *out) {
    double scale[QUARTER];
    find_noise(s, &out->noise);
    out->tail = divide(s, s->seen, out->rho[0][0], BOUNCES, 1, s->total);
    balance(s, s->total, scale);
    for (int q = 0; q < QUARTER; q++)
        for (int i = 0; i < WAYS; i++)
            for (int n = 0; n < BOUNCES; n++)
                out->rho[q][i][n] =
                    (float)((double)out->rho[q][i][n] * scale[q] * scale[image_of(i)]);
}

shd_status shd_westin_make(const shd_microgeometry *micro, const atomic_bool *cancelled,
                           shd_westin *out, shd_error *error) {
    simulation *s = malloc(sizeof *s);
    if (!s) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    prepare(s, micro);
    s->cancelled = cancelled;
    memset(out, 0, sizeof *out);
    out->isotropic = s->relief.isotropic;
    for (uint64_t batch = 1; batch <= BATCHES && !shd_is_cancelled(cancelled); batch++) {
        for (uint64_t path = 0; path < PATHS && !shd_is_cancelled(cancelled); path++)
            follow_path(s, batch, path);
        keep_batch(s, out);
    }
    finish(s, out);
    free(s);
    if (!shd_is_cancelled(cancelled)) shd_westin_limit(out);
    if (shd_is_cancelled(cancelled))
        return shd_fail(error, SHD_CANCELLED, "", "the simulation was cancelled");
    return SHD_OK;
}
