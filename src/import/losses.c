#include "import/losses.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static bool has_line(const char *text, const char *line, size_t length) {
    for (const char *at = text; *at; at = strchr(at, '\n') + 1)
        if (!strncmp(at, line, length)) return true;
    return false;
}

void shd_lose(shd_losses *losses, const char *format, ...) {
    char line[320];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line - 1, format, args);
    va_end(args);
    for (char *c = line; *c; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f) *c = '_';
    const size_t length = strlen(line) + 1;
    memcpy(line + length - 1, "\n", 2);
    if (has_line(losses->text, line, length)) return;
    if (losses->size + length >= sizeof losses->text) {
        losses->cut = true;
        return;
    }
    memcpy(losses->text + losses->size, line, length + 1);
    losses->size += length;
}
