# Installs the service: its files name where the programs and the configuration are, which is known
# when they are installed. SHADED_SOURCE and SHADED_STAGE are folders. /etc is that of /usr.
set(etc ${CMAKE_INSTALL_PREFIX}/etc)
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(etc /etc)
endif()

# install_changed(FILE NAME FOLDER): FILE of deploy/, with the places of this prefix.
function(install_changed file name folder)
  file(READ ${SHADED_SOURCE}/deploy/${file} text)
  string(REPLACE "/usr/bin/" "${CMAKE_INSTALL_PREFIX}/bin/" text "${text}")
  string(REPLACE "/usr/share/" "${CMAKE_INSTALL_PREFIX}/share/" text "${text}")
  string(REGEX REPLACE "/etc/(shaded|default)" "${etc}/\\1" text "${text}")
  file(WRITE ${SHADED_STAGE}/${folder}/${name} "${text}")
  file(INSTALL ${SHADED_STAGE}/${folder}/${name} DESTINATION ${folder})
endfunction()

foreach(unit shaded.service shaded.socket shaded-admin.socket)
  install_changed(systemd/${unit} ${unit} ${CMAKE_INSTALL_PREFIX}/lib/systemd/system)
endforeach()
install_changed(package/sysusers.conf shaded.conf ${CMAKE_INSTALL_PREFIX}/lib/sysusers.d)
install_changed(package/default shaded ${etc}/default)
file(INSTALL ${SHADED_SOURCE}/config/shaded.conf DESTINATION ${etc}/shaded)
