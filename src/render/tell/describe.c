/* Lists of what there is, as JSON for the HTTP routes of these names. Clients choose from these
 * lists, so each entry says what it is for. */
#include <string.h>

#include "base/json_memory.h"
#include "render/engine.h"
#include "render/tell/features.h"
#include "render/tell/json.h"

static json_t *tell_rgb(const double value[3]) {
    return json_pack("[fff]", value[0], value[1], value[2]);
}

static json_t *describe_materials(const shd_engine *engine) {
    const shd_library *library = shd_engine_library(engine);
    if (!library) return NULL;
    json_t *list = json_array();
    for (size_t i = 0; i < shd_preset_count(library); i++) {
        const shd_preset *preset = shd_preset_at(library, i);
        json_array_append_new(
            list,
            json_pack("{ss ss ss ss ss so so so sf}", "name", preset->name, "group", preset->group,
                      "model", shd_model_names[preset->model], "note", preset->note, "source",
                      preset->source, "ambient", tell_rgb(preset->ambient), "diffuse",
                      tell_rgb(preset->diffuse), "specular", tell_rgb(preset->specular),
                      "shininess", preset->shininess));
    }
    return json_pack("{ss so}", "colorSpace", "lin_rec709", "materials", list);
}

/* ---- Shapes ---- */

typedef struct member {
    const char *name;
    const char *type;    /* as JSON Schema spells types */
    const char *initial; /* the default as JSON, "" where there is none; NULL: it is required */
    const char *description;
} member;

static const struct {
    const char *description;
    member members[5]; /* the first one without a name ends the list */
} shapes[SHD_SHAPE_COUNT + SHD_BUILTIN_COUNT] = {
    [SHD_SPHERE] = {"A sphere around the origin",
                    {{"radius", "number", "1", "Its radius, greater than 0"}}},
    [SHD_PLANE] = {"The infinite plane y = 0, whose normal is +y", {{0}}},
    [SHD_DISC] = {"A flat disc around the origin in y = 0, whose normal is +y",
                  {{"radius", "number", "1", "Its radius, greater than 0"}}},
    [SHD_BOX] = {"A box centered on the origin, its edges along the axes",
                 {{"size", "array", "[1, 1, 1]", "Its extent along x, y and z, greater than 0"}}},
    [SHD_CYLINDER] = {"A closed cylinder around the y axis, centered on the origin",
                      {{"radius", "number", "1", "Its radius, greater than 0"},
                       {"height", "number", "2", "Its extent along y, greater than 0"}}},
    [SHD_CONE] = {"A closed cone around the y axis: base at y = -height/2, apex at y = height/2",
                  {{"radius", "number", "1", "The radius of its base, greater than 0"},
                   {"height", "number", "2", "Its extent along y, greater than 0"}}},
    [SHD_TORUS] = {"A ring around the y axis, centered on the origin",
                   {{"radius", "number", "1", "From its center to the middle of the tube"},
                    {"tube", "number", "0.25", "The radius of the tube, greater than 0"}}},
    [SHD_MESH] =
        {"Triangles",
         {{"positions", "array", NULL, "x, y, z of every vertex, one after another"},
          {"indices", "array", "",
           "Three vertices a triangle, counted from 0; where absent, every three vertices are one"},
          {"normals", "array", "null",
           "x, y, z of every vertex's normal; null: each triangle has its own"},
          {"uvs", "array", "", "u, v of every vertex, for patterns and pictures"}}},
    [SHD_SHAPE_COUNT + SHD_TEAPOT] =
        {"Newell's teapot, closed: its body has radius 1 around the y axis, its spout is at +x",
         {{0}}},
    [SHD_SHAPE_COUNT + SHD_BALL] =
        {"A ball of radius 1 around the origin, with a groove, on a stand down to y = -1.42",
         {{0}}},
};

/* What every object has, whatever its shape. */
static const member common_members[] = {
    {"material", "string or object", "{}",
     "A name from `materials` or from the library, or a material written out"},
    {"transform", "object", "{}", "scale, then rotate, then translate; or matrix"},
    {"interpolation", "string", "\"phong\"",
     "flat, gouraud or phong; where absent, the scene's own"},
    {"name", "string", "", "For people and programs; it changes nothing"},
    {0},
};

/* What those shapes also have that flat and gouraud turn into faces. */
static const member segments_member = {
    "segments", "integer", "32",
    "Slices that the shape is cut into for flat or gouraud, 3 to 1024"};

static json_t *describe_member(const member *m) {
    json_t *initial = m->initial ? json_loads(m->initial, JSON_DECODE_ANY, NULL) : NULL;
    return json_pack("{ss ss sb so* ss}", "name", m->name, "type", m->type, "required",
                     m->initial == NULL, "default", initial, "description", m->description);
}

static json_t *describe_members(const member *m) {
    json_t *list = json_array();
    for (; m->name; m++) json_array_append_new(list, describe_member(m));
    return list;
}

static json_t *describe_shapes(const shd_engine *engine) {
    (void)engine;
    json_t *list = json_array();
    for (int i = 0; i < SHD_SHAPE_COUNT + SHD_BUILTIN_COUNT; i++) {
        json_t *members = describe_members(shapes[i].members);
        if (i < SHD_SHAPE_COUNT && shd_tessellation_triangles((shd_shape)i, 32) > 0)
            json_array_append_new(members, describe_member(&segments_member));
        json_array_append_new(list,
                              json_pack("{ss ss so}", "type", shd_shape_names[i], "description",
                                        shapes[i].description, "members", members));
    }
    return json_pack("{so so}", "shapes", list, "common", describe_members(common_members));
}

/* ---- Color spaces ---- */

static json_t *describe_colorspaces(const shd_engine *engine) {
    const shd_catalog *catalog = shd_color_catalog(engine->color);
    json_t *spaces = json_array();
    for (size_t i = 0; i < catalog->space_count; i++) {
        const shd_space_info *space = &catalog->spaces[i];
        const char *const *names = shd_channel_names(space->channels);
        json_t *aliases = json_array();
        for (size_t k = 0; k < space->alias_count; k++)
            json_array_append_new(aliases, json_string(space->aliases[k]));
        json_array_append_new(spaces, json_pack("{ss so ss s[sss] sb}", "name", space->name,
                                                "aliases", aliases, "description",
                                                space->description, "channels", names[0], names[1],
                                                names[2], "sceneLinear", space->scene_linear));
    }
    json_t *displays = json_array();
    for (size_t i = 0; i < catalog->display_count; i++) {
        const shd_display_info *display = &catalog->displays[i];
        json_t *views = json_array();
        for (size_t k = 0; k < display->view_count; k++)
            json_array_append_new(views, json_string(display->views[k]));
        json_array_append_new(displays,
                              json_pack("{ss so}", "name", display->name, "views", views));
    }
    json_t *looks = json_array();
    for (size_t i = 0; i < catalog->look_count; i++)
        json_array_append_new(looks, json_pack("{ss ss}", "name", catalog->looks[i].name,
                                               "description", catalog->looks[i].description));
    json_t *defaults = json_pack("{ss ss}", "colorSpace", catalog->colors->name, "workingSpace",
                                 catalog->scene_linear->name);
    if (catalog->display_count > 0) {
        const shd_display_info *display = &catalog->displays[0];
        json_object_set_new(defaults, "display", json_string(display->name));
        json_object_set_new(defaults, "view", json_string(display->views[0]));
    }
    return json_pack("{so so so so}", "spaces", spaces, "displays", displays, "looks", looks,
                     "defaults", defaults);
}

/* ---- Version ---- */

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

#ifdef NDEBUG
#define BUILD_KIND "release"
#else
#define BUILD_KIND "debug"
#endif

/* CMake tells "name version|name version". What has no version is left out. */
static json_t *describe_libraries(void) {
    json_t *libraries = json_object();
    for (const char *at = SHADED_LIBRARIES, *end; *at; at = *end ? end + 1 : end) {
        end = strchrnul(at, '|');
        const char *version = strchrnul(at, ' ') + 1;
        if (version < end)
            json_object_setn_new(libraries, at, (size_t)(version - 1 - at),
                                 json_stringn(version, (size_t)(end - version)));
    }
    return libraries;
}

static json_t *describe_formats(void) {
    json_t *formats = json_array();
    for (int f = 0; f < SHD_FORMAT_COUNT; f++)
        if (shd_writes((shd_format)f))
            json_array_append_new(formats, json_string(shd_format_get((shd_format)f)->name));
    return formats;
}

/* The precision in which each tier lights. */
static json_t *describe_tiers(void) {
    json_t *tiers = json_array();
    for (int t = 0; shd_tier_names[t]; t++)
        json_array_append_new(
            tiers, json_sprintf("%s %s", shd_tier_names[t], t == SHD_EXACT ? "f64" : "f32"));
    return tiers;
}

static json_t *describe_version(const shd_engine *engine) {
    return json_pack("{ss ss ss ss so so ss ss so so}", "name", "shaded", "version", shd_version(),
                     "compiler", COMPILER, "build", BUILD_KIND, "libraries", describe_libraries(),
                     "formats", describe_formats(), "colorConfig",
                     shd_color_config_digest(engine->color), "kernel", shd_isa_name(engine->isa),
                     "kernels", describe_tiers(), "features", shd_tell_features(engine));
}

shd_status shd_engine_describe(const shd_engine *engine, shd_topic topic, char **json,
                               shd_error *error) {
    static json_t *(*const describe[])(const shd_engine *engine) = {
        [SHD_TOPIC_MATERIALS] = describe_materials,
        [SHD_TOPIC_SHAPES] = describe_shapes,
        [SHD_TOPIC_COLORSPACES] = describe_colorspaces,
        [SHD_TOPIC_VERSION] = describe_version};
    shd_json_memory_watch();
    /* The numbers were written down with a few digits, and are printed so. */
    char *text = shd_tell_print(describe[topic](engine), 7, NULL);
    if (!text) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    *json = text;
    return SHD_OK;
}
