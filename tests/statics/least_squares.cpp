#include "tests/statics/least_squares.h"

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

namespace legopt::test {

double NonNegativeResidual(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  constexpr double kGradient = 1e-12;
  const Eigen::Index n = A.cols();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<bool> positive(static_cast<size_t>(n), false);
  const auto solve = [&] {
    std::vector<Eigen::Index> chosen;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (positive[static_cast<size_t>(j)]) chosen.push_back(j);
    }
    Eigen::MatrixXd part(A.rows(), static_cast<Eigen::Index>(chosen.size()));
    for (size_t k = 0; k < chosen.size(); ++k) part.col(static_cast<Eigen::Index>(k)) = A.col(chosen[k]);
    const Eigen::VectorXd s = part.completeOrthogonalDecomposition().solve(b);
    Eigen::VectorXd all = Eigen::VectorXd::Zero(n);
    for (size_t k = 0; k < chosen.size(); ++k) all[chosen[k]] = s[static_cast<Eigen::Index>(k)];
    return all;
  };
  for (int iteration = 0; iteration < 10 * n; ++iteration) {
    const Eigen::VectorXd gradient = A.transpose() * (b - A * x);
    Eigen::Index best = -1;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (!positive[static_cast<size_t>(j)] && gradient[j] > kGradient && (best < 0 || gradient[j] > gradient[best])) {
        best = j;
      }
    }
    if (best < 0) break;
    positive[static_cast<size_t>(best)] = true;
    for (int inner = 0; inner < 10 * n; ++inner) {
      const Eigen::VectorXd s = solve();
      double step = 1.0;
      Eigen::Index blocking = -1;
      for (Eigen::Index j = 0; j < n; ++j) {
        if (!positive[static_cast<size_t>(j)] || s[j] > 0.0) continue;
        const double limit = x[j] / (x[j] - s[j]);
        if (!(limit < step)) continue;
        step = limit;
        blocking = j;
      }
      x += step * (s - x);
      if (blocking < 0) break;
      for (Eigen::Index j = 0; j < n; ++j) {
        if (positive[static_cast<size_t>(j)] && (j == blocking || x[j] <= 0.0)) {
          positive[static_cast<size_t>(j)] = false;
          x[j] = 0.0;
        }
      }
    }
  }
  return (A * x - b).norm();
}

}  // namespace legopt::test
