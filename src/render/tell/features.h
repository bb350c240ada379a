/* What this build can do, and the engine's options leave it, by names that clients ask for before
 * they use it. */
#pragma once

#include <jansson.h>

#include "render/engine.h"

/* A list of texts. Names are never given another meaning; api/openapi.yaml says what each stands
 * for. What depends on the build, on the libraries or on this machine has a name of two parts:
 * "format.exr", "kernel.avx2", "light.rect", "model.westin", "ocio.2.1", "scope.waveform". */
json_t *shd_tell_features(const shd_engine *engine);
