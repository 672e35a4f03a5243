#pragma once

#include <cstdio>
#include <exception>

namespace legopt {

/// Main function of a test program. An exception that escapes from `body` is printed and the program exits with 1
/// instead of aborting.
inline int GuardedMain(int argc, char** argv, int (*body)(int argc, char** argv)) noexcept {
  try {
    return body(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
}

}  // namespace legopt
