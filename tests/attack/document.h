/* What the evaluation of the model reads from a document. */
#ifndef SHD_ATTACK_DOCUMENT_H
#define SHD_ATTACK_DOCUMENT_H

#include <stddef.h>
#include <stdint.h>

#include "attack/model.h"
#include "attack/solids.h"

typedef enum light_kind {
    AMBIENT,
    DIRECTIONAL,
    POINT,
    SPOT,
    RECTANGLE, /* from here on lights have a shape */
    ROUND,
    BALL,
    AROUND /* an environment */
} light_kind;

typedef struct lamp {
    light_kind kind;
    point position, toward, axis; /* axis: the way that a spot's light travels, unit */
    real color[3];                /* times its intensity */
    real attenuation[3], least;   /* least: distance below which it stops growing */
    real angle, inner, exponent;  /* of a spot: where its light ends, and where it fades */
    point across, up;             /* of a shape: half of a rectangle's sides, radii of a disc */
    real radius;
    /* Of an environment, whose directions are told later (sky.h). */
    real turn;
    double *coarse, *fine;
    size_t coarse_count, fine_count;
} lamp;

/* An environment's texels, as the caller has them: [height][width][3]. */
typedef struct sky_map {
    int width, height;
    const float *texels;
} sky_map;

typedef enum reflection_kind {
    PLAIN, /* Phong's */
    BLINN,
    NORMALIZED,
    OREN_NAYAR,
    COOK_TORRANCE,
    TABLED, /* of a table that the caller knows */
    REFLECTIONS
} reflection_kind;

typedef struct lobe {
    real specular[3], shininess; /* of Cook and Torrance a weight and a roughness */
} lobe;

enum { MOST_LOBES = 4 };

typedef enum print_kind { NO_PRINT, CHECKER_PRINT, GRID_PRINT, RAMP_PRINT, NOISE_PRINT } print_kind;
typedef enum print_wrap { WRAP_CLAMP, WRAP_REPEAT, WRAP_MIRROR } print_wrap;

/* A coefficient that is a pattern. */
typedef struct print {
    print_kind kind;
    print_wrap wrap;
    real map[2][3]; /* (s, t) of (u, v, 1) */
    real width;
    real colors[2][3];
} print;

/* The places of coefficients. */
enum {
    EMISSIVE_PRINT,
    AMBIENT_PRINT,
    DIFFUSE_PRINT,
    LOBE_PRINTS,
    GLOSS_PRINTS = LOBE_PRINTS + MOST_LOBES, /* exponents, whose numbers are in `colors` */
    PRINTS = GLOSS_PRINTS + MOST_LOBES
};

typedef struct stuff {
    real constant[3], diffuse[3]; /* ke + ka Ia */
    lobe lobes[MOST_LOBES];
    size_t lobe_count;
    bool front_only;
    reflection_kind kind;
    table_function *weigh;
    const void *table;
    real sigma;                   /* radians */
    real index[3], absorption[3]; /* refractive; an index of infinity mirrors all */
    real opacity[3], reflection[3], transmission[3], ior;
    bool printed; /* some of these are no colors, unless their `kind` is NO_PRINT */
    print prints[PRINTS];
    real emissive[3], ambient[3], filled[3]; /* ke, ka and Ia */
} stuff;

typedef enum way { PHONG, GOURAUD, FLAT } way;

typedef struct thing {
    solid solid;
    way way;
    stuff stuff;
    real to_world[3][3], from_world[3][3], cofactor[3][3]; /* the latter outward */
    point origin;
    bool mirrored;
    real reach; /* of a sphere around `origin`, in the world; planes: 0 */
    /* Of a mesh, or of a shape that is cut into facets: corners in its frame and the world's,
     * [triangles][3]; normals, made unit, or NULL; which vertex each corner is; [triangles]: the
     * polygon of each. */
    point *corners, *placed, *normals;
    size_t *vertices, *polygons;
    real (*uvs)[2]; /* of each corner, or NULL */
    size_t triangles;
} thing;

typedef struct document {
    bool orthographic, transparent;
    point eye, right, up, back;
    real half; /* of the picture's height: at distance 1, or orthographic */
    int width, height, samples;
    real background[3];
    lamp *lamps;
    size_t lamp_count;
    thing *things;
    size_t thing_count;
    int depth; /* of traced rays */
    real least;
    bool shadows;
    int shadow_samples;
} document;

bool document_read(const char *json, document *out); /* false: memory, or not of scenes.h */
void document_drop(document *d);

static inline point apply(const real m[3][3], point p) {
    return (point){m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z,
                   m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z,
                   m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z};
}

static inline point place(const thing *t, point p) {
    return add(apply(t->to_world, p), t->origin);
}

#endif
