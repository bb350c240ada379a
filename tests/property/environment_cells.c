/* Light of environments that cells of the picture's grid share: it is within its share, knows no
 * regions, and saves walks. */
#include <stdatomic.h>

#include "property/put_picture.h"
#include "shade/around_quick.h"

/* A ball near by, whose facets environments light by cells of the picture. */
static drawn draw_facets(shd_engine *engine, const char *image, const char *tier) {
    char *json = text_of(
        "{\"image\": {%s}, \"accuracy\": {\"tier\": \"%s\"}, \"camera\": {\"position\": [0.3, 0.5, "
        "3], \"fov\": 14}, \"lights\": [{\"type\": \"environment\", \"map\": \"studio\"}], "
        "\"objects\": [{\"type\": \"sphere\", \"material\": {\"model\": \"cook-torrance\", "
        "\"diffuse\": 0, \"lobes\": [{\"roughness\": 0.4, \"weight\": 1}], \"fresnel\": {\"f0\": "
        "[0.9, 0.7, 0.4]}}}, {\"type\": \"box\", \"transform\": {\"scale\": 0.1, \"translate\": "
        "[0.1, 0.15, 1.2]}, \"material\": {\"model\": \"oren-nayar\", \"sigma\": 30}}]}",
        image, tier);
    drawn d = shown_film_of(engine, json);
    free(json);
    return d;
}

/* What cells of the picture's grid tell is of themselves: a region is the crop of the whole. */
static void cells_do_not_know_regions(void **state) {
    enum { WIDE = 64, HIGH = 48, LEFT = 13, TOP = 27, ACROSS = 39, DOWN = 11 };
    for (int samples = 1; samples <= 4; samples += 3) {
        char *image =
                 text_of("\"width\": %d, \"height\": %d, \"samples\": %d", WIDE, HIGH, samples),
             *cut = text_of("%s, \"region\": [%d, %d, %d, %d]", image, LEFT, TOP, ACROSS, DOWN);
        drawn all = draw_facets(*state, image, "standard"),
              part = draw_facets(*state, cut, "standard");
        for (size_t y = 0; y < DOWN; y++)
            assert_memory_equal(part.film.rgba + 4 * ACROSS * y,
                                all.film.rgba + 4 * (WIDE * (TOP + y) + LEFT),
                                4 * ACROSS * sizeof(float));
        drop_drawn(&part);
        drop_drawn(&all);
        free(cut);
        free(image);
    }
}

/* The exact tier walks for each point, and is off 1e-4 of the most. */
static double off_of_the_share(const drawn *exact, const drawn *quick) {
    double most = 0, worst = 0;
    for (size_t i = 0; i < 4 * pixels_of(exact); i++)
        if (i % 4 < 3) most = fmax(most, (double)exact->film.rgba[i]);
    for (size_t i = 0; i < 4 * pixels_of(exact); i++) {
        const double is = (double)exact->film.rgba[i], off = fabs((double)quick->film.rgba[i] - is);
        worst = fmax(worst, off / (SHD_QUICK_SHARE * is + SHD_AROUND_TOLERANCE * most + 1e-9));
    }
    print_message("cells: %.2f of what is allowed\n", worst);
    return worst;
}

static void cells_are_within_the_share(void **state) {
    static const char image[] = "\"width\": 28, \"height\": 20, \"samples\": 1";
    drawn exact = draw_facets(*state, image, "exact"),
          quick = draw_facets(*state, image, "standard");
    const double worst = off_of_the_share(&exact, &quick);
    assert_true(worst > 0 && worst <= 1);
    drop_drawn(&quick);
    drop_drawn(&exact);
}

static atomic_size_t walks;

void __real_shd_around_sum_quickly(const shd_surroundings *map, const shd_moments *moments,
                                   const shd_around_lobe *lobe, const shd_around_function *f,
                                   double share, double floor, double (*out)[SHD_WAY_SUMS]);
void __wrap_shd_around_sum_quickly(const shd_surroundings *map, const shd_moments *moments,
                                   const shd_around_lobe *lobe, const shd_around_function *f,
                                   double share, double floor, double (*out)[SHD_WAY_SUMS]);

void __wrap_shd_around_sum_quickly(const shd_surroundings *map, const shd_moments *moments,
                                   const shd_around_lobe *lobe, const shd_around_function *f,
                                   double share, double floor, double (*out)[SHD_WAY_SUMS]) {
    walks++;
    __real_shd_around_sum_quickly(map, moments, lobe, f, share, floor, out);
}

/* Or else each sample would be walked for. */
static void cells_share_walks(void **state) {
    walks = 0;
    drawn d = draw_facets(*state, "\"width\": 96, \"height\": 96, \"samples\": 1", "standard");
    size_t seen = 0;
    for (size_t i = 0; i < pixels_of(&d); i++) seen += d.film.rgba[4 * i + 3] > 0;
    print_message("cells: %zu walks for %zu samples\n", (size_t)walks, seen);
    assert_true(seen > 3000 && walks > 0 && walks < seen / 2);
    drop_drawn(&d);
}

/* Two lamps in a dim map behind the eye, so many texels to its left and right. */
static put_name put_lamps(shd_engine *engine, int aside) {
    enum { WIDE = 128, HIGH = 64, DIM = 29 };
    static uint8_t texels[HIGH][WIDE][4];
    memset(texels, DIM, sizeof texels);
    for (int row = HIGH / 2 - 1; row <= HIGH / 2; row++) {
        memset(texels[row][aside], 255, 4);
        memset(texels[row][WIDE - 1 - aside], 255, 4);
    }
    for (int k = 0; k < WIDE * HIGH; k++) texels[k / WIDE][k % WIDE][3] = 255;
    return put_picture(engine, WIDE, HIGH, &texels[0][0][0]);
}

/* Five lamps for which what a cell's polynomial leaves out is nothing along the cell's middle,
 * where it changes its sign, and 2 percent at an edge. */
static put_name put_five_lamps(shd_engine *engine) {
    enum { WIDE = 256, HIGH = 128, DIM = 3 };
    static const int lamps[][3] = {
        {57, 28, 132}, {62, 23, 21}, {60, 3, 255}, {71, 31, 46}, {88, 15, 144}};
    static uint8_t texels[HIGH][WIDE][4];
    memset(texels, DIM, sizeof texels);
    for (size_t k = 0; k < sizeof lamps / sizeof *lamps; k++)
        memset(texels[lamps[k][0]][lamps[k][1]], lamps[k][2], 4);
    for (int k = 0; k < WIDE * HIGH; k++) texels[k / WIDE][k % WIDE][3] = 255;
    return put_picture(engine, WIDE, HIGH, &texels[0][0][0]);
}

/* What a cell's polynomial leaves out has one sign between two lamps, and the other one above and
 * below: there is nothing of it in the cell's middle. Around one lamp, the nodes of the smallest
 * cells see nothing of it, nor does the middle, which is a node of theirs. */
static void cells_see_what_is_between_nodes(void **state) {
    static const struct {
        int aside;
        const char *image;
        double shininess;
    } cases[] = {
        {3,
         "\"width\": 32, \"height\": 32, \"samples\": 1, \"region\": [14, 4, 4, 2]}, "
         "\"camera\": {\"height\": 0.274, \"type\": \"orthographic\"",
         30},
        {0,
         "\"width\": 4, \"height\": 4, \"samples\": 4}, \"camera\": {\"height\": 0.255, \"type\": "
         "\"orthographic\"",
         30},
        {-1,
         "\"width\": 256, \"height\": 256, \"samples\": 1, \"region\": [88, 128, 8, 3]}, "
         "\"camera\": {\"fov\": 31.253840524268963, \"position\": [0, 0, 4.1348708]",
         22.8517613},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const put_name lamps =
            cases[k].aside < 0 ? put_five_lamps(*state) : put_lamps(*state, cases[k].aside);
        drawn d[2];
        for (int exact = 0; exact < 2; exact++) {
            char *json = text_of(
                "{\"image\": {%s}, \"accuracy\": {\"tier\": \"%s\"}, "
                "\"lights\": [{\"type\": \"environment\", \"map\": \"%s\"}], \"objects\": "
                "[{\"type\": \"sphere\", \"material\": {\"model\": \"phong-normalized\", "
                "\"diffuse\": 0, \"specular\": 1, \"shininess\": %.17g}}]}",
                cases[k].image, exact ? "exact" : "standard", lamps.text, cases[k].shininess);
            d[exact] = shown_film_of(*state, json);
            free(json);
        }
        assert_true(off_of_the_share(&d[1], &d[0]) <= 1);
        drop_drawn(&d[1]);
        drop_drawn(&d[0]);
    }
}
int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_do_not_know_regions),
        cmocka_unit_test(cells_are_within_the_share),
        cmocka_unit_test(cells_share_walks),
        cmocka_unit_test(cells_see_what_is_between_nodes),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
