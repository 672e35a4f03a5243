#pragma once

#include <vector>

#include "legopt/optimize/convex_subproblem.h"

namespace legopt {

/// Primal-dual interior-point method for ConvexSubproblem (Mehrotra's predictor-corrector).
///
/// The penalties are written as a saddle point, w|a| = max { y a : -w <= y <= w } and w max(0, a) = max { y a : 0 <= y
/// <= w }, so that both x and y live in boxes:
///
///     min_{l <= x <= u} max_{ly <= y <= uy}  g^T x + 1/2 x^T H x + y^T (A x + b)
///
/// Stationarity, with z >= 0 the multipliers of x's box and w >= 0 those of y's:
///
///     H x + g + A^T y - zl + zu = 0            A x + b + wl - wu = 0
///     zl (x - l) = zu (u - x) = wl (y - ly) = wu (uy - y) = sigma -> 0
///
/// Both equations hold from the start for suitable z and w, whatever x and y, so every iterate is feasible and the sum of
/// the products is the exact duality gap. A Newton step is one block-tridiagonal Cholesky factorisation of
/// H + Theta + A^T D A: linear cost in the number of waypoints. The objective is divided by the largest weight, which
/// keeps penalties of 1e12 solvable.
///
/// One thread; no allocation once the buffers have grown.
class InteriorPointSolver : public SubproblemSolver {
 public:
  Result Solve(const ConvexSubproblem& problem, double accuracy, Eigen::Ref<Eigen::VectorXd> dx) override;

 private:
  void Prepare(const ConvexSubproblem& problem);
  void StartingPoint(const ConvexSubproblem& problem);
  void Residuals(const ConvexSubproblem& problem);
  void StartRow(size_t i, double a, double barrier);
  double Gap() const;
  bool Factor(const ConvexSubproblem& problem);
  void AddRows(const ConvexSubproblem& problem);
  void FixVariables();
  bool FactorChain(const ConvexSubproblem& problem);
  void Direction(const ConvexSubproblem& problem, double sigma, bool corrector);
  void SolveFactored(const ConvexSubproblem& problem);
  double MaxStep() const;
  double GapAfter(double step) const;
  void Move(double step);
  void MultiplyRows(const ConvexSubproblem& problem, const std::vector<double>& x, std::vector<double>& ax) const;
  void AddTransposed(const ConvexSubproblem& problem, const std::vector<double>& y, std::vector<double>& out) const;

  size_t num_x_ = 0, num_y_ = 0, num_products_ = 0;
  int stride_ = 0, num_blocks_ = 0;
  double scale_ = 1.0;  ///< everything below is divided by it where it has the objective's unit
  bool chain_ = false;  ///< some coupling between blocks

  std::vector<double> matrix_, coupling_;  ///< H + Theta + A'DA, then its factor
  std::vector<char> fixed_;
  std::vector<double> x_, l_, u_, zl_, zu_, y_, ly_, uy_, wl_, wu_;
  std::vector<double> rd_, rp_;
  std::vector<double> dx_, dzl_, dzu_, dy_, dwl_, dwu_, ax_;
  std::vector<double> weight_, rhs_;       ///< D by row; right-hand side by variable
  std::vector<double> row_rhs_;
  std::vector<const double*> group_rows_;
  std::vector<double> group_weights_;
};

}  // namespace legopt
