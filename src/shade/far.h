/* The light of many lights that are far from a few points, as one polynomial.
 *
 * A light at v from a point sends E = Il f(|v|) v / |v| there, and N.E is what diffuse surfaces
 * show of it, as long as N.E is not below 0. E is the gradient of a potential, because it is
 * central: where the point moves by h, so that |v|^2 becomes D^2 + e, that of a series in e. What
 * of it is of the sixth degree in h or lower has 83 derivatives, of the fourth 34, of the third 19,
 * whose sums tell the light of all lights together. The rest of E is bounded, for each light, by
 * shd_far_rest.
 *
 * Lights that lie together (plan/bunches.h) have one series, about where they are: a light that is
 * s beside the middle sends to h what one in the middle sends to h - s. So moments of their places
 * make derivatives for all of them, at distances that |h| + |s| may be instead of |h|.
 *
 * The series of 1 / |v| in h are Gegenbauer polynomials of the angle between v and h, whose
 * largest values are known. So are those of the gradients of Legendre's (Sonin: P^2 + (1 - t^2)
 * P'^2 / (n (n + 1)) is at most 1). All is f64 and pure. Any thread. */
#pragma once

#include "plan/bunches.h"

enum { SHD_FAR_TERMS = 83 };

typedef struct shd_far {
    shd_vec3 center; /* world frame */
    int channels;    /* 1: all lights are grey */
    int degree;      /* 3, 4 or 6: of the potential, whose higher derivatives are left out */
    size_t lights;
    /* Derivatives of the potential: monomials of degree 1 on, see shd_monomial. */
    double terms[3][SHD_FAR_TERMS];
} shd_far;

/* An upper bound of what a potential of `degree` leaves out of |E|, over Il f(distance), at points
 * within `radius` of a center that is `distance` away from the light. Infinite: not known. */
double shd_far_rest(const shd_plan_light *light, double distance, double radius, int degree);

/* Adds a light without a shape, a spot as if it had no cone. */
void shd_far_add(const shd_plan_light *light, shd_far *to);

/* Adds what `from` tells, about another center. Both have the same channels. */
void shd_far_shift(const shd_far *from, shd_far *to);

/* What lights are looked at from: points within a sphere, and cones around their normals and
 * mirrored views. */
enum { SHD_FAR_LOBES = 8 };
typedef struct shd_far_patch {
    shd_vec3 center, axis, mirror;
    double radius;
    shd_angle spread, glitter;
    /* The material's, absolute, times what one counts that a channel is off by. */
    double diffuse[3], specular[SHD_FAR_LOBES][3], shininess[SHD_FAR_LOBES];
    size_t lobe_count;
    int degree; /* as in shd_far */
} shd_far_patch;

typedef struct shd_far_look {
    double
        rest; /* what the worst channel is off by if the light is taken; infinite: it may not be */
    bool behind;    /* N.L is not above 0 anywhere */
    bool told;      /* it is taken by being added; else by being left out, which is no worse */
    double gleam;   /* the part of `rest` by highlights */
    double certain; /* f N.L at all points, at least; 0 if that is not known to be above 0 */
    double most;    /* and at most */
} shd_far_look;

/* Diffuse light: what all points have at least, by channel, and any of them at most in any. */
typedef struct shd_far_sums {
    double least[3], most;
} shd_far_sums;

/* One for each instruction set; all give the same bits. */
typedef struct shd_far_kernel {
    /* Looks at lights by their places in bunches->lights: out[count]. Adds what they send. */
    void (*look)(const shd_bunches *bunches, const shd_far_patch *patch, const uint32_t *places,
                 size_t count, shd_far_look *out, shd_far_sums *sums);
    /* The same of all lights of a bunch together, by indices in bunches->list. What is certain and
     * most is to be multiplied with the bunch's strength. Adds nothing to sums. */
    void (*look_at_bunches)(const shd_bunches *bunches, const shd_far_patch *patch,
                            const uint32_t *indices, size_t count, shd_far_look *out);
    /* Adds them. */
    void (*add)(const shd_bunches *bunches, const uint32_t *places, size_t count, shd_far *to);
    /* Adds all lights of bunches, by indices in bunches->list. */
    void (*add_bunches)(const shd_bunches *bunches, const uint32_t *indices, size_t count,
                        shd_far *to);
    /* Adds the sum of N.E Il to the points' rows, those of points32 in the plan's frame. Sums below
     * 0 are 0: lights' colors must not be negative. Rounds once. */
    void (*light)(const shd_plan *plan, const shd_far *far, size_t count,
                  const float *const position[3], const float *const low[3],
                  const float *const normal[3], float *const diffuse[3]);
} shd_far_kernel;

extern const shd_far_kernel shd_far_kernel_portable, shd_far_kernel_avx2, shd_far_kernel_avx512;

const shd_far_kernel *shd_far_kernel_of(shd_isa isa);
