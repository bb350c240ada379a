/* What the plan leaves out adds nothing: lights of a picture, of an object and of a patch of its
 * surface, weighed here by the equations themselves. */
#include "bound/light/weakest.h"
#include "property/pieces.h"
#include "render/show/shown.h"

static const char *const shapes[] = {"sphere", "box",  "cylinder", "cone",
                                     "torus",  "disc", "plane",    "mesh"};
enum { SHAPES = sizeof shapes / sizeof shapes[0] };

static void write_light(FILE *out, uint64_t *random) {
    static const char *const types[] = {"point", "spot", "directional"};
    static const char *const colors[] = {"0", "[1, 0, 0]", "[0, 0.7, 0]", "[0.2, 0.4, 0.6]", "0.5"};
    int type = below(random, 3);
    shd_vec3 from = shd_scale(random_direction(random), uniform(random, 0.3, 6));
    fprintf(out, "{\"type\": \"%s\", \"color\": %s", types[type], colors[below(random, 5)]);
    if (type != 2) {
        fputs(", ", out);
        write_vector(out, "position", from);
        fprintf(out, ", \"attenuation\": [%d, 0, %.17g]", below(random, 2),
                uniform(random, 0.1, 1));
    }
    if (type != 0) {
        fputs(", ", out);
        write_vector(out, "direction", random_direction(random));
    }
    if (type == 1)
        fprintf(out, ", \"angle\": %.17g, \"penumbra\": %.17g, \"exponent\": %d",
                uniform(random, 1, below(random, 2) ? 180 : 40), uniform(random, 0, 1),
                3 * below(random, 2));
    fputs("}", out);
}

static void write_object(FILE *out, uint64_t *random) {
    static const char *const colors[] = {"0", "[0, 0.5, 0]", "[0.5, 0, 0]", "0.6"};
    const char *shape = shapes[below(random, SHAPES)];
    shd_affine turn = random_rotation(random);
    shd_affine size = scaling(uniform(random, 0.1, 1.2), uniform(random, 0.1, 1.2),
                              (below(random, 2) ? 1 : -1) * uniform(random, 0.1, 1.2));
    shd_affine map = shd_compose(&turn, &size);
    map.origin = shd_scale(random_direction(random), uniform(random, 0, 1.5));
    fprintf(out, "{\"type\": \"%s\", ", shape);
    if (!strcmp(shape, "mesh")) {
        write_ball(out, 8, 5, below(random, 2));
        fputs(", ", out);
    }
    write_transform(out, &map);
    fprintf(out,
            ", \"material\": {\"diffuse\": %s, \"specular\": %s, \"shininess\": %.17g, \"side\": "
            "\"%s\"}}",
            colors[below(random, 4)], colors[below(random, 4)], pow(10, uniform(random, 0, 3)),
            below(random, 3) ? "both" : "front");
}

static char *scene(uint64_t seed, int lights, int objects) {
    uint64_t random = seed * 7919 + 3;
    bool ortho = below(&random, 3) == 0;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 40, \"height\": 30, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"%s\"}, \"camera\": {\"type\": \"%s\", ",
            below(&random, 2) ? "standard" : "exact", ortho ? "orthographic" : "perspective");
    write_vector(
        w.out, "position",
        shd_scale(random_direction(&random), uniform(&random, 0.1, below(&random, 3) ? 5 : 50)));
    fputs("}, \"lights\": [", w.out);
    for (int i = 0; i < lights; i++) {
        fputs(i ? ", " : "", w.out);
        write_light(w.out, &random);
    }
    fputs("], \"objects\": [", w.out);
    for (int i = 0; i < objects; i++) {
        fputs(i ? ", " : "", w.out);
        write_object(w.out, &random);
    }
    fputs("]}", w.out);
    return finish(&w);
}

/* ---- The equations. ---- */

typedef struct point {
    shd_vec3 position, normal, view;
} point;

static point point_of(const sampled *s, size_t i) {
    double *const *p = s->seen.position, *const *n = s->seen.normal, *const *v = s->seen.view;
    return (point){
        {p[0][i], p[1][i], p[2][i]}, {n[0][i], n[1][i], n[2][i]}, {v[0][i], v[1][i], v[2][i]}};
}

/* What a light adds to each channel: 0 where it is behind or outside of its cone. */
static void radiance_of(const shd_light *light, const shd_material *material, const point *at,
                        double rgb[3]) {
    memset(rgb, 0, 3 * sizeof *rgb);
    shd_vec3 path = shd_sub(light->position, at->position);
    shd_vec3 toward = shd_scale(light->direction, -1);
    double factor = 1;
    if (light->type != SHD_LIGHT_DIRECTIONAL) {
        assert_true(shd_normalize(path, &toward));
        double d = fmax(shd_length(path), light->min_distance);
        const double *a = light->attenuation;
        factor = 1 / (a[0] + d * (a[1] + d * a[2]));
    }
    if (light->type == SHD_LIGHT_SPOT) {
        double cosine = -shd_dot(toward, light->direction);
        if (cosine < cos(light->angle)) return;
        double inner = cos(light->angle * (1 - light->penumbra)), outer = cos(light->angle);
        double x = inner > outer ? fmin((cosine - outer) / (inner - outer), 1) : 1;
        factor *= x * x * (3 - 2 * x);
        if (light->exponent > 0) factor *= cosine > 0 ? pow(cosine, light->exponent) : 0;
    }
    double facing = shd_dot(at->normal, toward);
    if (!(facing > 0)) return;
    shd_vec3 mirrored = shd_sub(shd_scale(at->normal, 2 * facing), toward);
    double shine = shd_dot(mirrored, at->view);
    for (int c = 0; c < 3; c++) {
        rgb[c] = material->diffuse[c] * facing;
        for (size_t k = 0; k < material->lobe_count && shine > 0; k++)
            rgb[c] += material->lobes[k].specular[c] * pow(shine, material->lobes[k].shininess);
        rgb[c] *= factor * light->color[c];
    }
}

static bool holds(const uint32_t *list, size_t count, const shd_plan *plan, size_t light) {
    for (size_t k = 0; k < count; k++)
        if (plan->lights[list[k]].index == light) return true;
    return false;
}

/* ---- Objects. ---- */

static void lights_left_out_of_an_object_add_nothing_to_it(void **state) {
    size_t dropped[32] = {0}, kept = 0, pairs = 0;
    for (uint64_t seed = 1; seed <= 150; seed++) {
        char *json = scene(seed, 12, 1 + (int)(seed % 4));
        sampled s = samples_of(*state, json);
        const shd_plan *plan = s.request->rendering.plan;
        const shd_scene *from = plan->scene;
        for (size_t j = 0; j < from->light_count; j++) {
            for (int bit = 1; bit < 32; bit *= 2) dropped[bit] += (plan->drops[j] & bit) != 0;
            uint32_t at;
            assert_int_equal(shd_plan_find_light(plan, j, &at), !plan->drops[j]);
            if (!plan->drops[j]) assert_int_equal(plan->lights[at].index, j);
        }
        for (size_t i = 0; i < s.count; i++) {
            if (s.seen.object[i] == SHD_NOTHING) continue;
            const shd_plan_object *object = &plan->objects[s.seen.object[i]];
            const point at = point_of(&s, i);
            for (size_t j = 0; j < from->light_count; j++) {
                pairs++;
                if (holds(object->lights, object->light_count, plan, j)) {
                    kept++;
                    continue;
                }
                double rgb[3];
                radiance_of(&from->lights[j],
                            &from->materials[from->objects[s.seen.object[i]].material], &at, rgb);
                if (rgb[0] != 0 || rgb[1] != 0 || rgb[2] != 0)
                    fail_msg("light %zu adds %g %g %g to object %d in\n%s", j, rgb[0], rgb[1],
                             rgb[2], s.seen.object[i], json);
            }
        }
        drop_sampled(&s);
        free(json);
    }
    /* Every reason was met, and a good part of the work is saved. */
    assert_true(dropped[SHD_DROP_BLACK] && dropped[SHD_DROP_UNLIT] && dropped[SHD_DROP_BEHIND] &&
                dropped[SHD_DROP_CONE]);
    assert_true(kept < pairs * 2 / 3);
}

static void reduced_pictures_are_the_whole_ones(void **state) {
    size_t fewer = 0;
    for (uint64_t seed = 1; seed <= 60; seed++) {
        char *json = scene(seed + 1000, 6, 3);
        drawn reduced = film_of(*state, json);
        drawn whole = {.request = read_scene(*state, json)};
        shd_error error;
        shd_sight *sight;
        shd_arena *arena = whole.request->rendering.arena;
        const shd_plan *draft;
        shd_choice choice;
        assert_true(shd_plan_draft(whole.request->scene, whole.request->rendering.engine->isa, true,
                                   NULL, arena, &draft));
        assert_int_equal(
            shd_choose(draft, NULL, shd_plan_kernel_costs(draft), arena, &choice, &error), SHD_OK);
        assert_true(shd_plan_finish(&choice, arena, &whole.request->rendering.plan));
        /* A light that is left out does not ask for more digits. */
        ((shd_plan *)whole.request->rendering.plan)->split_positions =
            reduced.request->rendering.plan->split_positions;
        assert_int_equal(shd_sight_new(whole.request->rendering.plan, NULL, arena, &sight, &error),
                         SHD_OK);
        assert_int_equal(
            shd_film_render(&whole.request->rendering, sight, NULL, NULL, &whole.film, &error),
            SHD_OK);
        /* A light that reaches nothing does not make positions keep more digits, either: then
         * the pictures are as far apart as both errors allow. */
        const shd_plan *few = reduced.request->rendering.plan, *all = whole.request->rendering.plan;
        if (few->split_positions == all->split_positions) {
            if (!same_film(&reduced, &whole)) fail_msg("the pictures differ in\n%s", json);
        } else {
            for (size_t i = 0; i < 4 * pixels_of(&whole); i++) {
                double apart = (double)reduced.film.rgba[i] - (double)whole.film.rgba[i];
                assert_true(fabs(apart) <= few->bound.linear + all->bound.linear);
            }
        }
        fewer += reduced.request->rendering.plan->light_count <
                 whole.request->rendering.plan->light_count;
        drop_drawn(&reduced);
        drop_drawn(&whole);
        free(json);
    }
    assert_true(fewer > 20);
}

/* ---- Patches. ---- */

/* Around samples [first, first + count) of one object. */
static shd_patch patch_of(const sampled *s, size_t first, size_t count) {
    shd_patch patch = {.cos_spread = 1};
    for (size_t i = first; i < first + count; i++) {
        point at = point_of(s, i);
        patch.center = shd_madd(patch.center, at.position, 1 / (double)count);
        patch.axis = shd_add(patch.axis, at.normal);
    }
    if (!shd_normalize(patch.axis, &patch.axis)) patch.cos_spread = -1;
    for (size_t i = first; i < first + count; i++) {
        point at = point_of(s, i);
        patch.radius = fmax(patch.radius, shd_length(shd_sub(at.position, patch.center)));
        patch.cos_spread = fmin(patch.cos_spread, shd_dot(at.normal, patch.axis));
    }
    return patch;
}

static void check_patch(const sampled *s, size_t first, size_t count, double tolerance,
                        size_t *given, size_t *kept) {
    const shd_plan *plan = s->request->rendering.plan;
    const shd_scene *from = plan->scene;
    const size_t index = (size_t)s->seen.object[first];
    const shd_plan_object *object = &plan->objects[index];
    const shd_patch patch = patch_of(s, first, count);
    uint32_t list[64];
    size_t left = shd_plan_cull(plan, &patch, object->lights, object->light_count, list);
    const double room = shd_patch_room(plan, index, &patch, tolerance, list, left);
    left = shd_drop_weakest(plan, index, &patch, room, list, left);
    *given += object->light_count;
    *kept += left;
    for (size_t k = 1; k < left; k++) assert_true(list[k - 1] < list[k]);
    for (size_t i = first; i < first + count; i++) {
        const point at = point_of(s, i);
        double sum[3] = {0, 0, 0};
        for (size_t k = 0; k < object->light_count; k++) {
            const size_t j = plan->lights[object->lights[k]].index;
            if (holds(list, left, plan, j)) continue;
            double rgb[3];
            radiance_of(&from->lights[j], &from->materials[from->objects[index].material], &at,
                        rgb);
            for (int c = 0; c < 3; c++) sum[c] += fabs(rgb[c]);
        }
        for (int c = 0; c < 3; c++) assert_true(sum[c] <= tolerance);
    }
}

/* Under a budget the plan's own tolerances hold: of what is left out beside what is seen. */
static void check_budget(const sampled *s, const shd_plan *plan, size_t first, size_t count,
                         size_t *given, size_t *kept) {
    const shd_scene *from = plan->scene;
    const size_t index = (size_t)s->seen.object[first];
    const shd_plan_object *object = &plan->objects[index];
    const shd_plan_material *material = &plan->materials[object->material];
    const shd_patch patch = patch_of(s, first, count);
    uint32_t list[64];
    size_t left = shd_plan_cull(plan, &patch, object->lights, object->light_count, list);
    const double room = shd_patch_room(plan, index, &patch, plan->drop_tolerance, list, left);
    left = shd_drop_weakest(plan, index, &patch, room, list, left);
    *given += object->light_count;
    *kept += left;
    for (size_t i = first; i < first + count; i++) {
        const point at = point_of(s, i);
        double out[3] = {0, 0, 0}, all[3];
        memcpy(all, material->constant, sizeof all);
        for (size_t k = 0; k < object->light_count; k++) {
            const size_t j = plan->lights[object->lights[k]].index;
            double rgb[3];
            radiance_of(&from->lights[j], &from->materials[from->objects[index].material], &at,
                        rgb);
            for (int c = 0; c < 3; c++) {
                all[c] += rgb[c];
                if (!holds(list, left, plan, j)) out[c] += rgb[c];
            }
        }
        for (int c = 0; c < 3; c++)
            assert_true(out[c] <= plan->drop_tolerance + plan->drop_relative * all[c]);
    }
}

/* A cone's exponent leaves less than f64's least number of it there. */
static void lights_that_add_nothing_are_the_weakest(void **state) {
    shd_request *request = read_scene(
        *state,
        "{\"lights\": [{\"type\": \"point\", \"position\": [0, 3, 4]}, {\"type\": \"spot\", "
        "\"position\": [0, 3, 4], \"direction\": [0, -3.5, 2.5], \"angle\": 89, "
        "\"exponent\": 500}], \"objects\": [{\"type\": \"disc\", \"transform\": "
        "{\"rotate\": [30, 0, 0]}}]}");
    shd_error error = {.status = SHD_OK};
    const shd_plan *plan;
    assert_int_equal(shd_plan_make(request->scene, request->rendering.engine->isa, NULL, NULL,
                                   request->rendering.arena, &plan, &error),
                     SHD_OK);
    const shd_plan_object *disc = &plan->objects[0];
    assert_int_equal(disc->light_count, 2);
    const double a = SHD_PI / 6;
    const shd_patch patch = {.radius = 0.01, .axis = {0, cos(a), sin(a)}, .cos_spread = 1};
    uint32_t list[2];
    assert_int_equal(shd_plan_cull(plan, &patch, disc->lights, 2, list), 2);
    assert_int_equal(shd_drop_weakest(plan, 0, &patch, 0, list, 2), 2);
    assert_int_equal(shd_drop_weakest(plan, 0, &patch, 1e-3, list, 2), 1);
    assert_int_equal(list[0], 0);
    shd_request_drop(request);
}

static void budgets_leave_out_lights_of_patches_within_their_tolerances(void **state) {
    size_t given = 0, kept = 0, relative = 0;
    for (uint64_t seed = 1; seed <= 40; seed++) {
        char *json = scene(seed + 3000, 40, 2);
        sampled s = samples_of(*state, json);
        /* The same scene with a budget: its plan alone is needed. */
        shd_scene asking = *s.request->scene;
        asking.accuracy =
            (shd_accuracy){.budget = true, .max_error = 1, .metric = SHD_DELTA_E_2000};
        asking.ambient[0] = asking.ambient[1] = asking.ambient[2] = 0.05;
        shd_error error;
        const shd_plan *plan = NULL;
        const shd_shown *shown = NULL;
        assert_int_equal(shd_shown_make(&s.request->rendering, &asking, &shown, &error), SHD_OK);
        if (shd_plan_make(&asking, SHD_PORTABLE, shown, NULL, s.request->rendering.arena, &plan,
                          &error))
            fail_msg("%s in\n%s", error.text, json);
        relative += plan->drop_relative > 0;
        for (size_t i = 0; i < s.count;) {
            size_t end = i + 1;
            while (end < s.count && end % 40 && s.seen.object[end] == s.seen.object[i] &&
                   end - i < 8)
                end++;
            if (s.seen.object[i] != SHD_NOTHING) check_budget(&s, plan, i, end - i, &given, &kept);
            i = end;
        }
        drop_sampled(&s);
        free(json);
    }
    assert_true(relative > 20 && kept < given);
}

static void lights_left_out_of_a_patch_add_no_more_than_is_tolerated(void **state) {
    static const double tolerances[] = {0, 1e-3, 0.1, 1};
    size_t kept[4] = {0}, given = 0;
    for (uint64_t seed = 1; seed <= 60; seed++) {
        char *json = scene(seed + 2000, 40, 2);
        sampled s = samples_of(*state, json);
        for (size_t i = 0; i < s.count;) {
            size_t end = i + 1;
            while (end < s.count && end % 40 && s.seen.object[end] == s.seen.object[i] &&
                   end - i < 8)
                end++;
            for (int t = 0; t < 4 && s.seen.object[i] != SHD_NOTHING; t++)
                check_patch(&s, i, end - i, tolerances[t], t ? &(size_t){0} : &given, &kept[t]);
            i = end;
        }
        drop_sampled(&s);
        free(json);
    }
    assert_true(kept[0] < given * 3 / 4);
    for (int t = 1; t < 4; t++) assert_true(kept[t] < kept[t - 1]);
}

/* ---- Materials, greys, positions. ---- */

static void same_plan(shd_engine *engine, const char *json, bool (*claim)(const shd_plan *)) {
    shd_request *request = read_scene(engine, json);
    shd_error error;
    assert_int_equal(shd_plan_make(request->scene, engine->isa, NULL, NULL,
                                   request->rendering.arena, &request->rendering.plan, &error),
                     SHD_OK);
    if (!claim(request->rendering.plan)) fail_msg("not so in\n%s", json);
    shd_request_drop(request);
}

static bool is_grey(const shd_plan *plan) {
    return plan->grey && plan->grey_lights && plan->opaque;
}
static bool has_grey_lights_only(const shd_plan *plan) {
    return !plan->grey && plan->grey_lights;
}
static bool is_colored(const shd_plan *plan) {
    return !plan->grey && !plan->grey_lights;
}
static bool has_one_group(const shd_plan *plan) {
    return plan->group_count == 1 && plan->objects[0].group == 0 && plan->objects[1].group == 0 &&
           plan->objects[0].lights == plan->objects[1].lights;
}
static bool has_two_groups(const shd_plan *plan) {
    return plan->group_count == 2 && plan->objects[0].group != plan->objects[1].group;
}
static bool is_split(const shd_plan *plan) {
    return plan->split_positions;
}
static bool is_not_split(const shd_plan *plan) {
    return !plan->split_positions;
}

static void plans_tell_what_scenes_need(void **state) {
    static const struct {
        const char *json;
        bool (*claim)(const shd_plan *);
    } cases[] = {
        {"{\"objects\": [{\"type\": \"sphere\"}]}", is_grey},
        {"{\"objects\": [{\"type\": \"sphere\", \"material\": {\"preset\": \"brass\"}}]}",
         has_grey_lights_only},
        {"{\"objects\": [{\"type\": \"sphere\"}], \"background\": [0, 0, 1]}",
         has_grey_lights_only},
        {"{\"objects\": [{\"type\": \"sphere\"}], \"lights\": [{\"type\": \"point\", \"color\": "
         "[1, 0, 1]}]}",
         is_colored},
        /* A colored light that reaches nothing colors nothing. */
        {"{\"objects\": [{\"type\": \"sphere\"}], \"lights\": [{\"type\": \"directional\", "
         "\"color\": [1, 0, 1], \"direction\": [0, 0, 1]}]}",
         is_grey},
        {"{\"objects\": [{\"type\": \"sphere\", \"material\": {\"diffuse\": 0.5}}, {\"type\": "
         "\"torus\", \"material\": {\"diffuse\": [0.5, 0.5, 0.5]}}]}",
         has_one_group},
        {"{\"objects\": [{\"type\": \"sphere\", \"material\": {\"diffuse\": 0.5}}, {\"type\": "
         "\"torus\", \"material\": {\"diffuse\": 0.5, \"emissive\": 0.1}}]}",
         has_two_groups},
        {"{\"objects\": [{\"type\": \"sphere\"}], \"lights\": [{\"type\": \"point\"}]}",
         is_not_split},
        {"{\"objects\": [{\"type\": \"sphere\"}], \"lights\": [{\"type\": \"point\", "
         "\"position\": [0, 0, 1.04]}]}",
         is_split},
        {"{\"objects\": [{\"type\": \"sphere\", \"radius\": 1e20}], \"camera\": {\"position\": "
         "[0, 0, 4e20]}, \"lights\": [{\"type\": \"point\", \"position\": [0, 0, 1.3e20]}]}",
         is_not_split},
        {"{\"objects\": [{\"type\": \"box\", \"size\": [9, 9, 9]}], \"camera\": {\"position\": "
         "[0, 0, 2]}, \"lights\": [{\"type\": \"point\", \"position\": [0, 0, 1]}]}",
         is_not_split},
        {"{\"objects\": [{\"type\": \"plane\"}], \"lights\": [{\"type\": \"point\", \"position\": "
         "[1000, 1, 0]}]}",
         is_split},
        {"{\"objects\": [{\"type\": \"sphere\"}], \"lights\": [{\"type\": \"spot\", \"penumbra\": "
         "0.01}]}",
         is_split},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        same_plan(*state, cases[i].json, cases[i].claim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lights_left_out_of_an_object_add_nothing_to_it),
        cmocka_unit_test(reduced_pictures_are_the_whole_ones),
        cmocka_unit_test(lights_left_out_of_a_patch_add_no_more_than_is_tolerated),
        cmocka_unit_test(lights_that_add_nothing_are_the_weakest),
        cmocka_unit_test(budgets_leave_out_lights_of_patches_within_their_tolerances),
        cmocka_unit_test(plans_tell_what_scenes_need),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
