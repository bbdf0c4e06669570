# Runs while files are installed: man pages and completions from what the programs say, the sample's part from its program, and the
# files that a Debian package must have.
set(to "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}")
if(python)
  execute_process(COMMAND "${python}" "${source}/tools/interface-files" "${programs}" "${to}/${data}" COMMAND_ERROR_IS_FATAL ANY)
else()
  message(WARNING "without python3 there are no man pages and no completions")
endif()
if(has_step)
  execute_process(COMMAND "${programs}/make_bracket" "${to}/${documents}/samples/bracket/bracket.step" COMMAND_ERROR_IS_FATAL ANY)
endif()
file(WRITE "${to}/${documents}/copyright" "Flexel deforms CAD parts.\n\nCopyright: 2026 the developers of Flexel\nLicense: GPL-3.0-or-later\nOn Debian systems the text of the GNU General Public License, version 3, \
is in\n/usr/share/common-licenses/GPL-3.\n")
execute_process(COMMAND gzip -9nc "${source}/CHANGELOG.md" OUTPUT_FILE "${to}/${documents}/changelog.gz" COMMAND_ERROR_IS_FATAL ANY)
