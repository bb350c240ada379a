/* The scene as values, and its reader.
 *
 * A scene is what a client's JSON document says, checked, with every default filled in, every color
 * in the working space and every direction of unit length. It is constant once it is read, lives in
 * the arena that it was read into, and may be shared by threads.
 *
 * Lengths are unitless, angles are radians here (degrees in JSON), the frame is right-handed with
 * +Y up. */
#pragma once

#include "base/arena.h"
#include "base/cancel.h"
#include "base/catalog.h"
#include "base/digest.h"
#include "base/format.h"
#include "base/limits.h"
#include "base/report.h"
#include "base/scope.h"
#include "base/spectrum.h"
#include "base/vec3.h"
#include "scene/texture.h"

typedef enum shd_projection { SHD_PERSPECTIVE, SHD_ORTHOGRAPHIC } shd_projection;

/* The camera frame: right, up and back (toward the viewer) are unit and perpendicular. */
typedef struct shd_camera {
    shd_projection projection;
    shd_vec3 position;
    shd_vec3 right, up, back;
    double fov;    /* vertical, in (0, pi); perspective */
    double height; /* of the view volume; orthographic */
} shd_camera;

typedef struct shd_raster {
    int width, height; /* of the whole picture, in pixels */
    int x, y, w, h;    /* the region that is rendered; (0,0) is top left */
    int samples;       /* a pixel, 1 to 64 */
} shd_raster;

typedef enum shd_light_type {
    SHD_LIGHT_AMBIENT,
    SHD_LIGHT_DIRECTIONAL,
    SHD_LIGHT_POINT,
    SHD_LIGHT_SPOT,
    /* With a shape: they are lit from all of its points (docs/model.md). */
    SHD_LIGHT_RECT,
    SHD_LIGHT_DISC,
    SHD_LIGHT_SPHERE,
    /* All around, infinitely far away: a map of the sphere (scene/surroundings.h). */
    SHD_LIGHT_ENVIRONMENT
} shd_light_type;

static inline bool shd_has_shape(shd_light_type type) {
    return type >= SHD_LIGHT_RECT && type <= SHD_LIGHT_SPHERE;
}

/* A light in the world frame, into which lights of the camera frame are carried over. */
typedef struct shd_light {
    shd_light_type type;
    shd_vec3 position;  /* point, spot; the middle of a shape */
    shd_vec3 direction; /* the way that the light travels, unit; directional, spot, rect,
                         * disc, which shine to that side */
    double color[3];    /* Il = color * intensity */
    /* The light's own ambient share, intensity not applied. An ambient light has its color *
     * intensity here, too, and its `color` is 0. */
    double ambient[3];
    double attenuation[3]; /* a, b, c of 1/(a + b d + c d^2); 1, 0, 0 for directional */
    double min_distance;   /* distance below which attenuation stops growing */
    double angle;          /* half-angle of the cone, in (0, pi]; spot */
    double penumbra;       /* share of the angle over which it fades, 0 to 1; spot */
    double exponent;       /* of (cos t)^exponent; spot */
    /* Unit, perpendicular to `direction` and each other, across x up = direction; rect, disc. */
    shd_vec3 across, up;
    double size[2]; /* along `across` and `up`; rect */
    double radius;  /* disc, sphere */
    bool visible;   /* whether the camera sees the shape, or the surroundings */
    /* Environment: its radiance, and the angle by which it is turned about +y, in radians. */
    const struct shd_surroundings *map;
    const struct shd_surroundings
        *seen; /* the same, by texels that suit pixels, if it is visible */
    double turn;
    double of_map[3][3]; /* times a color of the map is one of the working space */
    /* What `color` and `ambient` are the RGB of, intensity applied; NULL: they are RGB. */
    const shd_curve *color_curve, *ambient_curve;
} shd_light;

enum { SHD_ENVIRONMENTS_MOST = 4 }; /* in a scene */

/* The area of a light's shape, or of its outline if it is a sphere. */
static inline double shd_light_area(const shd_light *light) {
    return light->type == SHD_LIGHT_RECT ? light->size[0] * light->size[1]
                                         : SHD_PI * light->radius * light->radius;
}

/* No point of a light's shape is farther from its position. */
static inline double shd_light_reach(const shd_light *light) {
    return light->type == SHD_LIGHT_RECT ? hypot(light->size[0], light->size[1]) / 2
                                         : light->radius;
}

/* How light is reflected. All but Phong are lit in the exact tier's arithmetic. */
typedef enum shd_model {
    SHD_MODEL_PHONG,
    SHD_MODEL_BLINN_PHONG,
    SHD_MODEL_PHONG_NORMALIZED,
    SHD_MODEL_OREN_NAYAR,
    SHD_MODEL_COOK_TORRANCE,
    SHD_MODEL_WESTIN,
    SHD_MODEL_COUNT
} shd_model;

/* What tells how much of light is mirrored by a smooth facet: the index of refraction n and the
 * absorption k of each channel, relative to air. A reflectance of 1 at any angle has n infinite.
 * Spectral scenes have the curves instead, where there are any. */
typedef struct shd_fresnel {
    double n[3], k[3];
    const shd_curve *n_curve, *k_curve;
    const shd_curve *f0_curve; /* the reflectance at a right angle, instead of both */
    /* The same as a pattern or a picture, whose values are held within 0 to 1; n is then of the
     * most that it is in each channel, and k 0. NULL: it is one color. */
    const shd_texture *f0_texture;
} shd_fresnel;

typedef enum shd_microgeometry_type {
    SHD_GROOVES,
    SHD_WEAVE,
    SHD_HEIGHTFIELD
} shd_microgeometry_type;

/* The small surface that a Westin material's reflectance is simulated of: see docs/model.md. What
 * its type does not have is 0. */
typedef struct shd_microgeometry {
    shd_microgeometry_type type;
    double angle;      /* of the grooves' sides with the surface, radians, 0 to 70 degrees */
    double warp, weft; /* radii of threads that are 1 apart, 0.2 to 0.5 */
    double slope;      /* of the height field, RMS, 0 to 2 */
} shd_microgeometry;

/* NULL is like NULL alone. */
bool shd_same_microgeometry(const shd_microgeometry *a, const shd_microgeometry *b);

typedef struct shd_lobe {
    double specular[3]; /* Cook-Torrance: the weight, three times */
    double shininess;   /* >= 0; Cook-Torrance: the RMS slope of its facets */
} shd_lobe;

enum { SHD_LOBES_MOST = 64 }; /* beside the first */

typedef struct shd_material {
    /* Key of `materials` or preset; "" for a material that is written at its object. */
    const char *name;
    double emissive[3], ambient[3], diffuse[3];
    /* The first is `specular`/`shininess`, then come `lobes`; black ones are included. */
    const shd_lobe *lobes;
    size_t lobe_count; /* >= 1 */
    bool front_only;   /* side "front": the normal is not turned to face the viewer */
    bool antialiased;  /* highlights are widened by what surfaces bend within a pixel */
    shd_model model;
    double sigma;                           /* of the facets' angles, in radians; Oren-Nayar */
    shd_fresnel fresnel;                    /* Cook-Torrance */
    const shd_microgeometry *microgeometry; /* Westin; else NULL */
    /* What counts only if the scene is traced. */
    double opacity[3];                                                      /* 1 */
    double reflection[3], transmission[3];                                  /* 0 */
    const shd_curve *opacity_curve, *reflection_curve, *transmission_curve; /* or NULL */
    double ior; /* of what is behind the surface; 1.5 */
    /* What these colors are the RGB of; NULL: they are RGB. */
    const shd_curve *emissive_curve, *ambient_curve, *diffuse_curve;
    const shd_curve *const *lobe_curves; /* [lobe_count]: the same of lobes; NULL: all are RGB */
    /* Coefficients that are patterns. The colors above are then, channel by channel, those of both
     * that are farther from 0. NULL: they are colors. */
    const shd_texture *emissive_texture, *ambient_texture, *diffuse_texture;
    const shd_texture *const *lobe_textures; /* [lobe_count]; NULL: no lobe has one */
    /* [lobe_count]: what is numbers in place of a lobe's exponent, each 1 or more, or roughness,
     * which is then that of the sharpest lobe anywhere. NULL: no lobe has that. */
    const shd_texture *const *lobe_gloss;
    /* The opacity, if it is one and the scene is traced; `opacity` is then the least of it. */
    const shd_texture *opacity_texture;
    /* The same of these, if rays are followed; they are then the most of it, channel by channel. */
    const shd_texture *reflection_texture, *transmission_texture;
    /* A map of normals, in the frame that shade/bump.h tells: a picture whose texels are unit
     * vectors (shd_picture_wish.normals), with its scale in `high`; or a pattern of `low` and
     * `high`, vectors of any length but 0, whose mix is not made unit yet. NULL: normals are the
     * surface's own. */
    const shd_texture *normal_texture;
} shd_material;

/* Whether any of a material's coefficients or exponents is a pattern, or its normal a map. */
static inline bool shd_is_textured(const shd_material *m) {
    return m->emissive_texture || m->ambient_texture || m->diffuse_texture || m->lobe_textures ||
           m->lobe_gloss || m->fresnel.f0_texture || m->opacity_texture || m->reflection_texture ||
           m->transmission_texture || m->normal_texture;
}

/* Whether they have the same patterns in the same colors, and the same map of normals. */
bool shd_same_textures(const shd_material *a, const shd_material *b);

/* What it mirrors and transmits at most in a channel, together: patterns of both may take turns. */
double shd_bounced_most(const shd_material *m, size_t channel);

typedef enum shd_shape {
    SHD_SPHERE,   /* radius */
    SHD_PLANE,    /* infinite, y = 0, normal +y */
    SHD_DISC,     /* radius; in y = 0, normal +y */
    SHD_BOX,      /* size, centred */
    SHD_CYLINDER, /* radius, height, axis y, centred, capped */
    SHD_CONE,     /* radius at y = -height/2, apex at y = +height/2, capped */
    SHD_TORUS,    /* radius of the ring, radius of the tube, axis y */
    SHD_MESH,
    SHD_SHAPE_COUNT
} shd_shape;

/* Meshes that are built in. Their types follow those of shapes in shd_shape_names. */
typedef enum shd_builtin { SHD_TEAPOT, SHD_BALL, SHD_BUILTIN_COUNT } shd_builtin;

typedef enum shd_interpolation { SHD_PHONG, SHD_GOURAUD, SHD_FLAT } shd_interpolation;

/* The parts of a mesh that are kept for many scenes, so that no scene makes them again. */
typedef struct shd_mesh_kept {
    shd_digest digest;                /* of the bytes that the mesh was read from: its name */
    const struct shd_mesh_tree *tree; /* over the triangles: see sight/tree.h */
    const double *units;              /* [vertex_count][3]: the normals, each made unit, if any */
    struct shd_mesh_memo *memo; /* What plans found of it last (plan/cells.h); NULL: nothing. */
} shd_mesh_kept;

typedef struct shd_mesh {
    size_t vertex_count, triangle_count;
    const double *positions; /* [vertex_count][3] */
    /* [vertex_count][3], none of them zero; NULL: each triangle has its own */
    const double *normals;
    const uint32_t *indices;   /* [triangle_count][3], each < vertex_count */
    const double *uvs;         /* [vertex_count][2]; NULL: it has no chart */
    shd_vec3 low, high;        /* the box around its vertices */
    size_t inverted;           /* triangles whose normals point to their back */
    const shd_mesh_kept *kept; /* NULL: the mesh is of this scene alone */
    const char *type;          /* what a built-in one is called: "teapot"; NULL: it is none */
    /* Whether it is an entry of `meshes`, and the first object that has it, by index. Those that
     * follow share what is made of it. */
    bool shared;
    size_t first;
} shd_mesh;

typedef struct shd_object {
    shd_shape shape;
    double radius, tube, height; /* 1, 0.25 and 2 if the document has none */
    shd_vec3 size;               /* 1, 1, 1 */
    const shd_mesh *mesh;        /* SHD_MESH */
    shd_affine transform;        /* object to world; invertible */
    size_t material;             /* index into shd_scene.materials */
    const char *name; /* for those who ask for it (/v1/fit): no picture depends on it; or NULL */
    shd_interpolation interpolation;
    int segments; /* slices of a tessellated analytic shape, 3 to 1024 */
    /* The light whose visible shape this is; NULL: an object of the document. It follows these. Its
     * material emits what the camera sees of it; its other side is black. */
    const shd_light *emitter;
} shd_object;

/* Whether its normals turn along the surface, and it is lit at every sample. */
static inline bool shd_is_curved(const shd_object *object) {
    if (object->interpolation != SHD_PHONG) return false;
    if (object->shape == SHD_MESH) return object->mesh && object->mesh->normals;
    return object->shape != SHD_PLANE && object->shape != SHD_DISC && object->shape != SHD_BOX;
}

typedef enum shd_tier { SHD_STANDARD, SHD_EXACT } shd_tier;
typedef enum shd_metric { SHD_LINEAR, SHD_CODE, SHD_DELTA_E_2000 } shd_metric;

typedef struct shd_accuracy {
    shd_tier tier;
    /* Whether the document asks for `draft`: `standard`, but with fewer samples where that is
     * bounded (shd_plan.mean_room). */
    bool draft;
    bool budget; /* whether a budget and its metric are given instead of a tier */
    /* What the document asks for, and what of it planning has: all of it, but where a lossy
     * format takes a part (shd_output.measured). */
    double whole, max_error;
    shd_metric metric;
    bool exactly; /* no tier but the exact one is to meet the budget */
} shd_accuracy;

/* Whether planning has only a part of the budget. */
static inline bool shd_is_shared(const shd_accuracy *accuracy) {
    return accuracy->budget && accuracy->max_error < accuracy->whole;
}

typedef enum shd_layer_kind {
    SHD_LAYER_BEAUTY,
    SHD_LAYER_EMISSIVE,
    SHD_LAYER_AMBIENT,
    SHD_LAYER_DIFFUSE,
    SHD_LAYER_SPECULAR,
    SHD_LAYER_LOBE,
    SHD_LAYER_LIGHT,
    SHD_LAYER_SHADOW, /* the share of light that arrives */
    SHD_LAYER_BOUNCE, /* what rays beyond the eye's add */
    SHD_LAYER_NORMAL, /* from here on, layers of data */
    SHD_LAYER_POSITION,
    SHD_LAYER_DEPTH,
    SHD_LAYER_OBJECT,
    SHD_LAYER_BOUND, /* of the pixel's linear error */
    SHD_LAYER_KINDS
} shd_layer_kind;

typedef struct shd_layer {
    shd_layer_kind kind;
    size_t light;     /* SHD_LAYER_LIGHT; of SHD_LAYER_LOBE the lobe, in shd_material.lobes */
    const char *name; /* as the client wrote it: "light.0" */
} shd_layer;

typedef struct shd_output {
    const char *name; /* of an entry of `outputs`; NULL for the one `output` */
    shd_format format;
    bool format_given;                 /* false: `format` is the reader's fallback */
    const char *display, *view;        /* both or neither */
    const shd_space_info *color_space; /* NULL if display and view are set */
    int channel;                       /* -1: all; 0 to 2: that one as grey; 3: alpha */
    shd_depth depth;
    int quality;   /* 1 to 100; 0: the least that meets the budget */
    int effort;    /* of WebP, 0 to 6 */
    bool measured; /* the format is lossy, and there is a budget that counts what it loses */
    shd_adjust adjust;
    bool dither;             /* of 8 bits */
    double matte[3];         /* under transparent pixels where the format has no alpha */
    const char *compression; /* EXR: as OpenEXR names it; PNG: fast, small; NULL: the default */
    shd_scope scope;         /* what is shown of the picture instead of it */
    const shd_layer *layers; /* EXR only, and only if the color space is scene-linear */
    size_t layer_count;
} shd_output;

/* Rays beyond the eye's. All off: no light is stopped, and nothing is mirrored. */
typedef struct shd_trace {
    bool shadows;
    int shadow_samples;      /* of a light with a shape */
    int depth;               /* mirrors, transmissions and non-opaque hits on a path, 0 to 16 */
    double min_contribution; /* of a path to a pixel, in its largest channel */
} shd_trace;

/* Light in so many channels, equal bins of wavelengths, instead of RGB. */
typedef struct shd_spectral {
    int channels;    /* 0: RGB */
    double from, to; /* nm */
} shd_spectral;

typedef struct shd_scene {
    shd_camera camera;
    shd_raster raster;
    double ambient[3];
    double background[3];    /* 0 if nothing of it is seen */
    bool transparent;        /* the background has an alpha below 1, as null has */
    double background_alpha; /* that alpha where it is not 0; of an opaque background 0 */
    /* The environment that is seen behind all objects, instead of a background, which is then black
     * and opaque; NULL: there is none. */
    const shd_light *backdrop;
    const shd_space_info *working_space;
    const shd_light *lights;
    size_t light_count;
    const shd_material *materials; /* those that objects use */
    size_t material_count;
    const shd_object *objects;
    size_t object_count;
    /* Triangles of all objects that are meshes, each as often as it is there. */
    uint64_t mesh_triangles;
    shd_accuracy accuracy;
    shd_trace trace;
    shd_spectral spectral;
    shd_affine to_working;          /* linear: of linear Rec.709, if `spectral` has channels */
    const shd_curve *ambient_curve; /* what `ambient` is the RGB of; NULL: it is RGB */
    const shd_output *outputs;      /* at least one */
    size_t output_count;
    bool multipart; /* `outputs` was given: the answer is multipart, even for one */
    /* 128 bits of SHA-256 of all that a picture depends on, hexadecimal. Documents that say the
     * same in other words, or by defaults, have the same. */
    char digest[33];
} shd_scene;

static inline bool shd_is_traced(const shd_scene *scene) {
    return scene->trace.shadows || scene->trace.depth > 0;
}

/* Whether a background is seen where no object is. */
static inline bool shd_has_background(const shd_scene *scene) {
    return !scene->transparent || scene->background_alpha > 0;
}

/* What a scene may name and does not have itself. All that it gives stays as long as the scene that
 * is read.
 *
 * `find` finds a mesh that is kept by its digest; NULL if there is none. (find NULL: none are
 * kept.) `keep` keeps one that is built in (NULL: it does not do that), and returns what is kept of
 * it, or NULL. `texels` and `pyramid` find a picture, and the pyramid of one, with the errors of
 * render/pictures.h; error->path means nothing. (NULL: there are none.) */
typedef struct shd_shelf {
    const shd_mesh *(*find)(void *context, const shd_digest *digest);
    void *context;
    const shd_mesh *(*keep)(void *context, const shd_mesh *mesh, const shd_digest *digest);
    shd_status (*texels)(void *context, const shd_picture_wish *wish, const shd_texels **out,
                         shd_error *error);
    shd_status (*pyramid)(void *context, const shd_texels *texels, const shd_pyramid **out,
                          shd_error *error);
    /* Finds the map of a picture, with colors of the space `working`, of about `rows` rows
     * (shd_surroundings_rows), with the errors of render/maps.h; error->path means nothing. */
    shd_status (*surround)(void *context, const char *name, const shd_space_info *working, int rows,
                           const struct shd_surroundings **out, shd_error *error);
} shd_shelf;

/* Reads `length` bytes of JSON. `report` gets everything that is wrong, with JSON Pointers, and
 * warnings; items of a list past its limit are not read. The scene is made only if there is no
 * error. `fallback` is the format of an output that names none. `shelf` has the meshes and
 * pictures that it may name; NULL: there are none. Jansson's own memory is freed before the
 * function returns; the scene lives in `arena`. `cancelled` (or NULL) ends the reading with
 * SHD_CANCELLED. Returns report->status. */
shd_status shd_scene_read(const char *text, size_t length, const shd_catalog *catalog,
                          const shd_limits *limits, const atomic_bool *cancelled,
                          shd_format fallback, const shd_shelf *shelf, shd_arena *arena,
                          const shd_scene **out, shd_report *report);

/* Reads a mesh alone: {"positions": [...], "indices": [...], "normals": [...]} as an object has
 * them. If it is binary, the same as numbers of 4 bytes, the lowest byte first: the number of
 * vertices, the number of indices (0: every three vertices are a triangle), flags (1: it has
 * normals; 2: it has uvs), then 3 floats a vertex for positions, as many for normals, 2 for uvs,
 * then the indices. Errors point into the arrays in either form. `cancelled`
 * as above. */
shd_status shd_mesh_read(const void *data, size_t length, bool binary, const shd_limits *limits,
                         const atomic_bool *cancelled, shd_arena *arena, const shd_mesh **out,
                         shd_report *report);

/* A material of the library as clients are told of it. Colors are linear Rec.709. */
typedef struct shd_preset {
    const char *name, *group;
    const char *source; /* where its numbers come from */
    const char *note;   /* one line for people, may be "" */
    shd_model model;
    double ambient[3], diffuse[3];
    double specular[3]; /* of the first lobe; Cook-Torrance: what is reflected at a right angle */
    double shininess;   /* 0 where the model has none */
} shd_preset;

#define SHD_METAL_ROUGHNESS 0.2

/* The measured metals, by name. NULL: there is none. */
const shd_fresnel *shd_metal_find(const char *name);

/* The index of what reflects so much at a right angle: ((n - 1) / (n + 1))^2. What a conversion of
 * colors has rounded counts as 0 or 1. */
double shd_index_of(double f0);
extern const char *const shd_metal_names[]; /* ended by NULL */

/* The reflectance of a smooth facet for unpolarized light that meets it at the angle of `cosine`,
 * by Fresnel's equations. */
double shd_fresnel_reflectance(const shd_fresnel *fresnel, int channel, double cosine);

/* The material library: config/materials.json, which is built in, and files of operators. Constant
 * once all files are added; shared by threads. `catalog` is the one that documents are read with;
 * its `library` is not asked. Errors are SHD_CONFIG, with `path` and a JSON Pointer in the
 * text, and SHD_EXHAUSTED; after one, nothing but shd_library_drop may follow. */
typedef struct shd_library shd_library;
shd_status shd_library_new(const shd_catalog *catalog, shd_library **out, shd_error *error);
shd_status shd_library_add(shd_library *library, const char *path, const char *text, size_t length,
                           const shd_catalog *catalog, shd_error *error);
void shd_library_drop(shd_library *library); /* NULL is fine */

/* Its materials, sorted by name. NULL has none. */
size_t shd_preset_count(const shd_library *library);
const shd_preset *shd_preset_at(const shd_library *library, size_t index);
size_t shd_preset_find(const shd_library *library, const char *name); /* SIZE_MAX: none */

/* Names as documents have them, by enum; NULL follows the last one. */
extern const char *const shd_tier_names[],
    *const shd_metric_names[], *const shd_light_names[], *const shd_model_names[],
                                                             *const shd_shape_names[],
                                                                 *const shd_interpolation_names[];

/* The name of the tier that the document asks for. */
const char *shd_asked_tier(const shd_accuracy *accuracy);

/* Half of the picture's height on the image plane: at a distance of 1, or of the view volume. */
static inline double shd_half_height(const shd_camera *camera) {
    return camera->projection == SHD_PERSPECTIVE ? tan(camera->fov / 2) : camera->height / 2;
}

/* The map of an object's unit form (see sight/item.h) to the world. */
shd_affine shd_object_to_world(const shd_object *object);

/* That map, and the inverse of its linear
 * part. False if there is no inverse, which no object of a scene has. */
bool shd_object_frame(const shd_object *object, shd_affine *to_world, shd_affine *from_world);

/* The sphere around an object in the world frame. False for infinite objects. */
bool shd_object_bounds(const shd_object *object, shd_vec3 *center, double *radius);

/* The box around an object in its own frame, with its dimensions applied. False for infinite
 * ones. */
bool shd_object_box(const shd_object *object, shd_vec3 *low, shd_vec3 *high);

/* How many triangles a shape becomes for flat and gouraud interpolation. A sphere has `segments`
 * slices and max(2, segments / 2) stacks; the two stacks at the poles are single triangles. A torus
 * has `segments` by `segments` quads. 0 for planes and meshes. */
size_t shd_tessellation_triangles(shd_shape shape, int segments);
