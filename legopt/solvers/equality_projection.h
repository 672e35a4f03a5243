#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/waypoint_metric.h"

namespace legopt {

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
