/* Reads colors of CSS, one a line, and answers each with a line: "linear R G B A" or "encoded R G B
 * A" as shd_css_color has them, or "wrong" and why. */
#include <stdio.h>
#include <stdlib.h>

#include "scene/css.h"

int main(void) {
    char *line = NULL;
    size_t size = 0;
    for (ssize_t length; (length = getline(&line, &size, stdin)) > 0;) {
        if (line[length - 1] == '\n') line[length - 1] = '\0';
        shd_css_color color;
        shd_css_wrong wrong;
        if (shd_css_read(line, &color, &wrong))
            printf("%s %.17g %.17g %.17g %.17g\n", color.linear ? "linear" : "encoded",
                   color.rgb[0], color.rgb[1], color.rgb[2], color.alpha);
        else
            printf("wrong %s%s\n", wrong.text, wrong.name);
    }
    free(line);
    return 0;
}
