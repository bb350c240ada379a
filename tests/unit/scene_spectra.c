/* Spectra in documents, and what scenes and plans make of them. */
#include "plan/plan.h"
#include "unit/scene_support.h"

#define SURFACE(members) OBJECT("'type': 'sphere', 'material': {" members "}")
#define RAYS(members)                                                                              \
    "{'spectral': true, 'trace': {'depth': 1}, 'objects': [{'type': 'sphere', 'material': "        \
    "{" members "}}]}"
#define BUMPS "{'wavelengths': [400, 500, 600], 'values': [0.25, 0.5, 0.125]}"

static void spectra_are_kept_beside_their_colors(void **state) {
    (void)state;
    reading r = read_scene(
        "{'spectral': {'channels': 20, 'to': 740}, 'ambient': {'spectrum': 'E', 'scale': 0.5},"
        " 'lights': [{'type': 'point', 'color': {'spectrum': 'D65'}, 'intensity': 3},"
        "            {'type': 'ambient', 'color': {'spectrum': 'A'}, 'intensity': 2},"
        "            {'type': 'point', 'color': [1, 0, 0], 'ambient': {'spectrum': 'F2'}}],"
        " 'objects': [{'type': 'sphere', 'material': {'diffuse': " BUMPS
        ", 'lobes': [{}, {'specular': " BUMPS "}]}}]}");
    const shd_scene *scene = r.scene;
    assert_int_equal(scene->spectral.channels, 20);
    assert_float_equal(scene->spectral.from, 380, 0);
    assert_float_equal(scene->spectral.to, 740, 0);
    assert_string_equal(scene->ambient_curve->name, "E");
    assert_float_equal(scene->ambient_curve->scale, 0.5, 0);
    assert_string_equal(scene->lights[0].color_curve->name, "D65");
    assert_float_equal(scene->lights[0].color_curve->scale, 3, 0);
    /* White to what ten decimals of the primaries leave. */
    for (int c = 0; c < 3; c++) assert_float_equal(scene->lights[0].color[c], 3, 1e-8);
    assert_null(scene->lights[1].color_curve);
    assert_string_equal(scene->lights[1].ambient_curve->name, "A");
    assert_float_equal(scene->lights[1].ambient_curve->scale, 2, 0);
    assert_null(scene->lights[2].color_curve);
    assert_string_equal(scene->lights[2].ambient_curve->name, "F2");
    const shd_material *m = &scene->materials[0];
    assert_int_equal(m->diffuse_curve->count, 3);
    assert_float_equal(shd_curve_value(m->diffuse_curve, 450), 0.375, 1e-15);
    assert_ptr_equal(m->ambient_curve, m->diffuse_curve); /* as its color */
    assert_null(m->emissive_curve);
    assert_null(m->lobe_curves[0]);
    assert_null(m->lobe_curves[1]);
    assert_non_null(m->lobe_curves[2]);
    assert_int_equal(r.report.warning_count, 0);
    drop(&r);
}

static void colors_that_override_spectra_have_none(void **state) {
    (void)state;
    reading r = read_scene(SURFACE("'diffuse': " BUMPS ", 'ambient': 0.5"));
    assert_non_null(r.scene->materials[0].diffuse_curve);
    assert_null(r.scene->materials[0].ambient_curve);
    drop(&r);
}

static void without_spectral_there_is_one_warning(void **state) {
    (void)state;
    reading r = read_scene(SURFACE("'diffuse': " BUMPS ", 'specular': " BUMPS));
    assert_int_equal(r.report.warning_count, 1);
    assert_true(has_warning(&r, "/objects/0/material/diffuse", "without `spectral`"));
    drop(&r);
}

static void mistakes_are_named(void **state) {
    (void)state;
    static const refusal cases[] = {
        {WITH("'spectral': 16"), "/spectral", "expected true, false or {channels, from, to}"},
        {WITH("'spectral': {'channels': 15}"), "/spectral/channels", "16 to 256"},
        {WITH("'spectral': {'channels': 16.5}"), "/spectral/channels", "integer"},
        {WITH("'spectral': {'from': 381}"), "/spectral/from", "360 to 380 nm"},
        {WITH("'spectral': {'to': 729}"), "/spectral/to", "730 to 830 nm"},
        {WITH("'spectral': {'bins': 20}"), "/spectral/bins", "channels"},
        {SURFACE("'diffuse': {'spectrum': 'D65'}"), "/objects/0/material/diffuse",
         "is an illuminant"},
        {LIGHT("'type': 'point', 'color': {'spectrum': 'TCS01'}"), "/lights/0/color",
         "is the reflectance of a surface"},
        {SURFACE("'emissive': {'spectrum': 'TCS01'}"), "/objects/0/material/emissive",
         "is the reflectance of a surface"},
        {LIGHT("'type': 'point', 'color': {'spectrum': 'D66'}"), "/lights/0/color/spectrum",
         "did you mean \"D65\"?"},
        {SURFACE("'diffuse': {'spectrum': 'TCS01', 'values': [1]}"), "/objects/0/material/diffuse",
         "either `spectrum`"},
        {SURFACE("'diffuse': {'values': [1]}"), "/objects/0/material/diffuse", "either `spectrum`"},
        {SURFACE("'diffuse': {'wavelengths': [1, 2], 'values': [1]}"),
         "/objects/0/material/diffuse", "2 `wavelengths` and 1 `values`"},
        {SURFACE("'diffuse': {'wavelengths': [2, 1], 'values': [1, 1]}"),
         "/objects/0/material/diffuse", "must ascend"},
        {SURFACE("'diffuse': {'wavelengths': [], 'values': [1]}"),
         "/objects/0/material/diffuse/wavelengths", "1 to 1000 numbers"},
        {SURFACE("'diffuse': {'wavelengths': [0], 'values': [1]}"),
         "/objects/0/material/diffuse/wavelengths/0", "greater than 0"},
        {SURFACE("'diffuse': {'wavelengths': [500], 'values': [-1]}"),
         "/objects/0/material/diffuse/values/0", "0 to 1e30"},
        {LIGHT("'type': 'point', 'color': {'wavelengths': [300, 310], 'values': [1, 0]}"),
         "/lights/0/color", "nothing of this light is visible"},
        {SURFACE("'reflection': {'spectrum': 'D65'}"), "/objects/0/material/reflection",
         "is an illuminant"},
        {SURFACE("'opacity': {'wavelengths': [500, 600], 'values': [0.5, 0.75], 'scale': 2}"),
         "/objects/0/material/opacity", "from 0 to 1 at every wavelength, got 1.5"},
        {SURFACE("'opacity': {'spectrum': 'TCS01'}, 'diffuse': [1, 1, 1, 0.5]"),
         "/objects/0/material", "either `opacity` or a fourth component"},
        {WITH("'background': {'spectrum': 'A'}"), "/background/spectrum", "space"},
    };
    for (size_t i = 0; i + 1 < sizeof cases / sizeof cases[0]; i++) assert_refused(&cases[i], 1);
    reading r = read_with(cases[18].text, &scene_limits); /* which also lacks `space` and `value` */
    assert_int_equal(r.status, SHD_SCENE);
    drop(&r);
}

/* The digest of a document with these members. */
static void digest_of(const char *text, char out[33]) {
    reading r = read_scene(text);
    memcpy(out, r.scene->digest, 33);
    drop(&r);
}

static void digests_see_spectra(void **state) {
    (void)state;
    static const char *const other[] = {
        "{'objects': [{'type': 'sphere', 'material': {'diffuse': 0.5}}]}",
        "{'spectral': true, 'objects': [{'type': 'sphere', 'material': {'diffuse': 0.5}}]}",
        "{'spectral': {'channels': 17}, 'objects': [{'type': 'sphere', 'material': {'diffuse': "
        "0.5}}]}",
        "{'spectral': {'to': 731}, 'objects': [{'type': 'sphere', 'material': {'diffuse': 0.5}}]}",
        "{'spectral': {'from': 379}, 'objects': [{'type': 'sphere', 'material': {'diffuse': "
        "0.5}}]}",
        "{'spectral': true, 'objects': [{'type': 'sphere', 'material': {'diffuse': " BUMPS "}}]}",
        "{'spectral': true, 'objects': [{'type': 'sphere', 'material': {'diffuse': " BUMPS
        ", 'ambient': 0}}]}",
        "{'spectral': true, 'objects': [{'type': 'sphere', 'material': {'diffuse': {'spectrum': "
        "'TCS01'}}}]}",
        "{'objects': [{'type': 'sphere', 'material': {'diffuse': {'spectrum': 'TCS01'}}}]}",
        RAYS("'opacity': {'spectrum': 'TCS02'}"),
        RAYS("'reflection': {'spectrum': 'TCS02'}"),
        RAYS("'transmission': {'spectrum': 'TCS02'}"),
        RAYS("'reflection': {'spectrum': 'TCS02', 'scale': 0.5}"),
        RAYS("'reflection': 0.5")};
    enum { COUNT = sizeof other / sizeof *other };
    char digests[COUNT][33], again[33];
    for (size_t i = 0; i < COUNT; i++) {
        digest_of(other[i], digests[i]);
        for (size_t j = 0; j < i; j++) assert_string_not_equal(digests[i], digests[j]);
    }
    digest_of(
        "{'spectral': {'channels': 16, 'from': 380}, 'objects': [{'type': 'sphere', 'material':"
        "{'diffuse': 0.5}}]}",
        again);
    assert_string_equal(again, digests[1]);
    digest_of("{'spectral': false, 'objects': [{'type': 'sphere', 'material': {'diffuse': 0.5}}]}",
              again);
    assert_string_equal(again, digests[0]);
}

/* Two greys, one of them a curve that bends where no RGB sees it, are one material in RGB and two
 * in channels; equal curves are one. */
static void plans_merge_materials_by_their_spectra(void **state) {
    (void)state;
    static const char *const objects =
        "'lights': [{'type': 'point', 'position': [0, 0, 9]}],"
        "'objects': [{'type': 'sphere', 'material': {'ambient': 0, 'diffuse': 0.25}},"
        "            {'type': 'sphere', 'material': {'ambient': 0, 'diffuse':"
        "              {'wavelengths': [300, 301], 'values': [1, 0.25]}}},"
        "            {'type': 'sphere', 'material': {'ambient': 0, 'diffuse':"
        "              {'wavelengths': [500], 'values': [0.25]}}},"
        "            {'type': 'sphere', 'material': {'ambient': 0, 'diffuse':"
        "              {'wavelengths': [360, 380], 'values': [0.75, 0.25]}}}]}";
    char text[1000];
    snprintf(text, sizeof text, "{'spectral': {'from': 360}, %s", objects);
    reading r = read_scene(text);
    const shd_plan *plan;
    assert_true(shd_plan_draft(r.scene, SHD_PORTABLE, false, NULL, r.arena, &plan));
    assert_true(plan->extended);
    assert_int_equal(plan->bins->count, 16);
    const shd_plan_object *o = plan->objects;
    assert_int_equal(o[1].material, o[2].material);
    assert_int_not_equal(o[1].material, o[3].material);
    /* What is kept of a term's color is what summing it up gives. */
    double scratch[3];
    const shd_plan_material *m = &plan->materials[o[3].material];
    const double *kept = shd_term_color(plan, m, plan->lights, 0, scratch);
    shd_plan bare = *plan;
    assert_ptr_not_equal(kept, scratch);
    bare.term_colors = NULL;
    shd_term_color(&bare, m, plan->lights, 0, scratch);
    assert_memory_equal(kept, scratch, sizeof scratch);
    drop(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spectra_are_kept_beside_their_colors),
        cmocka_unit_test(colors_that_override_spectra_have_none),
        cmocka_unit_test(without_spectral_there_is_one_warning),
        cmocka_unit_test(mistakes_are_named),
        cmocka_unit_test(digests_see_spectra),
        cmocka_unit_test(plans_merge_materials_by_their_spectra),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
