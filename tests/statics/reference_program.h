#pragma once

#include <Eigen/Core>
#include <optional>

#include "legopt/statics/stance_forces.h"

namespace legopt::test {

/// A linear program as GLPK sees it: min c . x, lower <= A x <= upper, x >= 0 and below `columns_upper`.
struct ReferenceProgram {
  Eigen::MatrixXd A;
  Eigen::VectorXd lower, upper, columns_upper, c;
};

/// Returns the minimum by GLPK's simplex; empty if infeasible, minus infinity if unbounded.
std::optional<double> MinimumByGlpk(const ReferenceProgram& program);

/// Returns the program of the smallest imbalance s of a stance, with the centre of mass at `com_W`: variables lambda,
/// s.
ReferenceProgram ImbalanceProgram(const StanceForces& forces, const Eigen::Vector3d& com_W);

}  // namespace legopt::test
