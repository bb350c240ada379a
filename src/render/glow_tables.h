/* The tables of environments (shade/prefilter.h), kept between requests by map and exponent.
 *
 * They hold neither a rotation nor an intensity, nor a material's color. They are kept in the order
 * of their last use, and stay while a request holds them. Any thread. */
#pragma once

#include "plan/plan.h"
#include "render/rendering.h"

/* Bytes that may be kept: some hundred tables of usual exponents, or three of the largest. */
enum { SHD_GLOW_BYTES = 96 << 20 };

/* The tables of all terms of a draft's materials under environments: see shd_plan.glows. *out is
 * NULL if there is no environment, or the exact tier is asked for. Makes those that are not kept,
 * which takes some 0.1 seconds each, and up to one where lobes are narrow. SHD_CANCELLED,
 * SHD_CROWDED, SHD_EXHAUSTED, SHD_MEMORY. */
shd_status shd_rendering_glows(shd_rendering *r, const shd_plan *draft, const shd_glow **out,
                               shd_error *error);

/* The maps of a draft's environments in blocks (shade/moments.h), kept like tables: see
 * shd_plan.moments. *out is NULL if no term is walked for. The same errors. */
shd_status shd_rendering_moments(shd_rendering *r, const shd_plan *draft,
                                 const struct shd_moments *const **out, shd_error *error);
