/* Surfaces have two sides, mirrored ones stay outside out, and facets approach what they stand
 * for. */
#include "property/pieces.h"

static sampled take(void **state, char *json) {
    sampled s = samples_of(*state, json);
    free(json);
    return s;
}

#define SMALL "\"image\": {\"width\": 48, \"height\": 36, \"samples\": 1}, "
#define EXACT "\"accuracy\": {\"tier\": \"exact\"}, "
#define LAMP  "\"lights\": [{\"type\": \"point\", \"position\": [2, 3, 4]}], "
#define GLOSS "\"diffuse\": [0.6, 0.4, 0.2], \"specular\": 0.5, \"shininess\": 30"

static void symmetric_shapes_mirror_into_themselves(void **state) {
    static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus", "disc"};
    static const char *const scales[] = {"[-1, 1, 1]", "[1, 1, -1]", "[-1, 1, -1]", "-1"};
    for (size_t i = 0; i < 6; i++)
        for (int k = 0; k < 4; k++) {
            /* The cone has no mirror plane across its axis. */
            if (i == 3 && k == 3) continue;
            sampled pictures[2];
            for (int m = 0; m < 2; m++)
                pictures[m] =
                    take(state, text_of("{" SMALL EXACT LAMP "\"objects\": [{\"type\": \"%s\", "
                                        "\"material\": {" GLOSS "}, \"transform\": {\"scale\": %s, "
                                        "\"rotate\": [40, 0, 30]}}]}",
                                        shapes[i], m ? scales[k] : "1"));
            /* A sign changes no digit, but the order of a sum's terms may: the torus's roots are
             * iterated. */
            assert_below(sample_difference(&pictures[0], &pictures[1], 0.05, NULL), 1e-12);
            drop_sampled(&pictures[0]);
            drop_sampled(&pictures[1]);
        }
}

/* A disc that faces the camera, or turns its back, lit from the camera's side or from behind. */
static char *disc(const char *side, bool back, bool lit_from_behind, double ambient) {
    return text_of("{" SMALL EXACT "\"ambient\": %g, \"lights\": [{\"type\": \"point\", "
                   "\"position\": [0.5, 1, %d]}], \"objects\": [{\"type\": \"disc\", \"material\": "
                   "{" GLOSS ", \"side\": \"%s\"}, \"transform\": {\"rotate\": [%d, 0, 0]}}]}",
                   ambient, lit_from_behind ? -3 : 3, side, back ? -90 : 90);
}

static double sum_of(const sampled *s) {
    double sum = 0;
    for (size_t i = 0; i < s->count; i++)
        for (int c = 0; c < 3; c++) sum += s->radiance[i][c];
    return sum;
}

static void both_sides_of_a_surface_look_alike(void **state) {
    for (int behind = 0; behind < 2; behind++) {
        sampled front = take(state, disc("both", false, behind, 0.2)),
                back = take(state, disc("both", true, behind, 0.2));
        /* Quarter turns are exact: so is this. */
        assert_below(sample_difference(&front, &back, -1, NULL), 1e-15);
        drop_sampled(&front);
        drop_sampled(&back);
    }
}

static void light_behind_a_surface_does_not_shine_through(void **state) {
    for (int back = 0; back < 2; back++) {
        sampled s = take(state, disc("both", back, true, 0));
        assert_true(sum_of(&s) == 0);
        drop_sampled(&s);
    }
}

static void a_front_only_surface_keeps_its_normal(void **state) {
    /* Its front looks as that of a two-sided one. */
    sampled both = take(state, disc("both", false, false, 0)),
            front = take(state, disc("front", false, false, 0));
    assert_below(sample_difference(&both, &front, -1, NULL), 1e-15);
    drop_sampled(&both);
    drop_sampled(&front);

    /* Its back gets nothing from a light on the viewer's side: that is behind it. */
    sampled back = take(state, disc("front", true, false, 0));
    size_t hits = 0;
    for (size_t i = 0; i < back.count; i++) {
        hits += back.seen.object[i] != SHD_NOTHING;
        if (back.seen.object[i] != SHD_NOTHING) assert_true(facing_of(&back, i) < 0);
    }
    assert_true(hits > 100);
    assert_true(sum_of(&back) == 0);
    drop_sampled(&back);

    /* And from a light in front of it, it gets N.L as if seen from there. */
    sampled through = take(state, disc("front", true, true, 0));
    assert_true(sum_of(&through) > 0);
    drop_sampled(&through);
}

static void the_inside_of_a_sphere_is_lit_from_the_inside(void **state) {
    /* All of the picture sees the wall at z < -0.8: a light inside strikes it, one behind it at
     * z = -5 does not. */
    for (int inside = 0; inside < 2; inside++) {
        sampled s = take(state, text_of("{" SMALL EXACT "\"camera\": {\"position\": [0, 0, 0.5]}, "
                                        "\"lights\": [{\"type\": \"point\", \"position\": [0, 0.3, "
                                        "%g]}], \"objects\": [{\"type\": \"sphere\"}]}",
                                        inside ? 0.5 : -5));
        for (size_t i = 0; i < s.count; i++) {
            assert_int_equal(s.seen.object[i], 0);
            assert_true(facing_of(&s, i) > 0);
            assert_true(inside ? s.radiance[i][0] > 0 : s.radiance[i][0] == 0);
        }
        drop_sampled(&s);
    }
}

static void tessellated_winding_survives_a_mirror(void **state) {
    /* A front-only tessellated sphere is as bright as the analytic one, mirrored or not: were its
     * normals turned inward by the mirror, it would be dark. */
    static const char *const scales[] = {"1", "[-1, 1, 1]", "-1"};
    static const char *const kinds[] = {"flat", "gouraud"};
    for (int k = 0; k < 3; k++)
        for (int f = 0; f < 2; f++) {
            static const char *const interpolations[] = {"phong", NULL};
            double sums[2] = {0, 0};
            for (int m = 0; m < 2; m++) {
                char *json = text_of(
                    "{" SMALL LAMP "\"objects\": [{\"type\": \"sphere\", \"segments\": 64, "
                    "\"interpolation\": \"%s\", \"material\": {" GLOSS ", \"side\": \"front\"}, "
                    "\"transform\": {\"scale\": %s}}]}",
                    m ? kinds[f] : interpolations[0], scales[k]);
                drawn d = film_of(*state, json);
                for (size_t i = 0; i < 4 * pixels_of(&d); i++)
                    if (i % 4 != 3) sums[m] += (double)d.film.rgba[i];
                drop_drawn(&d);
                free(json);
            }
            /* 64 slices hold 1 - (2 pi / 64)^2 / 6 = 0.998 of the disc, and highlights are cut. */
            assert_below(fabs(sums[1] / sums[0] - 1), 0.01);
        }
}

/* ---- Facets approach the surface. ---- */

/* A sphere in a picture; `how` gives its interpolation. Values where it is wholly covered. */
static drawn ball(void **state, const char *how, double specular) {
    char *json = text_of("{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 1}, " EXACT LAMP
                         "\"background\": null, \"objects\": [{\"type\": \"sphere\", %s, "
                         "\"material\": {\"diffuse\": 0.8, \"specular\": %g, \"shininess\": 20}}]}",
                         how, specular);
    drawn d = film_of(*state, json);
    free(json);
    return d;
}

/* The largest difference where both pictures are covered, and N.V > 0.2 in the analytic one:
 * pixel (x, y) at radius r of the silhouette's has N.V = sqrt(1 - r^2) or more. */
static double difference_inside(const drawn *a, const drawn *b) {
    double most = 0;
    /* fov 40 at a distance of 4: the silhouette's radius is tan(asin(1/4)) / tan(20 deg) of half
     * the height. */
    double radius = 24 * tan(asin(0.25)) / tan(20 * SHD_PI / 180);
    for (size_t i = 0; i < pixels_of(a); i++) {
        double x = (double)(i % 64) + 0.5 - 32, y = (double)(i / 64) + 0.5 - 24;
        if (x * x + y * y > 0.96 * radius * radius) continue;
        assert_true(a->film.rgba[4 * i + 3] == 1 && b->film.rgba[4 * i + 3] == 1);
        for (size_t c = 0; c < 3; c++)
            most =
                fmax(most, fabs((double)a->film.rgba[4 * i + c] - (double)b->film.rgba[4 * i + c]));
    }
    return most;
}

static void gouraud_approaches_phong(void **state) {
    drawn smooth = ball(state, "\"interpolation\": \"phong\"", 0.5);
    double previous = 1;
    for (int segments = 32; segments <= 256; segments *= 2) {
        char *how = text_of("\"interpolation\": \"gouraud\", \"segments\": %d", segments);
        drawn faceted = ball(state, how, 0.5);
        free(how);
        double difference = difference_inside(&smooth, &faceted);
        /* Linear interpolation over h = 2 pi / segments is off by h^2 / 8 of the second derivative
         * in each of two directions: R turns twice as fast as N, which makes it 4 ns ks = 40 in
         * the highlight, and kd elsewhere. At the terminator the kink of (N.L)+ gives h / 4 of its
         * slope, kd. */
        double h = 2 * SHD_PI / segments;
        assert_below(difference, 2 * 41 * h * h / 8 + 0.8 * h / 4);
        assert_true(difference < previous);
        previous = difference;
        drop_drawn(&faceted);
    }
    drop_drawn(&smooth);
}

static void flat_approaches_phong(void **state) {
    drawn smooth = ball(state, "\"interpolation\": \"phong\"", 0);
    double previous = 1;
    for (int segments = 16; segments <= 256; segments *= 4) {
        char *how = text_of("\"interpolation\": \"flat\", \"segments\": %d", segments);
        drawn faceted = ball(state, how, 0);
        free(how);
        double difference = difference_inside(&smooth, &faceted);
        /* A face is constant: off by up to half its diagonal, h / sqrt(2), times the slope kd. */
        assert_below(difference, 0.8 * 2 * SHD_PI / segments);
        assert_true(difference < previous / 2);
        previous = difference;
        drop_drawn(&faceted);
    }
    drop_drawn(&smooth);
}

static void a_mesh_with_a_spheres_normals_approaches_the_sphere(void **state) {
    drawn smooth = ball(state, "\"interpolation\": \"phong\"", 0.5);
    for (int segments = 32; segments <= 128; segments *= 2) {
        writing w;
        start(&w);
        fputs("{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 1}, " EXACT LAMP
              "\"background\": null, \"objects\": [{\"type\": \"mesh\", \"material\": "
              "{\"diffuse\": 0.8, \"specular\": 0.5, \"shininess\": 20}, ",
              w.out);
        write_ball(w.out, segments, segments / 2, true);
        fputs("}]}", w.out);
        char *json = finish(&w);
        drawn mesh = film_of(*state, json);
        free(json);
        /* The surface lies h^2 / 8 lower, which N.V = 0.2 makes five times that along it; shading
         * changes along it by up to kd + ks ns / 3 = 4 a unit. Interpolated normals are right to
         * higher order. */
        double h = 2 * SHD_PI / segments;
        assert_below(difference_inside(&smooth, &mesh), 4 * 5 * h * h / 8);
        drop_drawn(&mesh);
    }
    drop_drawn(&smooth);
}

/* A coarse ball lit from behind, on the right: a mesh with a sphere's normals, or tessellated. */
static drawn lit_from_behind(void **state, const char *interpolation, bool tessellated,
                             double light) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 160, \"height\": 120, \"samples\": 4}, " EXACT
            "\"lights\": [{\"type\": \"directional\", \"direction\": [%g, 0, %g]}], "
            "\"interpolation\": \"%s\", \"objects\": [{\"material\": {" GLOSS "}, ",
            -0.8 * light, 0.6 * light, interpolation);
    if (tessellated)
        fputs("\"type\": \"sphere\", \"segments\": 12", w.out);
    else
        fputs("\"type\": \"mesh\", ", w.out), write_ball(w.out, 12, 6, true);
    fputs("}]}", w.out);
    char *json = finish(&w);
    drawn d = film_of(*state, json);
    free(json);
    return d;
}

static void no_light_from_behind_is_seen_on_a_dark_silhouette(void **state) {
    static const char *const interpolations[] = {"phong", "gouraud", "gouraud"};
    for (int i = 0; i < 3; i++) {
        drawn dark = lit_from_behind(state, interpolations[i], i == 2, 1),
              bright = lit_from_behind(state, interpolations[i], i == 2, -1);
        size_t unlit = 0, covered = 0, lit = 0;
        for (size_t p = 0; p < pixels_of(&dark); p++) {
            const float sum =
                dark.film.rgba[4 * p] + dark.film.rgba[4 * p + 1] + dark.film.rgba[4 * p + 2];
            lit += sum > 0;
            /* Where normals point left by more than slices are wide, N.L < 0: x < -0.3 there. */
            if (p % 160 >= 80 - 20) continue;
            unlit += sum > 0;
            covered += bright.film.rgba[4 * p] > 0;
        }
        assert_int_equal(unlit, 0);
        assert_true(covered > 1000);
        assert_true(lit > 100); /* on its right */
        drop_drawn(&dark);
        drop_drawn(&bright);
    }
}

static void a_mesh_without_normals_is_flat(void **state) {
    /* Every triangle has its own normal: phong on it sees the facets that flat would. */
    writing w;
    start(&w);
    fputs("{" SMALL EXACT "\"lights\": [{\"type\": \"directional\"}], \"objects\": [{\"type\": "
          "\"mesh\", ",
          w.out);
    write_ball(w.out, 16, 8, false);
    fputs("}], \"interpolation\": \"phong\"}", w.out);
    char *phong = finish(&w), *flat = text_of("%s", phong);
    memcpy(strstr(flat, "\"phong\"}"), "\"flat\"} ", 8);
    drawn a = film_of(*state, phong), b = film_of(*state, flat);
    /* A directional light and no highlight: constant on a face, up to the sums' order. */
    assert_below(film_difference(&a, &b), 1e-6);
    drop_drawn(&a);
    drop_drawn(&b);
    free(phong);
    free(flat);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(symmetric_shapes_mirror_into_themselves),
        cmocka_unit_test(both_sides_of_a_surface_look_alike),
        cmocka_unit_test(light_behind_a_surface_does_not_shine_through),
        cmocka_unit_test(a_front_only_surface_keeps_its_normal),
        cmocka_unit_test(the_inside_of_a_sphere_is_lit_from_the_inside),
        cmocka_unit_test(tessellated_winding_survives_a_mirror),
        cmocka_unit_test(gouraud_approaches_phong),
        cmocka_unit_test(flat_approaches_phong),
        cmocka_unit_test(a_mesh_with_a_spheres_normals_approaches_the_sphere),
        cmocka_unit_test(no_light_from_behind_is_seen_on_a_dark_silhouette),
        cmocka_unit_test(a_mesh_without_normals_is_flat),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
