#include "shade/glow_needs.h"

#include "shade/prefilter.h"

typedef struct needed_table {
    const shd_surroundings *map;
    double exponent;
    bool lobe;
} needed_table;

typedef struct counting {
    shd_glow_needs needs;
    needed_table tables[SHD_GLOWS_MOST];
} counting;

/* False: it is summed. */
static bool count_table(counting *c, const needed_table *table) {
    if (!shd_prefilter_serves(table->exponent, table->lobe)) return false;
    for (size_t i = 0; i < c->needs.tables; i++) {
        const needed_table *t = &c->tables[i];
        if (t->map == table->map && t->exponent == table->exponent && t->lobe == table->lobe)
            return true;
    }
    if (c->needs.tables == SHD_GLOWS_MOST) return false;
    c->tables[c->needs.tables++] = *table;
    c->needs.bytes += shd_prefilter_size(table->exponent, table->lobe);
    return true;
}

static size_t count_material(counting *c, const shd_surroundings *map, const shd_material *m) {
    size_t summed = !count_table(c, &(needed_table){map, 1, false});
    for (size_t k = 0; k < m->lobe_count; k++) {
        const double *s = m->lobes[k].specular;
        if (s[0] == 0 && s[1] == 0 && s[2] == 0) continue;
        summed += !count_table(c, &(needed_table){map, m->lobes[k].shininess, true});
    }
    return summed;
}

shd_glow_needs shd_glow_needs_of(const shd_scene *scene) {
    counting c; /* its tables are filled as they are counted */
    c.needs = (shd_glow_needs){0, 0, 0};
    const shd_accuracy *accuracy = &scene->accuracy;
    const bool exact = !accuracy->budget && accuracy->tier == SHD_EXACT,
               shown = accuracy->budget && accuracy->metric != SHD_LINEAR; /* tables rarely do */
    for (size_t j = 0; j < scene->light_count; j++) {
        if (scene->lights[j].type != SHD_LIGHT_ENVIRONMENT) continue;
        size_t most = 0;
        for (size_t m = 0; m < scene->material_count; m++) {
            const shd_material *material = &scene->materials[m];
            size_t terms = 1 + material->lobe_count;
            if (!exact) {
                const size_t summed = count_material(&c, scene->lights[j].map, material);
                if (!shown) terms = summed;
            }
            if (terms > most) most = terms;
        }
        c.needs.summed += most;
    }
    return c.needs;
}
