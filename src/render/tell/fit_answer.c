#include "render/tell/fit_answer.h"

#include <math.h>
#include <stdio.h>

#include "base/json_memory.h"
#include "render/tell/json.h"

static const char *const term_names[] = {"constant", "diffuse", "specular", "shininess"};

static json_t *tell_color(const double rgb[3]) {
    json_t *list = json_array();
    for (int c = 0; c < 3; c++) json_array_append_new(list, shd_tell_number(rgb[c]));
    return list;
}

/* ---- Values ---- */

static json_t *tell_term(const shd_phong_fit *fit, int term) {
    double value[3], deviation[3];
    for (int c = 0; c < 3; c++) {
        value[c] = fit->channels[c].value[term];
        deviation[c] = fit->channels[c].deviation[term];
    }
    return json_pack("{so so}", "value", tell_color(value), "deviation", tell_color(deviation));
}

static json_t *tell_shininess(const shd_phong_fit *fit) {
    const bool known = fit->doubt != SHD_FIT_NO_LOBE;
    return json_pack("{so so}", "value", shd_tell_number(known ? fit->shininess : INFINITY),
                     "deviation", shd_tell_number(known ? fit->deviation : INFINITY));
}

static json_t *tell_covariance(const shd_phong_fit *fit) {
    json_t *channels = json_array();
    for (int c = 0; c < 3; c++) {
        json_t *rows = json_array();
        for (int i = 0; i < SHD_FIT_TERMS; i++) {
            json_t *row = json_array();
            for (int j = 0; j < SHD_FIT_TERMS; j++)
                json_array_append_new(row, shd_tell_number(fit->channels[c].covariance[i][j]));
            json_array_append_new(rows, row);
        }
        json_array_append_new(channels, rows);
    }
    return channels;
}

static json_t *tell_residual(const shd_fit_told *t) {
    double linear[3], codes[3];
    for (int c = 0; c < 3; c++) {
        linear[c] = t->fit->channels[c].rms;
        codes[c] = t->photo->codes ? t->fit->channels[c].weighted / sqrt(12) : INFINITY;
    }
    return json_pack("{so so}", "linear", tell_color(linear), "codes", tell_color(codes));
}

/* ---- Doubts ---- */

static const char *const unseen[] = {
    "it is clipped on every pixel",
    "no light in it strikes a pixel that is used",
    "no highlight in it falls on a pixel that is used",
};

#define TOO_FEW "fewer pixels are used than there are unknowns"

static void say_alike(int term, int like, char *out, size_t size) {
    static const char *const names[] = {"emissive and ambient light", "diffuse light",
                                        "the highlight"};
    if (like == SHD_FIT_CONSTANT || (term == SHD_FIT_CONSTANT && like >= 0))
        snprintf(out, size, "%s is the same on all pixels that are used, as %s is",
                 names[term == SHD_FIT_CONSTANT ? like : term], names[SHD_FIT_CONSTANT]);
    else if (like >= 0)
        snprintf(out, size, "%s goes as %s does on all pixels that are used", names[term],
                 names[like]);
    else
        snprintf(out, size, "%s is a sum of the other two on all pixels that are used",
                 names[term]);
}

static void say_doubt(const shd_fit_channel *channel, int term, char *out, size_t size) {
    if (channel->doubt[term] == SHD_FIT_UNSEEN)
        snprintf(out, size, "%s", unseen[term]);
    else if (channel->doubt[term] == SHD_FIT_LIKE_OTHERS)
        say_alike(term, channel->like[term], out, size);
    else if (channel->doubt[term] == SHD_FIT_TOO_FEW)
        snprintf(out, size, TOO_FEW);
    else if (channel->doubt[term] == SHD_FIT_SHARP)
        snprintf(out, size, "no highlight is seen, and a sharp one would hardly be on any pixel");
    else
        snprintf(out, size, "its standard deviation is more than 0.02 and a quarter of it");
}

static bool doubts_alike(const shd_fit_channel *a, const shd_fit_channel *b, int term) {
    return a->doubt[term] == b->doubt[term] && a->like[term] == b->like[term];
}

/* Channels with one reason are told together. */
static void tell_term_doubts(const shd_phong_fit *fit, int term, json_t *list) {
    static const char *const names[] = {"R", "G", "B"};
    bool told[3] = {false, false, false};
    for (int c = 0; c < 3; c++) {
        const shd_fit_channel *channel = &fit->channels[c];
        char reason[160];
        if (told[c] || channel->doubt[term] == SHD_FIT_SURE) continue;
        json_t *channels = json_array();
        for (int k = c; k < 3; k++) {
            if (!doubts_alike(channel, &fit->channels[k], term)) continue;
            told[k] = true;
            json_array_append_new(channels, json_string(names[k]));
        }
        say_doubt(channel, term, reason, sizeof reason);
        json_array_append_new(list, json_pack("{ss so ss}", "term", term_names[term], "channels",
                                              channels, "reason", reason));
    }
}

static json_t *tell_doubts(const shd_phong_fit *fit) {
    static const char *const reasons[] = {
        [SHD_FIT_TOO_FEW] = TOO_FEW,
        [SHD_FIT_VAGUE] = "its standard deviation is more than a quarter of it",
        [SHD_FIT_NO_LOBE] = "no highlight stands out of what the other terms leave",
        [SHD_FIT_FLAT] = "any other one leaves as little",
        [SHD_FIT_FEW] = "the highlight is on fewer than eight pixels",
        [SHD_FIT_BEYOND] = "the largest one that is tried fits best: the highlight is smaller than "
                           "pixels show"};
    json_t *list = json_array();
    for (int term = 0; term < SHD_COLUMNS; term++) tell_term_doubts(fit, term, list);
    if (fit->doubt != SHD_FIT_SURE && reasons[fit->doubt])
        json_array_append_new(list, json_pack("{ss ss}", "term", term_names[SHD_FIT_SHININESS],
                                              "reason", reasons[fit->doubt]));
    return list;
}

/* ---- The material ---- */

/* Plain numbers would be in the document's `colorSpace`, which is another. */
static json_t *tell_coefficient(const shd_scene *scene, const double rgb[3]) {
    return json_pack("{ss so}", "space", scene->working_space->name, "value", tell_color(rgb));
}

static json_t *tell_material(const shd_fit_told *t) {
    const shd_scene *scene = t->scene;
    const shd_phong_fit *fit = t->fit;
    double emissive[3], ambient[3], diffuse[3], specular[3];
    bool glows = false, shines = fit->doubt != SHD_FIT_NO_LOBE;
    for (int c = 0; c < 3; c++) {
        const double *value = fit->channels[c].value;
        double around = scene->ambient[c];
        for (size_t i = 0; i < scene->light_count; i++) around += scene->lights[i].ambient[c];
        ambient[c] = around > 0 ? value[SHD_FIT_CONSTANT] / around : 0;
        emissive[c] = around > 0 ? 0 : value[SHD_FIT_CONSTANT];
        glows |= emissive[c] > 0;
        diffuse[c] = value[SHD_FIT_DIFFUSE];
        specular[c] = value[SHD_FIT_SPECULAR];
    }
    json_t *material = json_object();
    if (t->model != SHD_MODEL_PHONG)
        json_object_set_new(material, "model", json_string(shd_model_names[t->model]));
    if (glows) json_object_set_new(material, "emissive", tell_coefficient(scene, emissive));
    json_object_set_new(material, "ambient", tell_coefficient(scene, ambient));
    json_object_set_new(material, "diffuse", tell_coefficient(scene, diffuse));
    if (shines) {
        json_object_set_new(material, "specular", tell_coefficient(scene, specular));
        json_object_set_new(material, "shininess", json_real(fit->shininess));
    }
    return material;
}

/* ---- The whole ---- */

static json_t *tell_pixels(const shd_fit_told *t) {
    const shd_photo *p = t->photo;
    return json_pack("{sI sI sI sI sI sI}", "used", (json_int_t)p->count, "seen",
                     (json_int_t)t->seen, "edge", (json_int_t)t->edge, "clipped",
                     (json_int_t)p->clipped, "transparent", (json_int_t)p->transparent, "outside",
                     (json_int_t)p->outside);
}

char *shd_fit_tell(const shd_fit_told *t, const atomic_bool *cancelled) {
    shd_json_memory_watch();
    json_t *json = json_pack(
        "{ss? ss ss so so so so so so so so so}", "object", t->object, "model",
        shd_model_names[t->model], "space", t->scene->working_space->name, "pixels", tell_pixels(t),
        term_names[0], tell_term(t->fit, SHD_FIT_CONSTANT), term_names[1],
        tell_term(t->fit, SHD_FIT_DIFFUSE), term_names[2], tell_term(t->fit, SHD_FIT_SPECULAR),
        term_names[3], tell_shininess(t->fit), "covariance", tell_covariance(t->fit), "residual",
        tell_residual(t), "notIdentifiable", tell_doubts(t->fit), "material", tell_material(t));
    return shd_tell_print(json, 9, cancelled);
}
