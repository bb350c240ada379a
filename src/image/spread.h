/* What encoders have in common: work that is spread over threads and ends if nobody wants it any
 * more. */
#pragma once

#include "image/image.h"

/* SHD_MEMORY and SHD_CANCELLED, with one text each for all. */
shd_status shd_encode_no_memory(shd_error *error);
shd_status shd_encode_cancelled(shd_error *error);

/* Asks image->go_on, if it is there. */
bool shd_encode_goes_on(const shd_image *image);

/* Calls run(work, index, slot) for all of [0, count), slot < shd_encode_slots(image), as
 * image->spread does, or alone; before each of its own the calling thread asks whether to go on.
 * False: it was not to, and some were left out. */
bool shd_encode_spread(const shd_image *image, size_t count,
                       void (*run)(void *work, size_t index, unsigned slot), void *work);
unsigned shd_encode_slots(const shd_image *image);
