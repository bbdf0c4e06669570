# Tests written as Python scripts: every `def test_x` of tests/<folder>/<topic>_test.py is the ctest test <folder>.<topic>.x, run
# by itself in an empty folder. Debian's own interpreter, because that is the one that python3-meshio is installed for.
find_program(FLEXEL_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
function(flexel_script_tests folder timeout)
  file(GLOB scripts CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*_test.py)
  foreach(script ${scripts})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${script})
    get_filename_component(topic ${script} NAME_WE)
    string(REGEX REPLACE "_test$" "" topic ${topic})
    file(STRINGS ${script} tests REGEX "^def test_")
    foreach(line ${tests})
      string(REGEX REPLACE "^def (test_[a-z0-9_]+).*" "\\1" function ${line})
      string(REGEX REPLACE "^test_" "" name ${function})
      add_test(NAME ${folder}.${topic}.${name} COMMAND ${FLEXEL_PYTHON} -B ${script} ${function})
      set_tests_properties(${folder}.${topic}.${name} PROPERTIES TIMEOUT ${timeout} COST ${timeout} SKIP_RETURN_CODE 77 ENVIRONMENT
        "FLEXEL_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY};FLEXEL_SOURCE=${CMAKE_SOURCE_DIR};FLEXEL_PARTS=${CMAKE_SOURCE_DIR}/../shared/parts;PYTHONPATH=${CMAKE_SOURCE_DIR}/tests/programs:${CMAKE_BINARY_DIR}/python;FLEXEL_HAS_PYTHON=${builds_python_module}")
    endforeach()
  endforeach()
endfunction()
