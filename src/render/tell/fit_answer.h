/* A fit, told in JSON. */
#pragma once

#include "analysis/phong_fit.h"
#include "render/tell/photo.h"

typedef struct shd_fit_told {
    const shd_scene *scene;
    const char *object; /* as the caller named it; NULL: all */
    shd_model model;
    size_t seen, edge; /* pixels of the photo that are the object's alone, or partly */
    const shd_photo *photo;
    const shd_phong_fit *fit;
} shd_fit_told;

/* NULL: memory, or `cancelled` (or NULL) was raised. */
char *shd_fit_tell(const shd_fit_told *told, const atomic_bool *cancelled);
