/* `trace`, and the members of materials that count with it. */
#include "unit/scene_support.h"

static void nothing_is_traced_unless_asked_for(void **state) {
    (void)state;
    reading r = read_scene("{'objects': [{'type': 'sphere'}]}");
    const shd_trace *t = &r.scene->trace;
    const shd_material *m = &r.scene->materials[0];
    assert_false(shd_is_traced(r.scene));
    assert_false(t->shadows);
    assert_int_equal(t->depth, 0);
    assert_rgb(m->opacity, 1, 1, 1);
    assert_rgb(m->reflection, 0, 0, 0);
    assert_rgb(m->transmission, 0, 0, 0);
    assert_true(m->ior == 1.5);
    drop(&r);
    r = read_scene(WITH("'trace': {'shadows': true}"));
    assert_true(shd_is_traced(r.scene) && r.scene->trace.shadows);
    assert_int_equal(r.scene->trace.shadow_samples, 16);
    assert_true(r.scene->trace.min_contribution == 0.001);
    drop(&r);
}

static void coefficients_are_read_as_they_are(void **state) {
    (void)state;
    reading r = read_scene(
        "{'trace': {'depth': 3, 'shadowSamples': 64, 'minContribution': 0}, 'objects': [{'type': "
        "'sphere', 'material': {'opacity': 0.25, 'reflection': [0, 0.5, 2], 'transmission': 0.125, "
        "'ior': 0.75}}, {'type': 'sphere', 'material': {'diffuse': [0.1, 0.2, 0.3, 0.5]}}]}");
    const shd_material *m = r.scene->materials;
    assert_int_equal(r.scene->trace.depth, 3);
    assert_int_equal(r.scene->trace.shadow_samples, 64);
    assert_true(r.scene->trace.min_contribution == 0);
    assert_rgb(m[0].opacity, .25, .25, .25);
    assert_rgb(m[0].reflection, 0, .5, 2);
    assert_rgb(m[0].transmission, .125, .125, .125);
    assert_true(m[0].ior == 0.75);
    assert_rgb(m[1].diffuse, .1, .2, .3);
    assert_rgb(m[1].ambient, .1, .2, .3);
    assert_rgb(m[1].opacity, .5, .5, .5);
    assert_true(has_warning(&r, "/objects/0/material", "2.125 times what its rays meet"));
    assert_int_equal(r.report.warning_count, 1);
    drop(&r);
}

static void what_no_ray_shows_is_warned_of(void **state) {
    (void)state;
    static const char *const members[] = {"'opacity': 0.5", "'reflection': 0.5",
                                          "'transmission': 0.5", "'diffuse': [1, 1, 1, 0]"};
    for (size_t k = 0; k < 4; k++)
        for (int traced = 0; traced < 2; traced++) {
            char text[256];
            snprintf(text, sizeof text,
                     "{'trace': {'depth': %d}, 'objects': [{'type': 'sphere', 'material': {%s}}]}",
                     traced, members[k]);
            reading r = read_scene(text);
            assert_int_equal(has_warning(&r, "/objects/0/material", "not seen without a `depth`"),
                             !traced);
            drop(&r);
        }
}

#define MATERIAL(members) OBJECT("'type': 'sphere', 'material': {" members "}")

static void mistakes_are_named(void **state) {
    (void)state;
    static const refusal cases[] = {
        {WITH("'trace': true"), "/trace", "an object"},
        {WITH("'trace': {'shadow': true}"), "/trace/shadow", "shadows"},
        {WITH("'trace': {'shadows': 1}"), "/trace/shadows", "true or false"},
        {WITH("'trace': {'shadowSamples': 0}"), "/trace/shadowSamples", "1 to 1024"},
        {WITH("'trace': {'shadowSamples': 1025}"), "/trace/shadowSamples", "1 to 1024"},
        {WITH("'trace': {'depth': 17}"), "/trace/depth", "0 to 16"},
        {WITH("'trace': {'depth': 1.5}"), "/trace/depth", "0 to 16"},
        {WITH("'trace': {'minContribution': -1}"), "/trace/minContribution", "0 to 1"},
        {MATERIAL("'opacity': 1.5"), "/objects/0/material/opacity", "from 0 to 1"},
        {MATERIAL("'opacity': [0, 0, -1]"), "/objects/0/material/opacity/2", "from 0 to 1"},
        {MATERIAL("'reflection': -0.5"), "/objects/0/material/reflection", "0 or more"},
        {MATERIAL("'transmission': [0, -1, 0]"), "/objects/0/material/transmission/1", "0 or more"},
        {MATERIAL("'ior': 0"), "/objects/0/material/ior", "greater than 0"},
        {MATERIAL("'diffuse': [1, 1, 1, 2]"), "/objects/0/material/diffuse/3", "from 0 to 1"},
        {MATERIAL("'diffuse': [1, 1, 1, 0.5], 'opacity': 1"), "/objects/0/material", "not both"},
        {MATERIAL("'specular': [1, 1, 1, 0.5]"), "/objects/0/material/specular", "alpha below 1"},
        {OUTPUT("'format': 'exr', 'layers': ['shadow']"), "/output/layers/0", "needs `shadows`"},
        {OUTPUT("'format': 'exr', 'layers': ['bounce']"), "/output/layers/0", "needs a `depth`"},
    };
    ASSERT_REFUSED(cases);
}

/* Digests see each value that may change a picture, and what is off changes none. */
static void digests_see_what_is_traced(void **state) {
    (void)state;
    static const char *const traces[] = {"'shadows': false",
                                         "'shadows': true",
                                         "'shadows': true, 'shadowSamples': 17",
                                         "'depth': 1",
                                         "'depth': 2",
                                         "'depth': 2, 'minContribution': 0.5",
                                         "'depth': 2, 'shadows': true"},
                             *const members[] = {"'ior': 1.5",
                                                 "'opacity': 0.5",
                                                 "'opacity': [1, 1, 0.5]",
                                                 "'reflection': 0.5",
                                                 "'transmission': 0.5",
                                                 "'transmission': 0.5, 'ior': 1.25"};
    char digests[16][33], text[256];
    size_t count = 0;
    for (size_t k = 0; k < 7; k++) {
        snprintf(text, sizeof text, "{'trace': {%s}, 'objects': [{'type': 'sphere'}]}", traces[k]);
        reading r = read_scene(text);
        memcpy(digests[count++], r.scene->digest, 33);
        drop(&r);
    }
    for (size_t k = 1; k < 6; k++) {
        snprintf(text, sizeof text, OBJECT("'type': 'sphere', 'material': {%s}"), members[k]);
        reading r = read_scene(text);
        memcpy(digests[count++], r.scene->digest, 33);
        drop(&r);
    }
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < i; k++) assert_string_not_equal(digests[i], digests[k]);
    reading plain = read_scene("{'objects': [{'type': 'sphere'}]}"),
            said = read_scene("{'trace': {'depth': 0}, 'objects': [{'type': 'sphere', 'material': "
                              "{'opacity': 1, 'ior': 1.5}}]}");
    assert_string_equal(plain.scene->digest, said.scene->digest);
    drop(&plain);
    drop(&said);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_traced_unless_asked_for),
        cmocka_unit_test(coefficients_are_read_as_they_are),
        cmocka_unit_test(what_no_ray_shows_is_warned_of),
        cmocka_unit_test(mistakes_are_named),
        cmocka_unit_test(digests_see_what_is_traced),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
