#pragma once

#include <cstdint>
#include <string_view>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Problems of a dataset used by an experiment, so that settings are tuned on some and reported on others.
enum class Split : std::uint8_t {
  kAll,     ///< all problems
  kTuning,  ///< problems with an even id, for tuning of settings
  kTest,    ///< problems with an odd id, for reporting
};

template <>
inline constexpr auto kEnumNames<Split> =
    MakeEnumNames<Split>({{Split::kAll, "all"}, {Split::kTuning, "tuning"}, {Split::kTest, "test"}});

/// Returns whether a split contains the problem `problem_id`, >= 0.
constexpr bool ContainsProblem(Split split, int problem_id) {
  return split == Split::kAll || (split == Split::kTuning) == (problem_id % 2 == 0);
}

/// Text appended to the dataset's name in captions; empty for all problems.
constexpr std::string_view SplitCaption(Split split) {
  if (split == Split::kAll) return "";
  return split == Split::kTuning ? " (tuning split, even ids)" : " (test split, odd ids)";
}

}  // namespace legopt
