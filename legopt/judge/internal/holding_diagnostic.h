#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/judge/internal/holding_probe.h"
#include "legopt/robot/kinematics.h"
#include "legopt/statics/collapse_motion.h"

namespace legopt {

/// A point of a contact and the force on the robot there.
struct PointForce {
  Eigen::Vector3d position_W;  ///< m
  Eigen::Vector3d force_N;
};

/// A contact that carries, in a posture that is held or not.
struct ContactHolding {
  std::string contact;
  Eigen::Vector3d normal_W;              ///< unit normal of the surface, pointing out of it
  std::optional<double> friction;        ///< Coulomb coefficient; empty for a bar, whose forces are bounded instead
  std::vector<PointForce> forces;        ///< forces of points with a force; empty without equilibrium
  std::optional<SurfaceMovement> moves;  ///< movement in the collapse; only without equilibrium
};

/// How contacts and joints hold a posture, or why they do not (docs/explanation/judge.md#physical-rule).
struct HoldingDiagnostic {
  std::vector<ContactHolding> contacts;    ///< contacts that carry, in the order of the stance
  std::vector<Eigen::Vector2d> polygon_W;  ///< equilibrium polygon, world xy, counter-clockwise, m; may be empty
  bool balanced = false;                   ///< result of the judge's check `equilibrium`
  TorqueRatio torques;                     ///< StaticEquilibrium::ComputeLeastForces; only if balanced
  /// Degrees of freedom that must exceed their effort limits (TorqueRatio::decisive_dofs): several if contacts can
  /// relieve each of them only by loading another one.
  std::vector<int> overloaded;
  std::optional<Eigen::Vector3d> com_direction_W;  ///< unit: how the centre of mass falls; only without equilibrium
};

/// Explains the judge's checks `equilibrium` and `torque` of a posture. `holding`: a probe of `dataset`, whose Measure
/// decides. `kinematics`: after Update(), joints clamped to their limits. Nothing is listed for kinematics that
/// overflowed.
HoldingDiagnostic ExplainHolding(const Dataset& dataset, const Stance& stance, const Kinematics& kinematics,
                                 HoldingProbe* holding);

}  // namespace legopt
