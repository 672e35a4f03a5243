# Installs the library for find_package(legopt): targets legopt::robot, legopt::solve, ... (legopt/CMakeLists.txt has the
# rooms), headers under include/legopt, configuration with version.
include(CMakePackageConfigHelpers)
set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/legopt)

set_target_properties(legopt_options PROPERTIES EXPORT_NAME options)
foreach(room ${LEGOPT_ROOMS})
  add_library(legopt::${room} ALIAS legopt_${room})
  set_target_properties(legopt_${room} PROPERTIES EXPORT_NAME ${room})
  install(TARGETS legopt_${room} EXPORT legopt ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library)
endforeach()
install(TARGETS legopt_options EXPORT legopt)
if(LEGOPT_LTO)
  # Link-time optimisation's part of the archives fits this compiler alone; the machine code beside it fits all.
  install(CODE "
    file(GLOB archives \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/liblegopt_*.a\")
    foreach(archive \${archives})
      execute_process(COMMAND ${CMAKE_OBJCOPY} --wildcard --remove-section .gnu.lto_* --remove-section .gnu.debuglto_*
                              --strip-symbol __gnu_lto_v1 \${archive} COMMAND_ERROR_IS_FATAL ANY)
    endforeach()" COMPONENT library)
endif()
install(EXPORT legopt NAMESPACE legopt:: FILE legopt-targets.cmake DESTINATION ${config_folder} COMPONENT library)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/legopt ${PROJECT_SOURCE_DIR}/words
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/legopt COMPONENT library FILES_MATCHING PATTERN "*.h")
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/legopt-config.cmake.in legopt-config.cmake
  INSTALL_DESTINATION ${config_folder})
write_basic_package_version_file(legopt-config-version.cmake COMPATIBILITY SameMinorVersion)
install(
  FILES ${PROJECT_BINARY_DIR}/legopt-config.cmake ${PROJECT_BINARY_DIR}/legopt-config-version.cmake
        ${PROJECT_SOURCE_DIR}/cmake/LibraryDependencies.cmake
  DESTINATION ${config_folder} COMPONENT library)
