#pragma once

#include <numbers>

namespace legopt {

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< one degree in radians

}  // namespace legopt
