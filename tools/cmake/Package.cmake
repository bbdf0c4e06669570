# What an installation has beside the programs, and the Debian package that cpack makes of it (tools/package).
include(GNUInstallDirs)
find_program(FLEXEL_PYTHON3 python3 PATHS /usr/bin NO_DEFAULT_PATH DOC "Makes the man pages and completions of an installation")
set(documents ${CMAKE_INSTALL_DATADIR}/doc/flexel)
install(DIRECTORY docs samples DESTINATION ${documents} PATTERN CMakeLists.txt EXCLUDE PATTERN *.cpp EXCLUDE PATTERN __pycache__ EXCLUDE)
install(FILES README.md DESTINATION ${documents})
install(CODE "set(programs \"${CMAKE_RUNTIME_OUTPUT_DIRECTORY}\")
set(documents \"${documents}\")
set(source \"${CMAKE_SOURCE_DIR}\")
set(python \"${FLEXEL_PYTHON3}\")
set(data \"${CMAKE_INSTALL_DATADIR}\")
set(has_step \"${FLEXEL_STEP}\")")
install(SCRIPT tools/cmake/install_made_files.cmake)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME flexel)
set(CPACK_PACKAGE_CONTACT "The developers of Flexel <maintainers@flexel.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "deforms CAD parts by simulating a lattice of elements")
set(CPACK_PACKAGE_DESCRIPTION "Bends, twists, presses and breaks parts from CAD files (STEP, IGES, BREP) and
and meshes (STL, OBJ, PLY, glTF, 3MF, ...) as their material would, and
writes the same part deformed: its own faces, its own vertices. Says how far
the answer can be trusted, and what accuracy costs in time.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS gnuplot-nox)  # draws the plots of `flexel study`
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "gmsh, calculix-ccx, python3-meshio, paraview")
include(CPack)
