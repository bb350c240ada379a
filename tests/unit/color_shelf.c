/* What is kept of transforms: what it takes is counted, has an end, and gives way. */
#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "color/color.h"
#include "sanitized.h"

enum { KB = 1024, MB = 1024 * KB };

static const char hdr[] = "ACES 1.1 - HDR Video (1000 nits & Rec.2020 lim)";

static shd_color_config *load(shd_budget *budget) {
    shd_color_config *config;
    assert_int_equal(shd_color_config_load(NULL, &config, NULL), SHD_OK);
    assert_int_equal(shd_color_config_join(config, budget, NULL, NULL), SHD_OK);
    return config;
}

static uint64_t used(shd_budget *budget) {
    return shd_budget_load_of(budget).used;
}

static shd_status ask(shd_color_config *config, const char *display, const char *view,
                      double exposure, shd_color_lease **lease) {
    const shd_color_transform *made;
    const shd_adjust adjust = {.exposure = exposure, .gamma = 1};
    return exposure != 0
               ? shd_color_adjusted(config, "lin_rec709", NULL, display, view, &adjust, lease,
                                    &made, NULL)
               : shd_color_to_view(config, "lin_rec709", display, view, lease, &made, NULL);
}

/* Asks for a view at many exposures, each of a client who leaves. */
static void ask_for_many(shd_color_config *config, int first, int count) {
    for (int i = first; i < first + count; i++) {
        shd_color_lease *lease = NULL;
        assert_int_equal(ask(config, "Rec.2100-PQ", hdr, (i + 1) / 1000.0, &lease), SHD_OK);
        shd_color_lease_drop(lease);
    }
}

static size_t allocated(void) {
    const struct mallinfo2 all = mallinfo2();
    return all.uordblks + all.hblkhd;
}

/* Asks for all views, with and without an exposure, and holds them. */
static void hold_all(shd_color_config *config, double exposure, shd_color_lease **lease) {
    const shd_catalog *catalog = shd_color_catalog(config);
    for (size_t i = 0; i < catalog->display_count; i++)
        for (size_t j = 0; j < catalog->displays[i].view_count; j++)
            if (catalog->displays[i].holds[j] != SHD_HOLDS_DATA || exposure == 0)
                assert_int_equal(ask(config, catalog->displays[i].name,
                                     catalog->displays[i].views[j], exposure, lease),
                                 SHD_OK);
}

static void no_less_is_counted_than_malloc_gives(void **state) {
    (void)state;
    if (SHD_SANITIZED) skip();
    shd_budget *budget = shd_budget_new((uint64_t)1 << 30);
    shd_color_config *config = load(budget);
    shd_color_lease *lease = NULL;
    hold_all(config, 0, &lease); /* and what the first ones make once */
    hold_all(config, 0.5, &lease);
    const size_t before = allocated(), counted = used(budget);
    hold_all(config, 0.25, &lease);
    const size_t more = allocated() - before, told = used(budget) - counted;
    print_message("%zu KB are %zu\n", told / KB, more / KB);
    assert_true(told >= more && told < 2 * more);
    shd_color_lease_drop(lease);
    shd_color_config_drop(config);
    assert_int_equal(used(budget), 0);
    shd_budget_drop(budget);
}

static void what_nobody_holds_has_an_end(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(128 * MB); /* of which 8 may be kept */
    shd_color_config *config = load(budget);
    ask_for_many(config, 0, 8);
    const uint64_t kept = used(budget);
    assert_true(kept > MB && kept <= 8 * MB);
    ask_for_many(config, 7, 1); /* is there */
    assert_int_equal(used(budget), kept);
    ask_for_many(config, 8, 8);
    assert_true(used(budget) <= 8 * MB);
    if (!SHD_SANITIZED) {
        const size_t before = allocated();
        ask_for_many(config, 16, 24);
        assert_true(allocated() < before + MB);
    }
    assert_true(shd_color_trim(config, 1) > 0);
    assert_true(used(budget) > 0);
    shd_color_trim(config, SIZE_MAX);
    assert_int_equal(used(budget), 0);
    shd_color_config_drop(config);
    shd_budget_drop(budget);
}

static void what_is_held_stays_and_is_refused_without_room(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(8 * MB);
    shd_color_config *config = load(budget);
    shd_color_lease *lease = NULL;
    int held = 0;
    while (ask(config, "Rec.2100-PQ", hdr, (held + 1) / 1000.0, &lease) == SHD_OK) held++;
    assert_in_range(held, 2, 16);
    assert_int_equal(shd_color_trim(config, SIZE_MAX), 0);
    assert_true(used(budget) > 0 && used(budget) <= 8 * MB);
    const shd_color_transform *made;
    shd_error error;
    const shd_adjust adjust = {.exposure = -1, .gamma = 1};
    assert_int_equal(shd_color_adjusted(config, "lin_rec709", NULL, "Rec.2100-PQ", hdr, &adjust,
                                        &lease, &made, &error),
                     SHD_CROWDED);
    assert_non_null(strstr(error.text, "`memory`"));
    shd_color_lease_drop(lease);
    assert_true(used(budget) <= MB);
    shd_color_config_drop(config);
    assert_int_equal(used(budget), 0);
    shd_budget_drop(budget);
}

static void tables_of_codes_count(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(128 * MB);
    shd_color_config *config = load(budget);
    shd_color_lease *lease = NULL;
    const shd_color_transform *made;
    assert_int_equal(
        shd_color_to_view(config, "lin_rec709", "sRGB", "Standard", &lease, &made, NULL), SHD_OK);
    const uint64_t before = used(budget);
    assert_non_null(shd_color_codes_of(made, 65535, SIZE_MAX, NULL, NULL));
    assert_true(used(budget) > before + sizeof(float) * 65536);
    shd_color_lease_drop(lease);
    shd_color_config_drop(config);
    assert_int_equal(used(budget), 0);
    shd_budget_drop(budget);
}

/* After a reload: what the first one's transforms took is on the same shelf. */
static void a_second_configuration_shares_the_shelf(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(128 * MB);
    shd_color_config *first = load(budget), *second;
    ask_for_many(first, 0, 2);
    const uint64_t firsts = used(budget);
    assert_int_equal(shd_color_config_load(NULL, &second, NULL), SHD_OK);
    assert_int_equal(shd_color_config_join(second, budget, first, NULL), SHD_OK);
    ask_for_many(second, 0, 2);
    assert_true(used(budget) > firsts);
    shd_color_config_drop(second);
    assert_int_equal(used(budget), firsts);
    shd_color_trim(first, SIZE_MAX);
    assert_int_equal(used(budget), 0);
    shd_color_config_drop(first);
    shd_budget_drop(budget);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_less_is_counted_than_malloc_gives),
        cmocka_unit_test(what_nobody_holds_has_an_end),
        cmocka_unit_test(what_is_held_stays_and_is_refused_without_room),
        cmocka_unit_test(tables_of_codes_count),
        cmocka_unit_test(a_second_configuration_shares_the_shelf),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
