/* What of files is told before they are decoded: each that ends early, at whatever byte. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <libdeflate.h>

#include "decode/decode.h"

typedef struct file {
    unsigned char bytes[8192];
    size_t size;
    bool high_first;
} file;

static void put(file *f, uint64_t value, unsigned width) {
    for (unsigned i = 0; i < width; i++)
        f->bytes[f->size++] = (unsigned char)(value >> 8 * (f->high_first ? width - 1 - i : i));
}

static void put_text(file *f, const char *text) {
    memcpy(f->bytes + f->size, text, strlen(text));
    f->size += strlen(text);
}

/* Bytes are of the exact size, so that AddressSanitizer sees every one that is read past the end.
 */
static shd_status walk(const file *f, size_t size, shd_error *error) {
    unsigned char *copy = malloc(size);
    memcpy(copy, f->bytes, size);
    const shd_status status =
        shd_decode_walk(shd_format_sniff(f->bytes, f->size), copy, size, error);
    free(copy);
    return status;
}

/* The whole file may be well; no shorter one, of `least` bytes or more, is. */
static void ends_nowhere_else(const file *f, size_t least) {
    shd_error error;
    if (walk(f, f->size, &error) != SHD_OK) fail_msg("the whole one: %s", error.text);
    for (size_t size = least; size < f->size; size++) {
        if (walk(f, size, &error) != SHD_SCENE) fail_msg("%zu of %zu bytes", size, f->size);
        assert_non_null(strstr(error.text, "ends early"));
    }
}

/* ---- TIFF ---- */

typedef struct tiff_kind {
    bool high_first, big;
    unsigned packing, strips;
    unsigned type;  /* of lists: 3 is of 16 bits, 4 of 32, 16 of 64 */
    unsigned color; /* what samples are; of one strip */
} tiff_kind;

static void put_entry(file *f, const tiff_kind *kind, unsigned tag, unsigned type, uint64_t count,
                      uint64_t value) {
    const unsigned word = kind->big ? 8 : 4, width = type == 3 ? 2 : type == 4 ? 4 : 8;
    put(f, tag, 2);
    put(f, type, 2);
    put(f, count, word);
    const unsigned own = count * width > word ? word : width;
    put(f, value, own);
    put(f, 0, word - own);
}

/* A head, a directory, two lists if there are several strips, and strips of 20 bytes. */
static file make_tiff(const tiff_kind *kind) {
    enum { STRIP = 20, MOST = 9 };
    const bool is_one = kind->strips == 1;
    const unsigned entries = is_one ? MOST : 3, entry = kind->big ? 20 : 12;
    file f = {.high_first = kind->high_first};
    const unsigned word = kind->big ? 8 : 4, width = kind->type == 3 ? 2 : kind->type == 4 ? 4 : 8;
    put_text(&f, kind->high_first ? "MM" : "II");
    put(&f, kind->big ? 43 : 42, 2);
    if (kind->big) put(&f, 8, 4);
    const size_t start = f.size + word,
                 lists = start + (kind->big ? 8 : 2) + entries * entry + word;
    const bool has_lists = kind->strips * width > word;
    const size_t strips = lists + (has_lists ? 2 * kind->strips * width : 0);
    put(&f, start, word);
    put(&f, entries, kind->big ? 8 : 2);
    if (is_one) { /* of 5 x 2 pixels of two bytes */
        put_entry(&f, kind, 256, 4, 1, 5);
        put_entry(&f, kind, 257, 3, 1, 2);
        put_entry(&f, kind, 258, 3, 2, 8);
        put_entry(&f, kind, 262, 3, 1, kind->color);
        put_entry(&f, kind, 277, 3, 1, 2);
        put_entry(&f, kind, 284, 3, 1, 1);
    }
    put_entry(&f, kind, 259, 3, 1, kind->packing);
    put_entry(&f, kind, 273, kind->type, kind->strips, has_lists ? lists : strips);
    put_entry(&f, kind, 279, kind->type, kind->strips,
              has_lists ? lists + kind->strips * width : STRIP);
    put(&f, 0, word);
    for (unsigned i = 0; has_lists && i < kind->strips; i++) put(&f, strips + i * STRIP, width);
    for (unsigned i = 0; has_lists && i < kind->strips; i++) put(&f, STRIP, width);
    for (unsigned i = 0; i < kind->strips * STRIP; i++) put(&f, i, 1);
    return f;
}

static void a_tiff_has_what_it_says(void **state) {
    (void)state;
    static const tiff_kind kinds[] = {
        {false, false, 8, 5, 4, 2}, {true, false, 8, 5, 4, 2}, {false, false, 1, 3, 3, 2},
        {false, true, 8, 5, 16, 2}, {true, true, 5, 4, 4, 2},  {false, false, 8, 1, 4, 2},
        {true, true, 8, 1, 16, 2},  {true, false, 8, 1, 3, 2},
    };
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        const file f = make_tiff(&kinds[i]);
        ends_nowhere_else(&f, 8);
    }
    /* Of what is not packed the pixels tell how long it is. */
    static const tiff_kind plain[] = {
        {false, false, 1, 1, 4, 1}, {false, true, 1, 1, 16, 2}, {false, false, 1, 1, 3, 2}};
    for (size_t i = 0; i < sizeof plain / sizeof *plain; i++) {
        const file f = make_tiff(&plain[i]);
        ends_nowhere_else(&f, 8);
    }
    const file subsampled = make_tiff(&(tiff_kind){false, false, 1, 1, 4, 6});
    shd_error error;
    assert_int_equal(walk(&subsampled, subsampled.size - 1, &error), SHD_OK);
}

static shd_status check(const file *f, shd_decode_check_fn *look, size_t size, shd_error *error) {
    unsigned char *copy = malloc(size);
    memcpy(copy, f->bytes, size);
    const shd_status status = look(copy, size, error);
    free(copy);
    return status;
}

/* Of how many bytes from `first` on a bit may be another one. */
static size_t count_untold(const file *whole, shd_decode_check_fn *look, size_t first) {
    size_t untold = 0;
    for (size_t at = first; at < whole->size; at++) {
        file f = *whole;
        shd_error error;
        f.bytes[at] ^= 0x10;
        untold += check(&f, look, f.size, &error) == SHD_OK;
    }
    return untold;
}

static void packed_rows_of_a_tiff_are_looked_at(void **state) {
    (void)state;
    file f = make_tiff(&(tiff_kind){true, false, 8, 1, 4, 2});
    shd_error error;
    assert_int_equal(check(&f, shd_decode_check_tiff, f.size, &error), SHD_SCENE);
    /* 20 zeros by zlib, which the strip has room for. */
    static const unsigned char packed[] = {0x78, 0xda, 0x63, 0x60, 0xc0, 0x04,
                                           0x00, 0x00, 0x14, 0x00, 0x01};
    const size_t first = f.size - 20;
    memcpy(f.bytes + first, packed, sizeof packed);
    assert_int_equal(check(&f, shd_decode_check_tiff, f.size, &error), SHD_OK);
    assert_in_range(count_untold(&f, shd_decode_check_tiff, first), 0, 20 - sizeof packed + 3);
    for (size_t size = 8; size < f.size; size++) /* for the walk to tell */
        check(&f, shd_decode_check_tiff, size, &error);
    /* 1000 zeros are more than the strip has room for, but whole; then the sum is another one. */
    static const unsigned char longer[] = {0x78, 0xda, 0x63, 0x60, 0x18, 0x05, 0xa3, 0x60, 0x14,
                                           0x0c, 0x77, 0x00, 0x00, 0x03, 0xe8, 0x00, 0x01};
    memcpy(f.bytes + first, longer, sizeof longer);
    assert_int_equal(check(&f, shd_decode_check_tiff, f.size, &error), SHD_OK);
    f.bytes[first + sizeof longer - 1] ^= 1;
    assert_int_equal(check(&f, shd_decode_check_tiff, f.size, &error), SHD_SCENE);
}

enum { SHARED = 200 }; /* strips, of which each but one is where the first is */

/* Of rows of 20 zeros, each a strip: one more is listed that is no row of the picture. `bad` is
 * where nothing unpacks; `more` is behind all. */
static file make_shared(size_t bad, size_t more) {
    static const unsigned char packed[] = {0x78, 0xda, 0x63, 0x60, 0xc0, 0x04,
                                           0x00, 0x00, 0x14, 0x00, 0x01};
    enum { ENTRIES = 7, LISTED = SHARED + 1, LISTS = 8 + 2 + 12 * ENTRIES + 4 };
    const size_t first = LISTS + 8 * LISTED;
    const tiff_kind kind = {.packing = 8};
    file f = {.size = 0};
    put_text(&f, "II");
    put(&f, 42, 2);
    put(&f, 8, 4);
    put(&f, ENTRIES, 2);
    put_entry(&f, &kind, 256, 4, 1, 20);
    put_entry(&f, &kind, 257, 4, 1, SHARED);
    put_entry(&f, &kind, 258, 3, 1, 8);
    put_entry(&f, &kind, 259, 3, 1, kind.packing);
    put_entry(&f, &kind, 278, 4, 1, 1);
    put_entry(&f, &kind, 273, 4, LISTED, LISTS);
    put_entry(&f, &kind, 279, 4, LISTED, LISTS + 4 * LISTED);
    put(&f, 0, 4);
    for (size_t i = 0; i < LISTED; i++) put(&f, i == bad ? first + 1 : first, 4);
    for (size_t i = 0; i < LISTED; i++) put(&f, sizeof packed, 4);
    memcpy(f.bytes + f.size, packed, sizeof packed);
    f.size += sizeof packed + 1 + more;
    return f;
}

/* What a small file lists cannot make the look long, however often one strip is named. */
static void a_tiff_is_read_once(void **state) {
    (void)state;
    shd_error error;
    for (size_t bad = 0; bad <= SHARED; bad++) {
        const file small = make_shared(bad, 0), large = make_shared(bad, 20 * SHARED);
        assert_int_equal(check(&large, shd_decode_check_tiff, large.size, &error),
                         bad < SHARED ? SHD_SCENE : SHD_OK);
        assert_int_equal(check(&small, shd_decode_check_tiff, small.size, &error),
                         11 * (bad + 1) <= small.size && bad < SHARED ? SHD_SCENE : SHD_OK);
    }
    const file small = make_shared(0, 0);
    assert_in_range(small.size, 11, 11 * SHARED);
}

static void tiles_are_no_larger_than_a_picture_has_use_for(void **state) {
    (void)state;
    static const struct {
        unsigned wide, high, tile_wide, tile_high;
        shd_status is;
    } cases[] = {{1, 1, 4096, 4096, SHD_OK},
                 {8192, 16, 16, 1 << 22, SHD_SCENE},
                 {20000, 1, 256, 256, SHD_OK},
                 {8192, 8192, 256, 256, SHD_OK},
                 {3, 3, 1U << 31, 1U << 31, SHD_SCENE},
                 {3, 3, 0, 0, SHD_OK}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const tiff_kind kind = {.packing = 5};
        file f = {.size = 0};
        shd_error error;
        put_text(&f, "II");
        put(&f, 42, 2);
        put(&f, 8, 4);
        put(&f, 6, 2);
        put_entry(&f, &kind, 256, 4, 1, cases[i].wide);
        put_entry(&f, &kind, 257, 4, 1, cases[i].high);
        put_entry(&f, &kind, 259, 3, 1, kind.packing);
        put_entry(&f, &kind, 322, 4, 1, cases[i].tile_wide);
        put_entry(&f, &kind, 323, 4, 1, cases[i].tile_high);
        put_entry(&f, &kind, 324, 4, 1, 8);
        put(&f, 0, 4);
        assert_int_equal(check(&f, shd_decode_check_tiff, f.size, &error), cases[i].is);
    }
}

/* ---- HDR ---- */

static file make_hdr(const char *size, bool is_packed) {
    file f = {.size = 0};
    put_text(&f, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n");
    put_text(&f, size);
    for (int y = 0; y < 3; y++) {
        if (is_packed) put(&f, 0x0a000202, 4); /* 10 of them */
        for (int c = 0; is_packed && c < 4; c++) {
            put(&f, 128 + 6, 1);
            put(&f, 7, 1);
            put(&f, 4, 1);
            put(&f, 0, 4);
        }
        for (int x = 0; !is_packed && x < 10; x++) put(&f, 0x80402010, 4);
    }
    return f;
}

static void an_hdr_has_its_rows(void **state) {
    (void)state;
    shd_error error;
    for (int is_packed = 0; is_packed < 2; is_packed++) {
        const file f = make_hdr("-Y 3 +X 10\n", is_packed);
        ends_nowhere_else(&f, sizeof "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 10\n" - 1);
    }
    const file more = make_hdr("+Y 100000 +X 10\n", true);
    assert_int_equal(walk(&more, more.size, &error), SHD_SCENE);
    file damaged = make_hdr("-Y 3 +X 10\n", true);
    damaged.bytes[damaged.size - 5] = 9; /* more than there are left in the row */
    assert_int_equal(walk(&damaged, damaged.size, &error), SHD_SCENE);
    assert_non_null(strstr(error.text, "row"));
    /* Rows that take no bytes would be walked along for ever. */
    const file empty = make_hdr("-Y 18446744073709551615 +X 0\n", false);
    assert_int_equal(walk(&empty, empty.size, &error), SHD_OK);
    const file turned = make_hdr("+X 10 -Y 3\n", false);
    assert_int_equal(walk(&turned, turned.size - 9, &error), SHD_OK);
}

/* ---- JPEG ---- */

static file make_jpeg(int scans) {
    file f = {.high_first = true};
    put(&f, 0xffd8, 2);
    put(&f, 0xffe0, 2);
    put(&f, 6, 2);
    put(&f, 0xffd9ffda, 4); /* what a segment has is no marker */
    for (int i = 0; i < scans; i++) {
        put(&f, 0xffffda, 3);
        put(&f, 4, 2);
        put(&f, 0x0102, 2);
        put(&f, 0x33ff00ffd7ff0044, 8); /* stuffing, and a restart */
        put(&f, 0xffc40003, 4);
        put(&f, 0x55, 1);
    }
    put(&f, 0xffd9, 2);
    return f;
}

static void a_jpeg_has_an_end_and_few_scans(void **state) {
    (void)state;
    shd_error error;
    const file most = make_jpeg(64), more = make_jpeg(65);
    ends_nowhere_else(&most, 100);
    assert_int_equal(walk(&more, more.size, &error), SHD_SCENE);
    assert_non_null(strstr(error.text, "scans"));
}

/* ---- OpenEXR ---- */

enum { WIDE = 40, HIGH = 37, ROWS = 16, BLOCKS = 3 };

static void put_attribute(file *f, const char *name, const char *type, size_t length) {
    put_text(f, name);
    put(f, 0, 1);
    put_text(f, type);
    put(f, 0, 1);
    put(f, length, 4);
}

/* Of one channel of floats, whose blocks are ZIP. `table` is where that is. */
static file make_exr(size_t *table) {
    file f = {.size = 0};
    put(&f, 20000630, 4);
    put(&f, 2, 4);
    put_attribute(&f, "channels", "chlist", 19);
    put_text(&f, "R");
    put(&f, 0, 1);
    put(&f, 2, 4);
    put(&f, 0, 4);
    put(&f, 1, 4);
    put(&f, 1, 4);
    put(&f, 0, 1);
    put_attribute(&f, "compression", "compression", 1);
    put(&f, 3, 1);
    put_attribute(&f, "dataWindow", "box2i", 16);
    put(&f, 0xfffffffe, 4); /* from -2, -5 on */
    put(&f, 0xfffffffb, 4);
    put(&f, WIDE - 3, 4);
    put(&f, HIGH - 6, 4);
    put(&f, 0, 1);
    *table = f.size;
    f.size += 8 * BLOCKS;
    struct libdeflate_compressor *packer = libdeflate_alloc_compressor(6);
    for (size_t i = 0; i < BLOCKS; i++) {
        unsigned char rows[4 * WIDE * ROWS];
        for (size_t k = 0; k < sizeof rows; k++) rows[k] = (unsigned char)(k * k / 64 % 5);
        const size_t size = 4 * WIDE * (i + 1 < BLOCKS ? ROWS : HIGH - ROWS * (BLOCKS - 1)),
                     start = f.size,
                     length = libdeflate_zlib_compress(packer, rows, size, f.bytes + start + 8,
                                                       sizeof f.bytes - start - 8);
        assert_in_range(length, 1, size - 1);
        f.size = *table + 8 * i;
        put(&f, start, 8);
        f.size = start;
        put(&f, (uint32_t)((int)(ROWS * i) - 5), 4);
        put(&f, length, 4);
        f.size += length;
    }
    libdeflate_free_compressor(packer);
    return f;
}

static void each_block_of_an_exr_is_looked_at(void **state) {
    (void)state;
    size_t table;
    const file whole = make_exr(&table);
    shd_error error;
    if (check(&whole, shd_decode_check_exr, whole.size, &error) != SHD_OK)
        fail_msg("%s", error.text);
    for (size_t size = table; size < whole.size; size++)
        assert_int_equal(check(&whole, shd_decode_check_exr, size, &error), SHD_SCENE);
    /* But for lengths that leave a block whole, the head of zlib's, and what is behind a stream's
     * last bit. */
    assert_in_range(count_untold(&whole, shd_decode_check_exr, table + 8 * BLOCKS), 0, 4 * BLOCKS);
    file stray = whole;
    stray.bytes[table + 8]++;
    assert_int_equal(check(&stray, shd_decode_check_exr, stray.size, &error), SHD_SCENE);
    assert_non_null(strstr(error.text, "is not where"));
    memset(stray.bytes + table + 16, 0, 8); /* OpenEXR makes such a table anew */
    assert_int_equal(check(&stray, shd_decode_check_exr, stray.size, &error), SHD_OK);
}

/* ---- Anything ---- */

static void nothing_is_read_beyond_the_end(void **state) {
    (void)state;
    const file whole[] = {make_tiff(&(tiff_kind){false, false, 8, 5, 4, 2}),
                          make_tiff(&(tiff_kind){false, true, 1, 1, 4, 2}),
                          make_tiff(&(tiff_kind){true, true, 8, 5, 16, 2}),
                          make_hdr("-Y 3 +X 10\n", true), make_jpeg(3)};
    uint32_t seed = 1;
    for (int round = 0; round < 4000; round++) {
        file f = whole[round % 5];
        for (int i = 0; i < 3; i++) {
            seed = seed * 1664525 + 1013904223;
            f.bytes[4 + (seed >> 8) % (f.size - 4)] = (unsigned char)(seed >> 24 | (seed & 0x80));
        }
        shd_error error;
        const shd_status status = walk(&f, f.size - (seed >> 16) % 8, &error);
        assert_true(status == SHD_OK || status == SHD_SCENE);
    }
    size_t table;
    const file exr = make_exr(&table);
    for (int round = 0; round < 4000; round++) {
        file f = exr;
        for (int i = 0; i < 3; i++) {
            seed = seed * 1664525 + 1013904223;
            f.bytes[4 + (seed >> 8) % (table + 8 * BLOCKS)] =
                (unsigned char)(seed >> 24 | (seed & 0x80));
        }
        shd_error error;
        const shd_status status =
            check(&f, shd_decode_check_exr, f.size - (seed >> 16) % 8, &error);
        assert_true(status == SHD_OK || status == SHD_SCENE);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tiff_has_what_it_says),
        cmocka_unit_test(packed_rows_of_a_tiff_are_looked_at),
        cmocka_unit_test(a_tiff_is_read_once),
        cmocka_unit_test(tiles_are_no_larger_than_a_picture_has_use_for),
        cmocka_unit_test(an_hdr_has_its_rows),
        cmocka_unit_test(a_jpeg_has_an_end_and_few_scans),
        cmocka_unit_test(each_block_of_an_exr_is_looked_at),
        cmocka_unit_test(nothing_is_read_beyond_the_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
