/* The readers of single members. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "scene/read.h"

const shd_range shd_any_number = {-INFINITY, INFINITY, true, true, "finite"};
const shd_range shd_positive = {0, INFINITY, true, true, "greater than 0"};
const shd_range shd_not_negative = {0, INFINITY, false, true, "0 or more"};

void *shd_take(shd_reader *r, size_t count, size_t size) {
    void *memory = shd_arena_zalloc(r->arena, count, size);
    if (!memory && !r->out_of_memory) {
        r->out_of_memory = true;
        shd_report_error(r->report, SHD_MEMORY, "",
                         "the scene does not fit into the limit `memory`, %llu bytes",
                         (unsigned long long)r->limits->memory);
    }
    return memory;
}

const char *shd_take_text(shd_reader *r, const char *text) {
    size_t bytes = strlen(text) + 1;
    char *copy = shd_take(r, bytes, 1);
    return copy ? memcpy(copy, text, bytes) : NULL;
}

uint64_t shd_hold_to_limit(shd_reader *r, const shd_node *node, const char *subject, uint64_t count,
                           shd_limit which, uint64_t limit) {
    if (count <= limit) return count;
    const char *name = shd_limit_names[which];
    shd_node_fail(r->report, node, SHD_LIMIT, "%s %llu %s; the limit `%s` is %llu", subject,
                  (unsigned long long)count, name, name, (unsigned long long)limit);
    shd_report_limit(r->report, which);
    return limit;
}

/* ---- Objects and their members ---- */

bool shd_is_object(shd_reader *r, const shd_node *node) {
    if (json_is_object(node->value)) return true;
    shd_node_expect(r->report, node, "an object");
    return false;
}

static bool is_known(const shd_field *fields, size_t count, unsigned kinds, const char *key) {
    for (size_t i = 0; i < count; i++)
        if ((!fields[i].kinds || fields[i].kinds & kinds) && !strcmp(fields[i].name, key))
            return true;
    return false;
}

static void report_unknown(shd_reader *r, const shd_node *node, const shd_field *fields,
                           size_t count, unsigned kinds, const char *what, const char *key) {
    const char *names[SHD_FIELDS_MOST];
    size_t known = 0;
    for (size_t i = 0; i < count; i++)
        if (!fields[i].kinds || fields[i].kinds & kinds) names[known++] = fields[i].name;
    shd_node member = {node, key, 0, NULL};
    shd_wrong(r, &member, "unknown member \"%s\" of %s%s", shd_quote(key).text, what,
              shd_suggest(r->report, key, names, known).text);
}

uint32_t shd_read_fields(shd_reader *r, const shd_node *node, const shd_field *fields, size_t count,
                         unsigned kinds, const char *what, void *out) {
    uint32_t seen = 0, wrong = 0;
    size_t found = 0;
    for (size_t i = 0; i < count; i++) {
        const shd_field *field = &fields[i];
        if (field->kinds && !(field->kinds & kinds)) continue;
        shd_node member = shd_node_member(node, field->name);
        if (member.value) {
            seen |= UINT32_C(1) << i;
            found++;
        }
        if (!field->read || !(member.value || field->always)) continue;
        size_t errors = r->report->error_count;
        r->field = field;
        field->read(r, &member, (char *)out + field->offset);
        if (r->report->error_count > errors) wrong |= UINT32_C(1) << i;
    }
    r->wrong = wrong; /* last, because fields may have fields of their own */
    if (found == json_object_size(node->value)) return seen;
    json_t *object = (json_t *)(uintptr_t)node->value; /* jansson's iterators are not const */
    for (void *at = json_object_iter(object); at && !shd_is_cancelled(r->cancelled);
         at = json_object_iter_next(object, at))
        if (!is_known(fields, count, kinds, json_object_iter_key(at)))
            report_unknown(r, node, fields, count, kinds, what, json_object_iter_key(at));
    return seen;
}

void shd_read_label(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    if (!json_is_string(node->value)) shd_node_expect(r->report, node, "a string");
}

void shd_keep_value(shd_reader *r, const shd_node *node, void *out) {
    (void)r;
    *(const json_t **)out = node->value;
}

/* ---- Numbers ---- */

static bool in_range(double value, const shd_range *range) {
    return (range->above ? value > range->low : value >= range->low) &&
           (range->below ? value < range->high : value <= range->high);
}

static bool get_number(shd_reader *r, const shd_node *node, const shd_range *range, double *out) {
    if (!json_is_number(node->value)) {
        shd_node_expect(r->report, node, "a number");
        return false;
    }
    double value = json_number_value(node->value);
    if (!in_range(value, range)) {
        shd_wrong(r, node, "must be %s, got %.9g", range->text, value);
        return false;
    }
    *out = value;
    return true;
}

static const shd_range *range_of_field(const shd_reader *r) {
    return r->field->range ? r->field->range : &shd_any_number;
}

void shd_read_number(shd_reader *r, const shd_node *node, void *out) {
    get_number(r, node, range_of_field(r), out);
}

void shd_read_degrees(shd_reader *r, const shd_node *node, void *out) {
    double degrees;
    if (get_number(r, node, range_of_field(r), &degrees)) *(double *)out = degrees * (SHD_PI / 180);
}

void shd_read_integer(shd_reader *r, const shd_node *node, void *out) {
    const shd_range *range = range_of_field(r);
    double value = json_number_value(node->value);
    if (!json_is_number(node->value))
        shd_node_expect(r->report, node, "an integer");
    else if (!in_range(value, range) || value != floor(value))
        shd_wrong(r, node, "expected an integer from %s, got %.9g", range->text, value);
    else
        *(int *)out = (int)value;
}

bool shd_is_array(shd_reader *r, const shd_node *node, size_t least, size_t most,
                  const char *expected) {
    if (!json_is_array(node->value)) {
        shd_node_expect(r->report, node, expected);
        return false;
    }
    size_t size = json_array_size(node->value);
    if (size < least || size > most) shd_wrong(r, node, "expected %s, got %zu", expected, size);
    return true;
}

bool shd_get_numbers(shd_reader *r, const shd_node *node, size_t least, size_t most,
                     const char *expected, const shd_range *range, double *out) {
    if (!shd_is_array(r, node, least, most, expected)) return false;
    size_t size = json_array_size(node->value);
    bool good = size >= least && size <= most;
    for (size_t i = 0; i < size && i < most; i++) {
        shd_node item = shd_node_item(node, i);
        if (!get_number(r, &item, range, &out[i])) good = false;
    }
    return good;
}

bool shd_get_three(shd_reader *r, const shd_node *node, const shd_range *range, double out[3]) {
    return shd_get_numbers(r, node, 3, 3, "an array of 3 numbers", range, out);
}

void shd_read_vector(shd_reader *r, const shd_node *node, void *out) {
    double v[3];
    if (shd_get_three(r, node, range_of_field(r), v))
        *(shd_vec3 *)out = (shd_vec3){v[0], v[1], v[2]};
}

void shd_read_direction(shd_reader *r, const shd_node *node, void *out) {
    double v[3];
    if (!shd_get_three(r, node, &shd_any_number, v)) return;
    if (!shd_normalize((shd_vec3){v[0], v[1], v[2]}, out))
        shd_wrong(r, node, "must not be zero: it is a direction");
}

/* ---- Names ---- */

int shd_read_name(shd_reader *r, const shd_node *node, const char *const *names) {
    if (!json_is_string(node->value)) {
        shd_node_expect(r->report, node, "a string");
        return -1;
    }
    const char *name = json_string_value(node->value);
    size_t count = 0;
    for (; names[count]; count++)
        if (!strcmp(names[count], name)) return (int)count;
    shd_wrong(r, node, "\"%s\" is not known here%s", shd_quote(name).text,
              shd_suggest(r->report, name, names, count).text);
    return -1;
}

void shd_read_choice(shd_reader *r, const shd_node *node, void *out) {
    int index = shd_read_name(r, node, r->field->choices);
    if (index >= 0) *(int *)out = index;
}
