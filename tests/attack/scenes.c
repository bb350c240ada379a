#include "attack/scenes.h"

#include <stdlib.h>

#include "attack/makers.h"
#include "attack/write.h"

const family families[] = {
    {"plain", "an object or two, up to four lights", write_plain, true, false, 0},
    {"many", "up to 14 objects, up to 12 lights", write_many, true, false, 0},
    {"rims", "rims of light that overlap by a fraction of a pixel", write_rims, true, false, 0},
    {"slivers", "slivers and wedges of light", write_slivers, true, false, 0},
    {"coarse", "few pixels, shininess down to 0.05", write_coarse, true, false, 0},
    {"sharp", "shininess up to 1e6", write_sharp, true, false, 0},
    {"lamps", "up to 400 lights", write_lamps, true, false, 0},
    {"thousands", "up to 350 lamps at what is flat or round", write_thousands, false, false, 0},
    {"needles", "cylinders, cones, boxes and rings down to 1e-5 thin", write_needles, true, false,
     0},
    {"inplane", "planes with lights in them", write_inplane, true, false, 0},
    {"near", "lights and eyes next to a surface", write_near, true, false, 0},
    {"stretched", "flat, long and mirrored shapes", write_stretched, true, false, 0},
    {"faceted", "triangles, flat and gouraud", write_faceted, true, false, 0},
    {"smooth", "meshes with normals of their corners", write_smooth, true, false, 0},
    {"zoom", "meshes under a lens", write_zoom, true, false, 0},
    {"patches", "small patches beside large triangles", write_patches, true, false, 0},
    {"far", "scenes of any size, anywhere", write_far, true, false, 0},
    {"huge", "an eye above something huge", write_huge, true, false, 0},
    {"sunset", "an eye at something round and huge, against lights that graze it", write_sunset,
     true, false, 0},
    {"flatly", "planes and discs, flat or far, with lights close to where they are seen",
     write_flatly, true, true, 0},
    {"vast", "sizes up to 1e13 of what is near", write_vast, true, true, 0},
    {"grazed", "round things under a lens where they are met flatly, with a light close to it",
     write_grazed, true, true, 0},
    {"shown", "other outputs, working spaces and negative colors", write_shown, false, false, 0},
    {"models", "other models on an object or two", write_plain, true, false, BEYOND_MODELS},
    {"gloss", "other models, shininess up to 1e6, roughness down to 1e-4", write_sharp, true, false,
     BEYOND_MODELS},
    {"matte", "other models, few pixels, shininess down to 0", write_coarse, true, false,
     BEYOND_MODELS},
    {"beside", "other models, lights and eyes next to a surface", write_near, true, false,
     BEYOND_MODELS},
    {"bent", "other models on meshes with normals of their corners", write_smooth, true, false,
     BEYOND_MODELS},
    {"facets", "other models on triangles, flat and gouraud", write_faceted, true, false,
     BEYOND_MODELS},
    {"away", "other models in scenes of any size, anywhere", write_far, true, false, BEYOND_MODELS},
    {"dusk", "other models, round and huge, against lights that graze them", write_sunset, true,
     false, BEYOND_MODELS},
    {"level", "other models on planes and discs, with lights close to where they are seen",
     write_flatly, true, true, BEYOND_MODELS},
    {"skimmed", "other models under a lens where they are met flatly", write_grazed, true, true,
     BEYOND_MODELS},
    {"shapes", "lights with a shape, Phong's model", write_shaped, true, false, BEYOND_SHAPES},
    {"areas", "lights with a shape, other models", write_shaped, true, false,
     BEYOND_SHAPES | BEYOND_MODELS},
    {"veils", "opacity, up to 14 objects", write_many, true, false, BEYOND_OPACITY},
    {"tinted", "opacity and other models", write_plain, true, false,
     BEYOND_OPACITY | BEYOND_MODELS},
    {"mirrors", "mirrors before each other", write_mirrors, true, false, BEYOND_MIRRORS},
    {"glass", "glass and mirrors before each other", write_mirrors, true, false,
     BEYOND_MIRRORS | BEYOND_GLASS},
    {"polished", "mirrors, glass, opacity and other models", write_mirrors, true, false,
     BEYOND_MIRRORS | BEYOND_GLASS | BEYOND_OPACITY | BEYOND_MODELS},
    {"deep", "mirrors and glass, huge, far or tiny", write_far, true, false,
     BEYOND_MIRRORS | BEYOND_GLASS},
    {"spectra", "spectra of one sample and other models", write_plain, true, false,
     BEYOND_SPECTRUM | BEYOND_MODELS},
    {"printed", "patterns on flat and gouraud triangles", write_faceted, true, false,
     BEYOND_TEXTURES},
    {"wrapped", "patterns on meshes with normals of their corners, other models", write_smooth,
     true, false, BEYOND_TEXTURES | BEYOND_MODELS},
    {"lacquered", "patterns of mirrors before each other", write_mirrors, true, false,
     BEYOND_TEXTURES | BEYOND_MIRRORS},
    {"dyed", "patterns in spectra of one sample and other models", write_plain, true, false,
     BEYOND_TEXTURES | BEYOND_SPECTRUM | BEYOND_MODELS},
    {"hidden", "shadows of up to 7 objects", write_hidden, true, false, BEYOND_SHADOWS},
    {"standing", "shadows of things that touch what they stand on, of any size", write_standing,
     true, false, BEYOND_SHADOWS},
    {"folds", "shadows of flat and gouraud bodies, folded and anywhere", write_folds, true, false,
     BEYOND_SHADOWS},
    {"touched", "shadows of lights in, on and next to surfaces", write_touched, true, false,
     BEYOND_SHADOWS},
    {"leveled", "shadows of light along surfaces", write_level, true, false, BEYOND_SHADOWS},
    {"straight", "shadows through edges and corners of triangles", write_straight, true, false,
     BEYOND_SHADOWS},
    {"warped", "shadows of flat, long and mirrored shapes", write_stretched, true, false,
     BEYOND_SHADOWS},
    {"distant", "shadows in scenes of any size, anywhere", write_far, true, false, BEYOND_SHADOWS},
    {"penumbras", "shadows of lights with a shape", write_hidden, true, false,
     BEYOND_SHADOWS | BEYOND_SHAPES},
    {"contacts", "shadows of lights with a shape, of things that touch", write_standing, true,
     false, BEYOND_SHADOWS | BEYOND_SHAPES},
    {"corners", "shadows of lights with a shape, of folded bodies", write_folds, true, false,
     BEYOND_SHADOWS | BEYOND_SHAPES},
    {"panes", "shadows between panes and mirrors", write_hidden, true, false,
     BEYOND_SHADOWS | BEYOND_MIRRORS | BEYOND_OPACITY},
};
const int family_count = sizeof families / sizeof families[0];

char *write_scene(const family *f, uint64_t seed, const char *accuracy) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    uint64_t random = seed * 0x9e3779b97f4a7c15u + 1;
    for (const char *c = f->name; *c; c++) random = random * 31 + (unsigned char)*c;
    set_beyond(f->beyond, &random);
    f->write(out, &random, accuracy);
    fclose(out);
    return text;
}
