/* The material library. The classic table was published with OpenGL: teapots.c of the OpenGL
 * Programming Guide (Mark Kilgard, SGI), and the "OpenGL/VRML Materials" table for pewter and the
 * polished metals. Its shininess is a share of 128. Metal, plastic and planet follow the usual rule
 * of thumb for the Phong coefficients.
 *
 * The classic coefficients were chosen by eye in programs that sent their sums to the display as
 * they were. So they are display codes, and stand here as they were published. `decode_color` makes
 * linear light of them, by the sRGB curve; taken for linear light, gold would be beige and rubber
 * pink. */
#include <stdlib.h>
#include <string.h>

#include "base/transfer.h"
#include "scene/scene.h"

#define RGB(r, g, b)                                                                               \
    { r, g, b }
#define GREY(v) RGB(v, v, v)
#define TEAPOTS "OpenGL's classic table (teapots.c)"
#define MEASURED                                                                                   \
    "Cook-Torrance's model with the metal's measured indices of refraction (scene/metals.c)"
#define VRML "the OpenGL/VRML materials table"

/* A row of the library: shd_preset, its colors as they were published. */
typedef struct entry {
    const char *name;
    double ambient[3], diffuse[3], specular[3], shininess;
    const char *note;
} entry;

static const entry presets[] = {
    {"black-plastic", GREY(0), GREY(0.01), GREY(0.5), 32, "Black plastic; " TEAPOTS},
    {"black-rubber", GREY(0.02), GREY(0.01), GREY(0.4), 10, "Black rubber; " TEAPOTS},
    {"brass", RGB(0.329412, 0.223529, 0.027451), RGB(0.780392, 0.568627, 0.113725),
     RGB(0.992157, 0.941176, 0.807843), 27.8974, "Brass; " TEAPOTS},
    {"bronze", RGB(0.2125, 0.1275, 0.054), RGB(0.714, 0.4284, 0.18144),
     RGB(0.393548, 0.271906, 0.166721), 25.6, "Bronze; " TEAPOTS},
    {"chrome", GREY(0.25), GREY(0.4), GREY(0.774597), 76.8, "Chrome; " TEAPOTS},
    {"copper", RGB(0.19125, 0.0735, 0.0225), RGB(0.7038, 0.27048, 0.0828),
     RGB(0.256777, 0.137622, 0.086014), 12.8, "Copper; " TEAPOTS},
    {"cyan-plastic", RGB(0, 0.1, 0.06), RGB(0, 0.50980392, 0.50980392), GREY(0.50196078), 32,
     "Cyan plastic; " TEAPOTS},
    {"cyan-rubber", RGB(0, 0.05, 0.05), RGB(0.4, 0.5, 0.5), RGB(0.04, 0.7, 0.7), 10,
     "Cyan rubber; " TEAPOTS},
    {"emerald", RGB(0.0215, 0.1745, 0.0215), RGB(0.07568, 0.61424, 0.07568),
     RGB(0.633, 0.727811, 0.633), 76.8, "Emerald; " TEAPOTS},
    {"gold", RGB(0.24725, 0.1995, 0.0745), RGB(0.75164, 0.60648, 0.22648),
     RGB(0.628281, 0.555802, 0.366065), 51.2, "Gold; " TEAPOTS},
    {"green-plastic", GREY(0), RGB(0.1, 0.35, 0.1), RGB(0.45, 0.55, 0.45), 32,
     "Green plastic; " TEAPOTS},
    {"green-rubber", RGB(0, 0.05, 0), RGB(0.4, 0.5, 0.4), RGB(0.04, 0.7, 0.04), 10,
     "Green rubber; " TEAPOTS},
    {"jade", RGB(0.135, 0.2225, 0.1575), RGB(0.54, 0.89, 0.63), GREY(0.316228), 12.8,
     "Jade; " TEAPOTS},
    {"measured-aluminium", GREY(0), GREY(0), GREY(0), 0, MEASURED},
    {"measured-brass", GREY(0), GREY(0), GREY(0), 0, MEASURED},
    {"measured-chromium", GREY(0), GREY(0), GREY(0), 0, MEASURED},
    {"measured-copper", GREY(0), GREY(0), GREY(0), 0, MEASURED},
    {"measured-gold", GREY(0), GREY(0), GREY(0), 0, MEASURED},
    {"measured-silver", GREY(0), GREY(0), GREY(0), 0, MEASURED},
    {"metal", RGB(0.31, 0.3, 0.29), RGB(0.31, 0.3, 0.29), RGB(0.92, 0.89, 0.87), 200,
     "A metal by rule of thumb: small diffuse and large specular, both of its color; large "
     "shininess"},
    {"obsidian", RGB(0.05375, 0.05, 0.06625), RGB(0.18275, 0.17, 0.22525),
     RGB(0.332741, 0.328634, 0.346435), 38.4, "Obsidian; " TEAPOTS},
    {"pearl", RGB(0.25, 0.20725, 0.20725), RGB(1, 0.829, 0.829), GREY(0.296648), 11.264,
     "Pearl; " TEAPOTS},
    {"pewter", RGB(0.105882, 0.058824, 0.113725), RGB(0.427451, 0.470588, 0.541176),
     RGB(0.333333, 0.333333, 0.521569), 9.84615, "Pewter; " VRML},
    {"planet", RGB(0.15, 0.13, 0.11), RGB(0.77, 0.69, 0.61), GREY(0), 0,
     "A planet by rule of thumb: diffuse only, no highlight"},
    {"plastic", RGB(0.25, 0.1, 0.1), RGB(0.74, 0.35, 0.35), GREY(0.67), 30,
     "A plastic by rule of thumb: medium diffuse of its color, medium white specular, medium "
     "shininess"},
    {"polished-bronze", RGB(0.25, 0.148, 0.06475), RGB(0.4, 0.2368, 0.1036),
     RGB(0.774597, 0.458561, 0.200621), 76.8, "Polished bronze; " VRML},
    {"polished-copper", RGB(0.2295, 0.08825, 0.0275), RGB(0.5508, 0.2118, 0.066),
     RGB(0.580594, 0.223257, 0.0695701), 51.2, "Polished copper; " VRML},
    {"polished-gold", RGB(0.24725, 0.2245, 0.0645), RGB(0.34615, 0.3143, 0.0903),
     RGB(0.797357, 0.723991, 0.208006), 83.2, "Polished gold; " VRML},
    {"polished-silver", GREY(0.23125), GREY(0.2775), GREY(0.773911), 89.6,
     "Polished silver; " VRML},
    {"red-plastic", GREY(0), RGB(0.5, 0, 0), RGB(0.7, 0.6, 0.6), 32, "Red plastic; " TEAPOTS},
    {"red-rubber", RGB(0.05, 0, 0), RGB(0.5, 0.4, 0.4), RGB(0.7, 0.04, 0.04), 10,
     "Red rubber; " TEAPOTS},
    {"ruby", RGB(0.1745, 0.01175, 0.01175), RGB(0.61424, 0.04136, 0.04136),
     RGB(0.727811, 0.626959, 0.626959), 76.8, "Ruby; " TEAPOTS},
    {"silver", GREY(0.19225), GREY(0.50754), GREY(0.508273), 51.2, "Silver; " TEAPOTS},
    {"turquoise", RGB(0.1, 0.18725, 0.1745), RGB(0.396, 0.74151, 0.69102),
     RGB(0.297254, 0.30829, 0.306678), 12.8, "Turquoise; " TEAPOTS},
    {"white-plastic", GREY(0), GREY(0.55), GREY(0.7), 32, "White plastic; " TEAPOTS},
    {"white-rubber", GREY(0.05), GREY(0.5), GREY(0.7), 10, "White rubber; " TEAPOTS},
    {"yellow-plastic", GREY(0), RGB(0.5, 0.5, 0), RGB(0.6, 0.6, 0.5), 32,
     "Yellow plastic; " TEAPOTS},
    {"yellow-rubber", RGB(0.05, 0.05, 0), RGB(0.5, 0.5, 0.4), RGB(0.7, 0.7, 0.04), 10,
     "Yellow rubber; " TEAPOTS},
};

enum { PRESETS = sizeof presets / sizeof presets[0] };

size_t shd_preset_count(void) {
    return PRESETS;
}

static void decode_color(double rgb[3]) {
    for (int c = 0; c < 3; c++) rgb[c] = shd_curve_decode(SHD_TRANSFER_SRGB, rgb[c]);
}

/* Of a measured metal, which its name tells, all is linear light as it is. */
static void fill_metal(shd_preset *preset, const char *metal) {
    const shd_fresnel *fresnel = shd_metal_find(metal);
    preset->metal = metal;
    for (int c = 0; c < 3; c++)
        preset->ambient[c] = preset->specular[c] = shd_fresnel_reflectance(fresnel, c, 1);
}

shd_preset shd_preset_at(size_t index) {
    static const char measured[] = "measured-";
    const entry *from = &presets[index];
    shd_preset preset = {.name = from->name, .shininess = from->shininess, .note = from->note};
    if (!strncmp(from->name, measured, sizeof measured - 1)) {
        fill_metal(&preset, from->name + sizeof measured - 1);
        return preset;
    }
    memcpy(preset.ambient, from->ambient, sizeof preset.ambient);
    memcpy(preset.diffuse, from->diffuse, sizeof preset.diffuse);
    memcpy(preset.specular, from->specular, sizeof preset.specular);
    decode_color(preset.ambient);
    decode_color(preset.diffuse);
    decode_color(preset.specular);
    return preset;
}

static int compare_key(const void *key, const void *preset) {
    return strcmp(key, ((const entry *)preset)->name);
}

size_t shd_preset_find(const char *name) {
    const entry *found = bsearch(name, presets, PRESETS, sizeof presets[0], compare_key);
    return found ? (size_t)(found - presets) : SIZE_MAX;
}
