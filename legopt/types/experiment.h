#pragma once

#include <algorithm>
#include <cctype>
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

/// Suffix of the names of methods with an external solver.
inline constexpr char kExternalMark[] = " (external)";

/// Returns whether `wanted`, as typed by a user, names the method `name`. Ignores case; the suffix for external solvers
/// is optional.
inline bool IsMethodName(std::string_view name, std::string_view wanted) {
  const auto equal = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  };
  const auto same = [&equal](std::string_view a, std::string_view b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), equal);
  };
  const std::string_view mark = kExternalMark;
  return same(name, wanted) || (name.ends_with(mark) && same(name.substr(0, name.size() - mark.size()), wanted));
}

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
