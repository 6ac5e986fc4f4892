# Compiler flags. Never -ffast-math: -fno-trapping-math gives the same speed and keeps NaN checks.
if(NOT CMAKE_Fortran_COMPILER_ID STREQUAL "GNU" OR CMAKE_Fortran_COMPILER_VERSION VERSION_LESS 12)
  message(FATAL_ERROR "Stirpoint needs gfortran 12 or newer (found ${CMAKE_Fortran_COMPILER_ID} ${CMAKE_Fortran_COMPILER_VERSION})")
endif()
add_compile_options(
  -Wall
  -Wextra
  $<$<BOOL:${STIRPOINT_WERROR}>:-Werror>
  $<$<COMPILE_LANGUAGE:Fortran>:-std=f2018>
  $<$<COMPILE_LANGUAGE:Fortran>:-Wno-compare-reals>
  $<$<COMPILE_LANGUAGE:Fortran>:-Wno-unused-dummy-argument>
  $<$<COMPILE_LANGUAGE:Fortran>:-Wno-maybe-uninitialized>
  $<$<COMPILE_LANGUAGE:Fortran>:-Wno-function-elimination>   # keys are looked up after .and.
  $<$<COMPILE_LANGUAGE:Fortran>:-ffree-line-length-none>
  $<$<COMPILE_LANGUAGE:Fortran>:-fopenmp-simd>)
set(CMAKE_Fortran_FLAGS_RELEASE "-O3 -march=${STIRPOINT_ARCH} -fno-trapping-math -mprefer-vector-width=512")
set(CMAKE_C_FLAGS_RELEASE "-O3 -march=${STIRPOINT_ARCH}")
include(CheckCSourceCompiles)
set(CMAKE_REQUIRED_FLAGS "-march=${STIRPOINT_ARCH}")
check_c_source_compiles("#ifndef __AVX512F__\n#error\n#endif\nint main(void) { return 0; }" HAS_AVX512_${STIRPOINT_ARCH})
check_c_source_compiles("#if !(defined(__znver3__) || defined(__znver4__))\n#error\n#endif\nint main(void) { return 0; }" HAS_HALVES_${STIRPOINT_ARCH})
unset(CMAKE_REQUIRED_FLAGS)
if(HAS_AVX512_${STIRPOINT_ARCH})
  add_compile_definitions($<$<CONFIG:Release>:STIRPOINT_AVX512>)   # a record of 8 numbers of a node fills one register
endif()
set(cpu_family "cpu family: 25")
if(STIRPOINT_ARCH STREQUAL "native" AND EXISTS /proc/cpuinfo)   # gfortran 12 takes later processors for Zen 3
  file(STRINGS /proc/cpuinfo cpu_family REGEX "^cpu family" LIMIT_COUNT 1)
endif()
if(HAS_HALVES_${STIRPOINT_ARCH} AND cpu_family MATCHES ": 25$")
  add_compile_definitions($<$<CONFIG:Release>:STIRPOINT_HALVES>)   # Zen 4 executes 512 bits as two halves
endif()
add_compile_definitions($<$<CONFIG:Debug>:STIRPOINT_CONTRACTS>)   # kernels check their arguments
set(sanitizers "-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer")
set(CMAKE_Fortran_FLAGS_DEBUG "-g -O1 -fcheck=all,no-array-temps -ffpe-trap=invalid,zero,overflow -fbacktrace ${sanitizers}")
set(CMAKE_C_FLAGS_DEBUG "-g -O1 ${sanitizers}")
set(CMAKE_EXE_LINKER_FLAGS_DEBUG "-fsanitize=address,undefined")
