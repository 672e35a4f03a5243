#pragma once

#include "legopt/problem/program.h"
#include "legopt/problem/terms/waypoint_state.h"

namespace legopt {

/// Computes the difference of two configurations (n + 7 each) in n + 6 numbers: joints, base position (m), and 2 e,
/// where e is the vector part of the shorter unit quaternion of R_to R_from^T. 2 e is the rotation vector in world
/// axes, up to the third order.
void ConfigurationDifference(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                             Eigen::Ref<Eigen::VectorXd> difference);

/// Cost of a transition: squared change from one waypoint to the next, joints and base with weight 1 (the judge counts
/// joints only). All transitions of a program form one sampling unit (docs/explanation/paper.md#terms-and-samples).
class VelocityCostTerm : public Term {
 public:
  /// The states are those of `waypoint` and its successor and must outlive the term.
  VelocityCostTerm(int waypoint, int unit, const WaypointState& from, const WaypointState& to);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;

 private:
  const WaypointState* from_;
  const WaypointState* to_;
  Eigen::VectorXd difference_;
};

}  // namespace legopt
