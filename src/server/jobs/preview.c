#include "preview.h"

#include <ctype.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
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

/* Shapes in about the same frame; flat ones tilted so that the lamp is mirrored in them. `bottom`
 * is the height of their lowest point, where the ground is. */
static const struct framed {
    const char *shape, *members;
    double bottom;
} framed[] = {
    {"sphere", "{}", -1},
    {"box", "{\"size\": [1.25, 1.25, 1.25], \"transform\": {\"rotate\": [0, -25, 0]}}", -0.625},
    {"cylinder", "{\"radius\": 0.75, \"height\": 1.4}", -0.7},
    {"cone", "{\"radius\": 0.9, \"height\": 1.6, \"transform\": {\"translate\": [0, 0.1, 0]}}",
     -0.7},
    {"torus", "{\"radius\": 0.75, \"tube\": 0.3, \"transform\": {\"rotate\": [30, 0, 0]}}", -0.675},
    {"disc", "{\"radius\": 1.05, \"transform\": {\"rotate\": [66, -10, 0]}}", -0.95923},
    {"teapot",
     "{\"transform\": {\"scale\": 0.66, \"rotate\": [0, 20, 0], \"translate\": [-0.07, 0, 0]}}",
     -0.51975},
    {"ball",
     "{\"transform\": {\"scale\": 0.8, \"rotate\": [0, 60, 0], \"translate\": [0, 0.17, 0]}}",
     -0.966},
    {"plane", "{\"transform\": {\"rotate\": [66, -10, 0]}}", NAN},
};

enum { SIDE = 256, SAMPLES = 9, DIGITS_MOST = 15 };

/* Parts of the document, whose members most parameters become. */
enum part { DOCUMENT, IMAGE, COEFFICIENTS, OUTPUT, PARTS, NO_PART = PARTS };

/* What the text of a parameter stands for. */
enum meaning { TEXT, WHOLE, NUMBER, COLOR, CHOICE };

enum { SHAPE, SIZE, GROUND, PARAMETERS = 19, MATERIAL = PARAMETERS };

/* What a mistake's pointer begins with is whose it is, by the longest beginning. */
static const struct parameter {
    const char *name;
    enum part part;
    enum meaning meaning;
    const char *pointer;
} parameters[PARAMETERS + 1] = {
    [SHAPE] = {"shape", NO_PART, TEXT, "/objects/0"},
    [SIZE] = {"size", NO_PART, WHOLE, NULL},
    [GROUND] = {"ground", NO_PART, CHOICE, NULL},
    {"width", IMAGE, WHOLE, "/image"},
    {"height", IMAGE, WHOLE, "/image/height"},
    {"samples", IMAGE, WHOLE, "/image/samples"},
    {"display", OUTPUT, TEXT, "/output/display"},
    {"view", OUTPUT, TEXT, "/output/view"},
    {"colorSpace", OUTPUT, TEXT, "/output"},
    {"format", OUTPUT, TEXT, "/output/format"},
    {"quality", OUTPUT, WHOLE, "/output/quality"},
    {"expires", NO_PART, WHOLE, NULL},
    {"signature", NO_PART, TEXT, NULL},
    {"background", DOCUMENT, COLOR, "/background"},
    {"emissive", COEFFICIENTS, COLOR, "/objects/0/material/emissive"},
    {"ambient", COEFFICIENTS, COLOR, "/objects/0/material/ambient"},
    {"diffuse", COEFFICIENTS, COLOR, "/objects/0/material/diffuse"},
    {"specular", COEFFICIENTS, COLOR, "/objects/0/material/specular"},
    {"shininess", COEFFICIENTS, NUMBER, "/objects/0/material/shininess"},
    [MATERIAL] = {"material", NO_PART, TEXT, "/objects/0/material"}, /* of the path */
};

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
                "it is not known here: there is shape, size, ground, width, height, samples, "
                "background, display, view, colorSpace, format, quality, emissive, ambient, "
                "diffuse, specular, "
                "shininess");
}

static void drop_link(link_read *l) {
    for (size_t i = 0; i < PARAMETERS; i++) json_decref(l->values[i]);
    for (size_t i = 0; i < l->unknown_count; i++) free(l->unknown[i]);
}

/* Text of application/x-www-form-urlencoded, as forms and URLSearchParams write it. NULL: it is no
 * text in UTF-8, or memory is short. */
static json_t *decode_value(const char *from, size_t size, bool *is_short) {
    char *text = malloc(size + 1);
    if (!text) *is_short = true;
    size_t length = 0;
    for (size_t i = 0; text && i < size; i++) {
        char c = from[i] == '+' ? ' ' : from[i];
        const char digits[] = {i + 1 < size ? from[i + 1] : 0, i + 2 < size ? from[i + 2] : 0, 0};
        if (c == '%' && isxdigit((unsigned char)digits[0]) && isxdigit((unsigned char)digits[1])) {
            c = (char)strtol(digits, NULL, 16);
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
    while (which < PARAMETERS && (strlen(parameters[which].name) != length ||
                                  memcmp(parameters[which].name, from, length) != 0))
        which++;
    if (which == PARAMETERS) {
        add_unknown(l, from, length);
    } else if (l->values[which]) {
        add_mistake(l, parameters[which].name, "it is given more than once");
    } else {
        l->values[which] =
            equals ? decode_value(equals + 1, size - length - 1, &l->is_short) : json_string("");
        if (!l->values[which]) add_mistake(l, parameters[which].name, "it is no text in UTF-8");
    }
}

/* The color of a list of numbers with commas between them, or the number that is alone in it. NULL:
 * it is none, or memory is short. */
static json_t *parse_numbers(const char *text, bool *is_short) {
    char *brackets;
    if (asprintf(&brackets, "[%s]", text) < 0) {
        *is_short = true;
        return NULL;
    }
    json_t *list = json_loads(brackets, JSON_DECODE_INT_AS_REAL, NULL);
    free(brackets);
    bool all = list;
    for (size_t i = 0; i < json_array_size(list); i++)
        all = all && json_is_real(json_array_get(list, i));
    json_t *value = json_array_size(list) == 1 ? json_array_get(list, 0) : list;
    value = all ? json_incref(value) : NULL;
    json_decref(list);
    return value;
}

static json_t *parse_whole(const char *text) {
    const size_t length = strlen(text), digits = strspn(text, "0123456789");
    return length && length <= DIGITS_MOST && digits == length
               ? json_integer(strtoll(text, NULL, 10))
               : NULL;
}

/* Turns the text of a parameter that was given into what it is in a document. Texts that are no
 * numbers are colors of CSS, or mistakes, as the reader of scenes will find. */
static void read_value(link_read *l, size_t which) {
    const struct parameter *p = &parameters[which];
    const char *text = json_string_value(l->values[which]);
    json_t *value = NULL;
    if (!text || p->meaning == TEXT) return;
    if (p->meaning == CHOICE)
        value = !strcmp(text, "true") ? json_true() : !strcmp(text, "false") ? json_false() : NULL;
    else if (p->meaning == WHOLE)
        value = parse_whole(text);
    else
        value = parse_numbers(text, &l->is_short);
    if (p->meaning == CHOICE && !value) add_mistake(l, p->name, "expected true or false");
    if (p->meaning == WHOLE && !value) add_mistake(l, p->name, "expected an integer");
    if (p->meaning == NUMBER && !json_is_real(value)) add_mistake(l, p->name, "expected a number");
    if (!value) return;
    json_decref(l->values[which]);
    l->values[which] = value;
}

static void read_link(link_read *l, const char *target) {
    const char *query = strchr(target, '?');
    while (query) {
        const char *from = query + 1;
        query = strchr(from, '&');
        size_t size = query ? (size_t)(query - from) : strlen(from);
        if (size) read_parameter(l, from, size);
    }
    for (size_t which = 0; which < PARAMETERS; which++) read_value(l, which);
    /* The reader of scenes would miss its vertices, of which a link knows nothing. */
    const char *shape = json_string_value(l->values[SHAPE]);
    if (shape && !strcmp(shape, "mesh"))
        add_mistake(l, "shape", "a mesh has no preview: its triangles are the scene's own");
    if (shape && !strcmp(shape, "plane") && json_is_true(l->values[GROUND]))
        add_mistake(l, "ground", "a plane has no end, and so no ground beneath it");
}

/* ---- The document ---- */

/* A grey floor that the object stands on, and that it throws shadows on. Not 0 if memory is short.
 */
static int add_ground(json_t *document, json_t *objects, double height) {
    json_t *ground = json_pack("{s:s, s:{s:f}, s:{s:[f,f,f]}}", "type", "plane", "material",
                               "diffuse", 0.25, "transform", "translate", 0.0, height, 0.0);
    return json_array_append_new(objects, ground) |
           json_object_set_new(document, "trace", json_pack("{s:b}", "shadows", 1));
}

/* What is not given is as it is by default. NULL if memory is short. */
static char *make_document(link_read *l, json_t *preset) {
    if (!l->values[SIZE]) l->values[SIZE] = json_integer(SIDE);
    if (!l->values[SHAPE]) l->values[SHAPE] = json_string("sphere");
    json_t *side = l->values[SIZE], *shape = l->values[SHAPE];
    json_t *parts[PARTS] = {
        [DOCUMENT] = json_loads(surroundings, 0, NULL),
        [IMAGE] = json_pack("{s:O, s:O, s:i}", "width", side, "height", side, "samples", SAMPLES),
        [COEFFICIENTS] = json_pack("{s:O}", "preset", preset),
        [OUTPUT] = json_object()};
    int failed = 0;
    for (size_t i = 0; i < PARAMETERS; i++)
        if (l->values[i] && parameters[i].part != NO_PART)
            failed |= json_object_set(parts[parameters[i].part], parameters[i].name, l->values[i]);
    const struct framed *frame = &framed[0];
    for (size_t i = 0; shape && i < sizeof framed / sizeof framed[0]; i++)
        if (!strcmp(json_string_value(shape), framed[i].shape)) frame = &framed[i];
    json_t *document = parts[DOCUMENT], *object = json_loads(frame->members, 0, NULL);
    failed |= json_object_set(object, "type", shape);
    failed |= json_object_set_new(object, "material", parts[COEFFICIENTS]);
    failed |= json_object_set_new(document, "image", parts[IMAGE]);
    json_t *objects = json_pack("[o]", object);
    if (json_is_true(l->values[GROUND])) failed |= add_ground(document, objects, frame->bottom);
    failed |= json_object_set_new(document, "objects", objects);
    failed |= json_object_set_new(document, "output", parts[OUTPUT]);
    char *text = failed ? NULL : json_dumps(document, JSON_COMPACT);
    json_decref(document);
    return text;
}

bool shd_preview_document(shd_exchange *exchange) {
    static const shd_mistake no_text = {"material", NULL, "it is no text in UTF-8"};
    link_read l = {.mistake_count = 0};
    shd_reply *reply = &exchange->reply;
    char *text = NULL;
    shd_json_memory_watch();
    json_t *name = json_string(exchange->path + shd_path_fixed(SHD_ROUTE_PREVIEW));
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
    const struct parameter *best = NULL;
    size_t longest = 0;
    for (const struct parameter *p = parameters; p <= &parameters[MATERIAL]; p++) {
        const size_t length = p->pointer ? strlen(p->pointer) : 0;
        if (length <= longest || strncmp(pointer, p->pointer, length) != 0) continue;
        longest = length;
        best = p;
    }
    return best ? best->name : NULL;
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
        if (parameter == parameters[MATERIAL].name) kind = SHD_NOT_FOUND;
        if (is_side(parameter) && is_square(&job->question)) parameter = parameters[SIZE].name;
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
    const char *signature = raw_value(target, "signature");
    if (!signature) return SHD_LINK_UNSIGNED;
    size_t length = (size_t)(signature - target) - strlen("&signature=");
    if (!shd_keys_signed(keys, target, length, signature)) return SHD_LINK_WRONG;
    /* What is signed and no number ends as a mistake of the link, or here. */
    const char *end = raw_value(target, "expires");
    *expires = end ? strtoll(end, NULL, 10) : 0;
    return end && *expires <= shd_date() ? SHD_LINK_EXPIRED : SHD_LINK_SIGNED;
}
