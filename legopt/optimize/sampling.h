#pragma once

namespace legopt {

/// Which terms an iteration looks at (paper, section IV).
struct Sampling {
  int percent = 100;         ///< share of the program's terms that is refreshed per iteration, 1..100
  bool incremental = false;  ///< terms that are not refreshed keep their last gradient or model instead of dropping out
};

}  // namespace legopt
