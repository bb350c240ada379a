/* What f32 errs by on flat faces, with u = 2^-24. In a block, a face's weight, its normal's
 * direction and its point's way from the block's times the weight are at + x right + y down, of
 * which f64 has all three (sight/faces.c). B is |at| + 3.5 (|right| + |down|), of a vector by its
 * components: the most of it in the block. Three numbers are rounded, and two products and two
 * sums, each by u B at most: 4 u B in all, as x and y are multiples of 1/2.
 *
 * Normals. A normal's direction is LEAST_NORMAL times its B, or longer, so that it is off by 32 u
 * of itself, what f64 rounds counted, and its unit vector by 36 u.
 *
 * Points. With S the least weight, no point is farther from the block's than M = B / S, of which
 * 4 u are rounded. The weight is off by 4 u B of its own, and that is 8 S at most: 32 u of M. So
 * points are off by 39 u M, and lights are NEAR M away or more. Light's directions turn by 13 u by
 * that, and by 2 u as lights' places, and the difference, are rounded.
 *
 * Mirrored views. Rays' directions have the length 1 in the middle, and are off that by a quarter
 * at most: off by 4 u 1.25 / 0.75 of themselves, and their unit vectors by 11 u. N.V is off by 36 u
 * + 11 u + 3 u, and W by 11 u + 2 (50 u + 36 u) + 3 u = 186 u.
 *
 * On balls, these are 77, 28 and 278 units (sketch.c): what is told of balls holds of faces. */
#include <string.h>

#include "plan/faces.h"
#include "shade/sketch_job.h"

static const double LEAST_NORMAL = 0.125, LEAST_WEIGHT = 0.125, NEAR = 3, WIDE = 0.25,
                    F64 = 0x1p-27; /* what f64 may be off, of the least */

/* The most and the least that a function is in the block. */
static double most_of(double at, double right, double down) {
    return fabs(at) + SHD_FACE_REACH * (fabs(right) + fabs(down));
}

static double least_of(double at, double right, double down) {
    return at - SHD_FACE_REACH * (fabs(right) + fabs(down));
}

/* All is of the plan's frame, or made of vectors of about unit length: squares do not vanish. */
static double length_of(shd_vec3 v) {
    return sqrt(shd_dot(v, v));
}

static double most_of_ramp(const shd_ramp *r) {
    return length_of((shd_vec3){most_of(r->at.x, r->right.x, r->down.x),
                                most_of(r->at.y, r->right.y, r->down.y),
                                most_of(r->at.z, r->right.z, r->down.z)});
}

/* How far a face's points and normals are from those of the block's middle. */
typedef struct span {
    shd_vec3 normal; /* unit */
    double moved, turned;
} span;

/* False: it is not told how far off the face is in f32. */
static bool find_span(const shd_seen_face *f, span *out) {
    const double least = least_of(1, f->right, f->down), most = most_of(1, f->right, f->down),
                 point = most_of_ramp(&f->point), normal = most_of_ramp(&f->normal);
    if (!(least > LEAST_WEIGHT * most) || !(f->off_weight < F64 * least) ||
        !(f->off_point < F64 * point))
        return false;
    const double inverse = 1 / length_of(f->normal.at);
    out->normal = shd_scale(f->normal.at, inverse);
    const double straight =
        least_of(shd_dot(f->normal.at, out->normal), shd_dot(f->normal.right, out->normal),
                 shd_dot(f->normal.down, out->normal));
    if (!(straight > LEAST_NORMAL * normal) || !(f->off_normal < F64 * straight)) return false;
    /* No more than sqrt(2) times the sine of the angle, which is less than 90 degrees. */
    const double aside =
        SHD_FACE_REACH * (length_of(f->normal.right) + length_of(f->normal.down)) * inverse;
    out->turned = aside < 1 ? 1.4143 * aside : 1.4143;
    out->moved = point / least;
    return true;
}

static void round_ramp(const shd_ramp *from, float row[3][3]) {
    const shd_vec3 v[3] = {from->at, from->right, from->down};
    for (int k = 0; k < 3; k++) {
        row[0][k] = (float)v[k].x;
        row[1][k] = (float)v[k].y;
        row[2][k] = (float)v[k].z;
    }
}

static void round_face(const shd_seen_face *f, shd_sketch_face *out) {
    round_ramp(&f->normal, out->row);
    round_ramp(&f->point, out->row + 3);
    out->row[SHD_SKETCH_WEIGHT][0] = 1;
    out->row[SHD_SKETCH_WEIGHT][1] = (float)f->right;
    out->row[SHD_SKETCH_WEIGHT][2] = (float)f->down;
}

static void round_way(shd_vec3 v, float out[3]) {
    out[0] = (float)v.x;
    out[1] = (float)v.y;
    out[2] = (float)v.z;
}

/* Sets the view, and rounds all faces. False: see above. */
static bool set_view(const shd_plan *plan, const shd_block_faces *b, const shd_sketch_group *group,
                     shd_sketch_face *faces, shd_sketch_view *v) {
    const double wide = SHD_FACE_REACH * (length_of(b->way_right) + length_of(b->way_down));
    shd_vec3 n = {0, 0, 0};
    double moved = 0, turned = 0;
    if (!(wide < WIDE)) return false;
    for (int k = 0; k < b->count; k++) {
        span s;
        if (!find_span(&b->list[k], &s)) return false;
        if (!k) n = s.normal;
        moved = fmax(moved, s.moved);
        turned = fmax(turned, s.turned + length_of(shd_sub(s.normal, n)));
        round_face(&b->list[k], &faces[k]);
    }
    const shd_vec3 mirror = shd_sub(b->way, shd_scale(n, 2 * shd_dot(n, b->way)));
    moved /= plan->scale;
    *v = (shd_sketch_view){.moved = moved,
                           .turned = turned,
                           .chord = sqrt((double)group->reach) + 2 * turned + 1.4143 * wide +
                                    SHD_SKETCH_OFF,
                           .near = NEAR * moved};
    memcpy(v->point, &b->point, sizeof v->point);
    memcpy(v->normal, &n, sizeof v->normal);
    memcpy(v->mirror, &mirror, sizeof v->mirror);
    return true;
}

bool shd_sketch_faces(const shd_lighting *lighting, const shd_block_faces *faces, size_t stride,
                      float *const rgb[3]) {
    static shd_sketch_function *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sketch);
    const shd_plan *plan = lighting->plan;
    const shd_sketch_group *group = &lighting->sketches[plan->objects[faces->object].group];
    shd_sketch_face list[SHD_FACES_MOST];
    shd_sketch_job j = {.group = group,
                        .form = SHD_SKETCH_FACES,
                        .blocks = 1,
                        .turned2 = (float)(SHD_SKETCH_TURNED * SHD_SKETCH_TURNED),
                        .faces = list,
                        .face_of = faces->of};
    bool drawn;
    if (!group->fits || !set_view(plan, faces, group, list, &j.view)) return false;
    round_way(faces->way, j.way);
    round_way(faces->way_right, j.way_x);
    round_way(faces->way_down, j.way_y);
    return kernels[plan->isa](&j, stride, rgb, &drawn) && drawn;
}
