#include "attack/same.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "attack/knobs.h"
#include "attack/pictures.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/tiles/film.h"
#include "sight/sight.h"

typedef enum maker_kind { KEEPS, ALONE, PORTABLE, MAKERS } maker_kind;

struct same_maker {
    shd_engine *engines[MAKERS];
    const family *family;
    uint64_t seed;
    same_teller *tell;
    void *context;
    const char *json; /* at hand */
    uint64_t pictures;
};

static shd_engine *new_engine(maker_kind kind) {
    shd_engine_options options = shd_engine_defaults();
    shd_engine *out = NULL;
    shd_error error = {.status = SHD_OK};
    options.threads = kind == KEEPS ? 2 : 1;
    options.reuse = kind == KEEPS ? (size_t)64 << 20 : 0;
    options.kernel = kind == PORTABLE ? "portable" : NULL;
    if (shd_engine_new(&options, &out, &error)) return NULL;
    if (pictures_put(out, &error)) return out;
    fprintf(stderr, "attack: %s\n", error.text);
    shd_engine_drop(out);
    return NULL;
}

same_maker *same_new(void) {
    same_maker *s = calloc(1, sizeof *s);
    for (int k = 0; s && k < MAKERS; k++)
        if (!(s->engines[k] = new_engine((maker_kind)k))) {
            same_drop(s);
            return NULL;
        }
    return s;
}

void same_drop(same_maker *s) {
    for (int k = 0; s && k < MAKERS; k++) shd_engine_drop(s->engines[k]);
    free(s);
}

__attribute__((format(printf, 2, 3))) static void found(same_maker *s, const char *format, ...) {
    char line[400];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    s->tell(s->context, line, s->json);
}

/* ---- Files. ---- */

typedef struct file {
    shd_status status;
    char tag[80];
    void *data;
    size_t size;
    char why[200]; /* there is none */
} file;

static file draw_file(same_maker *s, maker_kind kind) {
    file out = {.size = 0};
    shd_request *request = NULL;
    shd_error error = {.status = SHD_OK};
    out.status = shd_request_new(s->engines[kind], &request, &error);
    if (out.status == SHD_OK) {
        out.status = shd_request_read(request, s->json, strlen(s->json), SHD_PNG);
        const shd_report *report = shd_request_report(request);
        if (out.status != SHD_OK)
            snprintf(out.why, sizeof out.why, "%.80s: %.100s", report->errors[0].pointer,
                     report->errors[0].detail);
    }
    if (out.status == SHD_OK) {
        snprintf(out.tag, sizeof out.tag, "%s", shd_request_etag(request));
        out.status = shd_request_render(request, NULL, &error);
        if (out.status != SHD_OK) snprintf(out.why, sizeof out.why, "%.190s", error.text);
    }
    if (out.status == SHD_OK) {
        size_t count;
        out.size = shd_request_pictures(request, &count)[0].size;
        out.data = shd_request_take(request, 0);
        s->pictures++;
    }
    shd_request_drop(request);
    return out;
}

static bool same_file(const file *a, const file *b) {
    return a->status == b->status && a->size == b->size &&
           (!a->size || !memcmp(a->data, b->data, a->size));
}

/* ---- Steps. ---- */

typedef struct step {
    int knob; /* that is moved, or -1 */
    uint64_t where;
    char accuracy[100];
} step;

enum { STEPS = 8 };

/* A tier whose sliders are dragged and let go, then a budget that becomes narrow, and wide. */
static void plan_steps(same_maker *s, step steps[STEPS]) {
    static const char *const tiers[] = {"standard", "standard", "draft", "exact"},
                             *const metrics[] = {"linear", "code", "deltaE2000"};
    static const double widest[] = {0.1, 6, 8};
    uint64_t random = s->seed * 1237 + 11;
    knobs_move(-1, 0);
    free(write_scene(s->family, s->seed, ""));
    const int knobs = knobs_count(), metric = one_of(&random, 3);
    /* Integrals over environments are slow. */
    const char *tier = tiers[one_of(&random, s->family->beyond & BEYOND_SKY ? 3 : 4)];
    for (int i = 0; i < STEPS; i++) {
        step *p = &steps[i];
        const double budget = widest[metric] * decades(&random, i == 5 || i == 7 ? 1e-3 : 0.3, 1);
        *p = (step){-1, (uint64_t)between(&random, 0, 1e9), ""};
        if (i > 0 && i != 3 && i != 5 && i != 6) p->knob = one_of(&random, knobs ? knobs : 1);
        if (i < 4)
            snprintf(p->accuracy, sizeof p->accuracy, "\"tier\": \"%s\"", tier);
        else
            snprintf(p->accuracy, sizeof p->accuracy, "\"maxError\": %.17g, \"metric\": \"%s\"",
                     budget, metrics[metric]);
    }
}

static void compare_step(same_maker *s, int index, const step *p, const file files[MAKERS]) {
    const file *alone = &files[ALONE];
    if (alone->status != SHD_OK && (index < 4 || alone->status != SHD_SCENE || !*alone->tag))
        found(s, "step %d {%s} ends with %d: %s", index, p->accuracy, alone->status, alone->why);
    if (!same_file(&files[KEEPS], alone))
        found(s, "step %d {%s}: with what is kept, on two threads, it is another picture (%d, %d)",
              index, p->accuracy, files[KEEPS].status, alone->status);
    if (strcmp(files[KEEPS].tag, alone->tag) != 0)
        found(s, "step %d {%s}: it has another tag on two threads", index, p->accuracy);
    if (!strcmp(files[PORTABLE].tag, alone->tag) && !same_file(&files[PORTABLE], alone))
        found(s, "step %d {%s}: kernels differ under one tag (%d, %d: %s)", index, p->accuracy,
              files[PORTABLE].status, alone->status, files[PORTABLE].why);
}

/* ---- A region. ---- */

typedef struct film_of {
    shd_request *request;
    shd_film film;
    bool good;
} film_of;

static film_of draw_film(same_maker *s, const char *json) {
    film_of out = {.good = false};
    shd_error error = {.status = SHD_OK};
    shd_sight *sight = NULL;
    if (shd_request_new(s->engines[ALONE], &out.request, &error) ||
        shd_request_read(out.request, json, strlen(json), SHD_PNG))
        return out;
    shd_rendering *r = &out.request->rendering;
    out.good = !shd_rendering_plan(r, out.request->scene, &error) &&
               !shd_sight_new(r->plan, NULL, r->arena, &sight, &error) &&
               !shd_film_render(r, sight, NULL, NULL, &out.film, &error);
    s->pictures += out.good;
    return out;
}

static const char IMAGE[] = "{\"image\": {";

/* NULL: memory. */
static char *with_region(const char *json, const int region[4]) {
    char *out = NULL;
    size_t size;
    FILE *to = open_memstream(&out, &size);
    if (!to || strncmp(json, IMAGE, strlen(IMAGE)) != 0) return NULL;
    fprintf(to, "%s\"region\": [%d, %d, %d, %d], %s", IMAGE, region[0], region[1], region[2],
            region[3], json + strlen(IMAGE));
    fclose(to);
    return out;
}

/* As tiers have it: a budget's picture may have lost its way to one for all of it. */
static void check_region(same_maker *s, const char *accuracy) {
    uint64_t random = s->seed * 31 + 7;
    char *json = write_scene(s->family, s->seed, accuracy);
    film_of whole = draw_film(s, json);
    const int width = whole.film.width, height = whole.film.height;
    if (whole.good) {
        const int x = one_of(&random, width), y = one_of(&random, height),
                  w = 1 + one_of(&random, width - x), h = 1 + one_of(&random, height - y);
        char *part_json = with_region(json, (int[]){x, y, w, h});
        film_of part = draw_film(s, part_json);
        size_t off = 0;
        for (int j = 0; part.good && j < h; j++)
            off += memcmp(part.film.rgba + 4 * (size_t)(j * w),
                          whole.film.rgba + 4 * ((size_t)(y + j) * (size_t)width + (size_t)x),
                          4 * sizeof(float) * (size_t)w) != 0;
        s->json = part_json;
        if (!part.good || off)
            found(s, "{%s}: %zu of %d rows of a region differ from the whole picture's", accuracy,
                  off, h);
        shd_request_drop(part.request);
        free(part_json);
    }
    shd_request_drop(whole.request);
    free(json);
}

uint64_t same_check(same_maker *s, const family *f, uint64_t seed, same_teller *tell,
                    void *context) {
    step steps[STEPS];
    file before[STEPS] = {{.size = 0}};
    s->family = f, s->seed = seed, s->tell = tell, s->context = context, s->pictures = 0;
    plan_steps(s, steps);
    /* Tables of environments are slow: a slider, and a budget that becomes narrow. */
    static const bool also_slow[STEPS] = {[0] = true, [1] = true, [4] = true, [5] = true};
    for (int i = 0; i < STEPS; i++) {
        if (f->beyond & BEYOND_SKY && !also_slow[i]) continue;
        knobs_move(steps[i].knob, steps[i].where);
        char *json = write_scene(f, seed, steps[i].accuracy);
        knobs_move(-1, 0);
        s->json = json;
        file files[MAKERS];
        for (int k = 0; k < MAKERS; k++) files[k] = draw_file(s, (maker_kind)k);
        compare_step(s, i, &steps[i], files);
        for (int k = 0; k < i; k++)
            if (*before[k].tag && *files[ALONE].tag && !strcmp(before[k].tag, files[ALONE].tag) &&
                !same_file(&before[k], &files[ALONE]))
                found(s, "step %d {%s} has the tag of step %d and is another picture", i,
                      steps[i].accuracy, k);
        before[i] = files[ALONE];
        free(files[KEEPS].data);
        free(files[PORTABLE].data);
        free(json);
    }
    for (int i = 0; i < STEPS; i++) free(before[i].data);
    static const char *const tiers[] = {"\"tier\": \"standard\"", "\"tier\": \"draft\"",
                                        "\"tier\": \"exact\""};
    check_region(s, tiers[seed % (f->beyond & BEYOND_SKY ? 2 : 3)]);
    return s->pictures;
}
