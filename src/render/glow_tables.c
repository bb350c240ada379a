#include "render/glow_tables.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "assets/store.h"
#include "base/pool.h"
#include "plan/around.h"
#include "render/westin_tables.h"
#include "shade/glow_needs.h"
#include "shade/moments.h"
#include "shade/prefilter.h"

/* What is made of a map and kept: a table, or the map in blocks. */
typedef struct wanted_thing {
    const shd_surroundings *map;
    bool blocks;
    double exponent;
    bool lobe;
} wanted_thing;

static shd_digest name_of(const wanted_thing *t) {
    char text[128];
    memset(text, 0, sizeof text);
    if (t->blocks)
        snprintf(text, sizeof text, "%.64s blocks", t->map->key);
    else
        snprintf(text, sizeof text, "%.64s %.17g %d", t->map->key, t->exponent, t->lobe);
    return shd_digest_of(text, sizeof text);
}

static size_t size_of(const wanted_thing *t) {
    return t->blocks ? shd_moments_size(t->map) : shd_prefilter_size(t->exponent, t->lobe);
}

static bool fill_thing(const wanted_thing *t, const atomic_bool *cancelled, void *scratch,
                       void *out) {
    return t->blocks ? shd_moments_make(t->map, cancelled, out)
                     : shd_prefilter_make(t->map, t->exponent, t->lobe, cancelled, scratch, out);
}

static shd_status make_thing(shd_rendering *r, const wanted_thing *t, const shd_digest *digest,
                             shd_stored **out, shd_error *error) {
    shd_store *store = r->engine->glows;
    const size_t scratch_bytes =
        t->blocks ? 64 : (shd_prefilter_scratch(t->exponent) + 63) / 64 * 64;
    shd_stored *made = NULL;
    if (!shd_budget_take(r->engine->budget, scratch_bytes))
        return shd_fail(error, SHD_CROWDED, "", "the process may take no more memory just now");
    void *scratch = aligned_alloc(64, scratch_bytes);
    shd_status status = scratch ? SHD_OK : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (status == SHD_OK)
        status = shd_stored_new(store, SHD_THING_TABLE, digest, size_of(t), &made, error);
    if (status == SHD_OK && !fill_thing(t, r->cancelled, scratch, shd_stored_bytes(made))) {
        shd_stored_drop(made);
        status = shd_rendering_cancelled(error);
    }
    free(scratch);
    shd_budget_give(r->engine->budget, scratch_bytes);
    /* Small work does not wait for many tables. */
    r->beside -= shd_pool_lend(r->engine->pool);
    if (status != SHD_OK) return status;
    /* A table that cannot be kept is as good for the one who made it. */
    bool known;
    shd_error unkept;
    shd_store_put(store, made, "", &known, &unkept);
    *out = made;
    return SHD_OK;
}

/* The request holds it from then on. *out NULL: it has enough of them. */
static shd_status hold_thing(shd_rendering *r, const wanted_thing *t, const void **out,
                             shd_error *error) {
    const shd_digest digest = name_of(t);
    size_t count = 0;
    *out = NULL;
    for (const shd_held_table *h = *r->tables; h; h = h->next) {
        if (h->glow && shd_digest_same(&h->name, &digest)) {
            *out = shd_stored_bytes(h->stored);
            return SHD_OK;
        }
        count += h->glow;
    }
    if (!t->blocks && count >= SHD_GLOWS_MOST) return SHD_OK;
    shd_held_table *held = calloc(1, sizeof *held);
    if (!held) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    held->stored = shd_store_find(r->engine->glows, SHD_THING_TABLE, &digest);
    if (!held->stored) {
        const shd_status status = make_thing(r, t, &digest, &held->stored, error);
        if (status != SHD_OK) {
            free(held);
            return status;
        }
    }
    held->glow = true;
    held->name = digest;
    held->next = *r->tables;
    *r->tables = held;
    *out = shd_stored_bytes(held->stored);
    return SHD_OK;
}

static bool has_tables(const shd_plan *draft) {
    const shd_accuracy *accuracy = &draft->scene->accuracy;
    return !accuracy->exactly && (accuracy->budget || accuracy->tier != SHD_EXACT);
}

/* Whether a term of some material is neither read from a table nor integrated. */
static bool has_walks(const shd_plan *draft) {
    const bool tables = has_tables(draft);
    for (size_t m = 0; m < draft->scene->material_count; m++)
        for (size_t t = draft->materials[m].has_diffuse ? 0 : 1;
             t < 1 + draft->materials[m].lobe_count; t++)
            if (tables ? shd_may_be_walked(&draft->materials[m], t)
                       : !shd_is_symmetric(draft->materials[m].model, t))
                return true;
    return false;
}

shd_status shd_rendering_moments(shd_rendering *r, const shd_plan *draft,
                                 const shd_moments *const **out, shd_error *error) {
    const shd_moments **moments = NULL;
    *out = NULL;
    for (size_t j = 0; j < draft->light_count; j++) {
        const shd_plan_light *light = &draft->lights[j];
        if (!light->environment || !has_walks(draft)) continue;
        if (!moments) moments = shd_arena_zalloc(r->arena, SHD_ENVIRONMENTS_MOST, sizeof *moments);
        if (!moments) return shd_rendering_full(r, "plan", error);
        const wanted_thing wanted = {.map = light->environment->map, .blocks = true};
        const void *found;
        const shd_status status = hold_thing(r, &wanted, &found, error);
        if (status != SHD_OK) return status;
        moments[light->around] = found;
    }
    *out = moments;
    return SHD_OK;
}

shd_status shd_rendering_glows(shd_rendering *r, const shd_plan *draft, const shd_glow **out,
                               shd_error *error) {
    const size_t terms = 1 + draft->max_lobes, of_material = SHD_ENVIRONMENTS_MOST * terms,
                 materials = shd_all_materials(draft);
    *out = NULL;
    if (!has_tables(draft)) return SHD_OK;
    shd_glow *glows = NULL;
    for (size_t j = 0; j < draft->light_count; j++) {
        const shd_plan_light *light = &draft->lights[j];
        if (!light->environment) continue;
        if (!glows) glows = shd_arena_zalloc(r->arena, materials, of_material * sizeof *glows);
        if (!glows) return shd_rendering_full(r, "plan", error);
        for (size_t m = 0; m < materials; m++) {
            const shd_plan_material *material = &draft->materials[m];
            for (size_t t = material->has_diffuse ? 0 : 1; t < 1 + material->lobe_count; t++) {
                const double exponent = t ? material->lobes[t - 1].shininess : 1;
                shd_glow *glow = &glows[m * of_material + light->around * terms + t];
                if (!shd_is_symmetric(material->model, t)) continue;
                if (!shd_prefilter_serves(exponent, t > 0)) continue;
                const wanted_thing wanted = {
                    .map = light->environment->map, .exponent = exponent, .lobe = t > 0};
                const void *found;
                const shd_status status = hold_thing(r, &wanted, &found, error);
                if (status != SHD_OK) return status;
                glow->table = found;
                if (glow->table) glow->error = glow->table->error + glow->table->cut_error;
            }
        }
    }
    *out = glows;
    return SHD_OK;
}
