#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "legopt/problem/program.h"

namespace legopt {

/// Differences along a chain of waypoints that a metric penalises.
enum class Differences : std::uint8_t {
  kVelocities,    ///< (K x)_t = x_{t+1} - x_t
  kAccelerations  ///< (K x)_t = x_{t-1} - 2 x_t + x_{t+1}
};

/// Returns whether there is more than one waypoint and the bounds fix the first.
bool FirstWaypointIsFixed(const Program& program);

/// The metric of CHOMP (velocities) and STOMP (accelerations) on chains of T waypoints, the same for every variable:
///
///     A = I + smoothness K^T K,   T x T.
///
/// A^-1 spreads a change over the neighbouring waypoints and does not alter an equal change of all waypoints. Published
/// metrics are K^T K alone, which the fixed ends of their trajectories make invertible; here the ends are free, hence
/// the identity. A first waypoint that is fixed is left out of A, and products with A^-1 are zero there. For one
/// waypoint, A is the identity. Vectors are T blocks of equal size. A workspace; one thread.
class WaypointMetric {
 public:
  /// Prepares for vectors of num_waypoints * block_size entries; smoothness >= 0. Factors A: cubic in the number of
  /// waypoints.
  void Reset(int num_waypoints, int block_size, double smoothness, Differences differences, bool first_fixed = false);

  /// Returns entry (s, t) of A^-1.
  double Inverse(Eigen::Index s, Eigen::Index t) const { return inverse_(s, t); }
  /// Sets v = A^-1 v.
  void ApplyInverse(Eigen::VectorXd& v) { Multiply(inverse_, v); }

  /// Transforms independent standard normal entries to covariance A^-1 / a along the chain, where a is the largest
  /// diagonal entry of A^-1: the waypoint that varies most has variance 1.
  void Correlate(Eigen::VectorXd& v) { Multiply(root_, v); }

  /// Sets v = M v, where M is A^-1 with columns scaled so that their largest entries are 1 / T (STOMP).
  void Smooth(Eigen::VectorXd& v) { Multiply(smoother_, v); }

 private:
  void Multiply(const Eigen::MatrixXd& factor, Eigen::VectorXd& v);

  int num_waypoints_ = 1, block_size_ = 1;
  Eigen::MatrixXd inverse_;   ///< A^-1
  Eigen::MatrixXd root_;      ///< L^-1 / sqrt(a), A = L L^T
  Eigen::MatrixXd smoother_;  ///< M^T
  Eigen::MatrixXd product_;
};

/// Projection on the equality terms that touch a single waypoint, which in programs of robots are the contact poses
/// (STOMP, CHOMP with constraints). A direction v is made tangent to them in the metric A of the chain, and a change dx
/// is moved onto them by Gauss-Newton steps of least norm, waypoint by waypoint:
///
///     v  <- v - A^-1 C^T (C A^-1 C^T)^-1 C v,                C = dr / dx of all waypoints,
///     dx <- dx - J^T (J J^T)^-1 r(Retract(x, dx)),           J = dr / d(dx) of one waypoint.
///
/// Redundant rows are damped. A workspace; one thread; no allocation once buffers have grown.
class EqualityProjection {
 public:
  /// Returns whether terms of this shape are handled by projection.
  static bool Holds(const TermShape& shape) { return shape.kind == TermKind::kEquality && shape.num_waypoints == 1; }

  /// Prepares for programs that have the terms of `program` in the same order.
  void Reset(const Program& program);

  /// Computes the derivatives C at x for MakeTangent, for the variables that the bounds leave free. `metric` must
  /// outlive the calls of MakeTangent.
  void Linearize(Program& program, const Eigen::VectorXd& x, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                 WaypointMetric& metric);
  /// Removes the components of v that leave the constraints, to first order. Does nothing if derivatives are not
  /// finite.
  void MakeTangent(Eigen::VectorXd& v);

  /// Changes dx, within lower and upper, until every row is below `kProjectionTolerance` or the maximum number of steps
  /// is reached, and sets point = Retract(x, dx). A waypoint with non-finite residuals stays unchanged.
  void Project(Program& program, const Eigen::VectorXd& x, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
               Eigen::VectorXd& dx, Eigen::VectorXd& point);

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  static constexpr double kProjectionTolerance = 1e-6;  ///< m, or sine of half an angle; far below the tolerances
  static constexpr int kMaxSteps = 5;                   ///< three are enough after noise of usual size
  static constexpr double kLongest = 0.5;               ///< longest step, rad or m; linear models do not hold beyond
  static constexpr double kDamping = 1e-9;              ///< damping of J J^T, relative to its largest diagonal entry

  /// Stacks the linear models of one waypoint's terms: derivatives by dx or, if dx is null, by the tangent. Returns the
  /// number of rows.
  int Stack(const Program& program, int waypoint, const Eigen::VectorXd* dx);
  /// Makes one step at one waypoint. Returns false if there is nothing to correct.
  bool Correct(Eigen::Index first, int rows, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
               Eigen::VectorXd& dx);
  /// Damps a Gram matrix and stores its Cholesky factor in its lower half. Returns false if there is none.
  static bool Factor(Eigen::Map<Eigen::MatrixXd>& gram);
  /// Factors C A^-1 C^T. Returns false if it is zero or not finite.
  bool FactorChain(const WaypointMetric& metric);
  /// Sets step_ to the step of least norm in the free variables.
  void SolveStep(int rows);

  std::vector<std::vector<size_t>> terms_;  ///< indices of the projected terms of every waypoint
  WaypointMetric* metric_ = nullptr;        ///< A; null: no constraints to be tangent to
  RowMajor chain_;                          ///< C, one row per constraint, with the columns of its waypoint
  std::vector<Eigen::Index> waypoint_of_;   ///< waypoint of every row of C
  std::vector<double> chain_gram_;          ///< Cholesky factor of C A^-1 C^T
  Eigen::VectorXd chain_multipliers_, correction_;
  LinearModel model_;
  RowMajor jacobian_;  ///< may have more rows than are used
  Eigen::VectorXd residuals_;
  std::vector<double> gram_;  ///< J J^T, then its factor
  Eigen::VectorXd multipliers_, step_, free_;
};

}  // namespace legopt
