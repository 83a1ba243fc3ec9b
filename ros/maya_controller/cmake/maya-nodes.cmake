# maya_nodes(FILE...): programs of this package that run under MAYA_PYTHON, in the devel space and where they are
# installed, whatever Python comes first on PATH.
function(maya_nodes)
  if(MAYA_MESSAGES_ONLY)
    return()
  endif()
  set(PYTHON_EXECUTABLE "${MAYA_PYTHON}") # catkin's wrappers in the devel space begin with it
  foreach(file ${ARGN})
    get_filename_component(name "${file}" NAME)
    set(program "${CMAKE_CURRENT_BINARY_DIR}/nodes/${name}")
    file(READ "${file}" text)
    file(WRITE "${program}" "#!${MAYA_PYTHON}\n${text}")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${file}")
    catkin_install_python(PROGRAMS "${program}" DESTINATION "${CATKIN_PACKAGE_BIN_DESTINATION}")
  endforeach()
endfunction()
