# Compiles one line, `use MODULE`, with the include directories of a layer (OWN), which must fail
# for want of that module, and with those of a HIGHER layer, which must work.
file(MAKE_DIRECTORY ${DIRECTORY})
file(WRITE ${DIRECTORY}/probe.f90
  "module probe\n  use ${MODULE}\n  implicit none\nend module probe\n")

function(compile directories result text)
  list(TRANSFORM directories PREPEND -I)
  execute_process(
    COMMAND ${COMPILER} ${directories} -fsyntax-only probe.f90
    WORKING_DIRECTORY ${DIRECTORY}
    RESULT_VARIABLE code
    ERROR_VARIABLE errors)
  set(${result} ${code} PARENT_SCOPE)
  set(${text} "${errors}" PARENT_SCOPE)
endfunction()

compile("${HIGHER}" code errors)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "use ${MODULE} must compile in a higher layer:\n${errors}")
endif()
compile("${OWN}" code errors)
if(code EQUAL 0)
  message(FATAL_ERROR "use ${MODULE} compiles in a layer that must not see it")
endif()
if(NOT errors MATCHES "Cannot open module file [^\n]*${MODULE}\\.mod")
  message(FATAL_ERROR "use ${MODULE} fails for another reason:\n${errors}")
endif()
