/* The readers of single members. */
#include <assert.h>
#include <string.h>

#include "scene/read.h"

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
    shd_node_report(r->report, node, SHD_LIMIT, "%s %llu %s; the limit `%s` is %llu", subject,
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

/* Reports the members of an object that are not among `names`. */
static void report_unknown(shd_reader *r, const shd_node *node, const char *const *names,
                           size_t count, const char *what) {
    for (void *at = json_object_iter(node->value); at && !shd_is_cancelled(r->cancelled);
         at = json_object_iter_next(node->value, at)) {
        const shd_node member = {node, json_object_iter_key(at), 0, NULL};
        size_t i = 0;
        while (i < count && strcmp(names[i], member.key) != 0) i++;
        if (i < count) continue;
        shd_wrong(r, &member, "unknown member \"%s\" of %s%s", shd_quote(member.key).text, what,
                  shd_suggest(r->report, member.key, names, count).text);
    }
}

bool shd_read_fields(shd_reader *r, const shd_node *node, const shd_field *fields, size_t count,
                     unsigned kinds, const char *what, void *out) {
    const char *names[SHD_FIELDS_MOST];
    const size_t members = json_object_size(node->value);
    size_t known = 0, found = 0;
    unsigned seen = 0, wrong = 0;
    assert(count <= SHD_FIELDS_MOST);
    if (node->value && !shd_is_object(r, node)) return false;
    for (const shd_field *field = fields; field < fields + count; field++) {
        if (field->kinds && !(field->kinds & kinds)) continue;
        /* Most objects have few of the members that they may have, and the first ones. */
        const shd_node member = found < members ? shd_node_member(node, field->name)
                                                : (shd_node){node, field->name, 0, NULL};
        const size_t errors = r->report->error_count;
        names[known++] = field->name;
        if (member.value) {
            seen |= field->mark;
            found++;
        } else if (field->required) {
            shd_wrong(r, node, "the member \"%s\" is missing", field->name);
        }
        r->field = field;
        if (field->read && (member.value || field->always))
            field->read(r, &member, (char *)out + field->offset);
        if (r->report->error_count > errors) wrong |= field->mark | SHD_SOME_FIELD;
    }
    /* Last, because fields may have fields of their own. */
    r->seen = seen;
    r->wrong = wrong;
    if (found < members) report_unknown(r, node, names, known, what);
    return true;
}

/* ---- Strings and values as they are ---- */

const char *shd_get_text(shd_reader *r, const shd_node *node, const char *expected) {
    if (!json_is_string(node->value)) shd_node_expect(r->report, node, expected);
    return json_string_value(node->value);
}

void shd_read_label(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    shd_get_text(r, node, "a string");
}

void shd_keep_value(shd_reader *r, const shd_node *node, void *out) {
    (void)r;
    *(json_t **)out = node->value;
}

/* ---- Numbers ---- */

static const shd_range *range_of_field(const shd_reader *r) {
    static const shd_range any = {-INFINITY, INFINITY, true, true, "finite"};
    return r->field->range ? r->field->range : &any;
}

bool shd_in_range(double value, const shd_range *range) {
    return (range->above ? value > range->low : value >= range->low) &&
           (range->below ? value < range->high : value <= range->high);
}

/* A number in the field's range. */
static bool get_number(shd_reader *r, const shd_node *node, double *out) {
    const shd_range *range = range_of_field(r);
    const double value = json_number_value(node->value);
    const bool number = json_is_number(node->value), good = number && shd_in_range(value, range);
    if (good)
        *out = value;
    else if (number)
        shd_wrong(r, node, "must be %s, got %.9g", range->text, value);
    else
        shd_node_expect(r->report, node, "a number");
    return good;
}

void shd_read_number(shd_reader *r, const shd_node *node, void *out) {
    get_number(r, node, out);
}

void shd_read_degrees(shd_reader *r, const shd_node *node, void *out) {
    double degrees;
    if (get_number(r, node, &degrees)) *(double *)out = degrees * (SHD_PI / 180);
}

void shd_read_integer(shd_reader *r, const shd_node *node, void *out) {
    const shd_range *range = range_of_field(r);
    double value = json_number_value(node->value);
    if (!json_is_number(node->value))
        shd_node_expect(r->report, node, "an integer");
    else if (!shd_in_range(value, range) || value != floor(value))
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
                     const char *expected, double *out) {
    if (!shd_is_array(r, node, least, most, expected)) return false;
    size_t size = json_array_size(node->value);
    bool good = size >= least && size <= most;
    for (size_t i = 0; i < size && i < most; i++) {
        shd_node item = shd_node_item(node, i);
        good &= get_number(r, &item, &out[i]);
    }
    return good;
}

bool shd_get_three(shd_reader *r, const shd_node *node, double out[3]) {
    return shd_get_numbers(r, node, 3, 3, "an array of 3 numbers", out);
}

void shd_read_vector(shd_reader *r, const shd_node *node, void *out) {
    double v[3];
    if (shd_get_three(r, node, v)) *(shd_vec3 *)out = (shd_vec3){v[0], v[1], v[2]};
}

void shd_read_direction(shd_reader *r, const shd_node *node, void *out) {
    double v[3];
    if (shd_get_three(r, node, v) && !shd_normalize((shd_vec3){v[0], v[1], v[2]}, out))
        shd_wrong(r, node, "must not be zero: it is a direction");
}

/* ---- Names ---- */

int shd_read_name(shd_reader *r, const shd_node *node, const char *const *names) {
    const char *name = shd_get_text(r, node, "a string");
    size_t count = 0;
    if (!name) return -1;
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
