/* Light adds up: in any order, in proportion, and black light is none. */
#include "property/film_of.h"

/* What all scenes here show: three shapes, two materials of which one has two lobes. Without
 * emission and ambient light, so that pictures are lights' sums and nothing else. */
static const char STAGE[] =
    "\"image\": {\"width\": 32, \"height\": 24, \"samples\": 1},"
    "\"materials\": {\"a\": {\"diffuse\": [0.7, 0.4, 0.2], \"ambient\": 0.5, \"specular\": 0.4,"
    " \"shininess\": 20}, \"b\": {\"diffuse\": 0.3, \"ambient\": 0.5, \"specular\": [0.2, 0.5, "
    "0.3],"
    " \"shininess\": 200, \"lobes\": [{\"specular\": 0.2, \"shininess\": 5}]}},"
    "\"objects\": [{\"type\": \"sphere\", \"material\": \"a\"},"
    " {\"type\": \"box\", \"material\": \"b\", \"transform\": {\"translate\": [1.2, 0.4, 0.3],"
    " \"rotate\": [20, 30, 40]}},"
    " {\"type\": \"plane\", \"material\": \"b\", \"transform\": {\"translate\": [0, -1, 0]}}]";

/* Light `index` of a fixed sequence of all types, its color and intensity multiplied. */
static void write_light(FILE *out, int index, double color, double intensity) {
    uint64_t random = (uint64_t)index + 1;
    for (int i = 0; i < 4; i++) uniform(&random, 0, 1);
    shd_vec3 p = shd_scale(random_direction(&random), uniform(&random, 1.5, 6));
    shd_vec3 d = shd_scale(p, -1);
    double r = uniform(&random, 0, 1), g = uniform(&random, 0, 1), b = uniform(&random, 0, 1);
    double strength = uniform(&random, 0.1, 2);
    fprintf(out, "{\"color\": [%.17g, %.17g, %.17g], \"intensity\": %.17g, ", r * color, g * color,
            b * color, strength * intensity);
    switch (index % 5) {
    case 0:
        fprintf(out, "\"type\": \"point\", \"position\": [%.17g, %.17g, %.17g]}", p.x, p.y, p.z);
        break;
    case 1:
        fprintf(out, "\"type\": \"directional\", \"direction\": [%.17g, %.17g, %.17g]}", d.x, d.y,
                d.z);
        break;
    case 2:
        fprintf(out,
                "\"type\": \"spot\", \"position\": [%.17g, %.17g, %.17g], \"direction\": [%.17g, "
                "%.17g, %.17g], \"angle\": 35, \"penumbra\": 0.5, \"exponent\": 2}",
                p.x, p.y, p.z, d.x, d.y, d.z);
        break;
    case 3:
        fprintf(out,
                "\"type\": \"point\", \"position\": [%.17g, %.17g, %.17g], \"attenuation\": [0.1, "
                "0.2, 0.3], \"minDistance\": 0.5, \"frame\": \"camera\"}",
                p.x, p.y, p.z + 4);
        break;
    default:
        fprintf(out, "\"position\": [%.17g, %.17g, %.17g, %d]}", p.x, p.y, p.z, index % 2);
    }
}

/* The stage lit by the lights of `order`. */
static char *lit_by(const char *tier, const int *order, int count, double color, double intensity) {
    writing w;
    start(&w);
    fprintf(w.out, "{%s, \"accuracy\": {\"tier\": \"%s\"}, \"lights\": [", STAGE, tier);
    for (int i = 0; i < count; i++) {
        fputs(i ? ", " : "", w.out);
        write_light(w.out, order[i], color, intensity);
    }
    fputs("]}", w.out);
    return finish(&w);
}

static sampled take(void **state, char *json) {
    sampled s = samples_of(*state, json);
    free(json);
    return s;
}

static const char *const tiers[] = {"exact", "standard"};
/* Sums of 100 in f64 round each addition: 100 * 2^-53 = 1.1e-14 of the sum of magnitudes. Those of
 * the standard tier are given in f32: model.md's figure. */
static const double rounding[] = {2e-14, 2e-7};
enum { LIGHTS = 100 };

static void shuffle(int *order, int count, uint64_t *random) {
    for (int i = count - 1; i > 0; i--) {
        int k = below(random, i + 1), held = order[i];
        order[i] = order[k];
        order[k] = held;
    }
}

static void order_does_not_matter(void **state) {
    for (int t = 0; t < 2; t++) {
        int order[LIGHTS];
        for (int i = 0; i < LIGHTS; i++) order[i] = i;
        char *json = lit_by(tiers[t], order, LIGHTS, 1, 1);
        drawn film = film_of(*state, json);
        sampled first = take(state, json);
        uint64_t random = 7;
        for (int round = 0; round < 4; round++) {
            if (round == 0)
                for (int i = 0; i < LIGHTS; i++) order[i] = LIGHTS - 1 - i;
            else
                shuffle(order, LIGHTS, &random);
            json = lit_by(tiers[t], order, LIGHTS, 1, 1);
            drawn shuffled_film = film_of(*state, json);
            sampled shuffled = take(state, json);
            assert_below(sample_difference(&first, &shuffled, -1, NULL), rounding[t]);
            assert_below(film_difference(&film, &shuffled_film), 2e-7);
            drop_sampled(&shuffled);
            drop_drawn(&shuffled_film);
        }
        drop_sampled(&first);
        drop_drawn(&film);
    }
}

/* model.md: summed naively in f32 this loses 3.5e-5. */
static void a_bright_light_among_ten_thousand_may_stand_anywhere(void **state) {
    enum { COUNT = 10000 };
    static const int places[] = {0, COUNT / 2, COUNT - 1};
    drawn films[3];
    for (int k = 0; k < 3; k++) {
        writing w;
        start(&w);
        fputs("{\"image\": {\"width\": 4, \"height\": 3, \"samples\": 1}, \"objects\": [{\"type\":"
              " \"sphere\", \"radius\": 3}], \"lights\": [",
              w.out);
        for (int i = 0; i < COUNT; i++)
            fprintf(w.out,
                    "%s{\"type\": \"directional\", \"direction\": [0, -1, -1], \"intensity\": %g}",
                    i ? "," : "", i == places[k] ? 1000 : 0.0137);
        fputs("]}", w.out);
        char *json = finish(&w);
        films[k] = film_of(*state, json);
        free(json);
    }
    for (int k = 1; k < 3; k++) assert_below(film_difference(&films[0], &films[k]), 2e-7);
    /* And the sum is right: equal weights, so the picture is that of one light of all. */
    char *json = text_of("{\"image\": {\"width\": 4, \"height\": 3, \"samples\": 1}, \"objects\":"
                         " [{\"type\": \"sphere\", \"radius\": 3}], \"lights\": [{\"type\":"
                         " \"directional\", \"direction\": [0, -1, -1], \"intensity\": %.17g}]}",
                         1000 + 9999 * 0.0137);
    drawn one = film_of(*state, json);
    free(json);
    assert_below(film_difference(&one, &films[0]), 2e-7);
    drop_drawn(&one);
    for (int k = 0; k < 3; k++) drop_drawn(&films[k]);
}

static void twice_the_intensity_is_twice_the_picture_to_the_bit(void **state) {
    static const int order[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    for (int t = 0; t < 2; t++) {
        sampled one = take(state, lit_by(tiers[t], order, 10, 1, 1));
        sampled two = take(state, lit_by(tiers[t], order, 10, 1, 2));
        sampled color = take(state, lit_by(tiers[t], order, 10, 2, 1));
        sampled three = take(state, lit_by(tiers[t], order, 10, 1, 3));
        double largest = largest_of(&one);
        for (size_t i = 0; i < one.count; i++)
            for (int c = 0; c < 3; c++) {
                double value = one.radiance[i][c];
                assert_true(two.radiance[i][c] == 2 * value);
                assert_true(color.radiance[i][c] == 2 * value);
                /* 3 rounds: once a light's color, once a product, once a sum */
                assert_true(fabs(three.radiance[i][c] - 3 * value) <= 3 * rounding[t] * largest);
            }
        drop_sampled(&one);
        drop_sampled(&two);
        drop_sampled(&color);
        drop_sampled(&three);
    }
}

static void the_lights_of_two_scenes_add_up(void **state) {
    int order[LIGHTS];
    for (int i = 0; i < LIGHTS; i++) order[i] = i;
    static const int splits[] = {1, 30, 99};
    for (int t = 0; t < 2; t++) {
        sampled all = take(state, lit_by(tiers[t], order, LIGHTS, 1, 1));
        for (int k = 0; k < 3; k++) {
            sampled a = take(state, lit_by(tiers[t], order, splits[k], 1, 1));
            sampled b = take(state, lit_by(tiers[t], order + splits[k], LIGHTS - splits[k], 1, 1));
            for (size_t i = 0; i < a.count; i++)
                for (int c = 0; c < 3; c++) a.radiance[i][c] += b.radiance[i][c];
            assert_below(sample_difference(&all, &a, -1, NULL), rounding[t]);
            drop_sampled(&a);
            drop_sampled(&b);
        }
        drop_sampled(&all);
    }
}

/* A scene with the given `lights` and `ambient` members. */
static char *with_lights(const char *members) {
    return text_of("{%s, %s}", STAGE, members);
}

#define SUN  "{\"type\": \"directional\", \"direction\": [-1, -2, -3], \"color\": [1, 0.5, 0.25]}"
#define LAMP "\"type\": \"point\", \"position\": [2, 3, 4], \"attenuation\": [0, 0, 0.1]"

static void channels_do_not_mix(void **state) {
    char *grey = with_lights("\"lights\": [{" LAMP "}]"),
         *colored = with_lights("\"lights\": [{" LAMP ", \"color\": [0.5, 2, 0]}]");
    sampled a = take(state, grey), b = take(state, colored);
    static const double color[3] = {0.5, 2, 0};
    for (size_t i = 0; i < a.count; i++)
        for (int c = 0; c < 3; c++) /* powers of 2 and 0: exact */
            assert_true(b.radiance[i][c] == color[c] * a.radiance[i][c]);
    drop_sampled(&a);
    drop_sampled(&b);
}

static void black_light_is_no_light(void **state) {
    static const char *const nothing[] = {
        "{" LAMP ", \"color\": 0}",
        "{" LAMP ", \"intensity\": 0}",
        "{" LAMP ", \"color\": \"#000\"}",
        "{" LAMP ", \"color\": [0, 0, 0], \"intensity\": 1e30}",
        "{\"type\": \"ambient\", \"color\": 0}",
        "{\"type\": \"ambient\", \"intensity\": 0}",
        "{\"type\": \"spot\", \"color\": 0}",
        "{\"type\": \"directional\", \"intensity\": 0}",
        "{\"position\": [1, 2, 3, 0], \"color\": [0, 0, 0]}",
    };
    for (size_t i = 0; i < sizeof nothing / sizeof nothing[0]; i++) {
        assert_true(same_png(*state, with_lights("\"lights\": [" SUN "]"),
                             text_of("{%s, \"lights\": [" SUN ", %s]}", STAGE, nothing[i])));
        assert_true(same_png(*state, with_lights("\"lights\": [" SUN "]"),
                             text_of("{%s, \"lights\": [%s, " SUN "]}", STAGE, nothing[i])));
    }
}

static void a_light_and_its_negative_are_no_light(void **state) {
    char *dark = with_lights("\"lights\": [], \"ambient\": 0.25");
    char *both =
        with_lights("\"ambient\": 0.25, \"lights\": [{" LAMP "}, {" LAMP ", \"intensity\": -1}]");
    drawn a = film_of(*state, dark), b = film_of(*state, both);
    assert_below(film_difference(&a, &b), 3e-7); /* in f32, products are not rounded in sums */
    drop_drawn(&a);
    drop_drawn(&b);
    free(dark);
    free(both);
}

static void ambient_light_may_come_from_anywhere(void **state) {
    static const char *const forms[] = {
        "\"lights\": [" SUN ", {\"type\": \"ambient\", \"color\": [0.1, 0.2, 0.3]}]",
        ("\"lights\": [" SUN ", {\"type\": \"ambient\", \"color\": [0.05, 0.1, 0.15],"
         " \"intensity\": 2}]"),
        "\"lights\": [" SUN ", {" LAMP ", \"color\": 0, \"ambient\": [0.1, 0.2, 0.3]}]",
        "\"lights\": [" SUN ", {" LAMP ", \"intensity\": 0, \"ambient\": [0.1, 0.2, 0.3]}]",
        ("\"lights\": [{\"type\": \"directional\", \"direction\": [-1, -2, -3], \"color\": [1,"
         " 0.5, 0.25], \"ambient\": [0.1, 0.2, 0.3]}]")};
    for (size_t i = 0; i < sizeof forms / sizeof forms[0]; i++)
        assert_true(same_png(*state,
                             with_lights("\"lights\": [" SUN "], \"ambient\": [0.1, 0.2, 0.3]"),
                             with_lights(forms[i])));
}

static void homogeneous_positions_are_points_and_directions(void **state) {
    static const char *const pairs[][2] = {
        {"{\"position\": [2, 3, 4, 1]}", "{\"type\": \"point\", \"position\": [2, 3, 4]}"},
        {"{\"position\": [1, 1.5, 2, 0.5]}", "{\"type\": \"point\", \"position\": [2, 3, 4]}"},
        {"{\"position\": [-4, -6, -8, -2]}", "{\"type\": \"point\", \"position\": [2, 3, 4]}"},
        {"{\"position\": [2, 3, 4, 0]}",
         "{\"type\": \"directional\", \"direction\": [-2, -3, -4]}"},
        {"{\"position\": [2e30, 3e30, 4e30, 0]}",
         "{\"type\": \"directional\", \"direction\": [-2, -3, -4]}"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++)
        assert_true(same_png(*state, text_of("{%s, \"lights\": [%s]}", STAGE, pairs[i][0]),
                             text_of("{%s, \"lights\": [%s]}", STAGE, pairs[i][1])));
}

static void lights_in_the_camera_frame_are_where_the_camera_puts_them(void **state) {
    /* A camera at (5,0,0) that looks along -x: its right is -z, its up y, its back +x. */
    static const char camera[] = "\"accuracy\": {\"tier\": \"exact\"}, \"camera\": {\"position\":"
                                 " [5, 0, 0], \"target\": [0, 0, 0]}";
    static const char *const pairs[][2] = {
        {"{\"type\": \"point\", \"position\": [1, 2, 0.5], \"frame\": \"camera\"}",
         "{\"type\": \"point\", \"position\": [5.5, 2, -1]}"},
        {"{\"type\": \"directional\", \"direction\": [1, -2, -3], \"frame\": \"camera\"}",
         "{\"type\": \"directional\", \"direction\": [-3, -2, -1]}"},
        {"{\"type\": \"spot\", \"position\": [0, 0, 0], \"direction\": [0, 0, -1], \"angle\": 10,"
         " \"frame\": \"camera\"}",
         "{\"type\": \"spot\", \"position\": [5, 0, 0], \"direction\": [-1, 0, 0], \"angle\": 10}"},
        {"{\"position\": [1, 2, 3, 0], \"frame\": \"camera\"}", "{\"position\": [3, 2, -1, 0]}"},
        {"{\"position\": [1, 2, 0.5, 1], \"frame\": \"camera\"}",
         "{\"type\": \"point\", \"position\": [5.5, 2, -1]}"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        sampled a = take(state, text_of("{%s, %s, \"lights\": [%s]}", STAGE, camera, pairs[i][0]));
        sampled b = take(state, text_of("{%s, %s, \"lights\": [%s]}", STAGE, camera, pairs[i][1]));
        /* Directions are unit to 2^-53; a 10 degree cone's edge multiplies that by about 100. */
        assert_below(sample_difference(&a, &b, -1, NULL), 1e-13);
        drop_sampled(&a);
        drop_sampled(&b);
    }
}

static void without_lights_there_is_a_headlight_and_with_none_there_is_not(void **state) {
    assert_true(same_png(
        *state, text_of("{%s}", STAGE),
        with_lights("\"lights\": [{\"type\": \"directional\", \"direction\": [0, 0, -1]}]")));
    char *json = with_lights("\"lights\": []");
    drawn dark = film_of(*state, json);
    for (size_t i = 0; i < 4 * pixels_of(&dark); i++)
        assert_true(dark.film.rgba[i] == (i % 4 == 3 ? 1.0f : 0.0f));
    drop_drawn(&dark);
    free(json);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(order_does_not_matter),
        cmocka_unit_test(a_bright_light_among_ten_thousand_may_stand_anywhere),
        cmocka_unit_test(twice_the_intensity_is_twice_the_picture_to_the_bit),
        cmocka_unit_test(the_lights_of_two_scenes_add_up),
        cmocka_unit_test(channels_do_not_mix),
        cmocka_unit_test(black_light_is_no_light),
        cmocka_unit_test(a_light_and_its_negative_are_no_light),
        cmocka_unit_test(ambient_light_may_come_from_anywhere),
        cmocka_unit_test(homogeneous_positions_are_points_and_directions),
        cmocka_unit_test(lights_in_the_camera_frame_are_where_the_camera_puts_them),
        cmocka_unit_test(without_lights_there_is_a_headlight_and_with_none_there_is_not),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
