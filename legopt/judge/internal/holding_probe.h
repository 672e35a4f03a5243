#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/robot/kinematics.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/statics/stance_forces.h"
#include "legopt/statics/static_equilibrium.h"

namespace legopt {

/// Whether contacts and joints can hold a posture.
struct Holding {
  /// Distance of the centre of mass outside the equilibrium polygon, m, >= 0; infinite if the polygon is empty.
  double distance_m = 0.0;
  /// Torque ratio (TorqueRatio::ratio); NaN if the centre of mass is further outside than kComTolerance_m.
  double torque_ratio = 0.0;
  int dof = -1;  ///< degree of freedom with that ratio; -1: none

  bool balanced() const;        ///< distance within its tolerance
  bool within_torques() const;  ///< balanced, and ratio within its tolerance
};

/// Measures static equilibrium with friction and effort limits. Keeps the forces and the polygon of the last stance.
///
/// The polygon is computed from the contacts' *targets*, except that bars are gripped where the posture grips them; the
/// torques from the actual posture. Near the tolerance of the
/// distance, the smallest imbalance (StaticEquilibrium::Imbalance) replaces the distance, because the polygon is
/// accurate to kPolygonAccuracy_m only.
///
/// A workspace: not thread-safe. Source: docs/explanation/judge.md#physical-rule.
class HoldingProbe {
 public:
  /// `dataset` must outlive this object.
  explicit HoldingProbe(const Dataset& dataset);

  /// Measures a posture. `kinematics`: after Update(), joints clamped to their limits.
  Holding Measure(const Stance& stance, const Kinematics& kinematics);

  /// Measures a posture whose stance does not occur again, without the polygon: distance_m is 0 or infinite, and
  /// balance is within kBalanceTolerance.
  Holding MeasureOnce(const Stance& stance, const Kinematics& kinematics);

  /// Returns the signed distance of the centre of mass from the stance's equilibrium polygon, m: > 0 outside, infinite
  /// if the polygon is empty.
  double SignedDistance(const Stance& stance, const Kinematics& kinematics);

  /// Corners of the equilibrium polygon of the last stance, world xy, m.
  const std::vector<Eigen::Vector2d>& polygon() const { return polygon_.corners; }

  /// Returns the push that the posture of the last Measure() resists (StaticEquilibrium::ResistedPush_N).
  double ResistedPush_N(const Kinematics& kinematics);

  /// Proof that the stance of the last Measure() cannot be held by any posture; empty if there is none.
  const std::optional<SlideProof>& slide() const { return polygon_.slide; }

 private:
  /// Computes the forces and the polygon of a stance, unless they are known.
  void Prepare(const Stance& stance, const Kinematics& kinematics);

  const Dataset& dataset_;
  StaticEquilibrium equilibrium_;
  std::optional<Stance> stance_;
  std::optional<StanceForces> forces_;
  EquilibriumPolygon polygon_;
};

}  // namespace legopt
