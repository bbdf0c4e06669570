# Runs while files are installed: what every Debian package has in its folder `documents`.
set(to "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}")
file(MAKE_DIRECTORY "${to}/${documents}")
configure_file("${CMAKE_CURRENT_LIST_DIR}/debian_copyright.txt" "${to}/${documents}/copyright" COPYONLY)
if(interpreter)
  execute_process(COMMAND "${interpreter}" "${source}/tools/debian-changelog" "${source}/CHANGELOG.md" "${maintainer}"
                  OUTPUT_VARIABLE changes COMMAND_ERROR_IS_FATAL ANY)
  file(WRITE "${to}/${documents}/changelog" "${changes}")
  execute_process(COMMAND gzip -9nf "${to}/${documents}/changelog" COMMAND_ERROR_IS_FATAL ANY)
endif()
