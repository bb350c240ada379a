/* What is kept between requests is found for equal work alone: after each change of a document by
 * one of its members, the picture is that of an engine that keeps nothing. Every member that hits
 * or sums of light depend on is here. */
#include "property/pieces.h"

/* Everything that a key has, with other values than those that are left out. */
static const char *const bases[] = {
    "{\"camera\": {\"type\": \"perspective\", \"position\": [0.2, 0.3, 4], \"target\": [0, 0.1, "
    "0], "
    "\"up\": [0, 1, 0], \"fov\": 40}, \"image\": {\"width\": 80, \"height\": 64, \"samples\": 4, "
    "\"region\": [0, 0, 72, 60]}, \"accuracy\": {\"tier\": \"standard\"}, \"background\": "
    "[0.1, 0, 0], \"ambient\": 0.1, \"lights\": [{\"type\": \"point\", \"position\": [1, 2, 3], "
    "\"color\": [1, 0.9, 0.8], \"attenuation\": [1, 0.1, 0.01], \"minDistance\": 3.7}, {\"type\": "
    "\"directional\", \"direction\": [0, -1, -2], \"color\": [0.2, 0.3, 0.4]}, {\"type\": "
    "\"spot\", "
    "\"position\": [-1, 1, 4], \"direction\": [0.2, -0.2, -1], \"angle\": 12, \"penumbra\": 0.5, "
    "\"exponent\": 3}], \"materials\": {\"a\": {\"diffuse\": [0.6, 0.4, 0.2], \"specular\": 0.3, "
    "\"shininess\": 50, \"side\": \"both\"}, \"b\": {\"diffuse\": 0.5, \"specular\": 0.1, "
    "\"shininess\": 9, \"lobes\": [{\"specular\": 0.2, \"shininess\": 20}]}}, \"objects\": "
    "[{\"type\": \"torus\", \"radius\": 0.7, \"tube\": 0.3, \"material\": \"a\", \"transform\": "
    "{\"scale\": [1, 1.1, 1.2], \"rotate\": [30, 40, 50], \"translate\": [0.1, 0.2, 0]}}, "
    "{\"type\": \"disc\", \"radius\": 1.2, \"material\": \"a\", \"transform\": {\"rotate\": [-60, "
    "0, "
    "0], \"translate\": [0, -0.4, -0.5]}}, {\"type\": \"cylinder\", \"radius\": 0.3, \"height\": "
    "1.5, \"material\": \"b\", \"transform\": {\"translate\": [-0.8, 0, 0.2]}}, {\"type\": "
    "\"box\", "
    "\"size\": [0.3, 0.4, 0.5], \"material\": \"b\", \"transform\": {\"translate\": [0.8, 0.6, "
    "0.2], \"rotate\": [20, 30, 0]}}]}",
    "{\"camera\": {\"type\": \"orthographic\", \"height\": 2.5}, \"accuracy\": {\"tier\": "
    "\"standard\"}, \"output\": {\"format\": \"png\", \"bitDepth\": 16}, \"image\": {\"width\": "
    "64, "
    "\"height\": 48, \"samples\": 1}, \"lights\": [{\"type\": \"point\", \"position\": [1, 2, 3], "
    "\"attenuation\": [0, 0, 1], \"intensity\": 9}], \"objects\": [{\"type\": \"mesh\", "
    "\"positions\": [-1, -1, 0, 1, -1, 0.1, 0, 1, 0.2, 1, 1, -0.5], \"normals\": [0, 0, 1, 0.1, 0, "
    "1, 0, 0.2, 1, 0.5, 0, 1], \"indices\": [0, 1, 2, 1, 3, 2], \"material\": {\"diffuse\": 0.6, "
    "\"specular\": 0.4, \"shininess\": 20}}]}",
    /* Much room for what a budget leaves out, and a rim between pixels' centres. */
    "{\"image\": {\"width\": 96, \"height\": 96, \"samples\": 16}, \"accuracy\": {\"maxError\": "
    "0.3, \"metric\": \"linear\"}, \"lights\": [{\"type\": \"spot\", \"position\": [0, 0, 3], "
    "\"direction\": [0, 0, -1], \"angle\": 9, \"penumbra\": 0.3}], \"objects\": [{\"type\": "
    "\"sphere\", \"material\": {\"specular\": 0.2, \"shininess\": 8}}]}"};

static const struct {
    int base;
    const char *from, *to; /* `from` is in the base once, or is its first of several */
} changes[] = {
    {1, "\"orthographic\", \"height\": 2.5", "\"perspective\""},
    {0, "[0.2, 0.3, 4]", "[0.2, 0.3, 4.5]"},
    {0, "\"target\": [0, 0.1, 0]", "\"target\": [0, 0.2, 0]"},
    {0, "\"up\": [0, 1, 0]", "\"up\": [0.5, 1, 0]"},
    {0, "\"fov\": 40", "\"fov\": 41"},
    {0, "\"width\": 80", "\"width\": 82"},
    {0, "\"height\": 64", "\"height\": 66"},
    {0, "\"samples\": 4", "\"samples\": 5"},
    {0, "[0, 0, 72, 60]", "[1, 0, 72, 60]"},
    {0, "[0, 0, 72, 60]", "[0, 1, 72, 60]"},
    {0, "[0, 0, 72, 60]", "[0, 0, 71, 60]"},
    {0, "[0, 0, 72, 60]", "[0, 0, 72, 59]"},
    {0, "[1, 2, 3]", "[1.5, 2, 3]"},
    {0, "[1, 2, 3]", "[1, 2.5, 3]"},
    {0, "[1, 2, 3]", "[1, 2, 3.5]"},
    {0, "[1, 0.9, 0.8]", "[0.9, 0.9, 0.8]"},
    {0, "[1, 0.9, 0.8]", "[1, 1, 0.8]"},
    {0, "[1, 0.9, 0.8]", "[1, 0.9, 0.7]"},
    {0, "[1, 0.1, 0.01]", "[1.2, 0.1, 0.01]"},
    {0, "[1, 0.1, 0.01]", "[1, 0.2, 0.01]"},
    {0, "[1, 0.1, 0.01]", "[1, 0.1, 0.1]"},
    {0, "[1, 0.1, 0.01]", "[2, 0.2, 0.02]"},
    {0, "\"minDistance\": 3.7", "\"minDistance\": 4"},
    {0, "[0, -1, -2]", "[0.2, -1, -2]"},
    {0, "\"directional\", \"direction\": [0, -1, -2]", "\"point\", \"position\": [0, 1, 2]"},
    {0, "[0.2, -0.2, -1]", "[0.1, -0.2, -1]"},
    {0, "\"angle\": 12", "\"angle\": 11"},
    {0, "\"penumbra\": 0.5", "\"penumbra\": 0.8"},
    {0, "\"exponent\": 3", "\"exponent\": 9"},
    {0, "\"type\": \"spot\"", "\"type\": \"spot\", \"intensity\": 0.5"},
    {0, "\"specular\": 0.3, ", "\"specular\": 0, "},
    {0, "\"shininess\": 50", "\"shininess\": 60"},
    {0, "\"shininess\": 9", "\"shininess\": 5"},
    {0, ", \"lobes\": [{\"specular\": 0.2, \"shininess\": 20}]", ""},
    {0, "\"shininess\": 20", "\"shininess\": 30"},
    {0, "\"side\": \"both\"", "\"side\": \"front\""},
    {0, "[0.6, 0.4, 0.2]", "0"},
    {0, "[0.6, 0.4, 0.2]", "[6, 4, 2]"},
    {0, "\"type\": \"cylinder\"", "\"type\": \"cone\""},
    {0, "\"radius\": 0.7", "\"radius\": 0.8"},
    {0, "\"tube\": 0.3", "\"tube\": 0.2"},
    {0, "\"height\": 1.5", "\"height\": 1.4"},
    {0, "[0.3, 0.4, 0.5]", "[0.4, 0.4, 0.5]"},
    {0, "[0.3, 0.4, 0.5]", "[0.3, 0.5, 0.5]"},
    {0, "[0.3, 0.4, 0.5]", "[0.3, 0.4, 0.6]"},
    {0, "[1, 1.1, 1.2]", "[1, 1, 1.2]"},
    {0, "[30, 40, 50]", "[30, 41, 50]"},
    {0, "[0.1, 0.2, 0]", "[0.2, 0.2, 0]"},
    {0, "[0.1, 0.2, 0]", "[0.1, 0.3, 0]"},
    {0, "[0.1, 0.2, 0]", "[0.1, 0.2, 0.3]"},
    {0, "\"radius\": 1.2, \"material\": \"a\"", "\"radius\": 1.2, \"material\": \"b\""},
    {0,
     ", {\"type\": \"box\", \"size\": [0.3, 0.4, 0.5], \"material\": \"b\", \"transform\": "
     "{\"translate\": [0.8, 0.6, 0.2], \"rotate\": [20, 30, 0]}}",
     ""},
    {1, "\"height\": 2.5", "\"height\": 2.4"},
    {1, "[-1, -1, 0,", "[-1, -1.1, 0,"},
    {1, "[0, 0, 1, 0.1,", "[0, 0.1, 1, 0.1,"},
    {1, "[0, 1, 2, 1, 3, 2]", "[0, 1, 3, 1, 3, 2]"},
    {1, "[0, 1, 2, 1, 3, 2]", "[0, 1, 2]"},
    {1, "\"normals\": [0, 0, 1, 0.1, 0, 1, 0, 0.2, 1, 0.5, 0, 1]", "\"normals\": null"},
    {1, "[0, 0, 1], \"intensity\"", "[0, 1, 0], \"intensity\""},
    {1, "[0, 0, 1], \"intensity\"", "[0.01, 0, 1], \"intensity\""},
    {2, "\"maxError\": 0.3", "\"maxError\": 1e-4"},
    {2, "0.3, \"metric\": \"linear\"", "0.3, \"metric\": \"code\""},
};
enum { BUDGET = 2, CHANGES = sizeof changes / sizeof changes[0] };

static char *changed(const char *base, const char *from, const char *to) {
    const char *at = strstr(base, from);
    if (!at) fail_msg("%s is not there", from);
    return text_of("%.*s%s%s", (int)(at - base), base, to, at + strlen(from));
}

static void every_member_makes_a_picture_of_its_own(void **state) {
    (void)state;
    shd_engine *forgets = new_engine_that_keeps(0, 2, NULL);
    size_t wrong = 0;
    for (size_t i = 0; i < CHANGES; i++) {
        const char *base = bases[changes[i].base];
        char *other = changed(base, changes[i].from, changes[i].to);
        shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL);
        file before = png_of(keeps, base), again = png_of(keeps, base),
             after = png_of(keeps, other), wanted = png_of(forgets, other);
        assert_true(same_file(before, again));
        if (!same_file(after, wanted))
            print_error("%s instead of %s: the picture is another's\n", changes[i].to,
                        changes[i].from);
        /* What changes nothing proves nothing; but what a budget leaves out is the plan's choice.
         */
        const bool idle = changes[i].base != BUDGET && same_file(before, wanted);
        if (idle) print_error("%s instead of %s changes nothing\n", changes[i].to, changes[i].from);
        wrong += idle || !same_file(after, wanted);
        free(before.data);
        free(again.data);
        free(after.data);
        free(wanted.data);
        free(other);
        shd_engine_drop(keeps);
    }
    shd_engine_drop(forgets);
    assert_int_equal(wrong, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_member_makes_a_picture_of_its_own)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
