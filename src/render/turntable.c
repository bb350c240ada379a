/* A turntable is drawn: its frames one after the other, each a file, and one file of all of them.
 */
#include <stdlib.h>

#include "image/animation.h"
#include "render/sheet.h"
#include "scene/variants.h"

typedef struct turning {
    const shd_contact_sheet *sheet;
    const shd_render_options *options;
    shd_bytes *files; /* [count], counted as borrowed of the request's arena */
    size_t at;        /* the frame, and how many there are */
} turning;

static void note_progress(void *context, double share) {
    const turning *t = context;
    if (t->options && t->options->progress)
        t->options->progress(t->options->context,
                             ((double)t->at + share) / (double)t->sheet->count);
}

/* The frame's file becomes the request's. */
static shd_status take_file(const shd_request *request, const shd_request *frame, shd_bytes file,
                            shd_bytes *out, shd_error *error) {
    shd_arena_repay(frame->rendering.arena, file.size);
    if (!shd_arena_borrow(request->rendering.arena, file.size)) {
        free(file.data);
        return shd_rendering_full(&request->rendering, "animation", error);
    }
    *out = file;
    return SHD_OK;
}

static shd_status draw_frame(shd_request *request, turning *t, shd_render_cell *render,
                             shd_error *error) {
    const shd_render_options options = {.progress = note_progress, .context = t};
    shd_request *frame;
    shd_image image;
    shd_bytes file;
    shd_status status = shd_sheet_open(request, t->at, &frame, error);
    if (status != SHD_OK) return status;
    shd_rendering *r = &frame->rendering;
    status = render(frame, t->options ? &options : NULL, &image, error);
    if (status == SHD_OK) {
        shd_stage_begin(r);
        status = shd_image_encode(&image, t->sheet->format, r->arena, &file, error);
        shd_stage_end(r, &r->times.encode);
    }
    status = shd_request_blame(frame, status, error);
    if (status == SHD_OK) status = take_file(request, frame, file, &t->files[t->at], error);
    shd_sheet_account(request, frame, !t->at);
    shd_request_drop(frame);
    return status;
}

static shd_status join_frames(shd_request *request, const turning *t, shd_error *error) {
    shd_rendering *r = &request->rendering;
    const shd_contact_sheet *sheet = t->sheet;
    const shd_animation animation = {.frames = t->files,
                                     .count = sheet->count,
                                     .width = sheet->cell_width,
                                     .height = sheet->cell_height,
                                     .milliseconds =
                                         (unsigned)shd_variants_turn(request->batch).milliseconds};
    shd_bytes bytes;
    request->pictures = shd_arena_zalloc(r->arena, 1, sizeof *request->pictures);
    if (!request->pictures) return shd_rendering_full(r, "animation", error);
    shd_stage_begin(r);
    const shd_status status = shd_image_animate(&animation, sheet->format, r->arena, &bytes, error);
    shd_stage_end(r, &r->times.encode);
    if (status != SHD_OK) return status;
    request->pictures[0] = (shd_picture){NULL, sheet->format, bytes.data, bytes.size, true};
    request->picture_count = 1;
    return SHD_OK;
}

shd_status shd_turn_render(shd_request *request, const shd_render_options *options,
                           shd_render_cell *render, shd_error *error) {
    shd_arena *arena = request->rendering.arena;
    turning t = {.sheet = request->sheet, .options = options};
    shd_status status = shd_sheet_weigh(request, error);
    if (status != SHD_OK) return status;
    t.files = shd_arena_zalloc(arena, t.sheet->count, sizeof *t.files);
    if (!t.files) return shd_rendering_full(&request->rendering, "animation", error);
    for (; status == SHD_OK && t.at < t.sheet->count; t.at++)
        status = draw_frame(request, &t, render, error);
    if (status == SHD_OK) status = join_frames(request, &t, error);
    for (size_t i = 0; i < t.sheet->count; i++) {
        shd_arena_repay(arena, t.files[i].size);
        free(t.files[i].data);
    }
    return status;
}
