#include "import/block.h"

#include <stdlib.h>
#include <string.h>

uint64_t shd_block_put(shd_block *b, const void *data, size_t size) {
    const size_t at = b->size, end = at + (size + 7) / 8 * 8;
    if (end > b->room && !b->full) {
        const size_t room = 2 * end;
        char *more = realloc(b->bytes, room);
        b->full = !more;
        if (more) b->bytes = more, b->room = room;
    }
    if (b->full) return 0;
    memset(b->bytes + at, 0, end - at);
    if (data && size) memcpy(b->bytes + at, data, size);
    b->size = end;
    return at;
}

shd_span shd_block_items(shd_block *b, const void *data, size_t count, size_t size) {
    return (shd_span){shd_block_put(b, data, count * size), count};
}

shd_span shd_block_text(shd_block *b, const char *text) {
    return shd_block_items(b, text, strlen(text), 1);
}
