# Debian packages of what is installed: `./dev package` sets SHADED_DEBIAN. OpenImageIO comes with some
# two hundred libraries, so that its module is a package of its own.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME shaded)
set(CPACK_PACKAGE_CONTACT "shaded <packages@shaded.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_SET_DESTDIR ON) # for /etc
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(soname libshaded${PROJECT_VERSION_MAJOR})
set(version ${PROJECT_VERSION})

# debian_package(GROUP NAME SECTION "SUMMARY" "DESCRIPTION" COMPONENT...)
macro(debian_package group name section summary description)
  string(TOUPPER ${group} key)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${key}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${key}_DESCRIPTION "${summary}\n${description}")
  list(APPEND groups ${group})
  foreach(component ${ARGN})
    list(APPEND in_${group} ${component})
  endforeach()
  list(GET in_${group} 0 component)
  install(FILES deploy/package/copyright ${CMAKE_BINARY_DIR}/changelog.gz
          DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${name} COMPONENT ${component})
endmacro()

# lintian takes "libdeflate 1.14", which /v1/version tells, for zlib's own text.
foreach(pair "shaded programs" "${soname} library")
  string(REPLACE " " ";" pair "${pair}")
  list(GET pair 0 name)
  list(GET pair 1 component)
  file(WRITE ${CMAKE_BINARY_DIR}/overrides/${name} "${name}: embedded-library zlib *\n")
  install(FILES ${CMAKE_BINARY_DIR}/overrides/${name} COMPONENT ${component}
          DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/lintian/overrides)
endforeach()

configure_file(deploy/package/changelog.in changelog @ONLY)
execute_process(COMMAND gzip -9nc changelog WORKING_DIRECTORY ${CMAKE_BINARY_DIR}
                OUTPUT_FILE changelog.gz COMMAND_ERROR_IS_FATAL ANY)

debian_package(service shaded net "pictures of JSON scenes over HTTP and on the command line"
  "shaded is a daemon that takes scene documents (JSON) and answers with shaded,\ncolor-managed pictures, each with bounds of its error. shade does so on the\ncommand line."
  programs service documents)
debian_package(formats shaded-openimageio graphics "TIFF, OpenEXR and Radiance HDR for shaded"
  "With this module the programs and the library of shaded also write TIFF,\nOpenEXR and Radiance HDR, by way of OpenImageIO."
  openimageio)
debian_package(models shaded-import graphics "models of other programs for shaded"
  "With this module `shade import` makes scenes of OBJ, glTF, PLY and STL files, by\nway of assimp."
  import)
debian_package(library ${soname} libs "pictures of JSON scenes: the library"
  "A scene document goes in, and shaded and color-converted pictures come out,\nas the daemon shaded makes them."
  library)
debian_package(development libshaded-dev libdevel "pictures of JSON scenes: for development"
  "Headers, a link and a pkg-config file for programs that use libshaded."
  development)

# /usr/bin/shaded opens these two when a body comes that needs them.
set(CPACK_DEBIAN_SERVICE_PACKAGE_DEPENDS
    "zlib1g, libzstd1, systemd | systemd-standalone-sysusers | systemd-sysusers")
set(CPACK_DEBIAN_SERVICE_PACKAGE_PREDEPENDS "init-system-helpers (>= 1.54~)")
set(CPACK_DEBIAN_SERVICE_PACKAGE_RECOMMENDS "shaded-openimageio (= ${version})")
set(CPACK_DEBIAN_SERVICE_PACKAGE_SUGGESTS "shaded-import (= ${version})")
set(scripts ${CMAKE_CURRENT_SOURCE_DIR}/deploy/package)
set(CPACK_DEBIAN_SERVICE_PACKAGE_CONTROL_EXTRA
    "${scripts}/conffiles;${scripts}/postinst;${scripts}/prerm;${scripts}/postrm")
set(CPACK_DEBIAN_FORMATS_PACKAGE_ENHANCES "shaded, ${soname}")
set(CPACK_DEBIAN_MODELS_PACKAGE_ENHANCES "shaded")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_RECOMMENDS "shaded-openimageio (= ${version})")
file(WRITE ${CMAKE_BINARY_DIR}/shlibs
     "libshaded ${PROJECT_VERSION_MAJOR} ${soname} (>= ${version})\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA "${scripts}/triggers;${CMAKE_BINARY_DIR}/shlibs")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${soname} (= ${version})")

include(CPack)
foreach(group ${groups})
  cpack_add_component_group(${group})
  foreach(component ${in_${group}})
    cpack_add_component(${component} GROUP ${group})
  endforeach()
endforeach()
