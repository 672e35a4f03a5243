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

# The public headers are those of the guide; internal ones are installed only if a public one includes them.
set(guide ${PROJECT_SOURCE_DIR}/docs/reference/library.md)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${guide})
file(STRINGS ${guide} rows REGEX "^\\| \\[`legopt/")
set(headers "")
foreach(row IN LISTS rows)
  string(REGEX REPLACE "^\\| \\[`([^`]+)`.*" "\\1" header "${row}")
  list(APPEND headers ${header})
endforeach()
set(queue ${headers})
while(queue)
  list(POP_FRONT queue header)
  file(STRINGS ${PROJECT_SOURCE_DIR}/${header} includes REGEX "^#include \"legopt/")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" included "${include}")
    if(NOT included IN_LIST headers)
      list(APPEND headers ${included})
      list(APPEND queue ${included})
    endif()
  endforeach()
endwhile()
foreach(header IN LISTS headers)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/${header}
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/legopt/${folder} COMPONENT library)
endforeach()
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/legopt-config.cmake.in legopt-config.cmake
  INSTALL_DESTINATION ${config_folder})
write_basic_package_version_file(legopt-config-version.cmake COMPATIBILITY SameMinorVersion)
install(
  FILES ${PROJECT_BINARY_DIR}/legopt-config.cmake ${PROJECT_BINARY_DIR}/legopt-config-version.cmake
        ${PROJECT_SOURCE_DIR}/cmake/LibraryDependencies.cmake
  DESTINATION ${config_folder} COMPONENT library)
