#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Physics of a stance that the solver's problem contains beyond the task's (docs/explanation/problem.md#physics). Each
/// value includes the previous ones.
enum class Physics : std::uint8_t {
  kNone,     ///< the task's: centre of mass above the support polygon
  kBalance,  ///< centre of mass in the equilibrium polygon: friction holds the robot
  kEffort    ///< torques within the joints' effort limits
};

template <>
inline constexpr auto kEnumNames<Physics> =
    MakeEnumNames<Physics>({{Physics::kNone, "none"}, {Physics::kBalance, "balance"}, {Physics::kEffort, "effort"}});

}  // namespace legopt
