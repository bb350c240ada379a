/* The blocks of a deflate stream (RFC 1951). Pure, any thread. */
#ifndef SHD_IMAGE_BLOCKS_H
#define SHD_IMAGE_BLOCKS_H

#include <stdbool.h>
#include <stddef.h>

/* Walks over a stream to the bit that says "the last block" and to the first bit behind that block:
 * both counted from the stream's first bit, a byte's least one first. False: it is no whole stream.
 * What it says is skipped: matches may reach before its beginning. */
bool shd_find_last_block(const unsigned char *data, size_t size, size_t *last, size_t *end);

#endif
