file(READ ${FILE} hex HEX)
string(LENGTH "${hex}" digits)
math(EXPR size "${digits} / 2")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n"
       bytes "${bytes}")
file(WRITE ${OUT}
"extern const unsigned char ${SYMBOL}[${size} + 1];
extern const unsigned long ${SYMBOL}_size;
const unsigned char ${SYMBOL}[${size} + 1] = {
${bytes}0};
const unsigned long ${SYMBOL}_size = ${size};
")
