/* The document: its parts in the order in which they need each other. */
#include "scene/read.h"

static void read_background(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    if (json_is_null(node->value))
        r->scene->transparent = true;
    else
        shd_read_color(r, node, r->scene->background);
}

static void read_ambient(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    shd_read_color(r, node, r->scene->ambient);
}

/* ---- Accuracy ---- */

typedef struct raw_accuracy {
    int tier, metric;
    double max_error;
} raw_accuracy;

static void read_accuracy(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    enum { TIER, MAX_ERROR, METRIC, COUNT };
    enum { STANDARD, EXACT, DRAFT };
    static const char *const tiers[] = {
        [STANDARD] = "standard", [EXACT] = "exact", [DRAFT] = "draft", NULL};
    static const shd_field fields[COUNT] = {
        [TIER] = {"tier", shd_read_choice, offsetof(raw_accuracy, tier), .choices = tiers},
        [MAX_ERROR] = {"maxError", shd_read_number, offsetof(raw_accuracy, max_error),
                       .range = &shd_positive},
        [METRIC] = {"metric", shd_read_choice, offsetof(raw_accuracy, metric),
                    .choices = shd_metric_names},
    };
    if (!shd_is_object(r, node)) return;
    raw_accuracy raw = {STANDARD, SHD_DELTA_E_2000, 0};
    uint32_t seen = shd_read_fields(r, node, fields, COUNT, 0, "accuracy", &raw);
    bool tier = seen >> TIER & 1, error = seen >> MAX_ERROR & 1, metric = seen >> METRIC & 1;
    if (tier && (error || metric))
        shd_wrong(r, node, "give either `tier` or a budget of `maxError` and `metric`, not both");
    if (metric && !error) shd_wrong(r, node, "`metric` needs a `maxError` that it measures");
    r->scene->accuracy = (shd_accuracy){.tier = raw.tier == EXACT ? SHD_EXACT : SHD_STANDARD,
                                        .draft = raw.tier == DRAFT,
                                        .budget = error,
                                        .max_error = raw.max_error,
                                        .metric = (shd_metric)raw.metric};
}

/* ---- The whole ---- */

/* Reports what a format cannot hold. Sides of the raster that are not known are 0. */
static void check_formats(shd_reader *r) {
    const shd_raster *raster = &r->scene->raster;
    for (int f = 0; f < SHD_FORMAT_COUNT; f++) {
        if (!(r->formats >> f & 1)) continue;
        const shd_format_info *format = shd_format_get((shd_format)f);
        int side = raster->w > raster->h ? raster->w : raster->h;
        if (side > format->side)
            shd_report_error(r->report, SHD_SCENE, "/image",
                             "a %s picture is at most %d pixels wide and high, not %d",
                             format->name, format->side, side);
        if (r->scene->transparent && r->flat >> f & 1)
            shd_report_warning(r->report, "/background",
                               "%s holds no alpha: the picture is laid over black", format->name);
    }
}

static void read_document(shd_reader *r, const json_t *tree) {
    /* Order: colors need both spaces; lights need the camera's frame; objects need the materials
     * and the interpolation; outputs need the working space and the number of lights. */
    static const shd_field fields[] = {
        {"$schema", .read = shd_read_label},
        {"workingSpace", .read = shd_read_spaces},
        {"colorSpace", .read = shd_read_spaces},
        {"camera", shd_read_camera, .always = true},
        {"image", shd_read_image, .always = true},
        {"ambient", .read = read_ambient},
        {"background", .read = read_background},
        {"lights", shd_read_lights, .always = true},
        {"interpolation", shd_read_choice, offsetof(shd_reader, interpolation),
         .choices = shd_interpolation_names},
        {"materials", .read = shd_read_materials},
        {"objects", shd_read_objects, .always = true},
        {"accuracy", .read = read_accuracy},
        {"output", shd_read_output, .always = true},
        {"outputs", .read = shd_read_outputs},
    };
    shd_node root = {.value = tree};
    if (!shd_is_object(r, &root)) return;
    shd_read_fields(r, &root, fields, sizeof fields / sizeof fields[0], 0, "the scene", r);
    check_formats(r);
}

/* `ambient` and `background` default to black, which has the same numbers in every scene-linear
 * space, and so do the arena's zeros. */
static shd_scene *make_scene(shd_reader *r) {
    shd_scene *scene = shd_take(r, 1, sizeof *scene);
    if (!scene) return NULL;
    scene->working_space = r->catalog->scene_linear;
    scene->accuracy = (shd_accuracy){.metric = SHD_DELTA_E_2000};
    return scene;
}

shd_status shd_scene_read(const char *text, size_t length, const shd_catalog *catalog,
                          const shd_limits *limits, const atomic_bool *cancelled,
                          shd_format fallback, const shd_mesh_shelf *shelf, shd_arena *arena,
                          const shd_scene **out, shd_report *report) {
    if (length > limits->body) {
        shd_report_error(report, SHD_LIMIT, "",
                         "the document has %zu bytes; the limit `body` is %llu", length,
                         (unsigned long long)limits->body);
        shd_report_limit(report, SHD_LIMIT_BODY);
        return report->status;
    }
    shd_json json;
    if (!shd_json_parse(text, length, limits->memory, cancelled, arena, &json, report))
        return report->status;

    shd_reader r = {.catalog = catalog,
                    .limits = limits,
                    .cancelled = cancelled,
                    .fallback = fallback,
                    .shelf = shelf,
                    .arena = arena,
                    .json = &json,
                    .report = report,
                    .colors = catalog->colors,
                    .interpolation = SHD_PHONG,
                    .default_used = SIZE_MAX};
    r.scene = make_scene(&r);
    if (r.scene) read_document(&r, json.tree);
    shd_report_missing(&r);
    shd_json_drop(&json, arena);
    if (report->status == SHD_OK) shd_scene_digest(r.scene, cancelled, r.scene->digest);
    if (shd_is_cancelled(cancelled)) {
        report->status = SHD_OK; /* missing data is not the document's mistake */
        shd_report_error(report, SHD_CANCELLED, "", "the reading was cancelled");
    }
    if (report->status != SHD_OK) return report->status;
    *out = r.scene;
    return SHD_OK;
}
