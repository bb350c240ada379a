/* Materials of other programs as ours: which lobes come nearest to theirs, and how far off a sphere
 * of them is.
 *
 * A foreign material adds I = diffuse(N.L) + lobe. Its lobe without color is fitted by at most
 * three of ours, by least squares of its root (which weighs dark parts as an eye does more than
 * plain least squares would): over normals around the half vector, for angles between light and eye
 * from 20 to 120 degrees. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/* Where light, eye and normal stand to each other: cosines, with H = (L + V) / |L + V| and R the
 * mirrored light. */
typedef struct shd_stand {
    double nl, nv, nh, vh, rv;
} shd_stand;

typedef enum shd_foreign_kind {
    SHD_FOREIGN_GLTF, /* GGX by Smith's separable shadowing, Schlick's Fresnel: glTF 2.0, appendix B
                       */
    SHD_FOREIGN_BLINN, /* (N.H)^n without N.L, as MTL has it */
    SHD_FOREIGN_THREE  /* three.js MeshPhongMaterial: Fresnel/4 (n/2 + 1) (N.H)^n N.L */
} shd_foreign_kind;

typedef struct shd_foreign {
    shd_foreign_kind kind;
    double diffuse[3];
    double specular[3]; /* what is mirrored at a right angle; Blinn: its factor */
    double shape;       /* glTF: alpha, the square of the roughness; else the exponent n */
    bool is_pictured;   /* `diffuse` is of a picture, and stays without what rough facets scatter */
} shd_foreign;

/* Ours: Cook-Torrance, Blinn-Phong or Phong. */
typedef enum shd_native_model {
    SHD_NATIVE_COOK_TORRANCE,
    SHD_NATIVE_BLINN_PHONG,
    SHD_NATIVE_PHONG
} shd_native_model;

enum { SHD_FIT_LOBES = 3 };

typedef struct shd_native {
    shd_native_model model;
    double diffuse[3], specular[3]; /* Cook-Torrance: f0 */
    struct {
        double shape, weight; /* slope or exponent, and what the color is multiplied by */
    } lobes[SHD_FIT_LOBES];
    size_t lobe_count;
} shd_native;

/* Fits up to `lobes` of them. Pure, any thread. */
void shd_fit(const shd_foreign *foreign, shd_native_model model, size_t lobes, shd_native *out);

/* CIEDE2000 between spheres of both on a display of sRGB: over 64 by 64 pixels, seen from afar, lit
 * by one directional light from (1, 1, 1) that shows diffuse 1 as 1. */
typedef struct shd_fit_error {
    double mean, most;
} shd_fit_error;

shd_fit_error shd_fit_measure(const shd_foreign *foreign, const shd_native *native);
