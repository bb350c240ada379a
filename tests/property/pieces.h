/* Parts of scenes that several property tests write. */
#ifndef SHD_TEST_PIECES_H
#define SHD_TEST_PIECES_H

#include "property/film_of.h"

/* A unit sphere as the members of a mesh: `slices` around y, `stacks` from pole to pole, corners
 * in order seen from outside. With normals they are the sphere's own, else each triangle has its
 * own. */
static inline void write_ball(FILE *out, int slices, int stacks, bool normals) {
    for (int pass = 0; pass < (normals ? 2 : 1); pass++) {
        fprintf(out, "\"%s\": [", pass ? "normals" : "positions");
        for (int k = 0; k <= stacks; k++)
            for (int i = 0; i < slices; i++) {
                double theta = SHD_PI * k / stacks, phi = 2 * SHD_PI * i / slices;
                double ring = k == 0 || k == stacks ? 0 : sin(theta);
                fprintf(out, "%s%.17g, %.17g, %.17g", k + i ? ", " : "", ring * cos(phi),
                        cos(theta), ring * sin(phi));
            }
        fputs("], ", out);
    }
    fputs("\"indices\": [", out);
    const char *comma = "";
    for (int k = 0; k < stacks; k++)
        for (int i = 0; i < slices; i++) {
            int next = (i + 1) % slices;
            int a = k * slices + i, b = k * slices + next, c = a + slices, d = b + slices;
            if (k > 0) fprintf(out, "%s%d, %d, %d", comma, a, b, d), comma = ", ";
            if (k + 1 < stacks) fprintf(out, "%s%d, %d, %d", comma, a, d, c), comma = ", ";
        }
    fputs("]", out);
}

static inline void write_vector(FILE *out, const char *name, shd_vec3 v) {
    fprintf(out, "\"%s\": [%.17g, %.17g, %.17g]", name, v.x, v.y, v.z);
}

/* "transform": {"matrix": ...}, column-major. */
static inline void write_transform(FILE *out, const shd_affine *m) {
    fputs("\"transform\": {\"matrix\": [", out);
    for (int c = 0; c < 3; c++)
        fprintf(out, "%.17g, %.17g, %.17g, 0, ", m->linear[0][c], m->linear[1][c], m->linear[2][c]);
    fprintf(out, "%.17g, %.17g, %.17g, 1]}", m->origin.x, m->origin.y, m->origin.z);
}

/* A rotation that takes y to a random direction, by Rodrigues' formula about a random axis. */
static inline shd_affine random_rotation(uint64_t *random) {
    shd_vec3 k = random_direction(random);
    double angle = uniform(random, -SHD_PI, SHD_PI), s = sin(angle), c = 1 - cos(angle);
    return (shd_affine){
        {{1 - c * (k.y * k.y + k.z * k.z), c * k.x * k.y - s * k.z, c * k.x * k.z + s * k.y},
         {c * k.x * k.y + s * k.z, 1 - c * (k.x * k.x + k.z * k.z), c * k.y * k.z - s * k.x},
         {c * k.x * k.z - s * k.y, c * k.y * k.z + s * k.x, 1 - c * (k.x * k.x + k.y * k.y)}},
        {0, 0, 0}};
}

static inline shd_affine scaling(double x, double y, double z) {
    return (shd_affine){{{x, 0, 0}, {0, y, 0}, {0, 0, z}}, {0, 0, 0}};
}

/* That a film differs from the exact one, by no more than its plan says, which is below `most`. */
static inline void check_bound(const drawn *film, const drawn *exact, double most) {
    const double bound = film->request->rendering.plan->bound.linear;
    double difference = 0;
    assert_true(isfinite(bound) && bound < most);
    for (size_t i = 0; i < 4 * pixels_of(film); i++)
        difference =
            fmax(difference, fabs((double)film->film.rgba[i] - (double)exact->film.rgba[i]));
    assert_true(difference > 0);
    assert_below(difference, bound);
}

/* That a scene of 64 x 48 pixels is the same by another engine, and a part of it where it is cut
 * out. */
static inline void check_region(shd_engine *engine, shd_engine *other, const char *whole) {
    drawn a = film_of(engine, whole), b = film_of(other, whole);
    assert_true(same_film(&a, &b));
    const char *size = strstr(whole, "\"samples\"");
    char *cut = text_of("%.*s\"region\": [13, 7, 20, 30], %s", (int)(size - whole), whole, size);
    drawn c = film_of(engine, cut);
    for (int y = 0; y < 30; y++)
        assert_memory_equal(c.film.rgba + 4 * 20 * y, a.film.rgba + 4 * (64 * (y + 7) + 13),
                            20 * 4 * sizeof(float));
    drop_drawn(&a);
    drop_drawn(&b);
    drop_drawn(&c);
    free(cut);
}

#endif
