#include "preview.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/json_memory.h"
#include "server/answer/problem.h"

/* What surrounds the object: seen from above, before a grey that black rubber is darker than, lit
 * by a lamp, from the side, and from below as a floor would, so that faces of every direction
 * shine. */
static const char surroundings[] =
    "{\"camera\": {\"position\": [1.2, 2.3, 4.2], \"fov\": 32}, \"background\": 0.06,"
    " \"ambient\": 0.3, \"lights\": [{\"type\": \"point\", \"position\": [-2.6, 3.1, 4.4]},"
    "{\"type\": \"directional\", \"direction\": [-1, -0.3, 0.55], \"color\": [0.75, 0.87, 1],"
    " \"intensity\": 0.7},"
    "{\"type\": \"directional\", \"direction\": [0.75, 0.45, -0.5], \"color\": [1, 0.9, 0.8],"
    " \"intensity\": 0.3}]}";

/* Shapes in about the same frame; flat ones tilted so that the lamp is mirrored in them. */
static const struct framed {
    const char *shape, *members;
} framed[] = {
    {"box", "{\"size\": [1.25, 1.25, 1.25], \"transform\": {\"rotate\": [0, -25, 0]}}"},
    {"cylinder", "{\"radius\": 0.75, \"height\": 1.4}"},
    {"cone", "{\"radius\": 0.9, \"height\": 1.6, \"transform\": {\"translate\": [0, 0.1, 0]}}"},
    {"torus", "{\"radius\": 0.75, \"tube\": 0.3, \"transform\": {\"rotate\": [30, 0, 0]}}"},
    {"disc", "{\"radius\": 1.05, \"transform\": {\"rotate\": [66, -10, 0]}}"},
    {"plane", "{\"transform\": {\"rotate\": [66, -10, 0]}}"},
};

enum { SIDE = 256, SAMPLES = 9, DIGITS_MOST = 15 };

/* Those of the output and those of the material stand together. */
enum {
    SHAPE,
    SIZE,
    WIDTH,
    HEIGHT,
    SAMPLES_PER_PIXEL,
    BACKGROUND,
    DISPLAY,
    VIEW,
    COLOR_SPACE,
    FORMAT,
    QUALITY,
    EMISSIVE,
    AMBIENT,
    DIFFUSE,
    SPECULAR,
    SHININESS,
    EXPIRES,
    SIGNATURE,
    PARAMETERS
};

static const char *const names[PARAMETERS] = {
    "shape",   "size",    "width",      "height",    "samples", "background",
    "display", "view",    "colorSpace", "format",    "quality", "emissive",
    "ambient", "diffuse", "specular",   "shininess", "expires", "signature"};

static const char material[] = "material"; /* of the path */

/* ---- The link ---- */

/* A link as it is read: the parameters' values, NULL if they are not given, and mistakes. */
typedef struct link_read {
    json_t *values[PARAMETERS];
    shd_mistake mistakes[SHD_REPORT_KEEP];
    char *unknown[SHD_REPORT_KEEP]; /* names in mistakes that are owned */
    size_t mistake_count, unknown_count;
    bool is_short; /* memory was refused */
} link_read;

static void add_mistake(link_read *l, const char *parameter, const char *detail) {
    if (l->mistake_count < SHD_REPORT_KEEP)
        l->mistakes[l->mistake_count++] = (shd_mistake){.parameter = parameter, .detail = detail};
}

static void add_unknown(link_read *l, const char *name, size_t length) {
    if (l->unknown_count == SHD_REPORT_KEEP) return;
    char *copy = strndup(name, length);
    if (!copy) {
        l->is_short = true;
        return;
    }
    l->unknown[l->unknown_count++] = copy;
    add_mistake(l, copy,
                "it is not known here: there is shape, size, width, height, samples, background, "
                "display, view, colorSpace, format, quality, emissive, ambient, diffuse, specular, "
                "shininess");
}

static void drop_link(link_read *l) {
    for (size_t i = 0; i < PARAMETERS; i++) json_decref(l->values[i]);
    for (size_t i = 0; i < l->unknown_count; i++) free(l->unknown[i]);
}

static int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    c |= 0x20; /* lower case */
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Text of application/x-www-form-urlencoded, as forms and URLSearchParams write it. NULL: it is no
 * text in UTF-8, or memory is short. */
static json_t *decode_value(const char *from, size_t size, bool *is_short) {
    char *text = malloc(size + 1);
    if (!text) *is_short = true;
    size_t length = 0;
    for (size_t i = 0; text && i < size; i++) {
        char c = from[i] == '+' ? ' ' : from[i];
        if (c == '%' && i + 2 < size && hex_digit(from[i + 1]) >= 0 &&
            hex_digit(from[i + 2]) >= 0) {
            c = (char)(hex_digit(from[i + 1]) * 16 + hex_digit(from[i + 2]));
            i += 2;
        }
        text[length++] = c;
    }
    json_t *value = text && !memchr(text, 0, length) ? json_stringn(text, length) : NULL;
    free(text);
    return value;
}

/* "name=value". Names are compared as they are written: there is nothing to escape in them. */
static void read_parameter(link_read *l, const char *from, size_t size) {
    const char *equals = memchr(from, '=', size);
    size_t length = equals ? (size_t)(equals - from) : size, which = 0;
    while (which < PARAMETERS &&
           (strlen(names[which]) != length || memcmp(names[which], from, length) != 0))
        which++;
    if (which == PARAMETERS) {
        add_unknown(l, from, length);
    } else if (l->values[which]) {
        add_mistake(l, names[which], "it is given more than once");
    } else {
        l->values[which] =
            equals ? decode_value(equals + 1, size - length - 1, &l->is_short) : json_string("");
        if (!l->values[which]) add_mistake(l, names[which], "it is no text in UTF-8");
    }
}

static void put_value(link_read *l, int which, json_t *value) {
    json_decref(l->values[which]);
    l->values[which] = value;
}

/* Turns a value of digits into a number. */
static void read_whole(link_read *l, int which) {
    const char *text = json_string_value(l->values[which]);
    if (!text) return;
    size_t length = strlen(text);
    if (!length || length > DIGITS_MOST || strspn(text, "0123456789") != length) {
        add_mistake(l, names[which], "expected an integer");
        return;
    }
    put_value(l, which, json_integer(strtoll(text, NULL, 10)));
}

/* The numbers of a list with commas between them; NULL if it is none, or memory is short. */
static json_t *parse_numbers(const char *text, bool *is_short) {
    size_t length = strlen(text);
    char *brackets = malloc(length + 3);
    if (!brackets) {
        *is_short = true;
        return NULL;
    }
    snprintf(brackets, length + 3, "[%s]", text);
    json_t *list = json_loads(brackets, JSON_DECODE_INT_AS_REAL, NULL);
    free(brackets);
    for (size_t i = 0; i < json_array_size(list); i++)
        if (!json_is_real(json_array_get(list, i))) {
            json_decref(list);
            return NULL;
        }
    return list;
}

/* Turns "0.5" and "0.1,0.2,0.3" into what they are in a document. Other texts are colors of CSS, or
 * mistakes, as the reader of scenes will find. */
static void read_color(link_read *l, int which) {
    const char *text = json_string_value(l->values[which]);
    json_t *list = text ? parse_numbers(text, &l->is_short) : NULL;
    if (!list) return;
    json_t *alone = json_array_size(list) == 1 ? json_incref(json_array_get(list, 0)) : NULL;
    put_value(l, which, alone ? alone : json_incref(list));
    json_decref(list);
}

static void read_number(link_read *l, int which) {
    read_color(l, which);
    if (l->values[which] && !json_is_real(l->values[which]))
        add_mistake(l, names[which], "expected a number");
}

/* null, which is transparent, has a name. */
static void read_background(link_read *l) {
    const char *text = json_string_value(l->values[BACKGROUND]);
    if (text && !strcmp(text, "transparent"))
        put_value(l, BACKGROUND, json_null());
    else
        read_color(l, BACKGROUND);
}

static void read_link(link_read *l, const char *target) {
    const char *query = strchr(target, '?');
    while (query) {
        const char *from = query + 1;
        query = strchr(from, '&');
        size_t size = query ? (size_t)(query - from) : strlen(from);
        if (size) read_parameter(l, from, size);
    }
    for (int which = SIZE; which <= SAMPLES_PER_PIXEL; which++) read_whole(l, which);
    read_whole(l, QUALITY);
    read_whole(l, EXPIRES);
    read_background(l);
    for (int which = EMISSIVE; which <= SPECULAR; which++) read_color(l, which);
    read_number(l, SHININESS);
    /* The reader of scenes would miss its vertices, of which a link knows nothing. */
    const char *shape = json_string_value(l->values[SHAPE]);
    if (shape && !strcmp(shape, "mesh"))
        add_mistake(l, names[SHAPE], "a mesh has no preview: its triangles are the scene's own");
}

/* ---- The document ---- */

static json_t *value_or(const link_read *l, int which, json_t *otherwise) {
    if (!l->values[which]) return otherwise;
    json_decref(otherwise);
    return json_incref(l->values[which]);
}

/* The object of a shape, without its material; NULL if memory is short. */
static json_t *make_object(const json_t *shape) {
    const char *name = json_string_value(shape), *members = "{}";
    for (size_t i = 0; i < sizeof framed / sizeof framed[0]; i++)
        if (!strcmp(name, framed[i].shape)) members = framed[i].members;
    json_t *object = json_loads(members, 0, NULL);
    json_object_set(object, "type", (json_t *)(uintptr_t)shape);
    return object;
}

static int set_members(json_t *object, const link_read *l, int first, int last) {
    int failed = object ? 0 : -1;
    for (int which = first; which <= last; which++)
        if (l->values[which]) failed |= json_object_set(object, names[which], l->values[which]);
    return failed;
}

/* NULL if memory is short. */
static char *make_document(const link_read *l, json_t *preset) {
    json_t *document = json_loads(surroundings, 0, NULL);
    json_t *side = value_or(l, SIZE, json_integer(SIDE));
    json_t *shape = value_or(l, SHAPE, json_string("sphere"));
    json_t *image = json_pack("{s:O, s:o, s:i}", "width", side, "height", side, "samples", SAMPLES);
    json_t *coefficients = json_pack("{s:O}", "preset", preset), *output = json_object();
    json_t *object = make_object(shape);
    int failed = set_members(image, l, WIDTH, SAMPLES_PER_PIXEL);
    failed |= set_members(coefficients, l, EMISSIVE, SHININESS);
    failed |= set_members(output, l, DISPLAY, QUALITY);
    failed |= set_members(document, l, BACKGROUND, BACKGROUND);
    failed |= json_object_set_new(document, "image", image);
    failed |= json_object_set_new(object, "material", coefficients);
    failed |= json_object_set_new(document, "objects", json_pack("[o]", object));
    json_decref(shape);
    failed |= json_object_set_new(document, "output", output);
    char *text = failed ? NULL : json_dumps(document, JSON_COMPACT);
    json_decref(document);
    return text;
}

bool shd_preview_document(shd_exchange *exchange) {
    static const char prefix[] = "/v1/preview/";
    static const shd_mistake no_text = {.parameter = material, .detail = "it is no text in UTF-8"};
    link_read l = {.mistake_count = 0};
    shd_reply *reply = &exchange->reply;
    char *text = NULL;
    shd_json_memory_watch();
    json_t *name = json_string(exchange->path + sizeof prefix - 1);
    if (exchange->target) read_link(&l, exchange->target);
    if (name && !l.mistake_count) text = make_document(&l, name);
    if (!exchange->target || l.is_short || shd_json_memory_short()) {
        free(text);
        text = NULL;
        shd_problem_reply(reply, SHD_NO_MEMORY, "out of memory");
    } else if (!name) {
        shd_problem_mistakes(reply, SHD_NOT_FOUND, &no_text, 1);
    } else if (l.mistake_count) {
        shd_problem_mistakes(reply, SHD_BAD_QUERY, l.mistakes, l.mistake_count);
    }
    json_decref(name);
    drop_link(&l);
    free(exchange->body);
    exchange->body = (unsigned char *)text;
    exchange->size = text ? strlen(text) : 0;
    return text;
}

/* ---- Mistakes that the reader finds ---- */

/* The parameter that the pointer's value came from; NULL: none. */
static const char *parameter_of(const char *pointer) {
    static const struct {
        const char *prefix, *parameter;
    } places[] = {
        {"/objects/0/material/emissive", "emissive"},
        {"/objects/0/material/ambient", "ambient"},
        {"/objects/0/material/diffuse", "diffuse"},
        {"/objects/0/material/specular", "specular"},
        {"/objects/0/material/shininess", "shininess"},
        {"/objects/0/material", material},
        {"/objects/0", "shape"},
        {"/image/samples", "samples"},
        {"/image/height", "height"},
        {"/image", "width"},
        {"/background", "background"},
        {"/output/display", "display"},
        {"/output/view", "view"},
        {"/output/format", "format"},
        {"/output/quality", "quality"},
        {"/output", "colorSpace"},
    };
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++)
        if (!strncmp(pointer, places[i].prefix, strlen(places[i].prefix)))
            return places[i].parameter;
    return NULL;
}

/* If both sides are the same, they are told as one size. */
static bool is_square(const shd_question *asked) {
    json_t *document = json_loadb((const char *)asked->body, asked->size, 0, NULL);
    const json_t *image = json_object_get(document, "image");
    bool square = json_equal(json_object_get(image, "width"), json_object_get(image, "height"));
    json_decref(document);
    return square;
}

static bool is_side(const char *parameter) {
    return parameter && (!strcmp(parameter, "width") || !strcmp(parameter, "height"));
}

void shd_preview_refuse(shd_job *job) {
    const shd_report *report = shd_request_report(job->request);
    shd_mistake mistakes[SHD_REPORT_KEEP];
    size_t count = 0;
    shd_problem_kind kind = report->status == SHD_SCENE ? SHD_BAD_QUERY : SHD_OVER_LIMIT;
    if (report->status != SHD_SCENE && report->status != SHD_LIMIT) {
        shd_problem_report(&job->reply, report, SHD_BAD_SCENE);
        return;
    }
    for (size_t i = 0; i < shd_report_errors_kept(report); i++) {
        const shd_problem *error = &report->errors[i];
        const char *parameter = parameter_of(error->pointer);
        if (parameter == material) kind = SHD_NOT_FOUND;
        if (is_side(parameter) && is_square(&job->question)) parameter = names[SIZE];
        /* A size's mistake is told once. */
        if (count && parameter && mistakes[count - 1].parameter == parameter) continue;
        mistakes[count++] = (shd_mistake){parameter, error->pointer, error->detail};
    }
    shd_problem_mistakes(&job->reply, kind, mistakes, count);
    if (kind == SHD_OVER_LIMIT) job->reply.limit = report->limit;
}

/* ---- Signatures ---- */

/* Where a parameter's value begins in the target, as it was sent; NULL: it has none. */
static const char *raw_value(const char *target, const char *name) {
    size_t length = strlen(name);
    for (const char *c = strpbrk(target, "?&"); c; c = strpbrk(c + 1, "?&"))
        if (!strncmp(c + 1, name, length) && c[1 + length] == '=') return c + length + 2;
    return NULL;
}

shd_link shd_preview_link(const shd_exchange *exchange, const shd_keys *keys, long long *expires) {
    const char *target = exchange->target ? exchange->target : "";
    const char *signature = raw_value(target, names[SIGNATURE]);
    if (!signature) return SHD_LINK_UNSIGNED;
    size_t length = (size_t)(signature - target) - strlen(names[SIGNATURE]) - 2;
    if (!shd_keys_signed(keys, target, length, signature)) return SHD_LINK_WRONG;
    /* What is signed and no number ends as a mistake of the link, or here. */
    const char *end = raw_value(target, names[EXPIRES]);
    *expires = end ? strtoll(end, NULL, 10) : 0;
    return end && *expires <= time(NULL) ? SHD_LINK_EXPIRED : SHD_LINK_SIGNED;
}
