# Finds all third-party libraries of the library in legopt/. Included by this build and, when installed, by
# legopt-config.cmake for users of the library. Imported targets have their include folders as SYSTEM.
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(yaml-cpp REQUIRED)

pkg_check_modules(GLIB REQUIRED IMPORTED_TARGET glib-2.0)
pkg_check_modules(ODE REQUIRED IMPORTED_TARGET ode)
pkg_check_modules(URDFDOM REQUIRED IMPORTED_TARGET urdfdom)
pkg_check_modules(TINYXML2 REQUIRED IMPORTED_TARGET tinyxml2)
pkg_check_modules(ASSIMP REQUIRED IMPORTED_TARGET assimp)
pkg_check_modules(MINIZIP REQUIRED IMPORTED_TARGET minizip)
pkg_check_modules(IPOPT REQUIRED IMPORTED_TARGET ipopt)
pkg_check_modules(SODIUM REQUIRED IMPORTED_TARGET libsodium)
pkg_check_modules(SLEEF REQUIRED IMPORTED_TARGET sleef)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(QHULL REQUIRED IMPORTED_TARGET qhull_r)
pkg_check_modules(PNG REQUIRED IMPORTED_TARGET libpng)

# voro++ has no pkg-config file.
if(NOT TARGET voro++)
  find_library(VORO_LIBRARY voro++ REQUIRED)
  find_path(VORO_INCLUDE_DIR voro++/voro++.hh REQUIRED)
  add_library(voro++ UNKNOWN IMPORTED)
  set_target_properties(voro++ PROPERTIES
    IMPORTED_LOCATION ${VORO_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${VORO_INCLUDE_DIR})
endif()
