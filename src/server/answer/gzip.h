/* Texts in gzip (RFC 1952), for clients that take it. Pure. */
#pragma once

#include <stddef.h>

/* What the caller frees. NULL: memory is short, or the text would not get shorter; the text itself
 * is an answer, too. */
void *shd_gzip(const void *text, size_t size, size_t *out_size);

/* The text of `out_size` bytes that is in a gzip of one member. NULL: memory is short. The caller
 * frees it. */
void *shd_gunzip(const void *gzip, size_t size, size_t out_size);
