# Writes FILE, a C source that names the commit of SOURCE, if it is not what FILE already says. Only the
# repository whose top SOURCE is counts: not one around an unpacked archive.
set(commit unknown)
find_program(GIT git)
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --show-cdup
    OUTPUT_VARIABLE up RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(NOT failed AND up STREQUAL "")
    execute_process(COMMAND ${GIT} --no-optional-locks -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
      OUTPUT_VARIABLE found RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(NOT failed AND found MATCHES "^[0-9a-f]+(-dirty)?$")
      set(commit ${found})
    endif()
  endif()
endif()
file(CONFIGURE OUTPUT ${FILE} @ONLY CONTENT [[
/* Written by cmake/commit.cmake. */
#include <string.h>

void stirpoint_commit(char name[64]) { strncpy(name, "@commit@", 64); }
]])
