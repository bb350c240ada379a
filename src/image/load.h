/* The module shaded_oiio.so, opened at first use and kept. Any thread. */
#pragma once

#include "base/status.h"
#include "image/oiio.h"

/* As shd_image_prepare. What failed is tried again by the next call, unless it was not there. */
shd_status shd_oiio_load(shd_oiio_encode_fn **out, shd_error *error);
