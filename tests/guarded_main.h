#pragma once

#include <cstdio>
#include <exception>

namespace legopt {

/// The main function of a test program: what escapes from `body` ends it with a line and 1, not with an abort.
inline int GuardedMain(int argc, char** argv, int (*body)(int argc, char** argv)) noexcept {
  try {
    return body(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
}

}  // namespace legopt
