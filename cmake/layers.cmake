# add_layer(NAME SOURCES file... [USES layer...]): a folder of modules/ is a library with a module
# directory of its own, linked only to the layers below it.
function(add_layer name)
  cmake_parse_arguments(LAYER "" "" "SOURCES;USES" ${ARGN})
  set(files)
  foreach(source ${LAYER_SOURCES})
    if(IS_ABSOLUTE ${source})
      list(APPEND files ${source})
    elseif(source MATCHES "\\.")
      list(APPEND files modules/${name}/${source})
    else()
      list(APPEND files modules/${name}/${source}.f90)
    endif()
  endforeach()
  add_library(${name} STATIC ${files})
  set_target_properties(${name} PROPERTIES
    OUTPUT_NAME stirpoint_${name}
    Fortran_MODULE_DIRECTORY ${CMAKE_BINARY_DIR}/mod/${name})
  target_include_directories(${name} PUBLIC ${CMAKE_BINARY_DIR}/mod/${name})
  target_link_libraries(${name} PUBLIC ${LAYER_USES})
endfunction()
