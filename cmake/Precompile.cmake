# Precompiled headers of all targets but the tests (legopt_precompile in tests/CMakeLists.txt). They save about a fifth of
# the compiler's time. Off with ccache, which does not cache such objects, and with LEGOPT_UNITY=OFF (preset debug),
# which checks that every source includes the headers that it needs.
set(LEGOPT_PRECOMPILE OFF)
if(LEGOPT_UNITY AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(LEGOPT_PRECOMPILE ON)
  # Defines a macro that the standard library reads. A compiler accepts a precompiled header only if such options are
  # the same.
  add_compile_options(-pthread)
endif()

# legopt_add_precompiled_header(): adds a precompiled header with the current optimization level, which must be the same
# in targets that use it. Not with clang, which spends its time in other parts: sanitized modules took as long with it.
function(legopt_add_precompiled_header)
  legopt_name_precompiled_header(name "${CMAKE_CXX_FLAGS_RELEASE}")
  if(LEGOPT_PRECOMPILE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT TARGET ${name})
    # A folder of its own, because CMake reads the level of a folder at its end.
    add_subdirectory(${PROJECT_SOURCE_DIR}/cmake/precompiled ${PROJECT_BINARY_DIR}/modules/${name})
  endif()
endfunction()

function(legopt_name_precompiled_header out flags)
  if(NOT CMAKE_BUILD_TYPE STREQUAL "Release")
    set(flags "")
  endif()
  string(MAKE_C_IDENTIFIER "legopt_precompiled_header${flags}" name)
  set(${out} ${name} PARENT_SCOPE)
endfunction()

# legopt_use_precompiled_header(TARGET): compiles a target of this project with the precompiled header of its level.
function(legopt_use_precompiled_header target)
  get_target_property(folder ${target} SOURCE_DIR)
  get_directory_property(flags DIRECTORY ${folder} DEFINITION CMAKE_CXX_FLAGS_RELEASE)
  legopt_name_precompiled_header(name "${flags}")
  set(examples ${PROJECT_SOURCE_DIR}/examples)
  cmake_path(IS_PREFIX examples ${folder} example)  # compiled with a user's options
  get_target_property(headers ${target} PRECOMPILE_HEADERS)
  get_target_property(reused ${target} PRECOMPILE_HEADERS_REUSE_FROM)
  if(TARGET ${name} AND NOT example AND NOT headers AND NOT reused)
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()
