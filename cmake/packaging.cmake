# What `cmake --install` puts where, and Debian packages of it (`./dev package`). All of it is in
# components: programs, openimageio (the module of formats), service (systemd, configuration),
# documents (manuals, completions, data), library and development.
include(GNUInstallDirs)

set(docdir ${CMAKE_INSTALL_DATAROOTDIR}/doc/shaded)

# ---- The programs ----
install(TARGETS shaded shade RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
# What reads the pictures of strangers; the programs start it.
install(TARGETS shaded-decode RUNTIME DESTINATION lib/shaded COMPONENT programs)
install(TARGETS shaded_oiio LIBRARY DESTINATION lib/shaded COMPONENT openimageio)
install(FILES config/shaded.conf DESTINATION ${docdir} COMPONENT programs)

# The image has the programs alone, and is built without what follows.
if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/deploy/manual)
  return()
endif()

# ---- The library: one more program that is made of what the others are made of ----
# What others see is what the public headers declare; a function that is told about in a comment is
# there, too.
set(shared_headers src/base/budget.h src/base/digest.h src/base/format.h)
set(names shd_limit_names)
foreach(header src/shaded.h ${shared_headers})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${header})
  file(READ ${header} text)
  string(REGEX MATCHALL "shd_[a-z0-9_]+[(]" found "${text}")
  list(APPEND names ${found})
endforeach()
list(TRANSFORM names REPLACE "[(]" "")
list(REMOVE_DUPLICATES names)
list(SORT names)
string(JOIN ";\n    " names ${names})
file(CONFIGURE OUTPUT shaded.map CONTENT
     "SHADED_${PROJECT_VERSION_MAJOR} {\nglobal:\n    ${names};\nlocal:\n    *;\n};\n" @ONLY)
if(NOT SHADED_SANITIZE AND NOT CMAKE_CROSSCOMPILING)
  file(CONFIGURE OUTPUT shared.c CONTENT "/* All is in the archive. */\n" @ONLY)
  add_library(shaded_shared SHARED ${CMAKE_BINARY_DIR}/shared.c)
  target_link_libraries(shaded_shared PRIVATE "$<LINK_LIBRARY:WHOLE_ARCHIVE,shadedlib>")
  set_target_properties(shaded_shared PROPERTIES OUTPUT_NAME shaded LINKER_LANGUAGE CXX
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}
    LINK_DEPENDS ${CMAKE_BINARY_DIR}/shaded.map)
  target_link_options(shaded_shared PRIVATE LINKER:--version-script=${CMAKE_BINARY_DIR}/shaded.map)
  # Where the module is, as seen from the library.
  file(RELATIVE_PATH way ${CMAKE_INSTALL_FULL_LIBDIR} ${CMAKE_INSTALL_PREFIX}/lib/shaded)
  set_target_properties(shaded_shared PROPERTIES INSTALL_RPATH "$ORIGIN/${way}")
  install(TARGETS shaded_shared
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library
          NAMELINK_COMPONENT development)
  set(includedir ${CMAKE_INSTALL_INCLUDEDIR}/shaded)
  install(FILES src/shaded.h DESTINATION ${includedir} COMPONENT development)
  install(FILES ${shared_headers} src/base/limits.h src/base/report.h src/base/status.h
          DESTINATION ${includedir}/base COMPONENT development)
  # Paths are told from where the file is, so that it may be installed anywhere.
  file(RELATIVE_PATH up ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
  string(REGEX REPLACE "/$" "" up ${up})
  set(libdir ${CMAKE_INSTALL_LIBDIR})
  configure_file(cmake/shaded.pc.in shaded.pc @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/shaded.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
          COMPONENT development)
endif()

# ---- Manuals and completions: what the programs say of themselves ----
set(manual ${CMAKE_BINARY_DIR}/manual)
set(made)
# make_manual(NAME "OUTPUT..." COMMAND...) of NAME's skeleton; COMMAND... asks the program.
function(make_manual name section others)
  set(skeleton manual/${name}.${section}.in)
  configure_file(deploy/${skeleton} ${skeleton} @ONLY)
  list(TRANSFORM others PREPEND ${manual}/)
  set(output ${manual}/${name}.${section}.gz ${others})
  file(GLOB tools CONFIGURE_DEPENDS cmake/*.awk)
  add_custom_command(
    OUTPUT ${output} WORKING_DIRECTORY ${manual} VERBATIM
    COMMAND sh ${CMAKE_CURRENT_SOURCE_DIR}/cmake/manual.sh ${CMAKE_CURRENT_SOURCE_DIR} ${name} ${ARGN}
    DEPENDS ${tools} cmake/manual.sh config/shaded.conf ${CMAKE_BINARY_DIR}/${skeleton})
  if(ARGN)
    add_custom_command(OUTPUT ${output} APPEND DEPENDS ${name})
  endif()
  set(made ${made} ${output} PARENT_SCOPE)
  install(FILES ${manual}/${name}.${section}.gz
          DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section} COMPONENT documents)
endfunction()
foreach(program shaded shade)
  make_manual(${program} 1 "${program}.bash;_${program}"
              ${CMAKE_CROSSCOMPILING_EMULATOR} ${CMAKE_BINARY_DIR}/${program})
  install(FILES ${manual}/${program}.bash RENAME ${program} COMPONENT documents
          DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/bash-completion/completions)
  install(FILES ${manual}/_${program} COMPONENT documents
          DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/zsh/site-functions)
endforeach()
make_manual(shaded.conf 5 "")
# Only where what is built is installed.
set(all ALL)
if(SHADED_SANITIZE OR CMAKE_CROSSCOMPILING)
  set(all)
endif()
add_custom_target(manual ${all} DEPENDS ${made})

# ---- Documents, and data that programs beside ours read ----
install(FILES README.md CHANGELOG.md SECURITY.md DESTINATION ${docdir} COMPONENT documents)
install(DIRECTORY docs DESTINATION ${docdir} COMPONENT documents
        PATTERN site EXCLUDE PATTERN make EXCLUDE)
install(DIRECTORY api/examples api/batches DESTINATION ${docdir} COMPONENT documents)
install(FILES config/materials.json config/shaded.ocio api/openapi.yaml api/openapi.json
              api/scene.schema.json
        DESTINATION ${CMAKE_INSTALL_DATADIR}/shaded COMPONENT documents)

# ---- The service ----
install(CODE "set(SHADED_SOURCE \"${CMAKE_CURRENT_SOURCE_DIR}\")
set(SHADED_STAGE \"${CMAKE_BINARY_DIR}/service\")" COMPONENT service)
install(SCRIPT cmake/service.cmake COMPONENT service)

option(SHADED_DEBIAN "Make Debian packages of what is installed" OFF)
if(SHADED_DEBIAN)
  include(cmake/debian.cmake)
endif()
