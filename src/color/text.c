#include "color/text.h"

#include "base/utf8.h"

bool shd_color_is_text(const char *text) {
    while (*text) {
        uint32_t point;
        const size_t length = shd_utf8_decode(text, &point);
        const bool is_control = point < ' ' || point == 0x7f;
        const bool is_blank = point >= '\t' && point <= '\r';
        if (!length || (is_control && !is_blank)) return false;
        text += length;
    }
    return true;
}
