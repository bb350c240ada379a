/* Parts of documents. Inside of tests/attack/. */
#ifndef SHD_ATTACK_WRITE_H
#define SHD_ATTACK_WRITE_H

#include <stdbool.h>

#include "attack/scenes.h"

typedef struct xyz {
    double x, y, z;
} xyz;

/* What the documents of a thread have beside Phong's model and lights that are points, by
 * `family.beyond`, until it is set anew. In spectral ones either all that reflects is grey, or all
 * that shines, so that light is the product of both whatever its spectrum. */
void set_beyond(unsigned beyond, uint64_t *random);

bool goes_beyond(unsigned bits); /* by any of them */

/* The members of the whole document that this takes, with a comma before each. */
void put_beyond(FILE *out, uint64_t *random);

xyz any_direction(uint64_t *random); /* unit */
xyz scaled_by(xyz v, double by);
xyz sum_of(xyz a, xyz b);
xyz cross_of(xyz a, xyz b);

/* `"name": [x, y, z]`, with all digits. */
void put_vector(FILE *out, const char *name, xyz v);
void put_color(FILE *out, const char *name, uint64_t *random, double most);

/* All up to `"lights": [`; sides of about `pixels`, and up to `most` samples. */
typedef struct frame {
    int pixels, most_samples;
    const char *camera; /* members of the camera; NULL: a plain one from z = 4 */
    const char *output; /* an object; NULL: {} */
} frame;

void put_frame(FILE *out, uint64_t *random, const char *accuracy, frame f);

/* `"material": {...}`: with a highlight of shininess up to `most`, from `least` on. */
void put_material(FILE *out, uint64_t *random, double least, double most);

/* Lights of any type around the origin, at distances from 2 to 7 times `size` around `at`; with
 * commas between them. */
void put_lights(FILE *out, uint64_t *random, int count, xyz at, double size);

/* `"type": ..., ` and dimensions near `size` of an analytic shape, all of them but planes. */
void put_shape(FILE *out, uint64_t *random, double size);

/* `"transform": {...}`: turned anyhow, moved by up to `away`, scaled by `scale`. */
void put_turn(FILE *out, uint64_t *random, xyz scale, xyz at);

/* `"type": "mesh", ...`: a ball of radius `size`, with normals of its vertices where `smooth`. */
void put_ball(FILE *out, int slices, int stacks, double size, bool smooth);

/* What comes between lights and objects, and the document's end. */
void put_objects(FILE *out);
void put_end(FILE *out, uint64_t *random);

/* Objects near the origin, of a size of about 1, with highlights from `least` to `most`. */
void put_some(FILE *out, uint64_t *random, int count, double least, double most);

#endif
