# What an installation has beside the programs, and the Debian packages that cpack makes of it (tools/package): flexel and, where
# the Python module is built, python3-flexel.
include(GNUInstallDirs)
find_program(FLEXEL_PYTHON3 python3 PATHS /usr/bin NO_DEFAULT_PATH DOC "Makes the man pages and completions of an installation")
set(documents ${CMAKE_INSTALL_DATADIR}/doc/flexel)
set(CPACK_PACKAGE_CONTACT "The developers of Flexel <maintainers@flexel.invalid>")
install(DIRECTORY docs samples DESTINATION ${documents} PATTERN CMakeLists.txt EXCLUDE PATTERN *.cpp EXCLUDE PATTERN __pycache__ EXCLUDE)
install(FILES README.md DESTINATION ${documents})
# Not named as a component: the installation script compares components with their names in if(), which would take the values.
install(CODE "set(program_folder \"${CMAKE_RUNTIME_OUTPUT_DIRECTORY}\")
set(documents \"${documents}\")
set(source \"${CMAKE_SOURCE_DIR}\")
set(interpreter \"${FLEXEL_PYTHON3}\")
set(data \"${CMAKE_INSTALL_DATADIR}\")
set(maintainer \"${CPACK_PACKAGE_CONTACT}\")
set(has_step \"${FLEXEL_STEP}\")")
install(SCRIPT tools/cmake/install_made_files.cmake)
if(builds_python_module)
  install(CODE "set(documents \"${CMAKE_INSTALL_DATADIR}/doc/python3-flexel\")
set(source \"${CMAKE_SOURCE_DIR}\")
set(interpreter \"${FLEXEL_PYTHON3}\")
set(maintainer \"${CPACK_PACKAGE_CONTACT}\")" COMPONENT python)
  install(SCRIPT tools/cmake/install_debian_files.cmake COMPONENT python)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME flexel)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "deforms CAD parts by simulating a lattice of elements")
set(CPACK_PACKAGE_DESCRIPTION "Bends, twists, presses and breaks parts from CAD files (STEP, IGES, BREP) and
meshes (STL, OBJ, PLY, glTF, 3MF, ...) as their material would, and
writes the same part deformed: its own faces, its own vertices. Says how far
the answer can be trusted, and what accuracy costs in time.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL ${CMAKE_INSTALL_DEFAULT_COMPONENT_NAME})
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME flexel)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS gnuplot-nox)  # draws the plots of `flexel study`
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SUGGESTS "gmsh, calculix-ccx, python3-meshio, paraview")
set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")  # after the summary
if(builds_python_module)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-flexel)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  # The module is for one version of Python; it runs the programs, and reads bodies, of its own version.
  math(EXPR next_python "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "flexel (= ${PROJECT_VERSION}), python3 (>= 3.${Python3_VERSION_MINOR}), \
python3 (<< 3.${next_python}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-meshio, python3-scipy")
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "This is the package flexel of Python: parts, lattices, simulations and
deformed parts as numpy arrays, with the results of the programs.")
endif()
include(CPack)
