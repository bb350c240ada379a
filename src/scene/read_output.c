/* Outputs: what the picture becomes. */
#include <stdlib.h>
#include <string.h>

#include "scene/read.h"

enum { SINGLE = 1, ENTRY = 2 };                                                       /* kinds */
enum { FORMAT = 1, DISPLAY = 2, VIEW = 4, COLOR_SPACE = 8, DEPTH = 16, EFFORT = 32 }; /* marks */
enum { CHANNEL = 64, LAYERS = 128, MATTE = 256, COMPRESSION = 512, SCOPE = 1024 };

/* Members whose meaning depends on others are kept as they are. They are resolved in order: format,
 * color, then depth, channel and layers. */
typedef struct raw_output {
    shd_output output;
    int format;
    const shd_space_info *color_space;
    const char *display, *view, *channel; /* as the document has them */
    shd_depth depth;                      /* 0: absent */
    json_t *layers;
    int compression; /* of compressions */
    int scope;       /* of scopes */
} raw_output;

static void read_string(shd_reader *r, const shd_node *node, void *out) {
    *(const char **)out = shd_get_text(r, node, "a string");
}

static void read_name(shd_reader *r, const shd_node *node, void *out) {
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    const char *name = node->value ? shd_get_text(r, node, "a string") : NULL;
    const size_t length = name ? strlen(name) : 0;
    if (!node->value)
        shd_wrong(r, node->parent,
                  "the member \"name\" is missing: it names the part of the answer");
    else if (name && (length < 1 || length > 64 || strspn(name, allowed) != length))
        shd_wrong(r, node,
                  "a name has 1 to 64 letters, digits, dots, underscores or hyphens, got \"%s\"",
                  shd_quote(name).text);
    else if (name)
        *(const char **)out = shd_take_text(r, name);
}

static void read_depth(shd_reader *r, const shd_node *node, void *out) {
    const double bits = json_number_value(node->value);
    const char *name = json_string_value(node->value) ? json_string_value(node->value) : "";
    const shd_depth depth = bits == 8                ? SHD_U8
                            : bits == 16             ? SHD_U16
                            : !strcmp(name, "half")  ? SHD_HALF
                            : !strcmp(name, "float") ? SHD_FLOAT
                                                     : 0;
    if (depth)
        *(shd_depth *)out = depth;
    else
        shd_wrong(r, node, "must be 8, 16, \"half\" or \"float\"");
}

static void keep_layers(shd_reader *r, const shd_node *node, void *out) {
    if (shd_is_array(r, node, 1, SIZE_MAX, "an array of one or more layers"))
        *(json_t **)out = node->value;
}

static const char *const formats[] = {"png", "jpeg", "webp", "tiff", "exr", "hdr", NULL};
_Static_assert(SHD_PNG == 0 && SHD_HDR == 5 && SHD_FORMAT_COUNT == 6, "names in the enum's order");

static const shd_range quality = {1, 100, .text = "1 to 100"};
static const shd_range effort = {0, 6, .text = "0 to 6"};

/* libwebp's own effort. Lossless: level 2 takes 100 ms for a 512 x 512 sphere of 49 kB; the usual 6
 * takes 220 ms for 47 kB. */
enum { LOSSY_EFFORT = 4, LOSSLESS_EFFORT = 2 };

static const shd_range exposure = {-32, 32, .text = "-32 to 32"};
static const shd_range gamma_range = {0.1, 10, .text = "0.1 to 10"};

/* Of EXR, then of PNG. */
enum { COMPRESSION_FAST = 10, COMPRESSION_DEFAULT };
static const char *const compressions[] = {"none",  "rle",     "zip",   "zips", "piz",
                                           "pxr24", "b44",     "b44a",  "dwaa", "dwab",
                                           "fast",  "default", "small", NULL};

static const char *const scopes[] = {"vectorscope", "chromaticity", "waveform", "parade",
                                     "histogram",   "falsecolor",   "gamut",    NULL};

static void read_dither(shd_reader *r, const shd_node *node, void *out) {
    if (json_is_boolean(node->value))
        *(bool *)out = json_is_true(node->value);
    else
        shd_wrong(r, node, "must be true or false");
}

/* The text of shd_adjust.looks. */
static void read_looks(shd_reader *r, const shd_node *node, void *out) {
    enum { MOST = 16 };
    const shd_catalog *catalog = r->catalog;
    if (!shd_is_array(r, node, 0, MOST, "an array of up to 16 looks")) return;
    const char *known[64];
    size_t count = 0, length = 1;
    for (; count < catalog->look_count && count < SHD_LENGTH(known); count++)
        known[count] = catalog->looks[count].name;
    const char *names[MOST];
    const size_t size = json_array_size(node->value), items = size < MOST ? size : MOST;
    for (size_t i = 0; i < items; i++) {
        const shd_node item = shd_node_item(node, i);
        const char *name = shd_get_text(r, &item, "the name of a look");
        names[i] = NULL;
        for (size_t k = 0; name && k < catalog->look_count; k++)
            if (!strcmp(name, catalog->looks[k].name)) names[i] = name;
        if (name && !names[i])
            shd_wrong(r, &item, "there is no look \"%s\"%s", shd_quote(name).text,
                      shd_suggest(r->report, name, known, count).text);
        if (!names[i]) return;
        length += strlen(name) + 1;
    }
    char *text = shd_take(r, length, 1), *end = text;
    for (size_t i = 0; text && i < items; i++) {
        if (i > 0) *end++ = '\n';
        end = stpcpy(end, names[i]);
    }
    *(const char **)out = text;
}

#define AT(member) offsetof(raw_output, member)

static const shd_field output_fields[] = {
    {"name", read_name, AT(output.name), ENTRY, .always = true},
    {"format", shd_read_choice, AT(format), .choices = formats, .mark = FORMAT},
    {"display", read_string, AT(display), .mark = DISPLAY},
    {"view", read_string, AT(view), .mark = VIEW},
    {"colorSpace", shd_read_space, AT(color_space), .mark = COLOR_SPACE},
    {"bitDepth", read_depth, AT(depth), .mark = DEPTH},
    {"quality", shd_read_integer, AT(output.quality), .range = &quality},
    {"effort", shd_read_integer, AT(output.effort), .range = &effort, .mark = EFFORT},
    {"exposure", shd_read_number, AT(output.adjust.exposure), .range = &exposure},
    {"looks", read_looks, .offset = AT(output.adjust.looks)},
    {"gamma", shd_read_number, AT(output.adjust.gamma), .range = &gamma_range},
    {"dither", read_dither, .offset = AT(output.dither)},
    {"matte", shd_read_color, AT(output.matte), .mark = MATTE},
    {"compression", shd_read_choice, AT(compression), .choices = compressions, .mark = COMPRESSION},
    {"scope", shd_read_choice, AT(scope), .choices = scopes, .mark = SCOPE},
    {"channel", read_string, AT(channel), .mark = CHANNEL},
    {"layers", keep_layers, AT(layers), .mark = LAYERS},
};

/* ---- Color ---- */

static const shd_display_info *find_display(shd_reader *r, const shd_node *node, const char *name) {
    enum { MOST = 64 };
    const shd_catalog *catalog = r->catalog;
    if (!name && catalog->display_count) return &catalog->displays[0];
    const shd_display_info *display = name ? shd_catalog_display(catalog, name) : NULL;
    if (display) return display;
    shd_node at = shd_node_member(node, name ? "display" : "view");
    const char *names[MOST];
    size_t count = 0;
    for (; count < catalog->display_count && count < MOST; count++)
        names[count] = catalog->displays[count].name;
    shd_wrong(r, &at, "there is no display \"%s\"%s", shd_quote(name ? name : "").text,
              shd_suggest(r->report, name ? name : "", names, count).text);
    return NULL;
}

/* A wrong view is NULL here, as an absent one is. The display is checked all the same. */
static void resolve_view(shd_reader *r, const shd_node *node, const char *display_name,
                         const char *view, shd_output *out) {
    const shd_display_info *display = find_display(r, node, display_name);
    if (!display) return;
    out->display = display->name;
    for (size_t i = 0; i < display->view_count; i++)
        if (!view || !strcmp(view, display->views[i])) {
            out->view = display->views[i];
            return;
        }
    shd_node at = shd_node_member(node, "view");
    shd_wrong(r, view ? &at : node, "the display \"%s\" has no view \"%s\"%s", display->name,
              shd_quote(view ? view : "").text,
              shd_suggest(r->report, view ? view : "", display->views, display->view_count).text);
}

static void resolve_color(shd_reader *r, const shd_node *node, raw_output *raw) {
    shd_output *out = &raw->output;
    bool space = r->seen & COLOR_SPACE, view = r->seen & (DISPLAY | VIEW);
    bool linear = shd_format_get(out->format)->linear || !r->catalog->display_count;
    if (space && view)
        shd_wrong(r, node, "give either `colorSpace`, or `display` and `view`, not both");
    if (space)
        out->color_space = raw->color_space;
    else if (!view && linear)
        out->color_space = r->scene->working_space;
    if ((view || !(space || linear)) && !(r->wrong & DISPLAY))
        resolve_view(r, node, raw->display, raw->view, out);
}

/* What the output's samples are. False: nothing that a file would be misread for. */
static bool find_held(shd_reader *r, const shd_output *out, shd_holds *holds) {
    if (out->color_space) {
        *holds = out->color_space->holds;
        return out->color_space->channels <= SHD_XYZ;
    }
    const shd_display_info *display =
        out->view ? shd_catalog_display(r->catalog, out->display) : NULL;
    for (size_t i = 0; display && i < display->view_count; i++)
        if (!strcmp(display->views[i], out->view)) *holds = display->holds[i];
    return display != NULL;
}

/* Warns of files that other programs take for something else than they are. */
static void warn_of_color(shd_reader *r, const shd_node *node, const shd_output *out) {
    const shd_format_info *format = shd_format_get(out->format);
    shd_holds holds = SHD_HOLDS_DATA;
    if (!find_held(r, out, &holds) || holds == SHD_HOLDS_DATA) return;
    const shd_node at = shd_node_member(node, r->seen & COLOR_SPACE ? "colorSpace"
                                              : r->seen & VIEW      ? "view"
                                                                    : "display");
    if (format->linear && holds == SHD_HOLDS_CODES)
        shd_warn(r, &at,
                 "%s holds scene-linear light by convention: other programs will take these "
                 "encoded values for it",
                 format->name);
    if (out->depth == SHD_U8 && holds == SHD_HOLDS_LIGHT)
        shd_warn(r, &at, "8 bits have few codes for dark linear light: it bands");
}

/* What is adjusted must be a color, and light that is to add up keeps its proportions. */
static void check_adjust(shd_reader *r, const shd_node *node, const shd_output *out) {
    const shd_adjust *adjust = &out->adjust;
    const struct {
        const char *name;
        bool does, bends; /* it is not neutral, and not in proportion to light */
    } members[] = {{"exposure", adjust->exposure != 0, false},
                   {"looks", adjust->looks != NULL, adjust->looks && *adjust->looks},
                   {"gamma", adjust->gamma != 1, adjust->gamma != 1}};
    shd_holds holds = SHD_HOLDS_CODES;
    const bool rgb = find_held(r, out, &holds);
    for (size_t i = 0; i < SHD_LENGTH(members); i++) {
        const shd_node at = shd_node_member(node, members[i].name);
        if (members[i].does && holds == SHD_HOLDS_DATA)
            shd_wrong(r, &at, "this output is data, as it is: no color to be adjusted");
        else if (members[i].bends && r->seen & LAYERS)
            shd_wrong(r, &at, "layers are light, which adds up: only `exposure` is for them");
    }
    const shd_node gamma = shd_node_member(node, "gamma");
    if (adjust->gamma != 1 && !rgb && holds != SHD_HOLDS_DATA)
        shd_wrong(r, &gamma, "gamma is of R, G and B: this output has other channels");
}

static void check_file(shd_reader *r, const shd_node *node, const raw_output *raw) {
    const shd_output *out = &raw->output;
    const shd_format_info *format = shd_format_get(out->format);
    const shd_node dither = shd_node_member(node, "dither"), matte = shd_node_member(node, "matte"),
                   compression = shd_node_member(node, "compression");
    if (out->dither && out->depth != SHD_U8)
        shd_wrong(r, &dither, "only 8 bits are dithered: this output has bitDepth %s",
                  shd_depth_name(out->depth));
    const bool of_png = raw->compression >= COMPRESSION_FAST;
    if (r->seen & COMPRESSION && out->format != (of_png ? SHD_PNG : SHD_EXR))
        shd_wrong(r, &compression, "%s has no compression \"%s\": it is one of %s", format->name,
                  compressions[raw->compression], of_png ? "png" : "exr");
    if (r->seen & MATTE && (format->alpha || out->channel == 3))
        shd_warn(r, &matte, "this output holds alpha: nothing is laid over a matte");
}

/* ---- Depth and channel ---- */

static void resolve_depth(shd_reader *r, const shd_node *node, raw_output *raw) {
    shd_output *out = &raw->output;
    const shd_format_info *format = shd_format_get(out->format);
    out->depth = raw->depth ? raw->depth : r->seen & SCOPE ? SHD_U8 : format->depth;
    if (format->depths & out->depth) return;
    char depths[64] = "";
    for (unsigned bit = SHD_U8; bit <= SHD_FLOAT; bit <<= 1) {
        if (!(format->depths & bit)) continue;
        if (*depths) strcat(depths, ", ");
        strcat(depths, shd_depth_name((shd_depth)bit));
    }
    shd_node at = shd_node_member(node, "bitDepth");
    shd_wrong(r, &at, "%s cannot hold bitDepth %s: it holds %s", format->name,
              shd_depth_name(out->depth), depths);
}

/* What the space of an output may be, as bits of shd_channels: anything if it is not known. */
static unsigned channels_of(const shd_reader *r, const raw_output *raw) {
    const shd_space_info *space = raw->output.color_space;
    if (r->seen & COLOR_SPACE && !space) return ~0u;
    bool view = !space || r->seen & (DISPLAY | VIEW);
    return (space ? 1u << space->channels : 0) | (view ? 1u << SHD_RGB : 0);
}

static void resolve_channel(shd_reader *r, const shd_node *node, raw_output *raw) {
    shd_output *out = &raw->output;
    const unsigned kinds = channels_of(r, raw);
    const char *name = raw->channel, *const *names = shd_channel_names(SHD_RGB);
    for (int kind = SHD_LCH; kind >= SHD_RGB; kind--) {
        if (!(kinds >> kind & 1)) continue;
        names = shd_channel_names((shd_channels)kind);
        for (int c = 0; c < 3; c++)
            if (!strcmp(names[c], name)) out->channel = c;
    }
    if (!strcmp("A", name)) out->channel = 3;
    if (out->channel >= 0) return;
    const char *advice = "";
    for (int c = 0; c < 3; c++) {
        if (!strcmp(shd_channel_names(SHD_RGB)[c], name)) advice = "; for it, ask for an RGB space";
        if (!strcmp(shd_channel_names(SHD_YIQ)[c], name)) advice = "; for it, set colorSpace YIQ";
        if (!strcmp(shd_channel_names(SHD_HSV)[c], name)) advice = "; for it, set colorSpace HSV";
    }
    shd_node at = shd_node_member(node, "channel");
    shd_wrong(r, &at, "this output has no channel \"%s\": there is %s, %s, %s, A%s",
              shd_quote(name).text, names[0], names[1], names[2], advice);
}

/* ---- Layers ---- */

static void check_layers(shd_reader *r, const shd_node *node, const raw_output *raw) {
    const shd_node at = shd_node_member(node, "layers");
    const bool view = r->seen & (DISPLAY | VIEW);
    if (raw->format != SHD_EXR && !(r->wrong & FORMAT))
        shd_wrong(r, &at, "%s has no layers: set format exr",
                  shd_format_get((shd_format)raw->format)->name);
    if (r->seen & COLOR_SPACE ? raw->color_space && !raw->color_space->scene_linear : view)
        shd_wrong(r, &at, "layers are light, which adds up: set a scene-linear `colorSpace`");
    if (r->seen & CHANNEL) shd_wrong(r, &at, "give either `channel` or `layers`, not both");
}

/* ---- One output, and several ---- */

/* A budget counts what lossy formats lose. A scope is a drawing, which shows the picture's values
 * but has none of them. */
static void resolve_quality(const shd_reader *r, shd_output *out) {
    enum { USUAL = 90 };
    const bool lossy = out->format == SHD_JPEG || (out->format == SHD_WEBP && out->quality < 100);
    out->measured = r->scene->accuracy.budget && lossy && !out->scope;
    if (!out->quality && !out->measured) out->quality = USUAL;
}

static void read_one(shd_reader *r, const shd_node *node, unsigned kind, shd_output *out) {
    raw_output raw = {.output = {.channel = -1, .adjust = {.gamma = 1}},
                      .format = (int)r->fallback};
    if (!shd_read_fields(r, node, output_fields, SHD_LENGTH(output_fields), kind, "an output",
                         &raw))
        return;
    shd_output *output = &raw.output;
    output->format = (shd_format)raw.format;
    if (!(r->seen & EFFORT))
        output->effort = output->quality >= 100 ? LOSSLESS_EFFORT : LOSSY_EFFORT;
    output->format_given = r->seen & FORMAT;
    if (!(r->wrong & FORMAT)) r->formats |= 1u << raw.format;
    if (!(r->wrong & (FORMAT | DEPTH))) resolve_depth(r, node, &raw);
    resolve_color(r, node, &raw);
    if (r->seen & SCOPE && !(r->wrong & SCOPE)) output->scope = (shd_scope)(1 + raw.scope);
    if (!r->wrong && !output->scope) warn_of_color(r, node, output);
    if (raw.channel) resolve_channel(r, node, &raw);
    if (r->seen & COMPRESSION && raw.compression != COMPRESSION_DEFAULT)
        output->compression = compressions[raw.compression];
    if (!r->wrong) check_adjust(r, node, output);
    if (output->scope) {
        shd_holds holds = SHD_HOLDS_CODES;
        if (!r->wrong) find_held(r, output, &holds);
        if (!(r->wrong & FORMAT)) shd_check_scope(r, node, output, holds);
    }
    if (!r->wrong) check_file(r, node, &raw);
    if (!shd_format_get(output->format)->alpha && output->channel != 3 && !(r->seen & MATTE))
        r->flat |= r->formats & 1u << raw.format;
    if (r->seen & LAYERS) check_layers(r, node, &raw);
    resolve_quality(r, output);
    const shd_node layers = {node, "layers", 0, raw.layers};
    if (raw.layers) shd_read_layers(r, &layers, output);
    *out = *output;
}

void shd_read_output(shd_reader *r, const shd_node *node, void *out) {
    if (!node->value && json_object_get(node->parent->value, "outputs")) return;
    shd_output *output = shd_take(r, 1, sizeof *output);
    if (!output) return;
    read_one(r, node, SINGLE, output);
    shd_scene *scene = out;
    scene->outputs = output;
    scene->output_count = 1;
}

void shd_read_outputs(shd_reader *r, const shd_node *node, void *out) {
    enum { MOST = 16 };
    if (json_object_get(node->parent->value, "output"))
        shd_wrong(r, node, "give either `output` or `outputs`, not both");
    if (!shd_is_array(r, node, 1, MOST, "an array of 1 to 16 outputs")) return;
    const size_t size = json_array_size(node->value), count = size < MOST ? size : MOST;
    shd_output *outputs = shd_take(r, count, sizeof *outputs);
    if (!outputs) return;
    for (size_t i = 0; i < count; i++) {
        shd_node entry = shd_node_item(node, i), name = {&entry, "name", 0, NULL};
        read_one(r, &entry, ENTRY, &outputs[i]);
        for (size_t j = 0; j < i && outputs[i].name; j++)
            if (outputs[j].name && !strcmp(outputs[i].name, outputs[j].name))
                shd_wrong(r, &name, "the name \"%s\" is taken by output %zu", outputs[i].name, j);
    }
    shd_scene *scene = out;
    scene->outputs = outputs;
    scene->output_count = count;
    scene->multipart = true;
}

void shd_share_budget(shd_scene *scene) {
    /* What light may be off costs less than what a format may lose. */
    static const double SHARE = 0.25;
    for (size_t i = 0; i < scene->output_count; i++)
        if (scene->outputs[i].measured) scene->accuracy.max_error = SHARE * scene->accuracy.whole;
}

void shd_lay_over_matte(shd_scene *scene) {
    static const double black[3] = {0};
    const double *matte = scene->outputs[0].matte;
    for (size_t i = 0; i < scene->output_count; i++) {
        const shd_output *output = &scene->outputs[i];
        if (shd_format_get(output->format)->alpha || output->channel == 3 ||
            memcmp(output->matte, matte, sizeof output->matte) != 0)
            return;
    }
    const double alpha = scene->background_alpha;
    if (!scene->transparent || (alpha == 0 && !memcmp(matte, black, sizeof black))) return;
    for (int c = 0; c < 3; c++)
        scene->background[c] = alpha * scene->background[c] + (1 - alpha) * matte[c];
    scene->transparent = false;
    scene->background_alpha = 0;
}
