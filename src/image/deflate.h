/* Deflate (RFC 1951) for the filtered rows of pictures: literals, and runs that repeat what lies
 * one pixel back. Filtered shading repeats itself in hardly any other way: the search for other
 * matches takes most of a general compressor's time and makes pictures a few percent smaller.
 *
 * A stream is made of pieces, which do not look at each other and are whole bytes, so that they
 * can be made in any order. Pure functions, any thread. */
#ifndef SHD_IMAGE_DEFLATE_H
#define SHD_IMAGE_DEFLATE_H

#include <stddef.h>
#include <stdint.h>

/* Bytes of a piece that are good to have: enough for its table of codes to pay, little enough for
 * the nearest caches. */
enum { SHD_DEFLATE_PIECE = 96 << 10 };

/* The most bytes that a piece of `size` bytes takes in `out`, and of working memory. */
size_t shd_deflate_bound(size_t size);
size_t shd_deflate_scratch(size_t size);

/* Compresses a piece, which is not the last one of its stream; returns its bytes. `distance` is
 * that of a pixel, 1 to 8; size is in [1, 2^31). `scratch` is aligned to 8. */
size_t shd_deflate_piece(const unsigned char *data, size_t size, unsigned distance, void *scratch,
                         unsigned char *out);

/* The bytes that end a stream: an empty last block. */
enum { SHD_DEFLATE_END = 2 };
void shd_deflate_end(unsigned char out[SHD_DEFLATE_END]);

#endif
