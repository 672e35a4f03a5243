#pragma once

#include <cstdint>
#include <string_view>

#include "words/words.h"

namespace legopt {

/// Which problems of a dataset an experiment takes, so that settings are chosen on some and reported on others.
enum class Split : std::uint8_t {
  kAll,     ///< both
  kTuning,  ///< with an even id: what settings may be chosen on
  kTest,    ///< with an odd id: what they are reported on
};

template <>
inline constexpr auto kWords<Split> =
    Words<Split>({{Split::kAll, "all"}, {Split::kTuning, "tuning"}, {Split::kTest, "test"}});

/// Whether a split has the problem with this id, >= 0.
constexpr bool Holds(Split split, int problem_id) {
  return split == Split::kAll || (split == Split::kTuning) == (problem_id % 2 == 0);
}

/// What captions say behind the dataset's name; nothing where all problems were taken.
constexpr std::string_view Mention(Split split) {
  if (split == Split::kAll) return "";
  return split == Split::kTuning ? " (tuning split, even ids)" : " (test split, odd ids)";
}

}  // namespace legopt
