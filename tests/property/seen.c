/* What error bounds stand on: every sample that is seen of an object lies in a piece of it, and in
 * each piece that it lies in, what a light does there is within the piece's intervals. Of scenes of
 * every shape, at each fineness. */
#include "bound/light/pieces.h"
#include "property/pieces.h"

/* Of lengths and cosines; far below the margins that pieces have of their own. */
static const double ROUNDING = 1e-9;

static void write_shape(FILE *out, uint64_t *random) {
    static const char *const shapes[] = {"sphere", "box",  "cylinder", "cone",
                                         "torus",  "disc", "plane",    "mesh"};
    const char *shape = shapes[below(random, 8)];
    shd_affine turn = random_rotation(random);
    shd_affine size =
        scaling(uniform(random, 0.3, 1.3), uniform(random, 0.3, 1.3), uniform(random, 0.3, 1.3));
    if (below(random, 2)) size = scaling(0.9, 0.9, 0.9);
    shd_affine map = shd_compose(&turn, &size);
    map.origin = shd_scale(random_direction(random), uniform(random, 0, 1));
    fprintf(out, "{\"type\": \"%s\", ", shape);
    if (!strcmp(shape, "mesh")) {
        write_ball(out, 12, 6, below(random, 2));
        fputs(", ", out);
    }
    write_transform(out, &map);
    fprintf(out, ", \"material\": {\"diffuse\": 0.5, \"specular\": 0.5, \"shininess\": 20%s}}",
            below(random, 5) ? "" : ", \"side\": \"front\"");
}

static char *scene(uint64_t seed) {
    uint64_t random = seed * 7919 + 3;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"accuracy\": {\"tier\": \"exact\"}, \"image\": {\"width\": 40, \"height\": 32, "
            "\"samples\": 1}, \"camera\": {\"type\": \"%s\", \"position\": [%g, %g, 3]}, "
            "\"lights\": [",
            below(&random, 3) ? "perspective" : "orthographic", uniform(&random, -2, 2),
            uniform(&random, -2, 2));
    for (int i = 0; i < 6; i++) {
        static const char *const types[] = {"point", "spot", "directional"};
        const int type = i % 3;
        const shd_vec3 from = shd_scale(random_direction(&random), uniform(&random, 0.3, 4));
        fprintf(w.out, "%s{\"type\": \"%s\"", i ? ", " : "", types[type]);
        if (type < 2) {
            fprintf(w.out, ", \"attenuation\": [%d, 0.3, 0.5], \"minDistance\": %g, ",
                    below(&random, 2), uniform(&random, 0, 1));
            write_vector(w.out, "position", from);
        }
        if (type == 1)
            fprintf(w.out, ", \"angle\": %g, \"penumbra\": %g, \"exponent\": %g",
                    uniform(&random, 3, 120), uniform(&random, 0, 1),
                    below(&random, 2) ? uniform(&random, 0, 30) : 0);
        if (type > 0) {
            fputs(", ", w.out);
            write_vector(w.out, "direction",
                         shd_add(shd_scale(from, -1), shd_scale(random_direction(&random), 0.4)));
        }
        fputs("}", w.out);
    }
    fputs("], \"objects\": [", w.out);
    for (int i = below(&random, 3); i >= 0; i--) {
        write_shape(w.out, &random);
        if (i) fputs(", ", w.out);
    }
    fputs("]}", w.out);
    return finish(&w);
}

/* A sample: its place, normal and mirrored view. */
typedef struct place {
    shd_vec3 at, normal, mirror;
} place;

static place place_of(const sampled *s, size_t i) {
    const shd_vec3 v = {s->seen.view[0][i], s->seen.view[1][i], s->seen.view[2][i]};
    place p = {.at = {s->seen.position[0][i], s->seen.position[1][i], s->seen.position[2][i]},
               .normal = {s->seen.normal[0][i], s->seen.normal[1][i], s->seen.normal[2][i]}};
    p.mirror = shd_sub(shd_scale(p.normal, 2 * shd_dot(p.normal, v)), v);
    return p;
}

/* Whether it lies in the piece: within its sphere, not nearer to the eye than all of it, within its
 * cone of normals and that of mirrored views. */
static bool holds(const shd_piece *piece, shd_vec3 eye, const place *p) {
    if (!(shd_length(shd_sub(p->at, eye)) >= piece->beyond * (1 - ROUNDING))) return false;
    if (!(shd_length(shd_sub(p->at, piece->center)) <= piece->radius + ROUNDING)) return false;
    return shd_dot(piece->axis, p->normal) >= piece->spread.cosine - ROUNDING &&
           shd_dot(piece->mirror, p->mirror) >= piece->glitter.cosine - ROUNDING;
}

/* What a light does at a place, as the model has it. */
static void check_light(const shd_scene *scene, const shd_piece *piece, const place *p,
                        const shd_plan_light *light, double least) {
    shd_vec3 toward = light->toward;
    double distance = 0, f = light->gain, s = 1;
    if (!light->directional) {
        toward = shd_sub(light->position, p->at);
        distance = shd_length(toward);
        shd_normalize(toward, &toward);
        const double d = fmax(distance, light->min_distance);
        if (light->attenuated) f = light->gain / (light->a + d * (light->b + d * light->c));
        assert_true(least <= distance * (1 + ROUNDING));
    }
    const double t = acos(fmin(1, fmax(-1, -shd_dot(light->axis, toward)))),
                 facing = shd_dot(p->normal, toward), shine = shd_dot(p->mirror, toward);
    if (light->spot) {
        const double outer = 1 - light->outer, inner = 1 - light->inner,
                     x = fmin(1, fmax(0, (cos(t) - outer) / (inner - outer)));
        s = x * x * (3 - 2 * x);
        if (light->exponent > 0) s *= pow(fmax(0, cos(t)), light->exponent);
    }
    shd_lit lit;
    if (!shd_piece_lit(scene, piece, light, least, &lit)) {
        assert_true(facing <= ROUNDING || s <= ROUNDING);
        return;
    }
    assert_true(lit.nearest <= distance * (1 + ROUNDING));
    assert_true(lit.facing_high >= facing - ROUNDING);
    assert_true(lit.facing_low <= fmax(0, facing) + ROUNDING);
    assert_true(lit.fall_high >= f * (1 - ROUNDING));
    assert_true(lit.factor_high >= f * s * (1 - ROUNDING));
    assert_true(lit.factor_low <= f * s * (1 + ROUNDING));
    if (facing > 0) assert_true(lit.shine_high >= shine - ROUNDING);
    assert_true(lit.shine_low <= fmax(0, shine) + ROUNDING);
    if (light->spot) {
        assert_true(lit.axis_high >= cos(t) - ROUNDING);
        assert_true(lit.axis_low <= cos(t) + ROUNDING);
    }
}

static void check_object(const sampled *s, size_t object, int fineness, size_t *seen,
                         size_t *pieces) {
    const shd_plan *plan = s->request->rendering.plan;
    const shd_scene *scene = plan->scene;
    const shd_place bounds = shd_place_of(&scene->objects[object], &plan->objects[object]);
    static shd_piece list[SHD_MOST_PIECES];
    const size_t count =
        shd_plan_pieces(scene, object, &plan->objects[object], fineness, NULL, list);
    assert_true(count <= SHD_MOST_PIECES);
    *pieces += count;
    for (size_t i = 0; i < s->count; i++) {
        if (s->seen.object[i] != (int32_t)object) continue;
        const place p = place_of(s, i);
        size_t holding = 0;
        for (size_t k = 0; k < count; k++) {
            if (!holds(&list[k], scene->camera.position, &p)) continue;
            holding++;
            for (size_t j = 0; j < plan->light_count; j++) {
                const shd_plan_light *light = &plan->lights[j];
                const double least =
                    light->directional ? 0 : shd_least_distance(&bounds, light->position);
                check_light(scene, &list[k], &p, light, least);
            }
        }
        if (!holding)
            fail_msg("of object %zu, fineness %d: no piece of %zu holds (%g, %g, %g)", object,
                     fineness, count, p.at.x, p.at.y, p.at.z);
        ++*seen;
    }
}

static void every_sample_lies_in_a_piece_that_knows_its_light(void **state) {
    size_t seen = 0, pieces = 0;
    for (uint64_t seed = 1; seed <= 150; seed++) {
        char *json = scene(seed);
        sampled s = samples_of(*state, json);
        for (size_t o = 0; o < s.request->scene->object_count; o++)
            for (int fineness = 0; fineness <= 3; fineness++)
                check_object(&s, o, fineness, &seen, &pieces);
        drop_sampled(&s);
        free(json);
    }
    assert_true(seen > 100000);
    /* Pieces that nobody can see are left out: these are about half of all. */
    print_message("%zu samples, %zu pieces\n", seen, pieces);
    assert_true(pieces < 24000);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_sample_lies_in_a_piece_that_knows_its_light)};
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
