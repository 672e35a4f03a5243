# Finds all third-party libraries.
include(${CMAKE_CURRENT_LIST_DIR}/LibraryDependencies.cmake)
find_package(Boost 1.74 REQUIRED)  # headers that the library's sources include; its users need none of them
if(LEGOPT_LIBRARY_ONLY)
  return()
endif()

find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(ZLIB REQUIRED)
pkg_check_modules(LCM REQUIRED IMPORTED_TARGET lcm)
pkg_check_modules(CAIRO REQUIRED IMPORTED_TARGET cairo-pdf)
pkg_check_modules(MICROHTTPD REQUIRED IMPORTED_TARGET libmicrohttpd)
pkg_check_modules(SQLITE REQUIRED IMPORTED_TARGET sqlite3>=3.40)

# lcm-gen is installed next to liblcm; Debian ships no CMake configuration for it.
pkg_get_variable(LCM_PREFIX lcm prefix)
find_program(LCM_GEN lcm-gen HINTS ${LCM_PREFIX}/bin REQUIRED)
