#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "legopt/judge/internal/holding_diagnostic.h"

namespace legopt::client {

/// Returns forces, friction, torques and the reason for which a posture is not held, in the format of
/// docs/reference/page-data.md ("holding"). Lengths are rounded to 0.1 mm, forces and torques to 0.01 N (m), directions
/// and shares to 1e-4. `with_polygon`: include the equilibrium polygon.
nlohmann::ordered_json HoldingJson(const HoldingDiagnostic& holding, bool with_polygon);

/// Returns limits of degrees of freedom; null: none.
nlohmann::ordered_json LimitsJson(const Eigen::VectorXd& limits);

/// Returns a number rounded to a multiple of `unit`, with a short decimal text; null if it is not finite.
nlohmann::ordered_json RoundedTo(double unit, double value);

/// Returns the numbers of a vector or list, rounded to multiples of `unit`.
template <class Vector>
nlohmann::ordered_json RoundedVectorJson(double unit, const Vector& vector) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const double value : vector) json.push_back(RoundedTo(unit, value));
  return json;
}

}  // namespace legopt::client
