#include "color/text.h"

#include <stdint.h>

bool shd_color_is_text(const char *text) {
    static const uint32_t smallest[] = {0, 0x80, 0x800, 0x10000};
    for (const unsigned char *at = (const unsigned char *)text; *at;) {
        uint32_t lead = *at++;
        if (lead < 0x80) {
            if ((lead < ' ' && !(lead >= '\t' && lead <= '\r')) || lead == 0x7f) return false;
            continue;
        }
        int more = lead >= 0xf8 ? 0 : lead >= 0xf0 ? 3 : lead >= 0xe0 ? 2 : lead >= 0xc0 ? 1 : 0;
        if (!more) return false;
        uint32_t point = lead & (0x3fu >> more);
        for (int i = 0; i < more; i++, at++) {
            if ((*at & 0xc0) != 0x80) return false; /* the final 0 ends here, too */
            point = point << 6 | (*at & 0x3fu);
        }
        if (point < smallest[more] || point > 0x10ffff || (point >= 0xd800 && point < 0xe000))
            return false;
    }
    return true;
}
