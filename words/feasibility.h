#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// What is known of a stance or a problem, whatever a method makes of it (docs/datasets.md#certificates).
enum class Feasibility : std::uint8_t {
  kCertified,   ///< a posture for every stance is known that the judge accepts
  kInfeasible,  ///< a stance has no posture: proven
  kOpen,        ///< neither
};

template <>
inline constexpr auto kWords<Feasibility> = Words<Feasibility>({{Feasibility::kCertified, "certified"},
                                                                {Feasibility::kInfeasible, "infeasible"},
                                                                {Feasibility::kOpen, "open"}});

/// Constraints of a stance that can be left out together, to learn which of them stand in the way.
enum class ConstraintGroup : std::uint8_t {
  kBalance,      ///< the centre of mass over the support polygon
  kSelf,         ///< collision between links
  kEnvironment,  ///< collision with the scene
};

template <>
inline constexpr auto kWords<ConstraintGroup> = Words<ConstraintGroup>({{ConstraintGroup::kBalance, "balance"},
                                                                        {ConstraintGroup::kSelf, "self"},
                                                                        {ConstraintGroup::kEnvironment, "scene"}});

}  // namespace legopt
