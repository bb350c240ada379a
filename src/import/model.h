/* What a file of another program holds, as plain data: what the module shaded_import.so makes of it
 * with assimp, and `shade import` makes a scene of.
 *
 * The module runs in a process of its own, which a hostile file may have made do anything. So a
 * model is one block of bytes that begins with a shd_model and holds no pointers: a span is a place
 * in the block. shd_model_check is what makes it fit for use.
 *
 * Lengths and axes are the file's. Colors are as the file has them, linear for glTF. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

typedef struct shd_span {
    uint64_t at, count; /* byte where the first item is, a multiple of 8; items */
} shd_span;

typedef struct shd_model_mesh {
    shd_span name;      /* text: bytes, without a final 0 */
    shd_span positions; /* float: x, y, z of each vertex */
    shd_span normals;   /* the same, or none */
    shd_span uvs;       /* float: u, v of each vertex, v upward, or none */
    shd_span indices;   /* uint32_t: three a triangle */
    uint32_t material;
    uint32_t colored; /* whether vertices have colors, which are left out */
} shd_model_mesh;

/* A picture's file, of any format that starts as one that is read here does. */
typedef struct shd_model_picture {
    shd_span name;  /* text: as the file has it */
    shd_span bytes; /* of the file, as they are; none: it cannot be read */
    uint32_t measured, reserved;
    float mean[4];   /* where `measured`: of its codes over the largest, red to alpha */
    float linear[3]; /* the same of what sRGB makes of the codes */
    float reserved_too;
} shd_model_picture;

/* What a material takes of pictures. */
typedef enum shd_model_map_kind {
    SHD_MAP_AMBIENT,
    SHD_MAP_DIFFUSE, /* glTF: the base color */
    SHD_MAP_SPECULAR,
    SHD_MAP_EMISSIVE,
    SHD_MAP_COLORS,
    SHD_MAP_OPACITY = SHD_MAP_COLORS, /* MTL's map_d */
    SHD_MAP_NORMAL,                   /* of the tangent space: glTF's, MTL's norm */
    SHD_MAP_GLOSS,                    /* MTL's map_Ns, which multiplies Ns */
    SHD_MAP_TAKEN,
    SHD_MAP_METAL_ROUGH = SHD_MAP_TAKEN, /* glTF: roughness in green, metal in blue */
    SHD_MAP_OCCLUSION,                   /* glTF, in red */
    /* Pictures that are made of glTF's base color and metal (metal.h), where that differs. */
    SHD_MAP_BENEATH,
    SHD_MAP_MIRRORED,
    SHD_MAP_KINDS
} shd_model_map_kind;

enum { SHD_MODEL_REPEAT, SHD_MODEL_CLAMP, SHD_MODEL_MIRROR };

/* (s, t) = (u, v) times scale, turned by `rotate` degrees from u to v, then moved by `offset`;
 * t is upward. */
typedef struct shd_model_map {
    uint32_t picture; /* 1 + its index; 0: there is none */
    uint32_t wrap;    /* along s; if `uneven`, another one along t */
    uint32_t uneven;
    uint32_t channel; /* of coordinates: only 0 is kept */
    float scale[2], offset[2];
    float rotate;
    float bump; /* of normals: what their x and y are multiplied by */
} shd_model_map;

/* How a file says what a surface is like. */
enum { SHD_MODEL_PLAIN, SHD_MODEL_MTL, SHD_MODEL_METAL_ROUGH, SHD_MODEL_GLOSSY };

typedef struct shd_model_material {
    shd_span name;
    shd_model_map maps[SHD_MAP_KINDS];
    uint32_t kind;
    uint32_t unlit;
    int32_t illum;          /* MTL */
    uint32_t cut_out;       /* glTF: alpha counts, that of the base color's picture too */
    float cutoff;           /* what is less is nothing, and the rest opaque; 0: it fades */
    float occlusion;        /* how much of the picture of occlusion counts, [0,1] */
    uint32_t strength_lost; /* a factor of `emissive`, because the file has it for another one */
    /* MTL: Ka, Kd, Ks, Ke, Tf, Ns, d, Ni. */
    float ambient[3], diffuse[3], specular[3], emissive[3], through[3];
    float shininess, opacity, ior;
    /* glTF: the base color is `diffuse`. */
    float metallic, roughness; /* or 1 - glossiness */
    float transmission;
} shd_model_material;

typedef struct shd_model_object {
    shd_span name;
    double matrix[16]; /* column-major, object to world */
    uint32_t mesh, reserved;
} shd_model_object;

typedef struct shd_model_camera {
    shd_span name;
    double position[3], forward[3], up[3];
    double fov;    /* vertical, degrees; 0: it is orthographic */
    double height; /* of the view volume; orthographic */
    double aspect; /* width by height; 0: not told */
} shd_model_camera;

enum { SHD_MODEL_POINT, SHD_MODEL_DIRECTIONAL, SHD_MODEL_SPOT };

typedef struct shd_model_light {
    shd_span name;
    uint32_t type, reserved;
    double position[3], direction[3]; /* the way that light travels */
    double color[3];                  /* lux or candela, as in KHR_lights_punctual */
    double inner, outer;              /* half-angles of a spot, degrees */
} shd_model_light;

typedef struct shd_model {
    char magic[8];
    uint64_t size; /* of the block */
    shd_span pictures, meshes, materials, objects, cameras, lights;
    shd_span losses;        /* text: sentences on what is left out, each with a newline behind it */
    uint64_t ranged_lights; /* which end somewhere in the file */
    char failure[256];      /* why there is no model, or "" */
} shd_model;

#define SHD_MODEL_MAGIC "shdmodl5"

/* Whether a block of `size` bytes, aligned to 8, is a model: every span is in it, every index is
 * one of something, and every number is finite. Normals that are zero, and normals and uvs that
 * are not finite, are let pass, for shd_mesh_has_normals and shd_mesh_has_uvs to find. SHD_SCENE
 * tells what is wrong. Pure, any thread. */
shd_status shd_model_check(const void *block, size_t size, shd_error *error);

/* Whether each vertex has a normal that is not zero. */
bool shd_mesh_has_normals(const shd_model *model, const shd_model_mesh *mesh);

/* Whether each vertex has coordinates of pictures. */
bool shd_mesh_has_uvs(const shd_model *model, const shd_model_mesh *mesh);

/* The items of a span of a block that was checked. */
static inline const void *shd_span_items(const shd_model *model, shd_span span) {
    return (const char *)model + span.at;
}

/* What the module exports, by this type and name: reads the file and writes a model, or the reason
 * why there is none, to a descriptor. Runs in a process that ends after it. False: it could not be
 * written. */
typedef bool shd_import_fn(const char *path, int descriptor);
#define SHD_IMPORT_ENTRY "shd_import_write"
