/* The inside of the reader: the state of one reading, the readers of single members, and the
 * readers of the document's parts, which live in read_*.c.
 *
 * A part is a table of fields: a name, the reader of its value, and where the value goes. Reading
 * goes through the table in its order, so that what others need comes first. It reports members
 * that are not in the table, and never stops at an error: a value that is wrong keeps its default.
 *
 * A check is left out only if what it needs is wrong itself, because its answer then depends on how
 * that is mended. Items of a list past the most that it may have are not read: limits bound the
 * work. */
#pragma once

#include "scene/json.h"
#include "scene/scene.h"

#define SHD_LENGTH(array) (sizeof(array) / sizeof(array)[0])

typedef struct shd_named_material {
    const char *name; /* the arena's */
    shd_material material;
    size_t used; /* its index in the scene, SIZE_MAX before it is used */
} shd_named_material;

/* An entry of `meshes`. */
typedef struct shd_shared_mesh {
    const char *name;     /* the arena's */
    const shd_mesh *mesh; /* NULL: it is wrong, or not kept */
    shd_mesh *own;        /* the same, if the document has its arrays */
    bool used;            /* by an object */
} shd_shared_mesh;

/* `materials` or `meshes`: structs of `size` bytes that begin with their name, and sorted by it
 * once all are read. */
typedef struct shd_entries {
    void *list; /* the arena's */
    size_t size, count;
    bool unknown; /* the member is not an object */
} shd_entries;

/* A mesh or a picture that is not kept. */
typedef struct shd_missing {
    const char *pointer;            /* to the first place that names it; the arena's */
    const char *what;               /* "mesh" or "asset" */
    char name[SHD_DIGEST_TEXT + 8]; /* "sha256-" and its digits */
} shd_missing;

typedef struct shd_reader {
    const shd_catalog *catalog;
    const shd_limits *limits;
    const atomic_bool *cancelled; /* if raised, reading ends, and what was read is not used */
    shd_format fallback;
    const shd_shelf *shelf; /* NULL: there is nothing that documents may name */
    shd_arena *arena;
    const shd_json *json;
    shd_report *report;
    shd_scene *scene;   /* under construction */
    bool out_of_memory; /* reported once */

    const shd_space_info *colors; /* the space of plain numbers; NULL: `colorSpace` is wrong */
    bool codes;                   /* plain numbers are sRGB's codes of that space's numbers */
    bool in_library;              /* what is read is a material of the library */
    int interpolation;            /* of objects that have none */
    size_t lights;                /* how many the document asks for; SIZE_MAX: unknown */
    uint64_t triangles;           /* of the objects so far */
    shd_missing missing[SHD_REPORT_KEEP]; /* the first ones, each once */
    size_t missing_count;                 /* of all of them */
    size_t maps;                          /* of pictures; the first are looked for */
    /* Bits of the shd_format of all outputs, and of those that have color and no alpha. */
    unsigned formats, flat;
    const struct shd_field *field; /* the one that is read */
    unsigned seen, wrong; /* marks of the fields that shd_read_fields found there, or wrong */

    shd_entries named;    /* shd_named_material */
    shd_entries shared;   /* shd_shared_mesh */
    size_t *presets_used; /* as shd_named_material.used, for each preset of the library */
    size_t default_used;  /* the same for objects without a material */
    shd_material *materials;
    size_t material_count;
    shd_material warned[SHD_REPORT_KEEP]; /* the first materials that warnings are about */
    size_t warned_count;
    shd_eye eye;       /* white 0: there was no spectrum yet */
    bool spectra_told; /* whether there is the warning about spectra without `spectral` */
} shd_reader;

typedef struct shd_range {
    double low, high;
    bool above, below; /* low and high themselves are outside */
    const char *text;  /* "greater than 0" */
} shd_range;

extern const shd_range shd_positive, shd_not_negative;

bool shd_in_range(double value, const shd_range *range);

/* Reads node->value (never NULL unless the field is `always`) into `out`. The field is r->field as
 * long as the reader reads no fields itself. */
typedef void shd_field_read(shd_reader *r, const shd_node *node, void *out);

typedef struct shd_field {
    const char *name;
    shd_field_read *read;       /* NULL: other code reads it, here it is only known */
    size_t offset;              /* of the value in the struct that is filled */
    unsigned kinds;             /* bits of the kinds of thing that have this member; 0: all */
    const shd_range *range;     /* NULL: any */
    const char *const *choices; /* ended by NULL */
    unsigned mark;              /* a bit of r->seen and r->wrong, or 0 */
    bool required;
    bool always; /* whether it is read even if it is absent, to report that or to make a default */
    /* Of a color that may be a spectrum: where its const shd_curve * is; 0: it may not. */
    size_t curve;
    bool lamp; /* whether that spectrum is of light */
    /* Of a coefficient: where its const shd_texture * is. */
    size_t texture;
} shd_field;

enum { SHD_FIELDS_MOST = 32, SHD_SOME_FIELD = 1 << 30 };

/* Reads the members of an object. An absent one has none, and anything else is an error, and false.
 * `kinds` are the bits of what this thing may be and `what` is its name in messages ("a sphere").
 * Then r->seen has the marks of fields that are there. r->wrong has those of fields whose reading
 * gave an error, so that nothing that needs them is checked, and SHD_SOME_FIELD if any did. */
bool shd_read_fields(shd_reader *r, const shd_node *node, const shd_field *fields, size_t count,
                     unsigned kinds, const char *what, void *out);

/* An error and a warning about the place. */
#define shd_wrong(r, node, ...) shd_node_report((r)->report, node, SHD_SCENE, __VA_ARGS__)
#define shd_warn(r, node, ...)  shd_node_report((r)->report, node, SHD_OK, __VA_ARGS__)

/* The smaller one of `count` and the limit `which`, after which the counted things are called. An
 * error if it is the limit: "the scene asks for 5 lights; the limit `lights` is 4" has the
 * `subject` "the scene asks for". */
uint64_t shd_hold_to_limit(shd_reader *r, const shd_node *node, const char *subject, uint64_t count,
                           shd_limit which, uint64_t limit);

/* The index of a string among `names`. -1, and an error, if it is none of them. */
int shd_read_name(shd_reader *r, const shd_node *node, const char *const *names);

/* A string's text. NULL, and an error, if the value is no string. */
const char *shd_get_text(shd_reader *r, const shd_node *node, const char *expected);

/* Whether a value is what it must be; false comes with an error. An array with a wrong number of
 * items gives an error, but is an array. */
bool shd_is_object(shd_reader *r, const shd_node *node);
bool shd_is_array(shd_reader *r, const shd_node *node, size_t least, size_t most,
                  const char *expected);

/* The numbers of an array, at most `most`, in the field's range. False, and errors, if their count
 * or one of them is wrong. The right ones are in `out` even then. */
bool shd_get_numbers(shd_reader *r, const shd_node *node, size_t least, size_t most,
                     const char *expected, double *out);
bool shd_get_three(shd_reader *r, const shd_node *node, double out[3]);

/* Field readers. */
shd_field_read shd_read_number;    /* double, in the field's range */
shd_field_read shd_read_integer;   /* int, in the field's range */
shd_field_read shd_read_degrees;   /* double, in radians; the field's range is in degrees */
shd_field_read shd_read_choice;    /* int, index into the field's choices */
shd_field_read shd_read_vector;    /* shd_vec3, each component in the field's range */
shd_field_read shd_read_direction; /* shd_vec3, made unit */
shd_field_read shd_read_color;     /* double[3], in the working space */
/* double[3], a color, or the RGB of a spectrum, which is written to where the field has its curve.
 */
shd_field_read shd_read_color_or_spectrum;
/* The same, or a pattern or a picture, whose larger colors are written, and which goes to where the
 * field has its texture. */
shd_field_read shd_read_coefficient;
shd_field_read shd_read_spectral; /* shd_spectral */
shd_field_read shd_read_space;    /* const shd_space_info *, by its name; NULL: it is wrong */
shd_field_read shd_read_label;    /* nothing: the string is for others */
shd_field_read shd_keep_value;    /* json_t *, as it is */

/* The parts. */
shd_field_read shd_read_working_space; /* as shd_read_space */
shd_field_read shd_read_plain_space;   /* r->colors */
shd_field_read shd_read_camera;        /* shd_camera */
shd_field_read shd_read_image;         /* shd_raster */
shd_field_read shd_read_lights;        /* these fill a shd_scene */
shd_field_read shd_read_objects;

/* Makes `across` and `up` of a light with a shape perpendicular to its direction. Without
 * `given_up`, up is +y, or -z for a light that shines straight up or down. */
void shd_turn_shape(shd_reader *r, const shd_node *node, bool given_up, shd_light *light);

/* How many lights of the scene are visible, and their shapes as objects with a material each, which
 * are added to r->materials. `node` is the scene's list of objects. */
size_t shd_count_emitters(const shd_scene *scene);
void shd_add_emitters(shd_reader *r, const shd_node *node, shd_object *objects);
shd_field_read shd_read_output;
shd_field_read shd_read_outputs;

shd_field_read shd_read_map; /* const shd_surroundings *, an environment's; NULL: it is wrong */

/* Fills what of an environment follows from the scene, and reports what it cannot be in. */
void shd_finish_surroundings(shd_reader *r, const shd_node *node, shd_light *light);

/* Reports what a scene with environments cannot have. `node` is the document. */
void shd_check_surroundings(shd_reader *r, const shd_node *node);

shd_field_read shd_read_trace;   /* shd_trace */
shd_field_read shd_read_switch;  /* bool */
shd_field_read shd_read_opacity; /* double[3], a material's: the least, if it is a texture */
shd_field_read shd_read_opacity_texture; /* the same of one */
/* double: a number, or the least or the most of what is numbers. The field has its texture. */
shd_field_read shd_read_shininess, shd_read_roughness;
/* A pattern or a picture of one number. False: it is wrong, or a picture that is not kept, which is
 * reported. */
bool shd_read_numbers(shd_reader *r, const shd_node *node, shd_texture *out);
shd_field_read shd_read_normal_map; /* const shd_texture * */
shd_field_read shd_read_bounced;    /* double[3]: its reflection or transmission; the most of one */
shd_field_read shd_read_bounced_texture; /* the same of one */
/* A reflectance of a color, a spectrum, or a pattern or picture of 0 to 1, whose most is read. */
shd_field_read shd_read_reflectance;

/* Whether the material has what only rays show. */
bool shd_is_rayed(const shd_material *material);
/* Whether these colors are equal. */
bool shd_same_rays(const shd_material *a, const shd_material *b);
void shd_warn_of_trace(shd_reader *r, const shd_node *node, const shd_material *material);

/* A transparent picture that all outputs lay over the same matte is one with that background. */
void shd_lay_over_matte(shd_scene *scene);

/* Planning has a part of the budget if some output's format is lossy. */
void shd_share_budget(shd_scene *scene);

shd_field_read shd_read_materials; /* r->named */
shd_field_read shd_read_meshes;    /* r->shared */

/* Reads members of an object as entries of `size` bytes: read_one() gets each with its name alone
 * set. `what`: "materials". */
typedef void shd_read_entry(shd_reader *r, const shd_node *node, void *entry);
void shd_read_entries(shd_reader *r, const shd_node *node, const char *what, size_t size,
                      shd_read_entry *read_one, shd_entries *out);

/* NULL: there is none of that name. */
void *shd_find_entry(const shd_entries *entries, const char *name);

/* The first names, at most `most`, for shd_suggest(); how many. */
size_t shd_name_entries(const shd_entries *entries, const char **names, size_t most);

/* The mesh of `meshes` that an object names. NULL: there is none, which is an error, or that one is
 * wrong itself. */
const shd_mesh *shd_use_mesh(shd_reader *r, const shd_node *node, size_t object);

/* The material of an entry of the library. After an error it means nothing. */
void shd_read_library_material(shd_reader *r, const shd_node *node, shd_material *out);
/* Fills all but the texts. */
void shd_tell_preset(const shd_material *material, shd_preset *out);

shd_field_read shd_read_microgeometry; /* const shd_microgeometry *; NULL: it is wrong */

/* An error if facets of that color would send on more light than arrives. NAN is none. */
void shd_check_facets(shd_reader *r, const shd_node *node, const double diffuse[3]);

/* Converts a color of the space `from` into the working space, in place. It becomes NAN if it
 * cannot be converted, which is an error, or if one of the spaces is not known (`from` is NULL). */
void shd_convert_color(shd_reader *r, const shd_node *node, const shd_space_info *from,
                       double rgb[3]);

/* Reads a color where an opacity may stand: [r, g, b, a], "#rrggbbaa" or any other color of CSS.
 * Writes the working space's straight components, and the alpha in [0,1] if the document has one:
 * *alpha is its caller's default otherwise, which is 1. After an error neither means anything, but
 * both are as they were or finite. (shd_read_color takes no alpha but 1.) */
void shd_read_color_alpha(shd_reader *r, const shd_node *node, double rgb[3], double *alpha);
/* Reads an array of layers into the output, once the rest of the document is read. */
void shd_read_layers(shd_reader *r, const shd_node *at, shd_output *out);

/* Reports what an output with a scope cannot have. `node` is the output, and `holds` what it would
 * display. */
void shd_check_scope(shd_reader *r, const shd_node *node, const shd_output *out, shd_holds holds);

/* The samples of what is no color, within r->field's range, and their means over what red, green
 * and blue stand for (shd_curve_means). NULL: wrong. */
const shd_curve *shd_read_measured(shd_reader *r, const shd_node *node, double means[3]);

/* The curve times a factor. NULL: there is no curve, or no memory. */
const shd_curve *shd_scale_curve(shd_reader *r, const shd_curve *curve, double factor);

/* A grey in the space of plain numbers, as if the document had it; NAN as above. */
void shd_default_color(shd_reader *r, double grey, double out[3]);

/* The index in the scene of the material that an object names or has itself. If node->value is
 * NULL, that of the default material. */
size_t shd_use_material(shd_reader *r, const shd_node *node);

/* `transform` of an object. linear[0][0] is NAN if the linear part is not known. */
shd_field_read shd_read_transform; /* shd_affine */

/* The arrays of a mesh as the document has them, or the name of what is kept. NULL: absent;
 * `normals` that are null count as absent. */
typedef struct shd_mesh_source {
    json_t *positions, *indices, *normals, *uvs;
    json_t *data;
} shd_mesh_source;

/* Checks a mesh of arrays and builds it in the arena; `node` has them. NULL if it is wrong, which
 * is an error unless the positions are absent. Adds to r->triangles, and builds nothing past the
 * limit. */
shd_mesh *shd_make_mesh(shd_reader *r, const shd_node *node, const shd_mesh_source *source);

/* The mesh of an object or of an entry of `meshes`: its arrays, of which *own is the mesh that is
 * made, or what is kept by the name in `data` (*own is NULL). NULL after an error, or if it is not
 * kept. */
const shd_mesh *shd_read_mesh(shd_reader *r, const shd_node *node, const shd_mesh_source *source,
                              shd_mesh **own);

/* Reports an object that its material's patterns cannot be on. `node` is the object. */
void shd_check_textured(shd_reader *r, const shd_node *node, const shd_object *object);

/* Notes what a place names and is not kept. `what` stays as long as the reader. */
void shd_note_missing(shd_reader *r, const shd_node *node, const char *what, const char *name);
/* Reports all of it, after all else that is wrong. */
void shd_report_missing(shd_reader *r);

/* Writes 128 bits of SHA-256 of what a picture of the scene depends on, as 32 hexadecimal digits.
 * After a cancellation they mean nothing. */
void shd_scene_digest(const shd_scene *scene, const atomic_bool *cancelled, char digest[33]);

/* Arena memory. NULL, and one SHD_MEMORY error, if the arena is full. */
void *shd_take(shd_reader *r, size_t count, size_t size);
const char *shd_take_text(shd_reader *r, const char *text);
