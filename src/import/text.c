#include <stdarg.h>
#include <stdlib.h>

#include "import/writing.h"

void shd_import_note(const shd_import_options *options, const char *format, ...) {
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    options->note(options->context, text);
}

void shd_put_text(FILE *out, const char *text) {
    fputc('"', out);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\') fputc('\\', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

void shd_put_float(FILE *out, float value) {
    char digits[32];
    for (int precision = 6; precision <= 9; precision++) {
        snprintf(digits, sizeof digits, "%.*g", precision, (double)value);
        if (strtof(digits, NULL) == value) break;
    }
    fputs(digits, out);
}

void shd_put_floats(FILE *out, const float *values, size_t count) {
    fputc('[', out);
    for (size_t i = 0; i < count; i++) {
        if (i) fputc(',', out);
        shd_put_float(out, values[i]);
    }
    fputc(']', out);
}

void shd_put_numbers(FILE *out, const double *values, size_t count) {
    fputc('[', out);
    for (size_t i = 0; i < count; i++) {
        if (i) fputs(", ", out);
        shd_put_float(out, (float)values[i] + 0.0f);
    }
    fputc(']', out);
}
