/* Looks for pictures that break what is said of them.
 *
 *     attack [--seconds N | --rounds N] [--first N] [--family NAME]... [--threads N]
 *            [--folder FOLDER] [--page FILE] [--kernel NAME] | --seed FAMILY:N | --list
 *
 * Of each scene (scenes.h), the exact tier's picture is held against an evaluation of the model
 * that shares no code with it (model.h) and its own bound, at some of its pixels; draft,
 * standard, and two budgets against the exact tier's picture, at all of them and in every metric.
 * A finding is told with the seed that makes it again, and its document is saved. */
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "attack/layers.h"
#include "attack/model.h"
#include "attack/pictures.h"
#include "attack/same.h"
#include "attack/scenes.h"
#include "attack/tally.h"
#include "bound/light/extended.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/tell/measure.h"
#include "render/tiles/film.h"
#include "scene/surroundings.h"
#include "sight/sight.h"

static const char EXACTLY[] = "\"tier\": \"exact\"";

typedef struct attack {
    double seconds;
    uint64_t first, rounds;
    int threads;
    const char *folder, *page;
    const char *kernel; /* NULL: the widest */
    bool one;           /* a seed alone */
    double began;
    atomic_uint_fast64_t next;
    pthread_mutex_t mutex; /* of what follows, and of what is printed */
    tally tally;
    int told;
} attack;

typedef struct worker {
    attack *attack;
    shd_engine *engine;
    same_maker *same; /* NULL until it is asked for */
    counts counts;    /* of the scene at hand */
    const family *family;
    uint64_t seed;
    const char *json; /* the document at hand */
} worker;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void save(const worker *w, int number) {
    char path[4096];
    mkdir(w->attack->folder, 0777);
    snprintf(path, sizeof path, "%s/%s-%llu-%d.json", w->attack->folder, w->family->name,
             (unsigned long long)w->seed, number);
    FILE *out = fopen(path, "w");
    if (!out || fputs(w->json, out) < 0)
        fprintf(stderr, "attack: %s cannot be written\n", path);
    else
        printf("    %s\n", path);
    if (out) fclose(out);
}

__attribute__((format(printf, 2, 3))) static void found(worker *w, const char *format, ...) {
    enum { MOST_TOLD = 40 };
    va_list args;
    const int number = (int)w->counts.findings++;
    pthread_mutex_lock(&w->attack->mutex);
    if (w->attack->told++ < MOST_TOLD || w->attack->one) {
        printf("--seed %s:%llu  ", w->family->name, (unsigned long long)w->seed);
        va_start(args, format);
        vprintf(format, args);
        va_end(args);
        puts("");
        save(w, number);
        fflush(stdout);
    }
    pthread_mutex_unlock(&w->attack->mutex);
}

/* ---- Pictures. ---- */

typedef struct picture {
    shd_request *request;
    shd_film film;
} picture;

static void drop_picture(picture *p) {
    shd_request_drop(p->request);
    p->request = NULL;
}

/* SHD_SCENE: no plan meets the budget. Anything else that fails is a finding. */
static bool draw(worker *w, picture *out, bool may_refuse) {
    shd_error error = {.status = SHD_OK};
    shd_sight *sight = NULL;
    shd_status status = shd_request_new(w->engine, &out->request, &error);
    if (status == SHD_OK) {
        status = shd_request_read(out->request, w->json, strlen(w->json), SHD_PNG);
        const shd_report *report = shd_request_report(out->request);
        if (status != SHD_OK) {
            found(w, "it is refused: %s: %s", report->errors[0].pointer, report->errors[0].detail);
            drop_picture(out);
            return false;
        }
        status = shd_rendering_plan(&out->request->rendering, out->request->scene, &error);
    }
    if (status == SHD_SCENE && may_refuse) {
        w->counts.refused++;
        drop_picture(out);
        return false;
    }
    if (status == SHD_OK)
        status = shd_sight_new(out->request->rendering.plan, NULL, out->request->rendering.arena,
                               &sight, &error);
    if (status == SHD_OK)
        status = shd_film_render(&out->request->rendering, sight, NULL, NULL, &out->film, &error);
    if (status == SHD_OK) {
        w->counts.pictures++;
        return true;
    }
    found(w, "it is not rendered: %s", error.text);
    drop_picture(out);
    return false;
}

/* ---- The exact tier against the model. ---- */

static model *read_model(worker *w, const model_program *program, const shd_scene *scene,
                         double offsets[64][2]) {
    const shd_raster *raster = &scene->raster;
    for (int i = 0; i < raster->samples; i++)
        shd_sample_offset(i, raster->samples, &offsets[i][0], &offsets[i][1]);
    model *m = program->read(w->json, (const double(*)[2])offsets);
    bool good = m;
    for (size_t i = 0; good && i < scene->light_count; i++) {
        const shd_surroundings *map = scene->lights[i].map;
        if (map) good = program->surround(m, i, map->width, map->height, map->texels);
    }
    if (good) return m;
    found(w, "the model is not evaluated");
    program->drop(m);
    return NULL;
}

/* By how much a value is out of a range. */
static double out_of(double value, double low, double high) {
    return value < low ? low - value : value > high ? value - high : value == value ? 0 : INFINITY;
}

static void check_model(worker *w, const picture *exact) {
    enum {
        MOST_SAMPLES = 1200,
        MOST_QUAD = 120,
        MOST_SHAPED = 60,
        MOST_VEILED = 200,
        MOST_SKY = 4
    };
    const shd_raster *raster = &exact->request->scene->raster;
    const model_program *program = w->family->quad ? &model_quad : &model_long;
    const shd_plan *plan = exact->request->rendering.plan;
    const bool known = isfinite(plan->bound.linear);
    const double told = exact->request->rendering.ray_error,
                 estimate = shd_linear_estimate(plan, NULL);
    double bound = fmin(plan->bound.linear, estimate);
    if (told > 0) bound = fmin(bound, told);
    double offsets[64][2];
    const size_t pixels = (size_t)raster->width * (size_t)raster->height;
    const unsigned beyond = w->family->beyond;
    const size_t samples = beyond & BEYOND_SKY      ? MOST_SKY
                           : beyond & BEYOND_SHAPES ? MOST_SHAPED
                           : beyond & (BEYOND_OPACITY | BEYOND_MIRRORS | BEYOND_SHADOWS)
                               ? MOST_VEILED
                           : w->family->quad ? MOST_QUAD
                                             : MOST_SAMPLES,
                 most = samples / (size_t)raster->samples;
    const size_t step = pixels > most ? pixels / most : 1;
    model *m = read_model(w, program, exact->request->scene, offsets);
    if (!m) return;
    w->counts.unbounded += !known;
    double worst = 0;
    size_t worst_at = 0, bad = 0;
    model_pixel worst_is = {.undecided = 0};
    for (size_t i = w->seed % step; i < pixels; i += step) {
        model_pixel is;
        const int x = (int)(i % (size_t)raster->width), y = (int)(i / (size_t)raster->width);
        program->evaluate(m, x, y, &is);
        w->counts.pixels++;
        w->counts.samples += (uint64_t)raster->samples;
        w->counts.undecided += (uint64_t)is.undecided;
        double error = 0;
        for (int c = 0; c < 3; c++)
            error = fmax(
                error, out_of((double)exact->film.rgba[4 * i + (size_t)c], is.low[c], is.high[c]));
        /* Coverage is a count of samples, in f32. */
        if (out_of((double)exact->film.rgba[4 * i + 3], is.low[3], is.high[3]) > 1e-6)
            error = INFINITY;
        bad += error > bound;
        if (error > worst) worst = error, worst_at = i, worst_is = is;
    }
    program->drop(m);
    w->counts.share[0] = fmax(w->counts.share[0], worst / bound);
    if (!bad) return;
    const float *rgba = exact->film.rgba + 4 * worst_at;
    found(w,
          "exact is off by %.3g, stated %.3g, at %zu of %zu pixels; at (%d, %d) it is %.9g %.9g "
          "%.9g %.9g, the model %.9g %.9g %.9g %.9g",
          worst, bound, bad, (pixels + step - 1) / step, (int)(worst_at % (size_t)raster->width),
          (int)(worst_at / (size_t)raster->width), (double)rgba[0], (double)rgba[1],
          (double)rgba[2], (double)rgba[3], worst_is.high[0], worst_is.high[1], worst_is.high[2],
          worst_is.high[3]);
}

/* ---- Tiers and budgets against the exact tier. ---- */

/* Where two films differ most. */
static size_t worst_pixel(const shd_film *a, const shd_film *b) {
    double most = -1;
    size_t at = 0;
    for (size_t i = 0; i < 4 * (size_t)a->width * (size_t)a->height; i++) {
        const double apart = fabs((double)a->rgba[i] - (double)b->rgba[i]);
        if (apart > most) most = apart, at = i / 4;
    }
    return at;
}

static void count_looseness(counts *c, const double is[3], const shd_bound *stated, double seen) {
    const double measured[LOOSE] = {is[0], is[2], is[2]},
                 bound[LOOSE] = {stated->linear, stated->delta_e, seen};
    for (int k = 0; k < LOOSE; k++) {
        if (!(measured[k] > 0) || isinf(bound[k])) continue;
        c->loose[k][(int)fmin(8 * log2(fmax(bound[k] / measured[k], 1)), EIGHTHS - 1)]++;
    }
}

static void check_tier(worker *w, const picture *exact, const char *accuracy, const double *budget,
                       int metric) {
    char *json = write_scene(w->family, w->seed, accuracy);
    const char *before = w->json;
    w->json = json;
    picture other = {NULL, {0}};
    if (json && draw(w, &other, budget != NULL)) {
        const shd_bound stated = other.request->rendering.plan->bound;
        const size_t at = worst_pixel(&exact->film, &other.film);
        const int width = exact->film.width;
        shd_showing showing;
        shd_difference got;
        shd_error error;
        double seconds;
        if (shd_showing_make(&other.request->rendering, other.request->scene,
                             &other.request->scene->outputs[0], &showing, &error) ||
            shd_film_measure(&other.request->rendering, &showing, &exact->film, &other.film, &got,
                             &seconds, &error)) {
            found(w, "it is not measured: %s", error.text);
        } else {
            const double is[] = {got.linear.max, got.code.max, got.delta_e.max},
                         bound[] = {stated.linear, stated.code, got.most};
            if (!budget && other.request->scene->raster.samples == 4)
                count_looseness(&w->counts, is, &stated, got.most);
            for (int k = 0; k < 3; k++) {
                const double room = budget && k == metric ? fmin(*budget, bound[k]) : bound[k];
                if (is[k] > 0) w->counts.share[1 + k] = fmax(w->counts.share[1 + k], is[k] / room);
                if (is[k] <= room) continue;
                found(w, "{%s}, drawn as %s, is off by %.4g %s, stated %.4g; most near (%d, %d)",
                      accuracy, shd_plan_tier_name(other.request->rendering.plan), is[k],
                      shd_metric_names[k], room, (int)(at % (size_t)width),
                      (int)(at / (size_t)width));
            }
            if (budget && bound[metric] > *budget)
                found(w, "{%s} is taken with a bound of %.4g", accuracy, bound[metric]);
        }
    }
    drop_picture(&other);
    w->json = before;
    free(json);
}

static void check_budget(worker *w, const picture *exact, int metric, uint64_t *random) {
    static const double least[] = {1e-6, 0.6, 1e-3}, most[] = {0.05, 6, 4};
    const double budget = decades(random, least[metric], most[metric]);
    char accuracy[100];
    snprintf(accuracy, sizeof accuracy, "\"maxError\": %.17g, \"metric\": \"%s\"", budget,
             shd_metric_names[metric]);
    check_tier(w, exact, accuracy, &budget, metric);
}

static void tell_of_same(void *context, const char *line, const char *json) {
    worker *w = context;
    w->json = json;
    found(w, "%s", line);
}

/* False: the attack cannot go on. */
static bool check_same(worker *w) {
    if (!w->same) w->same = same_new();
    if (!w->same) return false;
    w->counts.pictures += same_check(w->same, w->family, w->seed, tell_of_same, w);
    if (w->seed % 3 == 2) layers_check(w->engine, w->family, w->seed, tell_of_same, w);
    return true;
}

static void check_scene(worker *w) {
    uint64_t random = w->seed * 977 + 5;
    char *json = write_scene(w->family, w->seed, EXACTLY);
    picture exact = {NULL, {0}};
    w->json = json;
    w->counts = (counts){.scenes = 1};
    if (json && draw(w, &exact, false)) {
        if (w->family->modelled) check_model(w, &exact);
        check_tier(w, &exact, "\"tier\": \"standard\"", NULL, 0);
        check_tier(w, &exact, "\"tier\": \"draft\"", NULL, 0);
        const int metric = one_of(&random, 3);
        check_budget(w, &exact, metric, &random);
        check_budget(w, &exact, (metric + 1) % 3, &random);
    }
    drop_picture(&exact);
    free(json);
    w->json = NULL;
    if (w->family->beyond & BEYOND_DRESSED && !check_same(w)) {
        fprintf(stderr, "attack: engines that keep pictures cannot be made\n");
        exit(2);
    }
    w->json = NULL;
}

/* ---- All of them. ---- */

static _Thread_local worker *at_work;

/* What a crash was made by. */
static void tell_and_end(int number) {
    const worker *w = at_work;
    char text[200];
    if (w && w->family) {
        const int size = snprintf(text, sizeof text, "--seed %s:%llu  ends with signal %d\n",
                                  w->family->name, (unsigned long long)w->seed, number);
        if (write(STDOUT_FILENO, text, (size_t)size) < 0) _exit(2);
    }
    _exit(1);
}

/* Of how many rounds a family has one: integrals of other models and of lights with a shape are
 * slow, pictures that are made again and again, and most of all integrals over environments. */
static uint64_t share_of_rounds(const family *f) {
    return f->beyond & BEYOND_SKY ? 48 : f->beyond & BEYOND_DRESSED ? 16 : f->beyond ? 4 : 1;
}

static void *work(void *argument) {
    worker *w = argument;
    attack *a = w->attack;
    at_work = w;
    for (;;) {
        const uint64_t index = atomic_fetch_add(&a->next, 1);
        const uint64_t round = index / (uint64_t)a->tally.chosen_count;
        const int which = (int)(index % (uint64_t)a->tally.chosen_count);
        if (a->seconds > 0 ? now() - a->began > a->seconds : round >= a->rounds) break;
        w->family = a->tally.chosen[which];
        if (!a->one && !(a->seconds > 0) && share_of_rounds(w->family) * round >= a->rounds)
            continue;
        w->seed = a->first + round;
        check_scene(w);
        pthread_mutex_lock(&a->mutex);
        tally_add(&a->tally.counts[which], &w->counts);
        pthread_mutex_unlock(&a->mutex);
    }
    return NULL;
}

static bool run_attack(attack *a) {
    enum { MOST_THREADS = 64 };
    pthread_t threads[MOST_THREADS];
    worker workers[MOST_THREADS];
    int count = 0;
    if (a->threads > MOST_THREADS) a->threads = MOST_THREADS;
    a->began = now();
    for (; count < a->threads; count++) {
        shd_engine_options options = shd_engine_defaults();
        shd_error error;
        options.threads = 1;
        options.reuse = 0;
        options.kernel = a->kernel;
        workers[count] = (worker){.attack = a};
        if (shd_engine_new(&options, &workers[count].engine, &error) ||
            !pictures_put(workers[count].engine, &error)) {
            fprintf(stderr, "attack: %s\n", error.text);
            return false;
        }
        if (pthread_create(&threads[count], NULL, work, &workers[count])) return false;
    }
    for (int i = 0; i < count; i++) {
        pthread_join(threads[i], NULL);
        same_drop(workers[i].same);
        shd_engine_drop(workers[i].engine);
    }
    return true;
}

/* ---- The command line. ---- */

static const family *find_family(const char *name, size_t length) {
    for (int i = 0; i < family_count; i++)
        if (strlen(families[i].name) == length && !strncmp(families[i].name, name, length))
            return &families[i];
    fprintf(stderr, "attack: there is no family %.*s\n", (int)length, name);
    exit(2);
}

static void take_option(attack *a, const char *name, const char *value) {
    if (!strcmp(name, "--seconds")) {
        a->seconds = atof(value);
    } else if (!strcmp(name, "--rounds")) {
        a->rounds = strtoull(value, NULL, 10);
    } else if (!strcmp(name, "--first")) {
        a->first = strtoull(value, NULL, 10);
    } else if (!strcmp(name, "--threads")) {
        a->threads = atoi(value);
    } else if (!strcmp(name, "--folder")) {
        a->folder = value;
    } else if (!strcmp(name, "--page")) {
        a->page = value;
    } else if (!strcmp(name, "--kernel")) {
        a->kernel = value;
    } else if (!strcmp(name, "--family") && a->tally.chosen_count < MOST_CHOSEN) {
        a->tally.chosen[a->tally.chosen_count++] = find_family(value, strlen(value));
    } else if (!strcmp(name, "--seed") && strchr(value, ':')) {
        a->tally.chosen[0] = find_family(value, (size_t)(strchr(value, ':') - value));
        a->tally.chosen_count = 1;
        a->first = strtoull(strchr(value, ':') + 1, NULL, 10);
        a->rounds = 1;
        a->threads = 1;
        a->one = true;
    } else {
        fprintf(stderr, "attack: unknown option %s %s\n", name, value);
        exit(2);
    }
}

int main(int count, char **arguments) {
    attack a = {.rounds = 1,
                .first = 1,
                .threads = (int)sysconf(_SC_NPROCESSORS_ONLN),
                .folder = "attack",
                .mutex = PTHREAD_MUTEX_INITIALIZER};
    if (!strcmp(arguments[count - 1], "--list")) {
        for (int i = 0; i < family_count; i++)
            printf("%-10s %s\n", families[i].name, families[i].about);
        return 0;
    }
    if (count % 2 == 0) {
        fprintf(stderr, "attack: %s lacks its value\n", arguments[count - 1]);
        return 2;
    }
    for (int i = 1; i < count; i += 2) take_option(&a, arguments[i], arguments[i + 1]);
    for (int i = 0; !a.tally.chosen_count && i < family_count; i++)
        a.tally.chosen[i] = &families[i];
    if (!a.tally.chosen_count) a.tally.chosen_count = family_count;
    signal(SIGSEGV, tell_and_end);
    signal(SIGABRT, tell_and_end);
    signal(SIGFPE, tell_and_end);
    if (!run_attack(&a)) return 2;
    const double seconds = now() - a.began;
    tally_print_table(stdout, &a.tally);
    tally_print_looseness(stdout, &a.tally);
    printf("%.0f seconds, %llu findings\n", seconds, (unsigned long long)tally_findings(&a.tally));
    if (a.page && !tally_write_page(&a.tally, a.page, seconds, a.threads, a.first)) {
        fprintf(stderr, "attack: %s cannot be written\n", a.page);
        return 2;
    }
    return tally_findings(&a.tally) ? 1 : 0;
}
