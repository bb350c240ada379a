#include "render/sheet_label.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "image/draw.h"

static const char points[] = "...";

/* Takes signs from the line's end until it has room for the points. */
static void cut_line(char *line, double size, double width) {
    size_t length = strlen(line);
    char tried[SHD_LABEL_SIZE + sizeof points];
    do {
        snprintf(tried, sizeof tried, "%.*s%s", (int)length, line, points);
        if (!length ||
            (shd_text_width(tried, size) <= width && length + sizeof points <= SHD_LABEL_SIZE))
            break;
        while (length && (line[--length] & 0xc0) == 0x80) continue; /* all bytes of a sign */
    } while (true);
    memcpy(line, tried, length + sizeof points);
}

/* The line with a word more, if it fits. */
static bool add_word(char *line, const char *word, size_t length, double size, double width) {
    char tried[SHD_LABEL_SIZE];
    const int all =
        snprintf(tried, sizeof tried, "%s%s%.*s", line, *line ? " " : "", (int)length, word);
    if ((size_t)all >= sizeof tried || shd_text_width(tried, size) > width) return false;
    memcpy(line, tried, (size_t)all + 1);
    return true;
}

/* A line that is one word, which need not fit. */
static void put_word(char *line, const char *word, size_t length, double size, double width) {
    *line = 0;
    if (add_word(line, word, length, size, width)) return;
    if (length >= SHD_LABEL_SIZE) length = SHD_LABEL_SIZE - 1;
    while (length && (word[length] & 0xc0) == 0x80) length--; /* no sign in part */
    memcpy(line, word, length);
    line[length] = 0;
    cut_line(line, size, width);
}

size_t shd_label_break(const char *text, double size, double width,
                       char lines[SHD_LABEL_LINES][SHD_LABEL_SIZE]) {
    size_t count = 0;
    bool begins = true; /* a line feed was before */
    while (*text) {
        const size_t length = strcspn(text, " \n");
        if (length && (begins || !add_word(lines[count - 1], text, length, size, width))) {
            if (count == SHD_LABEL_LINES) {
                cut_line(lines[count - 1], size, width);
                break;
            }
            put_word(lines[count++], text, length, size, width);
            begins = false;
        }
        text += length;
        for (; *text == ' ' || *text == '\n'; text++) begins = begins || *text == '\n';
    }
    return count;
}
