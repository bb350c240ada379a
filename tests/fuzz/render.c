/* The whole way from a document to pictures: tiny ones, so that thousands are made in a minute. */
#include <jansson.h>
#include <math.h>
#include <string.h>

#include "base/cpu.h"
#include "fuzz.h"
#include "shaded.h"

enum { SIDE_MOST = 8 };

/* One engine renders everything anew, by the narrowest kernels that give the same bits; the other
 * one by this machine's widest ones, and from what earlier pictures left behind. */
typedef enum engine_kind { PLAIN, QUICK } engine_kind;

static shd_engine *engine_once(engine_kind kind) {
    static shd_engine *engines[2];
    if (engines[kind]) return engines[kind];
    shd_engine_options options = shd_engine_defaults();
    options.threads = 1;
    const bool fuses = shd_isa_fuses(SHD_PORTABLE) || !shd_cpu_has(SHD_AVX2);
    options.kernel = kind == QUICK ? "auto" : fuses ? "portable" : "avx2";
    options.reuse = kind == PLAIN ? 0 : 4 << 20;
    options.limits = (shd_limits){.pixels = SIDE_MOST * SIDE_MOST,
                                  .light_samples = 1 << 30,
                                  .object_lights = 1 << 20,
                                  .work = 60,
                                  .samples = SIDE_MOST * SIDE_MOST * 4,
                                  .lights = 16,
                                  .objects = 16,
                                  .triangles = 1000,
                                  .body = 1 << 16,
                                  .memory = 64 << 20};
    CHECK(shd_engine_new(&options, &engines[kind], NULL) == SHD_OK);
    return engines[kind];
}

static void make_small(json_t *image, const char *side) {
    json_t *value = json_object_get(image, side);
    if (value && !json_is_real(value)) return;
    double length = value ? json_real_value(value) : 6;
    if (length > SIDE_MOST) length = 1 + fmod(floor(length), SIDE_MOST);
    json_object_set_new(image, side, json_real(length));
}

/* The document, but for a picture's size that would be refused; NULL: it is no object, or not for
 * here. Documents
 * with a region keep theirs: what is rendered is small already, of a picture that need not be. */
static char *shrink(const char *text, size_t size) {
    json_t *tree = json_loadb(text, size, JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL, NULL);
    if (!json_is_object(tree)) {
        json_decref(tree);
        return NULL;
    }
    json_t *image = json_object_get(tree, "image");
    if (!image) json_object_set_new(tree, "image", image = json_pack("{sf}", "samples", 2.0));
    if (json_is_object(image) && !json_object_get(image, "region")) {
        make_small(image, "width");
        make_small(image, "height");
    }
    char *small = json_dumps(tree, JSON_COMPACT);
    json_decref(tree);
    /* A simulation takes half a minute in these builds, and gets nothing of a document but three
     * numbers. unit.shade_westin has it, and fuzz.scene the reader. */
    if (!small || !strstr(small, "\"microgeometry\"")) return small;
    free(small);
    return NULL;
}

static shd_request *read_scene(const char *text, engine_kind kind) {
    shd_request *request;
    CHECK(shd_request_new(engine_once(kind), &request, NULL) == SHD_OK);
    /* Sanitized, tables and sums of environments take seconds each. */
    if (shd_request_read(request, text, strlen(text), SHD_PNG) == SHD_OK &&
        !shd_request_planning_work(request) && shd_request_work(request) < 1 << 27)
        return request;
    shd_request_drop(request);
    return NULL;
}

/* What may go wrong with a scene that was accepted: it takes more memory than could be foreseen,
 * or its values do not fit what it asks for. Anything else is a defect. */
static bool succeeds(shd_status status, const shd_error *error) {
    if (status != SHD_OK && status != SHD_MEMORY && status != SHD_LIMIT && status != SHD_SCENE)
        fprintf(stderr, "%s: %s\n", error->path, error->text);
    CHECK(status == SHD_OK || status == SHD_MEMORY || status == SHD_LIMIT || status == SHD_SCENE);
    return status == SHD_OK;
}

static shd_request *render(const char *text, engine_kind kind) {
    shd_request *request = read_scene(text, kind);
    shd_error error = {0};
    if (!request) return NULL;
    if (succeeds(shd_request_render(request, NULL, &error), &error)) return request;
    shd_request_drop(request);
    return NULL;
}

/* Neither the instructions nor what earlier pictures left behind make a difference. */
static void check_bytes(const char *text) {
    shd_request *first = render(text, PLAIN), *second = first ? render(text, QUICK) : NULL;
    if (first) {
        size_t count, again;
        CHECK(second);
        const shd_picture *a = shd_request_pictures(first, &count);
        const shd_picture *b = shd_request_pictures(second, &again);
        CHECK(count && count == again);
        for (size_t i = 0; i < count; i++)
            CHECK(a[i].size && a[i].size == b[i].size && !memcmp(a[i].data, b[i].data, a[i].size));
    }
    shd_request_drop(first);
    shd_request_drop(second);
}

enum { IN_JSON, IN_WORDS, COMPARED, TELLINGS };

static void check_telling(const char *text, unsigned kind) {
    shd_request *request = read_scene(text, PLAIN);
    if (!request) return;
    shd_error error = {0};
    char *told = NULL;
    shd_status status =
        kind == COMPARED
            ? shd_request_compare(request, NULL, &told, &error)
            : shd_request_explain(request, kind == IN_JSON ? SHD_IN_JSON : SHD_IN_WORDS, &told,
                                  &error);
    if (succeeds(status, &error)) {
        json_t *tree = json_loads(told, 0, NULL);
        CHECK(kind == IN_WORDS ? *told : json_is_object(tree));
        json_decref(tree);
        free(told);
    }
    shd_request_drop(request);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char *text = shrink((const char *)data, size);
    if (!text) return 0;
    check_bytes(text);
    /* All of them would take longer than the pictures: the size chooses. */
    if (size % 8 < TELLINGS) check_telling(text, size % 8);
    free(text);
    return 0;
}
