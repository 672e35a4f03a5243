# Installs the library for find_package(legopt): targets legopt::robot, legopt::planning, ... (legopt/CMakeLists.txt lists
# the modules), headers under include/legopt, configuration with version.
include(CMakePackageConfigHelpers)
set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/legopt)

set_target_properties(legopt_options PROPERTIES EXPORT_NAME options)
foreach(module ${LEGOPT_MODULES})
  add_library(legopt::${module} ALIAS legopt_${module})
  set_target_properties(legopt_${module} PROPERTIES EXPORT_NAME ${module})
  install(TARGETS legopt_${module} EXPORT legopt
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library
    OBJECTS DESTINATION ${CMAKE_INSTALL_LIBDIR}/legopt COMPONENT library)
endforeach()
install(TARGETS legopt_options EXPORT legopt)
install(EXPORT legopt NAMESPACE legopt:: FILE legopt-targets.cmake DESTINATION ${config_folder} COMPONENT library)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/legopt
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/legopt COMPONENT library FILES_MATCHING PATTERN "*.h")
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/legopt-config.cmake.in legopt-config.cmake
  INSTALL_DESTINATION ${config_folder})
write_basic_package_version_file(legopt-config-version.cmake COMPATIBILITY SameMinorVersion)
install(
  FILES ${PROJECT_BINARY_DIR}/legopt-config.cmake ${PROJECT_BINARY_DIR}/legopt-config-version.cmake
        ${PROJECT_SOURCE_DIR}/cmake/LibraryDependencies.cmake
  DESTINATION ${config_folder} COMPONENT library)
