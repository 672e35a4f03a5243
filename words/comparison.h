#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// Result of comparing a second method with a first one.
enum class Change : std::uint8_t {
  kNone,    ///< no difference found; this does not prove that there is none
  kBetter,  ///< the second method solves more, is faster or cheaper
  kWorse,   ///< the second method solves fewer, is slower or more expensive
  kMixed,   ///< better in one respect, worse in another
};

template <>
inline constexpr auto kWords<Change> = Words<Change>(
    {{Change::kNone, "none"}, {Change::kBetter, "better"}, {Change::kWorse, "worse"}, {Change::kMixed, "mixed"}});

}  // namespace legopt
