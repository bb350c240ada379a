/* The module shaded_oiio.so, opened at first use and kept. Any thread. */
#pragma once

#include "base/status.h"
#include "image/oiio.h"

/* As shd_image_prepare. What failed is tried again by the next call, unless it was not there. */
shd_status shd_oiio_load(shd_oiio_encode_fn **out, shd_error *error);

/* Reads a file, as shd_oiio_read_fn has it, once the module is loaded. */
shd_status shd_oiio_read_file(shd_oiio_file *file, shd_error *error);
