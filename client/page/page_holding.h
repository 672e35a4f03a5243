#pragma once

#include <nlohmann/json.hpp>

#include "legopt/judge/internal/holding_diagnostic.h"
#include "legopt/robot/robot_model.h"

namespace legopt::client {

/// Returns forces, friction, torques and the reason for which a posture is not held, in the format of
/// docs/reference/page-data.md ("holding"). Lengths are rounded to 0.1 mm, forces and torques to 0.01 N (m), directions
/// and shares to 1e-4. `with_polygon`: include the equilibrium polygon.
nlohmann::ordered_json HoldingJson(const HoldingDiagnostic& holding, bool with_polygon);

/// Returns the effort limit of each degree of freedom, N m or N; null: none.
nlohmann::ordered_json EffortLimitsJson(const RobotModel& robot);

}  // namespace legopt::client
