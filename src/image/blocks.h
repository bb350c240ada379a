/* The blocks of a deflate stream (RFC 1951). Pure, any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/* Finds the bit of a stream that says "the last block", and the first bit behind that block. Both
 * are counted from the stream's first bit, and in a byte from the least one. False: it is no whole
 * stream. Its contents are skipped, so that matches may reach before its beginning. */
bool shd_find_last_block(const unsigned char *data, size_t size, size_t *last, size_t *end);
