/* One picture of all variants of a batch: a grid of cells, with labels below them. */
#pragma once

#include "image/image.h"
#include "render/request.h"

/* From a line of a label to the next one, in its font's size. */
#define SHD_LABEL_LEAD 1.4

typedef struct shd_contact_sheet {
    size_t count, columns, rows;
    int width, height, cell_width, cell_height; /* of all, and of a variant's picture, in pixels */
    int gap, label_height;                      /* below a cell; 0: there are no labels */
    double label_size;                          /* of the font */
    shd_format format;
    shd_format fallback; /* of variants that name none */
    shd_depth depth;
    bool alpha, grey;
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

/* Makes the request's picture, whose cells `render` makes: a variant each, one after the other. */
shd_status shd_sheet_render(shd_request *request, const shd_render_options *options,
                            shd_render_cell *render, shd_error *error);
