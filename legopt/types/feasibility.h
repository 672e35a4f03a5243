#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Known feasibility of a stance or problem, independent of any method (docs/reference/datasets.md#certificates).
enum class Feasibility : std::uint8_t {
  kCertified,   ///< a posture that the judge accepts is known for every stance
  kInfeasible,  ///< a stance is proven to have no posture
  kOpen,        ///< neither is known
};

template <>
inline constexpr auto kEnumNames<Feasibility> = MakeEnumNames<Feasibility>({{Feasibility::kCertified, "certified"},
                                                                            {Feasibility::kInfeasible, "infeasible"},
                                                                            {Feasibility::kOpen, "open"}});

/// Constraints of a stance that can be disabled together to find the conflicting ones.
enum class ConstraintGroup : std::uint8_t {
  kBalance,      ///< centre of mass over the support polygon
  kSelf,         ///< collision between links
  kEnvironment,  ///< collision with the scene
};

template <>
inline constexpr auto kEnumNames<ConstraintGroup> =
    MakeEnumNames<ConstraintGroup>({{ConstraintGroup::kBalance, "balance"},
                                    {ConstraintGroup::kSelf, "self"},
                                    {ConstraintGroup::kEnvironment, "scene"}});

}  // namespace legopt
