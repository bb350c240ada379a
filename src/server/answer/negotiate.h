/* Content negotiation and preconditions: RFC 9110, sections 8.8.3, 12.4 and 12.5.1.
 *
 * Header values are those of all fields of that name, joined by commas; NULL if there is none.
 * Pure functions. */
#pragma once

#include <stdbool.h>

#include "base/format.h"
#include "shaded.h"

/* Whether `accept` admits the media type. Without the header, everything is acceptable. */
bool shd_accepts(const char *accept, const char *media_type);

/* Whether `accept` likes a media type better than another one. False without the header. */
bool shd_prefers(const char *accept, const char *media_type, const char *other);

/* The picture format, of those that are made here, that `accept` likes best, under its name or
 * a usual alias (image/jpg, image/exr, ...); between equals the first of shd_format, which is also
 * the cheapest. False: it admits none. */
bool shd_accepts_picture(const char *accept, shd_format *out);

/* The form of a material's figures that `accept` likes best: between equals JSON, then SVG. False:
 * it admits none. */
bool shd_accepts_figure(const char *accept, shd_brdf_form *out);

/* The same of how two pictures differ: JSON, or the map, a PNG. */
bool shd_accepts_map(const char *accept, bool *map);

/* Whether a Content-Type is JSON: application/json or anything/anything+json, any parameters. */
bool shd_is_json(const char *content_type);

/* Whether a Content-Type, NULL if there is none, says application/octet-stream. */
bool shd_is_binary(const char *content_type);

/* Whether it says image/ and anything. */
bool shd_is_image(const char *content_type);

/* Whether Accept-Encoding (RFC 9110, section 12.5.3) likes gzip at least as well as the text as it
 * is. Without the header, it does not. */
bool shd_accepts_gzip(const char *accept_encoding);

/* Whether the tag (without quotes) is among those of If-None-Match, by weak comparison; `*` is
 * `star`. */
bool shd_etag_matches(const char *if_none_match, const char *etag, bool star);
