/* The names that documents have for enums. */
#include "scene/scene.h"

const char *const shd_tier_names[] = {[SHD_STANDARD] = "standard", [SHD_EXACT] = "exact", NULL};

const char *shd_asked_tier(const shd_accuracy *accuracy) {
    return accuracy->draft ? "draft" : shd_tier_names[accuracy->tier];
}

const char *const shd_metric_names[] = {
    [SHD_LINEAR] = "linear", [SHD_CODE] = "code", [SHD_DELTA_E_2000] = "deltaE2000", NULL};

const char *const shd_light_names[] = {[SHD_LIGHT_AMBIENT] = "ambient",
                                       [SHD_LIGHT_DIRECTIONAL] = "directional",
                                       [SHD_LIGHT_POINT] = "point",
                                       [SHD_LIGHT_SPOT] = "spot",
                                       [SHD_LIGHT_RECT] = "rect",
                                       [SHD_LIGHT_DISC] = "disc",
                                       [SHD_LIGHT_SPHERE] = "sphere",
                                       [SHD_LIGHT_ENVIRONMENT] = "environment",
                                       NULL};

const char *const shd_interpolation_names[] = {
    [SHD_PHONG] = "phong", [SHD_GOURAUD] = "gouraud", [SHD_FLAT] = "flat", NULL};

const char *const shd_shape_names[] = {[SHD_SPHERE] = "sphere",
                                       [SHD_PLANE] = "plane",
                                       [SHD_DISC] = "disc",
                                       [SHD_BOX] = "box",
                                       [SHD_CYLINDER] = "cylinder",
                                       [SHD_CONE] = "cone",
                                       [SHD_TORUS] = "torus",
                                       [SHD_MESH] = "mesh",
                                       [SHD_SHAPE_COUNT + SHD_TEAPOT] = "teapot",
                                       [SHD_SHAPE_COUNT + SHD_BALL] = "ball",
                                       [SHD_SHAPE_COUNT + SHD_BUILTIN_COUNT] = NULL};

const char *const shd_model_names[] = {[SHD_MODEL_PHONG] = "phong",
                                       [SHD_MODEL_BLINN_PHONG] = "blinn-phong",
                                       [SHD_MODEL_PHONG_NORMALIZED] = "phong-normalized",
                                       [SHD_MODEL_OREN_NAYAR] = "oren-nayar",
                                       [SHD_MODEL_COOK_TORRANCE] = "cook-torrance",
                                       [SHD_MODEL_WESTIN] = "westin",
                                       [SHD_MODEL_COUNT] = NULL};
