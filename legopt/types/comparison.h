#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Result of comparing a second method with a first one.
enum class ComparisonResult : std::uint8_t {
  kNone,    ///< no difference found; this does not prove that there is none
  kBetter,  ///< the second method solves more, is faster or cheaper
  kWorse,   ///< the second method solves fewer, is slower or more expensive
  kMixed,   ///< better in one respect, worse in another
};

template <>
inline constexpr auto kEnumNames<ComparisonResult> =
    MakeEnumNames<ComparisonResult>({{ComparisonResult::kNone, "none"},
                                     {ComparisonResult::kBetter, "better"},
                                     {ComparisonResult::kWorse, "worse"},
                                     {ComparisonResult::kMixed, "mixed"}});

}  // namespace legopt
