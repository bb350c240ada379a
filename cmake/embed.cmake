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
