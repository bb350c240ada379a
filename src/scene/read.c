/* The document: its parts in the order in which they need each other. */
#include <string.h>

#include "scene/read.h"

static void read_background(shd_reader *r, const shd_node *node, void *out) {
    shd_scene *scene = r->scene;
    double alpha = 1;
    if (json_is_null(node->value))
        alpha = 0;
    else
        shd_read_color_alpha(r, node, out, &alpha);
    scene->transparent = alpha < 1;
    if (scene->transparent) scene->background_alpha = alpha;
    if (alpha == 0) memset(scene->background, 0, sizeof scene->background);
}

static void read_interpolation(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    shd_read_choice(r, node, &r->interpolation);
}

/* ---- Accuracy ---- */

typedef struct raw_accuracy {
    int tier, metric;
    double max_error;
} raw_accuracy;

static void read_accuracy(shd_reader *r, const shd_node *node, void *out) {
    enum { TIER = 1, MAX_ERROR = 2, METRIC = 4 };
    enum { STANDARD, EXACT, DRAFT };
    static const char *const tiers[] = {
        [STANDARD] = "standard", [EXACT] = "exact", [DRAFT] = "draft", NULL};
    static const shd_field fields[] = {
        {"tier", shd_read_choice, offsetof(raw_accuracy, tier), .choices = tiers, .mark = TIER},
        {"maxError", shd_read_number, offsetof(raw_accuracy, max_error), .range = &shd_positive,
         .mark = MAX_ERROR},
        {"metric", shd_read_choice, offsetof(raw_accuracy, metric), .choices = shd_metric_names,
         .mark = METRIC},
    };
    raw_accuracy raw = {STANDARD, SHD_DELTA_E_2000, 0};
    if (!shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "accuracy", &raw)) return;
    if (r->seen & TIER && r->seen & (MAX_ERROR | METRIC))
        shd_wrong(r, node, "give either `tier` or a budget of `maxError` and `metric`, not both");
    if ((r->seen & (MAX_ERROR | METRIC)) == METRIC)
        shd_wrong(r, node, "`metric` needs a `maxError` that it measures");
    *(shd_accuracy *)out = (shd_accuracy){.tier = raw.tier == EXACT ? SHD_EXACT : SHD_STANDARD,
                                          .draft = raw.tier == DRAFT,
                                          .budget = r->seen & MAX_ERROR,
                                          .whole = raw.max_error,
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
        const int side = raster->w > raster->h ? raster->w : raster->h;
        if (side > format->side)
            shd_report_error(r->report, SHD_SCENE, "/image",
                             "a %s picture is at most %d pixels wide and high, not %d",
                             format->name, format->side, side);
        if (r->scene->transparent && r->flat >> f & 1)
            shd_report_warning(r->report, "/background",
                               "%s holds no alpha: the picture is laid over black", format->name);
    }
}

static void read_document(shd_reader *r, json_t *tree) {
    /* Order: colors need both spaces; lights need the camera's frame; materials need to
     * know what is traced; objects need the materials, the meshes and the interpolation; outputs
     * need the working space and the number of lights. */
    static const shd_field fields[] = {
        {"$schema", .read = shd_read_label},
        {"workingSpace", shd_read_working_space, .offset = offsetof(shd_scene, working_space)},
        {"colorSpace", .read = shd_read_plain_space},
        {"spectral", shd_read_spectral, .offset = offsetof(shd_scene, spectral)},
        {"camera", shd_read_camera, offsetof(shd_scene, camera), .always = true},
        {"image", shd_read_image, offsetof(shd_scene, raster), .always = true},
        {"ambient", shd_read_color_or_spectrum, .offset = offsetof(shd_scene, ambient),
         .curve = offsetof(shd_scene, ambient_curve), .lamp = true},
        {"background", read_background, .offset = offsetof(shd_scene, background)},
        {"lights", shd_read_lights, .always = true},
        {"interpolation", read_interpolation, .choices = shd_interpolation_names},
        {"trace", shd_read_trace, offsetof(shd_scene, trace), .always = true},
        {"materials", .read = shd_read_materials},
        {"meshes", .read = shd_read_meshes},
        {"objects", shd_read_objects, .required = true},
        {"accuracy", read_accuracy, .offset = offsetof(shd_scene, accuracy)},
        {"output", shd_read_output, .always = true},
        {"outputs", .read = shd_read_outputs},
    };
    const shd_node root = {.value = tree};
    if (shd_read_fields(r, &root, fields, SHD_LENGTH(fields), 0, "the scene", r->scene))
        check_formats(r);
    shd_check_surroundings(r, &root);
    if (r->scene->outputs) shd_lay_over_matte(r->scene);
    shd_share_budget(r->scene);
}

shd_status shd_scene_read(const char *text, size_t length, const shd_catalog *catalog,
                          const shd_limits *limits, const atomic_bool *cancelled,
                          shd_format fallback, const shd_shelf *shelf, shd_arena *arena,
                          const shd_scene **out, shd_report *report) {
    if (length > limits->body) {
        shd_report_error(report, SHD_LIMIT, "",
                         "the document has %zu bytes; the limit `body` is %llu", length,
                         (unsigned long long)limits->body);
        shd_report_limit(report, SHD_LIMIT_BODY);
        return report->status;
    }
    shd_json json;
    if (!shd_json_parse(text, length, limits->memory, true, cancelled, arena, &json, report))
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
    r.scene = shd_take(&r, 1, sizeof *r.scene);
    if (r.scene) {
        /* `ambient` and `background` are black, whose numbers are 0 in every scene-linear space. */
        r.scene->working_space = catalog->scene_linear;
        r.scene->accuracy.metric = SHD_DELTA_E_2000;
        read_document(&r, json.tree);
    }
    shd_report_missing(&r);
    shd_json_drop(&json, arena);
    if (report->status == SHD_OK) shd_scene_digest(r.scene, cancelled, r.scene->digest);
    if (shd_is_cancelled(cancelled)) {
        report->status = SHD_OK; /* missing data is not the document's mistake */
        shd_report_error(report, SHD_CANCELLED, "", "the reading was cancelled");
    }
    if (report->status == SHD_OK) *out = r.scene;
    return report->status;
}
