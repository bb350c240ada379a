/* The tokens of a color of CSS (CSS Syntax Module Level 3, section 4), as far as colors have them.
 * Only for css.c. Pure functions, any thread. */
#pragma once

#include <stddef.h>

typedef enum shd_css_kind {
    SHD_CSS_END,
    SHD_CSS_NUMBER,
    SHD_CSS_PERCENT,
    SHD_CSS_DIMENSION, /* a number with a unit */
    SHD_CSS_BEYOND,    /* a number that is too long, or beyond a double's range */
    SHD_CSS_WORD,
    SHD_CSS_FUNCTION, /* a word with the parenthesis behind it */
    SHD_CSS_HASH,     /* a # with the word behind it */
    SHD_CSS_COMMA,
    SHD_CSS_SLASH,
    SHD_CSS_CLOSE,
    SHD_CSS_STRANGE /* anything else */
} shd_css_kind;

typedef struct shd_css_token {
    shd_css_kind kind;
    double value;  /* of numbers */
    char word[40]; /* ASCII letters, digits, - and _, in lower case; longer ones are cut */
    size_t length; /* of the whole word */
} shd_css_token;

/* Reads the token behind white space and comments, and returns where it ends. */
const char *shd_css_next(const char *at, shd_css_token *out);
