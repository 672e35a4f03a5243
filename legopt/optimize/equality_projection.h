#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/optimize/waypoint_metric.h"
#include "legopt/program/program.h"

namespace legopt {

/// Keeps points on the equality terms that touch a single waypoint, which in programs of robots are the poses of the
/// feet (STOMP, CHOMP with constraints). A direction v is made tangent to them in the metric A of the chain, and a
/// change dx is moved onto them by Gauss-Newton steps of least norm, waypoint by waypoint:
///
///     v  <- v - A^-1 C^T (C A^-1 C^T)^-1 C v,                C = dr / dx of all waypoints,
///     dx <- dx - J^T (J J^T)^-1 r(Retract(x, dx)),           J = dr / d(dx) of one waypoint.
///
/// Redundant rows are damped. A workspace; one thread; no allocation once buffers have grown.
class EqualityProjection {
 public:
  /// Whether a term of this shape is projected upon.
  static bool Holds(const TermShape& shape) { return shape.kind == TermKind::kEquality && shape.num_waypoints == 1; }

  /// For programs with the terms of this one, in their order.
  void Reset(const Program& program);

  /// Takes the derivatives C at x for MakeTangent, of the variables that the bounds leave free. `metric` must outlive
  /// its use.
  void Linearize(Program& program, const Eigen::VectorXd& x, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                 WaypointMetric& metric);
  /// Takes from v what leaves the constraints, to first order. Nothing where derivatives are not finite.
  void MakeTangent(Eigen::VectorXd& v);

  /// Changes dx, within lower and upper, until every row is below `kHolds` or the steps are used up, and leaves
  /// point = Retract(x, dx). Where a residual is not finite, its waypoint stays as it is.
  void Project(Program& program, const Eigen::VectorXd& x, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
               Eigen::VectorXd& dx, Eigen::VectorXd& point);

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  static constexpr double kHolds = 1e-6;    ///< m, or sine of half an angle: far below the tolerances
  static constexpr int kMostSteps = 5;      ///< from where a step of usual noise leads, three do
  static constexpr double kLongest = 0.5;   ///< of one step, rad or m: where linear models end
  static constexpr double kDamping = 1e-9;  ///< of J J^T, relative to its largest diagonal entry

  /// The linear models of one waypoint's terms, stacked, by dx or, null, by the tangent; the number of their rows.
  int Stack(const Program& program, int waypoint, const Eigen::VectorXd* dx);
  /// One step at one waypoint; false where nothing is to be done.
  bool Correct(Eigen::Index first, int rows, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
               Eigen::VectorXd& dx);
  /// Damps a Gram matrix and puts its Cholesky factor in its lower half; false when it has none.
  static bool Factor(Eigen::Map<Eigen::MatrixXd>& gram);
  /// The factor of C A^-1 C^T; false when it is not finite or zero.
  bool FactorChain(const WaypointMetric& metric);
  /// step_ = the step of least norm in the free variables.
  void SolveStep(int rows);

  std::vector<std::vector<size_t>> terms_;  ///< of every waypoint
  WaypointMetric* metric_ = nullptr;        ///< A; null: nothing to be tangent to
  RowMajor chain_;                          ///< C, one row a constraint, of its waypoint
  std::vector<Eigen::Index> waypoint_of_;   ///< of every row of C
  std::vector<double> chain_gram_;          ///< the factor of C A^-1 C^T
  Eigen::VectorXd chain_multipliers_, correction_;
  LinearModel model_;
  RowMajor jacobian_;          ///< with room for more rows than are used
  Eigen::VectorXd residuals_;  ///< likewise
  std::vector<double> gram_;   ///< J J^T, then its factor
  Eigen::VectorXd multipliers_, step_, free_;
};

}  // namespace legopt
