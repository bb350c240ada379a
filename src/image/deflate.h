/* Deflate (RFC 1951) for the filtered rows of rendered pictures. Pure, any thread.
 *
 * Smooth surfaces leave small numbers that hardly repeat, backgrounds and edges leave runs. So two
 * places alone are tried for a match: the pixel before, and where the same eight bytes were last
 * seen. A prefix code made for the block does the rest. Samples of two bytes leave a number that
 * hardly repeats behind one that nearly always does: there, shorter matches are taken, and those
 * with the sample before, too. Where seven bytes of eight are zeros and the others hardly repeat,
 * runs of zeros are all that is looked for. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/cpu.h"

/* The most bytes of a block: what a stored one holds. */
enum { SHD_DEFLATE_BLOCK = 65535 };

/* The bytes of `out` that a block of so many takes at most. */
size_t shd_deflate_bound(size_t size);

/* The bytes of `room`, working memory of one thread at a time, aligned as malloc does. What it
 * holds between blocks does not matter. */
size_t shd_deflate_room(void);

/* Writes data[0..size), size <= SHD_DEFLATE_BLOCK, as one block, and returns its bytes. `before`
 * bytes before `data` are of the same stream and may be looked back at. Bytes that are `pixel`, 1
 * to 8, apart are likely alike; `wide`: samples are of two bytes, as `pixel` is. The last block
 * ends the stream; another is followed by an empty stored one, so that the next begins with a whole
 * byte. All of `isa` write the same. */
size_t shd_deflate_block(shd_isa isa, void *room, const unsigned char *data, size_t before,
                         size_t size, size_t pixel, bool wide, bool last, unsigned char *out);
