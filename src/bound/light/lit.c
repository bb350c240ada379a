/* What a light can do at a piece. */
#include "bound/light/error.h"
#include "bound/light/pieces.h"

static double spot_at(const shd_plan_light *light, double cosine) {
    if (light->exponent > 0 && !(cosine > 0)) return 0;
    const double s = shd_penumbra(light, 1 - cosine);
    return light->exponent > 0 ? s * pow(cosine, light->exponent) : s;
}

static double hypotenuse_of(double a, double b) {
    return shd_plan_length((shd_vec3){a, b, 0});
}

/* How a light may be seen from the points of a piece. */
typedef struct outlook {
    shd_vec3 toward;  /* unit: the light's direction from the middle */
    shd_angle spread; /* directions from other points are within this of it */
    double nearest, farthest;
    double facing_low, facing_high; /* N.L, by what distances tell */
} outlook;

/* Finds the outlook of a light that has a place. False: the light is behind a flat piece. */
static bool find_outlook(const shd_scene *scene, const shd_piece *piece,
                         const shd_plan_light *light, double least, outlook *out) {
    const shd_vec3 path = shd_sub(light->position, piece->center);
    const double distance = shd_plan_length(path), inverse = 1 / distance;
    const bool known = inverse > 0 && inverse < INFINITY;
    out->spread = known ? shd_seen_from(piece->radius, inverse) : SHD_ANY_ANGLE;
    if (known) out->toward = shd_scale(path, inverse);
    out->nearest = shd_larger(distance - piece->radius, 0);
    out->farthest = distance + piece->radius;
    if (piece->spread.cosine == 1) { /* flat: N.(l - p) is the same for all p */
        const double height = shd_dot(path, piece->axis),
                     across = sqrt(shd_larger(distance * distance - height * height, 0));
        if (!(height > -SHD_PIECE_MARGIN * distance)) return false;
        out->nearest = hypotenuse_of(height, shd_larger(across - piece->radius, 0));
        out->farthest = hypotenuse_of(height, across + piece->radius);
        if (piece->beyond > 0) {
            const double eye = shd_plan_length(shd_sub(light->position, scene->camera.position));
            out->nearest = shd_larger(out->nearest, piece->beyond - eye);
        }
        out->nearest *= 1 - SHD_PIECE_MARGIN;
        out->facing_high = shd_larger(height, 0) / out->nearest;
        out->facing_low = height / out->farthest;
    }
    out->nearest = shd_larger(out->nearest, least);
    return true;
}

bool shd_piece_lit(const shd_scene *scene, const shd_piece *piece, const shd_plan_light *light,
                   double least, shd_lit *out) {
    outlook o = {.toward = light->toward, .spread = {1, 0}, .facing_low = -1, .facing_high = 1};
    if (!light->directional && !find_outlook(scene, piece, light, least, &o)) return false;
    const shd_angle facing = shd_angle_of(shd_dot(piece->axis, o.toward)),
                    facings = shd_angle_sum(o.spread, piece->spread);
    const double facing_high =
        shd_smaller(o.facing_high, shd_cosine_less(facing, facings)) + SHD_PIECE_MARGIN;
    if (!(facing_high > 0)) return false;
    const double facing_low =
        shd_larger(o.facing_low, shd_cosine_more(facing, facings)) - SHD_PIECE_MARGIN;
    out->nearest = o.nearest;
    out->facing_high = shd_smaller(facing_high, 1);
    out->facing_low = shd_larger(facing_low, 0);
    out->fall_high = out->factor_high = shd_attenuation(light, o.nearest) * (1 + SHD_PIECE_MARGIN);
    out->factor_low = shd_attenuation(light, o.farthest) * (1 - SHD_PIECE_MARGIN);
    if (!(out->factor_low > 0)) out->factor_low = 0;
    if (light->spot) {
        const shd_angle off = shd_angle_of(-shd_dot(light->axis, o.toward));
        out->axis_high = shd_smaller(shd_cosine_less(off, o.spread) + SHD_PIECE_MARGIN, 1);
        out->axis_low = shd_cosine_more(off, o.spread) - SHD_PIECE_MARGIN;
        const double high = spot_at(light, out->axis_high);
        if (high == 0) return false;
        out->factor_high *= high;
        out->factor_low *= spot_at(light, out->axis_low);
    }
    const shd_angle shine = shd_angle_of(shd_dot(piece->mirror, o.toward)),
                    shines = shd_angle_sum(o.spread, piece->glitter);
    out->shine_high = shd_smaller(shd_cosine_less(shine, shines) + SHD_PIECE_MARGIN, 1);
    out->shine_low = out->facing_low > 0 ? shd_cosine_more(shine, shines) - SHD_PIECE_MARGIN : 0;
    return true;
}

/* No more than exp(-ns (1 - R.V)). */
double shd_shine_most(double shine, double shininess) {
    return shininess * (1 - shine) > 23 ? 1.1e-10 : shd_shine_power(shine, shininess);
}

double shd_shine_least(double shine, double shininess) {
    return shininess * (1 - shine) > 23 ? 0 : shd_shine_power(shine, shininess);
}

double shd_piece_most(const shd_scene *scene, const shd_piece *piece,
                      const shd_plan_material *material, const shd_plan_light *light,
                      double least) {
    shd_lit lit;
    if (!shd_piece_lit(scene, piece, light, least, &lit)) return 0;
    double reflected[3], most = 0;
    for (int c = 0; c < 3; c++) reflected[c] = fabs(material->diffuse[c]) * lit.facing_high;
    for (size_t k = 0; k < material->lobe_count; k++) {
        const shd_plan_lobe *lobe = &material->lobes[k];
        const double power = shd_shine_most(lit.shine_high, lobe->shininess);
        for (int c = 0; c < 3; c++) reflected[c] += fabs(lobe->specular[c]) * power;
    }
    for (int c = 0; c < 3; c++) most = shd_larger(most, reflected[c] * fabs(light->color[c]));
    return most * lit.factor_high;
}
