/* Documents to attack with: of each family any number, by seed. */
#ifndef SHD_ATTACK_SCENES_H
#define SHD_ATTACK_SCENES_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct family {
    const char *name;
    const char *about; /* a line for people */
    void (*write)(FILE *out, uint64_t *random, const char *accuracy);
    bool modelled;   /* the evaluation of the model knows all that its documents say */
    bool quad;       /* which takes 113 bits */
    unsigned beyond; /* BEYOND_ bits: what goes beyond Phong's model and lights that are points */
} family;

enum {
    BEYOND_MODELS = 1,
    BEYOND_SHAPES = 2,
    BEYOND_OPACITY = 4,
    BEYOND_SPECTRUM = 8,
    BEYOND_MIRRORS = 16,
    BEYOND_GLASS = 32,
    BEYOND_SHADOWS = 64,
    BEYOND_TEXTURES = 128, /* patterns that are one of their colors all over a surface */
    BEYOND_SKY = 256,      /* from here on only write_dressed() knows them: environments, */
    BEYOND_PRINTS = 512,   /* patterns of any size, */
    BEYOND_PICTURES = 1024,
    BEYOND_BUMPS = 2048,   /* maps of normals, */
    BEYOND_FACETS = 4096,  /* flat and gouraud; */
    BEYOND_LEVEL = 8192,   /* nothing but what the model's evaluation knows of patterns */
    BEYOND_SQUARE = 16384, /* numbers of a few digits: charts' seams and edges at samples */
    BEYOND_DRESSED = BEYOND_SKY | BEYOND_PRINTS | BEYOND_PICTURES | BEYOND_BUMPS | BEYOND_FACETS
};

extern const family families[];
extern const int family_count;

/* A document whose member `accuracy` is the text; free()d by the caller. */
char *write_scene(const family *f, uint64_t seed, const char *accuracy);

/* Evenly spread in [low, high), in [0, count), and over decades. */
double between(uint64_t *random, double low, double high);
int one_of(uint64_t *random, int count);
double decades(uint64_t *random, double low, double high);

#endif
