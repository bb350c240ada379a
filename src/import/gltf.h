/* The inside of the module: what glTF files say and assimp does not pass on. */
#pragma once

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "import/losses.h"

/* Whether the first chunk of a .glb file is as long as it says; assimp reserves what it says. True
 * of other files. */
bool shd_gltf_is_whole(const char *path);

/* The document of a .gltf or .glb file, which the caller drops. NULL: it is another file, or cannot
 * be read; assimp tells what is wrong with it. */
json_t *shd_gltf_open(const char *path);

/* The factor of a material's emissive light (KHR_materials_emissive_strength), of all that are
 * called so. False: they differ, and which one is meant is not known. */
bool shd_gltf_strength(const json_t *document, const char *name, float *out);

/* How many lights end somewhere (`range` of KHR_lights_punctual). */
size_t shd_gltf_ranges(const json_t *document);

/* Tells extensions, animations and the like that scenes do not have. */
void shd_gltf_losses(const json_t *document, shd_losses *losses);
