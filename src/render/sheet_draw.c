/* A sheet is drawn: its cells one after the other, into one picture that is encoded at the end. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/draw.h"
#include "image/pack.h"
#include "render/sheet.h"
#include "render/sheet_label.h"
#include "render/show/output.h"
#include "scene/variants.h"

/* Codes of 8 bits: a grey that is darker than most pictures, and text that is clear on it. */
enum { GROUND = 0x26, TEXT = 0xe6 };

typedef struct sheet_drawing {
    shd_request *request;
    const shd_contact_sheet *sheet;
    shd_render_cell *render;
    shd_image image; /* of the whole */
    shd_pack pack;
    unsigned char *samples; /* [height][width][pack.count] of pack.bytes */
    const shd_render_options *options;
    size_t at; /* the cell */
} sheet_drawing;

/* ---- Pixels ---- */

static void put_sample(unsigned char *to, const shd_pack *pack, unsigned code) {
    if (pack->bytes == 1)
        *to = (unsigned char)code;
    else
        *(uint16_t *)(void *)to = (uint16_t)(code * 257);
}

/* Codes of red, green and blue, opaque. */
static void put_pixel(unsigned char *to, const shd_pack *pack, const unsigned char rgb[3]) {
    for (int c = 0; c < pack->count; c++, to += pack->bytes)
        put_sample(to, pack, pack->alpha && c == pack->count - 1 ? 255 : rgb[c < 3 ? c : 2]);
}

static unsigned char *find_pixel(const sheet_drawing *d, int x, int y) {
    return d->samples + ((size_t)y * (size_t)d->sheet->width + (size_t)x) * (size_t)d->pack.count *
                            d->pack.bytes;
}

static bool fill_ground(const sheet_drawing *d) {
    static const unsigned char ground[3] = {GROUND, GROUND, GROUND};
    const size_t row = (size_t)d->sheet->width * (size_t)d->pack.count * d->pack.bytes;
    for (int x = 0; x < d->sheet->width; x++) put_pixel(find_pixel(d, x, 0), &d->pack, ground);
    for (int y = 1; y < d->sheet->height; y++) {
        if (shd_is_cancelled(d->request->rendering.cancelled)) return false;
        memcpy(find_pixel(d, 0, y), d->samples, row);
    }
    return true;
}

static void find_place(const sheet_drawing *d, int *x, int *y) {
    const shd_contact_sheet *s = d->sheet;
    *x = s->gap + (int)(d->at % s->columns) * (s->cell_width + s->gap);
    *y = s->gap + (int)(d->at / s->columns) * (s->cell_height + s->label_height + s->gap);
}

/* A cell may lack the alpha that another one has: it is opaque. */
static void copy_row(const shd_pack *from, const unsigned char *row, int width, const shd_pack *to,
                     unsigned char *out) {
    const size_t size = (size_t)from->count * from->bytes;
    if (from->count == to->count) {
        memcpy(out, row, size * (size_t)width);
        return;
    }
    for (int x = 0; x < width; x++, row += size, out += (size_t)to->count * to->bytes) {
        memcpy(out, row, size);
        put_sample(out + size, to, 255);
    }
}

static shd_status copy_cell(const sheet_drawing *d, const shd_image *image, shd_error *error) {
    shd_arena *arena = d->request->rendering.arena;
    const shd_arena_mark mark = shd_arena_mark_here(arena);
    const shd_pack pack = shd_pack_of(image, d->sheet->format);
    const size_t row = (size_t)image->width * (size_t)pack.count * pack.bytes;
    unsigned char *packed = shd_arena_alloc(arena, 1, row);
    int left, top;
    find_place(d, &left, &top);
    if (!packed) return shd_rendering_full(&d->request->rendering, "picture", error);
    if (pack.bytes != d->pack.bytes || pack.count > d->pack.count ||
        pack.count + (d->pack.alpha && !pack.alpha) != d->pack.count)
        return shd_fail(error, SHD_INTERNAL, "", "a sheet's picture has other samples than it");
    for (int y = 0; y < image->height; y++) {
        const unsigned char *from = packed;
        if (image->samples)
            from = (const unsigned char *)image->samples + (size_t)y * row;
        else
            shd_pack_row(&pack, image->rgba + 4 * (size_t)y * (size_t)image->width, image->width,
                         packed);
        copy_row(&pack, from, image->width, &d->pack, find_pixel(d, left, top + y));
    }
    shd_arena_return(arena, mark);
    return SHD_OK;
}

/* ---- Labels ---- */

static void draw_lines(shd_drawing *drawing, const shd_contact_sheet *sheet, const char *text) {
    static const shd_ink ink = {{TEXT, TEXT, TEXT}, 1, 1};
    char lines[SHD_LABEL_LINES][SHD_LABEL_SIZE];
    const double size = sheet->label_size;
    const size_t count = shd_label_break(text, size, sheet->cell_width, lines);
    for (size_t i = 0; i < count; i++)
        shd_draw_text(drawing, ink, sheet->cell_width / 2.0,
                      floor(size * (SHD_LABEL_LEAD * (double)i + 1.15)), size, SHD_ANCHOR_MIDDLE,
                      lines[i]);
}

static shd_status draw_label(const sheet_drawing *d, shd_error *error) {
    const shd_contact_sheet *s = d->sheet;
    const shd_rendering *r = &d->request->rendering;
    const shd_arena_mark mark = shd_arena_mark_here(r->arena);
    const int w = s->cell_width, h = s->label_height;
    const size_t pixels = (size_t)w * (size_t)h;
    char *text = shd_variants_label(d->request->batch, d->at);
    shd_drawing *drawing = text ? shd_drawing_new(r->arena, w, h) : NULL;
    unsigned char *rgb = drawing ? shd_arena_alloc(r->arena, pixels, 3) : NULL;
    bool fine = rgb;
    if (fine) {
        memset(rgb, GROUND, 3 * pixels);
        draw_lines(drawing, s, text);
        fine = !shd_drawing_full(drawing) &&
               shd_drawing_paint(drawing, 1, w, h, rgb, r->arena, r->cancelled);
    }
    free(text);
    if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    if (!fine) return shd_rendering_full(r, "picture", error);
    int left, top;
    find_place(d, &left, &top);
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++)
            put_pixel(find_pixel(d, left + x, top + s->cell_height + y), &d->pack,
                      rgb + 3 * ((size_t)y * (size_t)w + (size_t)x));
    shd_arena_return(r->arena, mark);
    return SHD_OK;
}

/* ---- Cells ---- */

static void note_progress(void *context, double share) {
    const sheet_drawing *d = context;
    if (d->options && d->options->progress)
        d->options->progress(d->options->context,
                             ((double)d->at + share) / (double)d->sheet->count);
}

/* The file says of its colors what all cells say of theirs. */
static void take_look(sheet_drawing *d, const shd_image *cell) {
    shd_rendering *r = &d->request->rendering;
    shd_image *image = &d->image;
    if (d->at) {
        if (image->about && (!cell->about || strcmp(image->about, cell->about)))
            image->about = NULL;
        if (cell->transfer == image->transfer && cell->has_primaries == image->has_primaries &&
            !memcmp(cell->primaries, image->primaries, sizeof cell->primaries))
            return;
        image->transfer = SHD_TRANSFER_UNKNOWN;
        image->has_primaries = false;
        image->space = NULL;
        return;
    }
    *image = *cell;
    image->width = d->sheet->width;
    image->height = d->sheet->height;
    image->alpha = d->sheet->alpha;
    image->rgba = NULL;
    image->samples = d->samples;
    image->about = cell->about ? shd_arena_strdup(r->arena, cell->about) : NULL;
    image->space = cell->space ? shd_arena_strdup(r->arena, cell->space) : NULL;
    shd_output_hand_over(r, image);
}

static shd_status draw_cell(sheet_drawing *d, shd_error *error) {
    const shd_render_options options = {.progress = note_progress, .context = d};
    shd_request *cell;
    shd_image image;
    shd_status status = shd_sheet_open(d->request, d->at, &cell, error);
    if (status != SHD_OK) return status;
    status = d->render(cell, d->options ? &options : NULL, &image, error);
    if (status == SHD_OK) {
        take_look(d, &image);
        status = copy_cell(d, &image, error);
    }
    status = shd_request_blame(cell, status, error);
    shd_sheet_account(d->request, cell, !d->at);
    shd_request_drop(cell);
    if (status == SHD_OK && d->sheet->label_height) status = draw_label(d, error);
    return status;
}

static shd_status begin_sheet(sheet_drawing *d, shd_error *error) {
    const shd_contact_sheet *sheet = d->sheet;
    const shd_rendering *r = &d->request->rendering;
    d->image = shd_sheet_image(sheet);
    d->pack = shd_pack_of(&d->image, sheet->format);
    d->samples = shd_arena_alloc(r->arena, (size_t)sheet->width * (size_t)sheet->height,
                                 (size_t)d->pack.count * d->pack.bytes);
    if (!d->samples) return shd_rendering_full(r, "picture", error);
    return fill_ground(d) ? SHD_OK : shd_rendering_cancelled(error);
}

static shd_status end_sheet(const sheet_drawing *d, shd_error *error) {
    shd_request *request = d->request;
    shd_rendering *r = &request->rendering;
    shd_bytes bytes;
    request->pictures = shd_arena_zalloc(r->arena, 1, sizeof *request->pictures);
    if (!request->pictures) return shd_rendering_full(r, "picture", error);
    shd_stage_begin(r);
    const shd_status status =
        shd_image_encode(&d->image, d->sheet->format, r->arena, &bytes, error);
    shd_stage_end(r, &r->times.encode);
    if (status != SHD_OK) return status;
    request->pictures[0] = (shd_picture){NULL, d->sheet->format, bytes.data, bytes.size, false};
    request->picture_count = 1;
    return SHD_OK;
}

shd_status shd_sheet_render(shd_request *request, const shd_render_options *options,
                            shd_render_cell *render, shd_error *error) {
    sheet_drawing d = {
        .request = request, .sheet = request->sheet, .render = render, .options = options};
    shd_status status = shd_sheet_weigh(request, error);
    if (status != SHD_OK) return status;
    status = begin_sheet(&d, error);
    for (d.at = 0; status == SHD_OK && d.at < d.sheet->count; d.at++) status = draw_cell(&d, error);
    return status == SHD_OK ? end_sheet(&d, error) : status;
}
