#pragma once

namespace legopt {

/// Selection of the terms that an iteration evaluates (paper, section IV).
struct Sampling {
  int percent = 100;         ///< share of the program's terms that is refreshed per iteration, 1..100
  bool incremental = false;  ///< terms that are not refreshed keep their last gradient or model
};

}  // namespace legopt
