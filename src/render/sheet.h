/* One picture of all variants of a batch: a grid of cells, with labels below them; or an animation,
 * whose frames they are. */
#pragma once

#include "image/image.h"
#include "render/request.h"

/* From a line of a label to the next one, in its font's size. */
#define SHD_LABEL_LEAD 1.4

typedef struct shd_contact_sheet {
    bool turns;                  /* it is an animation, without what follows about a grid */
    size_t count, columns, rows; /* variants; and cells */
    int width, height, cell_width, cell_height; /* of all, and of a variant's picture, in pixels */
    int gap, label_height;                      /* below a cell; 0: there are no labels */
    double label_size;                          /* of the font */
    shd_format format;
    shd_format fallback; /* of variants that name none */
    shd_depth depth;
    int channel;          /* as shd_image.channel, of the first one */
    bool alpha;           /* of any of them */
    uint64_t work, needs; /* as shd_request_work and shd_request_needs */
    char told[224];       /* as shd_request_plan */
} shd_contact_sheet;

/* The request of a variant, which was read; its report tells what is wrong with it. The caller
 * drops it. What cancels the sheet's request cancels it. */
shd_status shd_sheet_cell(shd_request *request, size_t index, shd_request **out, shd_error *error);

/* As far as it is known before cells are made. */
shd_image shd_sheet_image(const shd_contact_sheet *sheet);

typedef shd_status shd_render_cell(shd_request *cell, const shd_render_options *options,
                                   shd_image *out, shd_error *error);

/* A variant that was read without a mistake before: SHD_MISSING if a mesh was forgotten meanwhile.
 */
shd_status shd_sheet_open(shd_request *request, size_t index, shd_request **out, shd_error *error);

/* Plans all cells: tells the worst of their bounds, and refuses what will take too long. */
shd_status shd_sheet_weigh(shd_request *request, shd_error *error);

/* Adds what the making of a cell tells to the account of all. */
void shd_sheet_account(shd_request *request, const shd_request *cell, bool is_first);

/* The same for a turntable. */
shd_status shd_turn_render(shd_request *request, const shd_render_options *options,
                           shd_render_cell *render, shd_error *error);

/* Makes the request's picture, whose cells `render` makes: a variant each, one after the other. */
shd_status shd_sheet_render(shd_request *request, const shd_render_options *options,
                            shd_render_cell *render, shd_error *error);
