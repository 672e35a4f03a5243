#pragma once

#include <Eigen/Core>

namespace legopt::test {

/// Returns min |A x - b| over x >= 0 by the active set method of Lawson and Hanson (Solving Least Squares Problems,
/// 1974, chapter 23).
double NonNegativeResidual(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace legopt::test
