/* Drawings: areas are covered as geometry says, texts are crisp and of any size, and SVG says the
 * same things as pixels do. */
#include "image/draw.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 64 };

static const shd_ink white = {{255, 255, 255}, 1, 1};

typedef struct board {
    shd_arena *arena;
    shd_drawing *drawing;
    unsigned char rgb[SIDE * SIDE * 3];
} board;

static board *new_board(void) {
    board *b = test_calloc(1, sizeof *b);
    b->arena = shd_arena_new(8 << 20);
    b->drawing = shd_drawing_new(b->arena, SIDE, SIDE);
    assert_non_null(b->drawing);
    return b;
}

static void drop_board(board *b) {
    shd_arena_drop(b->arena);
    test_free(b);
}

static void paint(board *b) {
    assert_false(shd_drawing_full(b->drawing));
    assert_true(shd_drawing_paint(b->drawing, 1, SIDE, SIDE, b->rgb, b->arena, NULL));
}

/* The sum of what is covered, in pixels. */
static double area_of(const board *b) {
    double sum = 0;
    for (size_t i = 0; i < SIDE * SIDE; i++) sum += b->rgb[3 * i] / 255.0;
    return sum;
}

/* Coverage of an edge pixel is in steps of 1/255, so that its error is 0.002 of it at most. */
static void a_box_between_pixels_covers_its_area(void **state) {
    (void)state;
    board *b = new_board();
    shd_draw_box(b->drawing, white, 3.25, 5.5, 10.5, 7.25);
    paint(b);
    assert_true(fabs(area_of(b) - 10.5 * 7.25) < 0.002 * 40);
    assert_int_equal(b->rgb[3 * (6 * SIDE + 3)], (int)(0.75 * 255 + 0.5));
    assert_int_equal(b->rgb[3 * (8 * SIDE + 8)], 255);
    assert_int_equal(b->rgb[3 * (8 * SIDE + 20)], 0);
    drop_board(b);
}

/* A line by distance is its area to a few parts in a hundred of its edges. */
static void lines_discs_and_triangles_cover_their_area(void **state) {
    (void)state;
    static const double pi = 3.14159265358979323846;
    for (int i = 0; i < 5; i++) {
        board *b = new_board();
        const shd_point corners[] = {{5, 50}, {57.5, 40.25}, {20, 7}};
        const shd_ink broad = {{255, 255, 255}, 1, 3};
        double wanted = 0;
        if (i == 0) wanted = pi * 20 * 20, shd_draw_disc(b->drawing, white, 31.3, 30.7, 20);
        if (i == 1) wanted = 2 * pi * 20 * 3, shd_draw_circle(b->drawing, broad, 31.3, 30.7, 20);
        if (i == 2)
            wanted = 3 * hypot(40, 31) + pi * 9 / 4,
            shd_draw_segment(b->drawing, broad, 10, 12, 50, 43);
        if (i == 3)
            wanted = 0.5 * fabs(52.5 * (7 - 50) - 15 * (40.25 - 50)),
            shd_draw_polygon(b->drawing, white, corners, 3);
        if (i == 4) wanted = 3 * 3 * pi / 4, shd_draw_line(b->drawing, broad, corners, 1, false);
        paint(b);
        if (fabs(area_of(b) - wanted) > 0.02 * wanted + 0.5)
            fail_msg("mark %d covers %g, not %g", i, area_of(b), wanted);
        drop_board(b);
    }
}

static void a_star_is_filled_by_the_even_odd_rule(void **state) {
    (void)state;
    board *b = new_board();
    shd_point star[5];
    for (int i = 0; i < 5; i++)
        star[i] = (shd_point){32 + 28 * sin(i * 4 * M_PI / 5), 32 - 28 * cos(i * 4 * M_PI / 5)};
    shd_draw_polygon(b->drawing, white, star, 5);
    paint(b);
    assert_int_equal(b->rgb[3 * (32 * SIDE + 32)], 0);
    assert_int_equal(b->rgb[3 * (10 * SIDE + 32)], 255);
    drop_board(b);
}

static void ink_is_blended_by_its_alpha(void **state) {
    (void)state;
    board *b = new_board();
    memset(b->rgb, 100, sizeof b->rgb);
    shd_draw_box(b->drawing, (shd_ink){{200, 100, 0}, 0.5, 1}, 0, 0, SIDE, SIDE);
    paint(b);
    static const int wanted[] = {150, 100, 50};
    for (int c = 0; c < 3; c++) assert_in_range(b->rgb[c], wanted[c] - 1, wanted[c] + 1);
    drop_board(b);
}

/* A stroke of one pixel of a letter lies in one column, whatever the place: full, and nothing
 * beside it. */
static void upright_strokes_are_crisp(void **state) {
    (void)state;
    for (int size = 8; size <= 16; size++) {
        board *b = new_board();
        shd_draw_text(b->drawing, white, 7.3 + size * 0.17, 30.4, size, SHD_ANCHOR_START, "H");
        paint(b);
        int full = 0;
        for (int x = 0; x < SIDE; x++) {
            const int value = b->rgb[3 * (28 * SIDE + x)];
            assert_true(size > 12 || value == 0 || value == 255);
            full += value == 255;
        }
        assert_int_equal(full, 2);
        drop_board(b);
    }
}

static void all_of_ascii_has_its_own_look(void **state) {
    (void)state;
    unsigned char(*looks)[SIDE * SIDE] = test_malloc(95 * sizeof *looks);
    for (int c = 32; c < 127; c++) {
        const char text[2] = {(char)c, 0};
        board *b = new_board();
        shd_draw_text(b->drawing, white, 10, 48, 48, SHD_ANCHOR_START, text);
        paint(b);
        for (size_t i = 0; i < SIDE * SIDE; i++) looks[c - 32][i] = b->rgb[3 * i];
        assert_true(c == 32 || area_of(b) > 10);
        for (int other = 32; other < c; other++) /* O is a zero */
            if (memcmp(looks[c - 32], looks[other - 32], sizeof *looks) == 0 && c != 'O')
                fail_msg("%c and %c look the same", c, other);
        drop_board(b);
    }
    test_free(looks);
}

static void texts_are_as_wide_as_they_say(void **state) {
    (void)state;
    static const double sizes[] = {8, 9.5, 11, 14, 20};
    for (size_t s = 0; s < 5; s++) {
        board *b = new_board();
        const char *text = "Hm4";
        shd_draw_text(b->drawing, white, SIDE - 4, 30, sizes[s], SHD_ANCHOR_END, text);
        paint(b);
        int first = SIDE, last = -1;
        for (int i = 0; i < SIDE * SIDE; i++)
            if (b->rgb[3 * i] > 127) {
                first = i % SIDE < first ? i % SIDE : first;
                last = i % SIDE > last ? i % SIDE : last;
            }
        assert_in_range(last, SIDE - 6, SIDE - 3);
        assert_true(fabs(last + 1 - first - shd_text_width(text, sizes[s])) <= 1.5);
        drop_board(b);
    }
}

static void painting_twice_as_large_doubles_it(void **state) {
    (void)state;
    board *b = new_board();
    shd_draw_disc(b->drawing, white, 16, 16, 8);
    assert_true(shd_drawing_paint(b->drawing, 2, SIDE, SIDE, b->rgb, b->arena, NULL));
    assert_true(fabs(area_of(b) - M_PI * 256) < 4);
    drop_board(b);
}

static void what_lies_outside_is_left_out(void **state) {
    (void)state;
    board *b = new_board();
    shd_draw_segment(b->drawing, white, -900, -800, -5, -3);
    shd_draw_box(b->drawing, white, 100, 100, 1e5, 1e5);
    shd_draw_circle(b->drawing, white, 500, 30, 20);
    shd_draw_text(b->drawing, white, -300, 30, 12, SHD_ANCHOR_START, "off");
    paint(b);
    assert_true(area_of(b) == 0);
    shd_draw_box(b->drawing, white, -1000, -1000, 5000, 5000);
    paint(b);
    assert_true(area_of(b) == SIDE * SIDE);
    drop_board(b);
}

static void svg_has_the_same_list(void **state) {
    (void)state;
    board *b = new_board();
    shd_draw_segment(b->drawing, (shd_ink){{255, 128, 0}, 0.5, 1.5}, 1, 2.25, 3, -4.126);
    shd_draw_box(b->drawing, white, 0, 0, 2, 3);
    shd_draw_circle(b->drawing, white, 5, 6, 7);
    shd_draw_disc(b->drawing, white, 5, 6, 7.5);
    shd_draw_text(b->drawing, white, 8, 9, 10, SHD_ANCHOR_MIDDLE, "a < b & c");
    shd_draw_text_upward(b->drawing, white, 8, 9, 10, SHD_ANCHOR_END, "up");
    size_t length;
    const char *svg = shd_drawing_svg(b->drawing, "A <title>", b->arena, &length);
    assert_int_equal(length, strlen(svg));
    assert_string_equal(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"64\" height=\"64\" "
        "viewBox=\"0 0 64 64\" font-family=\"sans-serif\" fill-rule=\"evenodd\" "
        "stroke-linecap=\"round\" stroke-linejoin=\"round\">\n<title>A &lt;title&gt;</title>\n"
        "<polyline points=\"1,2.25 3,-4.13\" fill=\"none\" stroke=\"#ff8000\" "
        "stroke-opacity=\"0.5\" stroke-width=\"1.5\"/>\n"
        "<polygon points=\"0,0 2,0 2,3 0,3\" fill=\"#ffffff\"/>\n"
        "<circle cx=\"5\" cy=\"6\" r=\"7\" fill=\"none\" stroke=\"#ffffff\" "
        "stroke-width=\"1\"/>\n"
        "<circle cx=\"5\" cy=\"6\" r=\"7.5\" fill=\"#ffffff\"/>\n"
        "<text x=\"8\" y=\"9\" font-size=\"10\" text-anchor=\"middle\" fill=\"#ffffff\">a &lt; b "
        "&amp; c</text>\n"
        "<text transform=\"translate(8,9) rotate(-90)\" font-size=\"10\" text-anchor=\"end\" "
        "fill=\"#ffffff\">up</text>\n</svg>\n");
    drop_board(b);
}

static void a_full_arena_is_told(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 16);
    shd_drawing *drawing = shd_drawing_new(arena, 10, 10);
    for (int i = 0; i < 2000; i++) shd_draw_segment(drawing, white, 0, 0, 1, 1);
    assert_true(shd_drawing_full(drawing));
    shd_arena_drop(arena);
}

static void a_cancelled_painting_ends(void **state) {
    (void)state;
    board *b = new_board();
    const atomic_bool cancelled = true;
    shd_draw_box(b->drawing, white, 0, 0, SIDE, SIDE);
    assert_false(shd_drawing_paint(b->drawing, 1, SIDE, SIDE, b->rgb, b->arena, &cancelled));
    assert_true(area_of(b) == 0);
    drop_board(b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_between_pixels_covers_its_area),
        cmocka_unit_test(lines_discs_and_triangles_cover_their_area),
        cmocka_unit_test(a_star_is_filled_by_the_even_odd_rule),
        cmocka_unit_test(ink_is_blended_by_its_alpha),
        cmocka_unit_test(upright_strokes_are_crisp),
        cmocka_unit_test(all_of_ascii_has_its_own_look),
        cmocka_unit_test(texts_are_as_wide_as_they_say),
        cmocka_unit_test(painting_twice_as_large_doubles_it),
        cmocka_unit_test(what_lies_outside_is_left_out),
        cmocka_unit_test(svg_has_the_same_list),
        cmocka_unit_test(a_full_arena_is_told),
        cmocka_unit_test(a_cancelled_painting_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
