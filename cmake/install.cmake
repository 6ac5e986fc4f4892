# cmake --install, find_package(Stirpoint) and a Debian package (cpack -G DEB).
include(CMakePackageConfigHelpers)
install(TARGETS stirpoint EXPORT StirpointTargets RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
if(HAVE_PETSC)
  install(TARGETS petsc LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/stirpoint)
endif()
install(DIRECTORY share/ DESTINATION ${CMAKE_INSTALL_DATAROOTDIR})
install(FILES README.md LICENSE CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs input jobscripts DESTINATION ${CMAKE_INSTALL_DOCDIR}
  FILES_MATCHING PATTERN "*.md" PATTERN "*.nml" PATTERN "*.csv" PATTERN "*.png" PATTERN "slurm.sh")

# Stirpoint::stirpoint is the program, for projects that run it.
set(config_directory ${CMAKE_INSTALL_LIBDIR}/cmake/Stirpoint)
install(EXPORT StirpointTargets NAMESPACE Stirpoint:: DESTINATION ${config_directory})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/generated/StirpointConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
file(WRITE ${CMAKE_BINARY_DIR}/generated/StirpointConfig.cmake
  "include(\"\${CMAKE_CURRENT_LIST_DIR}/StirpointTargets.cmake\")\n")
install(FILES
  ${CMAKE_BINARY_DIR}/generated/StirpointConfig.cmake
  ${CMAKE_BINARY_DIR}/generated/StirpointConfigVersion.cmake
  DESTINATION ${config_directory})

# The module file of environment modules and Lmod knows where it was installed.
configure_file(packaging/modulefile.in ${CMAKE_BINARY_DIR}/generated/${PROJECT_VERSION} @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/generated/${PROJECT_VERSION}
  DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/modulefiles/stirpoint)

set(CPACK_PACKAGE_NAME stirpoint)
set(CPACK_PACKAGE_CONTACT "The Stirpoint developers <stirpoint@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Friction stir processing with the Material Point Method")
set(CPACK_PACKAGE_DESCRIPTION "A rotating tool stirs metal: temperatures, flow, force and torque from first steps to
whole passes. Parallel with MPI; results open in ParaView.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_GENERATOR DEB)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
if(MPI_Fortran_LIBRARY_VERSION_STRING MATCHES "Open MPI")
  set(CPACK_DEBIAN_PACKAGE_DEPENDS openmpi-bin)
else()
  set(CPACK_DEBIAN_PACKAGE_DEPENDS mpich)
endif()
include(CPack)
