#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// What a comparison shows of the second of two methods, beside the first.
enum class Change : std::uint8_t {
  kNone,    ///< no difference is shown, which is not to say that there is none
  kBetter,  ///< it solves more, is faster or cheaper
  kWorse,   ///< it solves fewer, is slower or dearer
  kMixed,   ///< better in one respect, worse in another
};

template <>
inline constexpr auto kWords<Change> = Words<Change>(
    {{Change::kNone, "none"}, {Change::kBetter, "better"}, {Change::kWorse, "worse"}, {Change::kMixed, "mixed"}});

}  // namespace legopt
