# legopt_options: options required to compile the headers of this library, in this build and in programs that link the
# installed library.
add_library(legopt_options INTERFACE)
target_include_directories(legopt_options INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/legopt>)
target_compile_features(legopt_options INTERFACE cxx_std_20)
if(LEGOPT_ARCH AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Determines how Eigen aligns its fixed-size types, and so the memory layout of types that contain them.
  target_compile_options(legopt_options INTERFACE -march=${LEGOPT_ARCH})
endif()
# No fusing of products and sums unless the source requests it: it would depend on inlining, and the same seed would
# give different bits in another build (sources compiled one at a time or in batches). Eigen's kernels fuse explicitly.
target_compile_options(legopt_options INTERFACE -ffp-contract=off)

# Warnings apply only to the code of this repository: they are set for the folder, so that users do not inherit them.
# Third-party code is never compiled here.
add_compile_options(
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Woverloaded-virtual
  $<$<BOOL:${LEGOPT_WERROR}>:-Werror>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # False positives of g++ 12: the first two in Eigen's assignments of 3-vectors, the others for "literal" +
  # std::string.
  add_compile_options(-Wno-array-bounds -Wno-maybe-uninitialized -Wno-restrict -Wno-stringop-overflow)
  # g++ starts garbage collection at 128 MB, which takes a sixth of a build; it starts later if each compiler has 3 GB.
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

# Flags that may change the bits of a result, for users and the build's id.
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
set(LEGOPT_NUMERIC_FLAGS ${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${build_type}})
get_target_property(interface_flags legopt_options INTERFACE_COMPILE_OPTIONS)
list(APPEND LEGOPT_NUMERIC_FLAGS ${interface_flags})
if(LEGOPT_SANITIZE)
  list(APPEND LEGOPT_NUMERIC_FLAGS -fsanitize=${LEGOPT_SANITIZE})
endif()
list(REMOVE_DUPLICATES LEGOPT_NUMERIC_FLAGS)
list(JOIN LEGOPT_NUMERIC_FLAGS " " LEGOPT_NUMERIC_FLAGS)

# legopt_optimize_rooms(LEVEL): sets the optimization level of the following folders in Release builds. All numerics is
# in legopt/, which has the highest level. Elsewhere run time is spent in system calls and SQLite, and a lower level
# shortens the build. There is no link-time optimization: it took a quarter of the build time without speeding up
# solves.
macro(legopt_optimize_rooms level)
  set(CMAKE_CXX_FLAGS_RELEASE "${level} -DNDEBUG")
endmacro()
