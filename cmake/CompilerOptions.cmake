# legopt_options: compiler options required for our headers, both in this build and for users of the installed library.
add_library(legopt_options INTERFACE)
target_include_directories(legopt_options INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/legopt>)
target_compile_features(legopt_options INTERFACE cxx_std_20)
if(LEGOPT_ARCH AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Determines the alignment of Eigen's fixed-size types, and therefore the layout of our types.
  target_compile_options(legopt_options INTERFACE -march=${LEGOPT_ARCH})
endif()
# Disables implicit fusing of products and sums: it would depend on inlining, so the same seed would give different bits
# in another build (e.g. with single or combined sources). Eigen's kernels fuse explicitly.
target_compile_options(legopt_options INTERFACE -ffp-contract=off)

# Warnings apply to our own code only: they are set for the folder, so that no user inherits them. Third-party code is
# never compiled here.
add_compile_options(
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Woverloaded-virtual
  $<$<BOOL:${LEGOPT_WERROR}>:-Werror>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # False alarms of g++ 12: the first two in Eigen's assignments of 3-vectors, the others for "literal" + std::string.
  add_compile_options(-Wno-array-bounds -Wno-maybe-uninitialized -Wno-restrict -Wno-stringop-overflow)
  # g++ starts its garbage collection at 128 MB, which costs a sixth of a build. Starts later if each compiler has 3 GB.
  cmake_host_system_information(RESULT memory_mib QUERY TOTAL_PHYSICAL_MEMORY)
  cmake_host_system_information(RESULT processors QUERY NUMBER_OF_LOGICAL_CORES)
  math(EXPR memory_mib "${memory_mib} / ${processors}")
  if(memory_mib GREATER_EQUAL 3072)
    add_compile_options("SHELL:--param ggc-min-heapsize=1000000")
  endif()
endif()

set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

if(LEGOPT_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "LEGOPT_FUZZ needs clang: cmake --preset fuzz")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
if(LEGOPT_SANITIZE)
  add_compile_options(-fsanitize=${LEGOPT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${LEGOPT_SANITIZE})
endif()
if(LEGOPT_FUZZ)
  # AddressSanitizer finds what these checks of pointers find, and they take long to compile. The preset asan-ubsan has
  # them.
  add_compile_options(-fno-sanitize=null,object-size,pointer-overflow,vptr)
endif()

# Flags that may change the bits of a result; displayed to users and part of the build's id.
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
set(LEGOPT_NUMERIC_FLAGS ${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${build_type}})
get_target_property(interface_flags legopt_options INTERFACE_COMPILE_OPTIONS)
list(APPEND LEGOPT_NUMERIC_FLAGS ${interface_flags})
if(LEGOPT_SANITIZE)
  list(APPEND LEGOPT_NUMERIC_FLAGS -fsanitize=${LEGOPT_SANITIZE})
endif()
list(REMOVE_DUPLICATES LEGOPT_NUMERIC_FLAGS)
list(JOIN LEGOPT_NUMERIC_FLAGS " " LEGOPT_NUMERIC_FLAGS)

# legopt_set_optimization_level(LEVEL): compiles the following targets with this level in Release builds. All numerics is in
# legopt/, which uses the highest level. Elsewhere a job's time is spent in system calls and SQLite, and a lower level
# shortens builds. Link-time optimisation is off: it took a quarter of a build, and solves are as fast without it.
macro(legopt_set_optimization_level level)
  set(CMAKE_CXX_FLAGS_RELEASE "${level} -DNDEBUG")
endmacro()
