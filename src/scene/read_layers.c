/* Layers of EXR pictures. */
#include <stdlib.h>
#include <string.h>

#include "scene/read.h"

static const char *const layer_names[] = {
    [SHD_LAYER_BEAUTY] = "beauty",     [SHD_LAYER_EMISSIVE] = "emissive",
    [SHD_LAYER_AMBIENT] = "ambient",   [SHD_LAYER_DIFFUSE] = "diffuse",
    [SHD_LAYER_SPECULAR] = "specular", [SHD_LAYER_LOBE] = "lobe.<i>",
    [SHD_LAYER_LIGHT] = "light.<i>",   [SHD_LAYER_SHADOW] = "shadow",
    [SHD_LAYER_BOUNCE] = "bounce",     [SHD_LAYER_NORMAL] = "normal",
    [SHD_LAYER_POSITION] = "position", [SHD_LAYER_DEPTH] = "depth",
    [SHD_LAYER_OBJECT] = "object",     [SHD_LAYER_BOUND] = "bound",
    [SHD_LAYER_KINDS] = NULL};

/* How many lobes the scene's materials have at most. SIZE_MAX: they are wrong. */
static size_t count_lobes(const shd_reader *r) {
    size_t most = r->report->error_count ? SIZE_MAX : 0;
    for (size_t i = 0; i < r->material_count; i++)
        if (r->materials[i].lobe_count > most) most = r->materials[i].lobe_count;
    return most;
}

/* Whether a name is `prefix`, "light." or "lobe.", and the number, without leading zeros, of one
 * that is there. */
static bool parse_number(shd_reader *r, const shd_node *node, const char *name, const char *prefix,
                         shd_layer *out) {
    const char *digits = name + strlen(prefix);
    const int what = (int)strlen(prefix) - 1;
    size_t length = strspn(digits, "0123456789");
    if (!length || length > 9 || digits[length] || (digits[0] == '0' && length > 1)) {
        shd_wrong(r, node, "\"%s\" is not a layer: expected the number of a %.*s, as in \"%s0\"",
                  shd_quote(name).text, what, prefix, prefix);
        return false;
    }
    const bool light = out->kind == SHD_LAYER_LIGHT;
    const size_t there = light ? r->lights : count_lobes(r);
    out->light = strtoul(digits, NULL, 10);
    if (out->light < there) return true;
    shd_wrong(r, node,
              light ? "there is no light %zu: the scene has %zu"
                    : "there is no lobe %zu: materials of the scene have %zu at most",
              out->light, there);
    return false;
}

static bool read_layer(shd_reader *r, const shd_node *node, shd_layer *out) {
    static const char *const prefixes[] = {
        [SHD_LAYER_LOBE] = "lobe.", [SHD_LAYER_LIGHT] = "light."};
    const char *name = shd_get_text(r, node, "the name of a layer");
    if (!name) return false;
    out->kind = SHD_LAYER_KINDS;
    for (shd_layer_kind k = SHD_LAYER_LOBE; k <= SHD_LAYER_LIGHT; k++)
        if (!strncmp(name, prefixes[k], strlen(prefixes[k])) && strcmp(name, layer_names[k]) != 0)
            out->kind = k;
    if (out->kind < SHD_LAYER_KINDS) {
        if (!parse_number(r, node, name, prefixes[out->kind], out)) return false;
    } else {
        const int kind = shd_read_name(r, node, layer_names);
        if (kind < 0) return false;
        out->kind = (shd_layer_kind)kind;
        if (kind == SHD_LAYER_LIGHT || kind == SHD_LAYER_LOBE) {
            const char *prefix = prefixes[kind];
            shd_wrong(r, node, "write the %.*s's number, as in \"%s0\"", (int)strlen(prefix) - 1,
                      prefix, prefix);
            return false;
        }
        if (kind == SHD_LAYER_SHADOW && !r->scene->trace.shadows)
            shd_wrong(r, node, "the layer \"shadow\" needs `shadows` in `trace`");
        if (kind == SHD_LAYER_BOUNCE && !r->scene->trace.depth)
            shd_wrong(r, node, "the layer \"bounce\" needs a `depth` in `trace`");
    }
    out->name = shd_take_text(r, name);
    return out->name != NULL;
}

static int compare_layers(const void *a, const void *b) {
    const shd_layer *p = a, *q = b;
    if (p->kind != q->kind) return p->kind < q->kind ? -1 : 1;
    return (p->light > q->light) - (p->light < q->light);
}

void shd_read_layers(shd_reader *r, const shd_node *at, shd_output *out) {
    const size_t count = json_array_size(at->value);
    if (count > SHD_LAYER_KINDS + SHD_LOBES_MOST + r->limits->lights) { /* each once */
        shd_node_report(r->report, at, SHD_LIMIT,
                        "%zu layers are more than there may be: the limit `lights` is %llu", count,
                        (unsigned long long)r->limits->lights);
        shd_report_limit(r->report, SHD_LIMIT_LIGHTS);
        return;
    }
    shd_layer *layers = shd_take(r, count, sizeof *layers);
    shd_layer *sorted = shd_take(r, count, sizeof *sorted);
    if (!layers || !sorted) return;
    size_t good = 0;
    for (size_t i = 0; i < count; i++) {
        shd_node item = shd_node_item(at, i);
        good += read_layer(r, &item, &layers[good]);
    }
    memcpy(sorted, layers, good * sizeof *layers);
    qsort(sorted, good, sizeof *sorted, compare_layers);
    for (size_t i = 1; i < good; i++)
        if (!compare_layers(&sorted[i - 1], &sorted[i]))
            shd_wrong(r, at, "the layer \"%s\" is there twice", shd_quote(sorted[i].name).text);
    out->layers = layers;
    out->layer_count = good;
}
