/* The members that the models of reflection have beside Phong's. Only for scene/. */
#pragma once

#include "scene/read.h"

/* The model that a material names, or has by its preset: a shd_model. -1, and an error, if it is
 * none. */
int shd_read_model(shd_reader *r, const shd_node *node);

shd_field_read shd_read_fresnel; /* shd_fresnel */
const shd_fresnel *shd_default_fresnel(void);

/* {roughness, weight} of a lobe of Cook-Torrance. `gloss`: what its roughness is a texture of. */
void shd_read_facet_lobe(shd_reader *r, const shd_node *node, shd_lobe *out,
                         const shd_texture **gloss);

/* What a lobe of 1 sends on of light from straight above, beside a diffuse term of 1. Of
 * Cook-Torrance it is no more than that, since facets also shadow each other. */
double shd_lobe_albedo(const shd_material *material, const shd_lobe *lobe);

/* Warns of what looks like a mistake; materials are never changed silently. Materials that are
 * alike by their values, however they are written, are warned of once. A NAN is an error
 * already. */
void shd_warn_of_material(shd_reader *r, const shd_node *node, const shd_material *m);
