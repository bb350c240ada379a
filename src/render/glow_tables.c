#include "render/glow_tables.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "assets/store.h"
#include "base/pool.h"
#include "render/westin_tables.h"
#include "shade/glow_needs.h"
#include "shade/prefilter.h"

static shd_digest name_of(const shd_surroundings *map, double exponent, bool lobe) {
    char text[128];
    memset(text, 0, sizeof text);
    snprintf(text, sizeof text, "%.64s %.17g %d", map->key, exponent, lobe);
    return shd_digest_of(text, sizeof text);
}

static shd_status make_table(shd_rendering *r, const shd_surroundings *map, double exponent,
                             bool lobe, const shd_digest *digest, shd_stored **out,
                             shd_error *error) {
    shd_store *store = r->engine->glows;
    const size_t scratch_bytes = (shd_prefilter_scratch(exponent) + 63) / 64 * 64;
    shd_stored *made = NULL;
    if (!shd_budget_take(r->engine->budget, scratch_bytes))
        return shd_fail(error, SHD_CROWDED, "", "the process may take no more memory just now");
    void *scratch = aligned_alloc(64, scratch_bytes);
    shd_status status = scratch ? SHD_OK : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (status == SHD_OK)
        status = shd_stored_new(store, SHD_THING_TABLE, digest, shd_prefilter_size(exponent, lobe),
                                &made, error);
    if (status == SHD_OK &&
        !shd_prefilter_make(map, exponent, lobe, r->cancelled, scratch, shd_stored_bytes(made))) {
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
static shd_status hold_glow(shd_rendering *r, const shd_surroundings *map, double exponent,
                            bool lobe, const shd_prefilter **out, shd_error *error) {
    const shd_digest digest = name_of(map, exponent, lobe);
    size_t count = 0;
    *out = NULL;
    for (const shd_held_table *h = *r->tables; h; h = h->next) {
        if (h->glow && shd_digest_same(&h->name, &digest)) {
            *out = shd_stored_bytes(h->stored);
            return SHD_OK;
        }
        count += h->glow;
    }
    if (count == SHD_GLOWS_MOST) return SHD_OK;
    shd_held_table *held = calloc(1, sizeof *held);
    if (!held) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    held->stored = shd_store_find(r->engine->glows, SHD_THING_TABLE, &digest);
    if (!held->stored) {
        const shd_status status = make_table(r, map, exponent, lobe, &digest, &held->stored, error);
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

shd_status shd_rendering_glows(shd_rendering *r, const shd_plan *draft, const shd_glow **out,
                               shd_error *error) {
    const shd_scene *scene = draft->scene;
    const shd_accuracy *accuracy = &scene->accuracy;
    const size_t terms = 1 + draft->max_lobes, of_material = SHD_ENVIRONMENTS_MOST * terms;
    *out = NULL;
    if (accuracy->exactly || (!accuracy->budget && accuracy->tier == SHD_EXACT)) return SHD_OK;
    shd_glow *glows = NULL;
    for (size_t j = 0; j < draft->light_count; j++) {
        const shd_plan_light *light = &draft->lights[j];
        if (!light->environment) continue;
        if (!glows)
            glows = shd_arena_zalloc(r->arena, scene->material_count, of_material * sizeof *glows);
        if (!glows) return shd_rendering_full(r, "plan", error);
        for (size_t m = 0; m < scene->material_count; m++) {
            const shd_plan_material *material = &draft->materials[m];
            if (material->from->model != SHD_MODEL_PHONG) continue;
            for (size_t t = material->has_diffuse ? 0 : 1; t < 1 + material->lobe_count; t++) {
                const double exponent = t ? material->lobes[t - 1].shininess : 1;
                shd_glow *glow = &glows[m * of_material + light->around * terms + t];
                if (!shd_prefilter_serves(exponent, t > 0)) continue;
                const shd_status status =
                    hold_glow(r, light->environment->map, exponent, t > 0, &glow->table, error);
                if (status != SHD_OK) return status;
                if (glow->table) glow->error = glow->table->error + glow->table->cut_error;
            }
        }
    }
    *out = glows;
    return SHD_OK;
}
