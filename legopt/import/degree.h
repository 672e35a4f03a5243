#pragma once

#include <numbers>

namespace legopt {

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< in radians

}  // namespace legopt
