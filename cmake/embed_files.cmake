# Writes OUT: the files NAMES (joined by "|") of FOLDER as a table SYMBOL.
string(REPLACE "|" ";" names "${NAMES}")
set(text "#include \"server/answer/studio.h\"\n\n")
set(table "")
set(count 0)
foreach(name ${names})
  file(READ ${FOLDER}/${name} hex HEX)
  string(LENGTH "${hex}" digits)
  math(EXPR size "${digits} / 2")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n"
         bytes "${bytes}")
  string(APPEND text "static const unsigned char file${count}[${size} + 1] = {\n${bytes}0};\n")
  string(APPEND table "    {\"${name}\", file${count}, ${size}},\n")
  math(EXPR count "${count} + 1")
endforeach()
file(WRITE ${OUT}
"${text}
extern const shd_embedded_file ${SYMBOL}[];
extern const size_t ${SYMBOL}_count;
const shd_embedded_file ${SYMBOL}[] = {\n${table}};
const size_t ${SYMBOL}_count = ${count};
")
