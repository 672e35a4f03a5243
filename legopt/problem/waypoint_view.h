#pragma once

#include <memory>
#include <vector>

#include "legopt/problem/program.h"

namespace legopt {

/// One waypoint of a program alone: its variables, and the constraints that touch no other waypoint. Costs and
/// preferences are left out. If constraints do not couple waypoints, a point of the whole program is feasible if and
/// only if every view of it is.
///
/// A workspace over the whole program, which must outlive it and whose point it changes. Evaluations count as the whole
/// program's. One thread.
class WaypointView : public Program {
 public:
  /// Views `waypoint` of `whole`, with the others as in `x` (num_waypoints * point_size of the whole).
  WaypointView(Program& whole, int waypoint, Eigen::Ref<const Eigen::VectorXd> x);

  int num_waypoints() const override { return 1; }
  int tangent_size() const override { return whole_->tangent_size(); }
  int point_size() const override { return whole_->point_size(); }
  /// Returns the constraints of the waypoint, which becomes waypoint 0.
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  void ClearCache() override { whole_->ClearCache(); }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override;
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override;
  void PullBack(const double* dx, double* row) const override { whole_->PullBack(dx, row); }
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override;
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override;

  /// Returns whether the whole program lets the waypoint move.
  bool IsFree() const;

 private:
  /// Returns the waypoint's part of a vector with `size` entries per waypoint.
  auto Part(Eigen::VectorXd& vector, int size) const {
    return vector.segment(static_cast<Eigen::Index>(waypoint_) * size, size);
  }

  Program* whole_;
  int waypoint_;
  std::vector<std::unique_ptr<Term>> terms_;
  mutable Eigen::VectorXd x_, dx_, next_, lower_, upper_;  ///< vectors of the whole program
};

}  // namespace legopt
