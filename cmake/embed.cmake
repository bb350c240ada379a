# shaded_embed(OUT.c SYMBOL FILE): a C file that holds FILE's bytes as
#   const unsigned char SYMBOL[]; const unsigned long SYMBOL_size;  (a 0 byte follows the last)
set(SHADED_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_DIR}/embed_file.cmake)
function(shaded_embed out symbol file)
  add_custom_command(
    OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DOUT=${out} -DSYMBOL=${symbol}
            -DFILE=${CMAKE_CURRENT_SOURCE_DIR}/${file} -P ${SHADED_EMBED_SCRIPT}
    DEPENDS ${file} ${SHADED_EMBED_SCRIPT}
    VERBATIM)
endfunction()

# shaded_embed_files(OUT.c SYMBOL FOLDER NAME...): a C file that holds files of a folder as
#   const shd_embedded_file SYMBOL[]; const size_t SYMBOL_count;  (each has a 0 byte behind it)
set(SHADED_EMBED_FILES_SCRIPT ${CMAKE_CURRENT_LIST_DIR}/embed_files.cmake)
function(shaded_embed_files out symbol folder)
  set(folder ${CMAKE_CURRENT_SOURCE_DIR}/${folder})
  list(TRANSFORM ARGN PREPEND ${folder}/ OUTPUT_VARIABLE files)
  list(JOIN ARGN "|" names)
  add_custom_command(
    OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DOUT=${out} -DSYMBOL=${symbol} -DFOLDER=${folder} -DNAMES=${names}
            -P ${SHADED_EMBED_FILES_SCRIPT}
    DEPENDS ${files} ${SHADED_EMBED_FILES_SCRIPT}
    VERBATIM)
endfunction()
