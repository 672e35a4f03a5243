#include "legopt/judge/internal/holding_probe.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/dataset/contact.h"
#include "legopt/judge/internal/diagnostic.h"
#include "legopt/types/check.h"

namespace legopt {

bool Holding::balanced() const { return !Exceeds(distance_m, kComTolerance_m); }

bool Holding::within_torques() const { return balanced() && !Exceeds(torque_ratio, kTorqueTolerance); }

HoldingProbe::HoldingProbe(const Dataset& dataset)
    : dataset_(dataset), equilibrium_(dataset.robot(), dataset.gravity_m_s2()) {}

void HoldingProbe::Prepare(const Stance& stance, const Kinematics& kinematics) {
  const bool slides = SlidesUnderLoad(dataset_, stance);
  if (stance_ && *stance_ == stance && !slides) return;
  stance_ = stance;
  forces_.emplace(SurfacesOf(dataset_, stance, &kinematics));
  polygon_ = ComputeEquilibriumPolygon(*forces_);
  if (slides) polygon_.slide.reset();  // another grip may hold
}

double HoldingProbe::SignedDistance(const Stance& stance, const Kinematics& kinematics) {
  if (!kinematics.com().allFinite()) return std::numeric_limits<double>::infinity();
  Prepare(stance, kinematics);
  if (polygon_.corners.empty()) return std::numeric_limits<double>::infinity();
  return SignedDistanceToPolygon(polygon_.corners, kinematics.com().head<2>());
}

double HoldingProbe::ResistedPush_N(const Kinematics& kinematics) {
  return equilibrium_.ResistedPush_N(*forces_, kinematics);
}

Holding HoldingProbe::Measure(const Stance& stance, const Kinematics& kinematics) {
  Holding holding;
  holding.torque_ratio = std::numeric_limits<double>::quiet_NaN();
  holding.distance_m = std::numeric_limits<double>::infinity();
  if (!kinematics.com().allFinite()) return holding;
  Prepare(stance, kinematics);
  if (polygon_.corners.empty()) return holding;
  const double distance = SignedDistanceToPolygon(polygon_.corners, kinematics.com().head<2>());
  holding.distance_m = std::max(0.0, distance);
  if (std::abs(distance - kComTolerance_m) < kPolygonAccuracy_m) {
    holding.distance_m = equilibrium_.Imbalance(*forces_, kinematics.com());
  }
  if (!holding.balanced()) return holding;
  const TorqueRatio torques = equilibrium_.ComputeTorqueRatio(*forces_, kinematics);
  holding.torque_ratio = torques.ratio;
  holding.dof = torques.dof;
  return holding;
}

Holding HoldingProbe::MeasureOnce(const Stance& stance, const Kinematics& kinematics) {
  const TorqueRatio torques =
      equilibrium_.ComputeTorqueRatio(StanceForces(SurfacesOf(dataset_, stance, &kinematics)), kinematics);
  return {.distance_m = std::isfinite(torques.ratio) ? 0.0 : torques.ratio,
          .torque_ratio = torques.ratio,
          .dof = torques.dof};
}

}  // namespace legopt
