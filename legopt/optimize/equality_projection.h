#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/program/program.h"

namespace legopt {

/// Moves points onto the equality terms that touch a single waypoint, which in programs of robots are the poses of the
/// feet: by Gauss-Newton steps of least norm, waypoint by waypoint,
///
///     dx <- dx - J^T (J J^T)^-1 r(Retract(x, dx)),   J = dr / d(dx),
///
/// so that to first order a change dx keeps its part in the null space of the contacts (STOMP, CHOMP with
/// constraints). Redundant rows are damped. A workspace; one thread; no allocation once buffers have grown.
class EqualityProjection {
 public:
  /// For programs with the terms of this one, in their order.
  void Reset(const Program& program);

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

  /// The linear models of one waypoint's terms, stacked; the number of their rows.
  int Stack(const Program& program, int waypoint, const Eigen::VectorXd& dx);
  /// One step at one waypoint; false where nothing is to be done.
  bool Correct(Eigen::Index first, int rows, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
               Eigen::VectorXd& dx);
  /// step_ = the step of least norm in the free variables.
  void SolveStep(int rows);

  std::vector<std::vector<size_t>> terms_;  ///< of every waypoint
  LinearModel model_;
  RowMajor jacobian_;          ///< with room for more rows than are used
  Eigen::VectorXd residuals_;  ///< likewise
  std::vector<double> gram_;   ///< J J^T, then its factor
  Eigen::VectorXd multipliers_, step_, free_;
};

}  // namespace legopt
