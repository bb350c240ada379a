#include "shade/glow_needs.h"

#include "plan/around.h"
#include "shade/moments.h"
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

/* What one material takes of one environment. */
typedef struct material_needs {
    size_t summed, walked, sharpened; /* those of Phong's lobes that are others at some points */
} material_needs;

static material_needs count_material(counting *c, const shd_surroundings *map,
                                     const shd_material *m, bool tables) {
    const bool pointwise = m->antialiased || m->normal_texture || m->lobe_gloss;
    material_needs out = {0};
    for (size_t t = 0; t < 1 + m->lobe_count; t++) {
        const double *s = t ? m->lobes[t - 1].specular : m->diffuse;
        if (t && s[0] == 0 && s[1] == 0 && s[2] == 0) continue;
        const needed_table table = {map, t ? m->lobes[t - 1].shininess : 1, t > 0};
        if (!shd_is_symmetric(m->model, t)) {
            out.walked++;
            continue;
        }
        if (!tables || !count_table(c, &table)) out.summed++;
        if (tables && t && pointwise) out.sharpened++;
    }
    return out;
}

shd_glow_needs shd_glow_needs_of(const shd_scene *scene) {
    counting c; /* its tables are filled as they are counted */
    c.needs = (shd_glow_needs){0};
    const shd_accuracy *accuracy = &scene->accuracy;
    const bool exact = !accuracy->budget && accuracy->tier == SHD_EXACT,
               shown = accuracy->budget && accuracy->metric != SHD_LINEAR; /* tables rarely do */
    for (size_t j = 0; j < scene->light_count; j++) {
        if (scene->lights[j].type != SHD_LIGHT_ENVIRONMENT) continue;
        const shd_surroundings *map = scene->lights[j].map;
        material_needs most = {0};
        for (size_t m = 0; m < scene->material_count; m++) {
            const shd_material *material = &scene->materials[m];
            material_needs own = count_material(&c, map, material, !exact);
            if (shown) own.summed = 1 + material->lobe_count - own.walked;
            if (!shown) own.walked += own.sharpened;
            if (own.summed > most.summed) most.summed = own.summed;
            if (own.walked > most.walked) most.walked = own.walked;
        }
        c.needs.summed += most.summed;
        c.needs.walked += most.walked;
        if (most.walked) c.needs.bytes += shd_moments_size(map);
    }
    return c.needs;
}
