#pragma once

#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/problem/program.h"
#include "legopt/problem/terms/internal/term_weights.h"
#include "legopt/problem/terms/internal/waypoint_terms.h"
#include "legopt/statics/static_equilibrium.h"
#include "legopt/types/physics.h"

namespace legopt {

// Terms of static equilibrium at one waypoint, without variables for the contact forces. Each refers to the state of
// its waypoint, which must outlive it. Source: docs/explanation/problem.md#physics.

/// Share of an effort limit that solvers leave unused, so that their tolerance does not exceed the judge's.
inline constexpr double kEffortShare = 0.98;

/// Share of an effort limit above which a torque becomes a row.
inline constexpr double kNearEffortShare = 0.7;

/// Distance from the edges of an equilibrium polygon: the smaller one of most_m and `share` times its area by its
/// perimeter, which is at most the radius of a circle inside. By default, forces with a margin hold all of it.
struct BalanceInset {
  double most_m = 1e-3;
  double share = 0.5;
};

/// Returns half-planes in which the centre of mass must be. On feet (StandsOnFeet) without physics: the edges of the
/// support polygon. Else those of the equilibrium polygon, moved inwards, and on feet also those of the support polygon
/// if it is smaller. None for a stance that nothing balances.
std::vector<HalfPlane> BalanceEdges(const Dataset& dataset, const Stance& stance, Physics physics,
                                    const BalanceInset& inset = {});

/// Inequality: torques of joints that no contact of the stance loads, which gravity alone determines:
/// +-g_j / limit_j - kEffortShare <= 0, 1. A joint has a row if it needs more than kNearEffortShare of its limit.
class FreeTorqueTerm : public Term {
 public:
  FreeTorqueTerm(int waypoint, WaypointState& state, const Dataset& dataset, const Stance& stance);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  /// Appends twice the degree of freedom, plus 1 for a negative torque.
  void RowKeys(int rows, std::vector<int>& keys) override;
  double AbsentRow() const override { return kNearEffortShare - kEffortShare; }

  std::int64_t weight_ns() const override { return term_weights::kFreeTorque_ns; }

 private:
  /// Sets torques_ and near_.
  void FindNear();

  WaypointState* state_;
  double gravity_m_s2_;
  std::vector<int> free_;  ///< degrees of freedom
  std::vector<int> near_;  ///< degrees of freedom with a row
  Eigen::VectorXd torques_;
  Eigen::MatrixXd jacobian_;
};

/// Inequality: the loaded joints' least torque ratio, t - kEffortShare <= 0, 1. The ratio is the optimum of a linear
/// program (StaticEquilibrium::ComputeLoadedRatio), its gradient follows from the multipliers. Without equilibrium
/// there is no row: the centre of mass is then outside of the polygon, whose rows lead back.
class LoadedTorqueTerm : public Term {
 public:
  LoadedTorqueTerm(int waypoint, WaypointState& state, const Dataset& dataset, const Stance& stance);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  double AbsentRow() const override { return kNearEffortShare - kEffortShare; }

  std::int64_t weight_ns() const override { return term_weights::kLoadedTorque_ns; }

 private:
  /// Sets result_; the ratio is infinite if there is no row.
  void Compute(bool with_gradient);

  WaypointState* state_;
  StanceForces forces_;
  StaticEquilibrium equilibrium_;
  LoadedRatio result_;
  std::uint64_t revision_ = 0;  ///< revision of the state at the last computation
  bool has_gradient_ = false;
  bool is_near_ = false;  ///< result_ had a ratio near its limit, or above
};

/// Inequality: the stance's push is resisted within contacts and efforts in all directions, (required - resisted) /
/// weight <= 0, 1. One row, for the weakest direction (StaticEquilibrium::ComputeWeakestPush), unless all directions
/// resist kNearPushShare of it. Without equilibrium there is no row, as for LoadedTorqueTerm.
class LoadedPushTerm : public Term {
 public:
  /// `stance` has a push.
  LoadedPushTerm(int waypoint, WaypointState& state, const Dataset& dataset, const Stance& stance);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  double AbsentRow() const override { return (1.0 - kNearPushShare) * required_N_ / weight_N_; }

  std::int64_t weight_ns() const override { return term_weights::kLoadedPush_ns; }

 private:
  static constexpr double kNearPushShare = 1.1;

  /// Sets result_; the push is infinite if there is no row.
  void Compute(bool with_gradient);

  WaypointState* state_;
  StanceForces forces_;
  StaticEquilibrium equilibrium_;
  double required_N_, weight_N_;
  WeakestPush result_;
  std::uint64_t revision_ = 0;  ///< revision of the state at the last computation
  bool has_gradient_ = false;
};

/// A set of places of the centre of mass c for which a push is balanced: normal . c + offset <= 0.
struct HalfSpace {
  Eigen::Vector3d normal_W;  ///< outward; its horizontal part is unit
  double offset_m = 0.0;

  /// Returns the horizontal distance of c from the set: > 0 outside, m.
  double Distance(const Eigen::Vector3d& com_W) const { return normal_W.dot(com_W) + offset_m; }
};

/// Returns half-spaces in which contact forces alone balance the stance's push in each of kPushDirections. They are the
/// edges of ComputePushPolygon for a push that is larger by half of the judge's tolerance. A direction in which nothing
/// balances the push has no half-space.
std::vector<HalfSpace> PushHalfSpaces(const Dataset& dataset, const Stance& stance);

/// Inequality: the centre of mass is in PushHalfSpaces, m; a half-space has a row if its edge is nearer than
/// kNearPush_m.
class PushTerm : public Term {
 public:
  PushTerm(int waypoint, WaypointState& state, std::vector<HalfSpace> half_spaces);
  void ComputeResiduals(std::vector<double>& residuals) override;
  void ComputeModel(LinearModel& model) override;
  /// Appends the indices of the half-spaces.
  void RowKeys(int rows, std::vector<int>& keys) override;
  double AbsentRow() const override { return -kNearPush_m; }

  std::int64_t weight_ns() const override { return term_weights::kPush_ns; }

 private:
  static constexpr double kNearPush_m = 0.05;

  /// Sets near_.
  void FindNear();

  WaypointState* state_;
  std::vector<HalfSpace> half_spaces_;
  std::vector<int> near_;  ///< indices of half-spaces with a row
  Eigen::MatrixXd com_jacobian_;
};

}  // namespace legopt
