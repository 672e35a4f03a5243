#include "legopt/statics/internal/linear_program.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "legopt/types/invariant.h"

namespace legopt {
namespace {

constexpr double kCostTolerance = 1e-10;    // reduced costs below this are 0
constexpr double kPivotTolerance = 1e-9;    // entries of the tableau below this are 0
constexpr double kStepTolerance = 1e-12;    // violation of a bound that is accepted for a larger pivot
constexpr int kPivotsWithoutProgress = 60;  // after which Bland's rule ends a cycle
constexpr int kMaxPivots = 5'000;
constexpr double kFullTurn = 2.0 * std::numbers::pi;

}  // namespace

double DualBound(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& upper,
                 const Eigen::VectorXd& c, const Eigen::VectorXd& y, double largest) {
  double bound = y.dot(b);
  for (Eigen::Index j = 0; j < c.size(); ++j) {
    bound += std::min(0.0, c[j] - y.dot(A.col(j))) * std::min(upper[j], largest);
  }
  return bound;
}

LinearProgramStatus LinearProgramSolver::Constrain(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                                   const Eigen::VectorXd& upper) {
  CheckInvariant(A.rows() == b.size() && A.cols() == upper.size(), "the sizes of a linear program agree", A.rows(),
                 b.size(), A.cols(), upper.size());
  A_ = A;
  b_ = b;
  upper_ = upper;
  pivots_ = 0;
  no_cost_.setZero(columns());
  SetInitialBasis();
  artificial_upper_ = kInfinity;
  const LinearProgramStatus status = Iterate(no_cost_, 1.0);
  if (status != LinearProgramStatus::kOptimal) return LinearProgramStatus::kStalled;
  Refine(no_cost_, 1.0);
  if (objective_ > kFeasibilityTolerance) return LinearProgramStatus::kInfeasible;
  artificial_upper_ = 0.0;
  return LinearProgramStatus::kOptimal;
}

bool LinearProgramSolver::Resume(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& upper) {
  const bool same_size = A.rows() == rows() && A.cols() == columns() && upper.size() == columns();
  const auto is_artificial = [this](int basic) { return basic >= columns(); };
  if (!same_size || basis_.empty() || std::ranges::any_of(basis_, is_artificial)) return false;
  A_ = A;
  b_ = b;
  upper_ = upper;
  pivots_ = 0;
  has_tableau_ = false;
  artificial_upper_ = 0.0;
  FactorBasis();
  values_ = factors_.solve(right_side_);
  // A nearly singular basis has no exact solution.
  if (!((basis_matrix_ * values_ - right_side_).cwiseAbs().maxCoeff() <= kFeasibilityTolerance)) return false;
  for (Eigen::Index i = 0; i < rows(); ++i) {
    if (values_[i] < 0.0 || values_[i] > UpperOfBasic(i)) return false;
  }
  return true;
}

LinearProgramStatus LinearProgramSolver::Minimize(const Eigen::VectorXd& c) {
  pivots_ = 0;
  if (!has_tableau_) {
    tableau_ = factors_.solve(A_);
    has_tableau_ = true;
  }
  const LinearProgramStatus status = Iterate(c, 0.0);
  if (status == LinearProgramStatus::kOptimal) Refine(c, 0.0);
  return status;
}

LinearProgramStatus LinearProgramSolver::Turn(const Eigen::VectorXd& c, const Eigen::VectorXd& d,
                                              const std::function<bool(const TurnedOptimum&)>& visit) {
  ComputeReducedCosts(c, 0.0, &reduced_);
  ComputeReducedCosts(d, 0.0, &turned_reduced_);
  double angle = 0.0;
  const auto goes_on = [&] {
    StoreBasicSolution(&turned_x_);
    return visit({angle, turned_x_, reduced_});
  };
  bool whole = !goes_on();
  for (pivots_ = 0; !whole && pivots_ < kMaxPivots; ++pivots_) {
    Eigen::Index column = -1;
    angle += TurnToNextColumn(&column);
    whole = angle >= kFullTurn;
    if (whole || column < 0) continue;
    const double direction = at_upper_[static_cast<size_t>(column)] != 0 ? -1.0 : 1.0;
    const Step step = LargestStep(column, direction);
    if (!std::isfinite(step.length)) break;
    Move(column, direction, step);
    whole = step.length > kStepTolerance && !goes_on();
  }
  turned_reduced_.resize(0);
  return whole ? LinearProgramStatus::kOptimal : LinearProgramStatus::kStalled;
}

double LinearProgramSolver::TurnToNextColumn(Eigen::Index* column) {
  *column = -1;
  double sine = 1.0, cosine = 0.0;  // a quarter turn
  for (Eigen::Index j = 0; j < columns(); ++j) {
    if (in_basis_[static_cast<size_t>(j)] != 0) continue;
    const double sign = at_upper_[static_cast<size_t>(j)] != 0 ? -1.0 : 1.0;
    const double here = std::max(0.0, sign * reduced_[j]), rate = sign * turned_reduced_[j];
    // here cos + rate sin becomes negative after tan = here / -rate
    if (!(rate < -kCostTolerance) || !(here * cosine < -rate * sine)) continue;
    *column = j;
    const double norm = std::hypot(here, rate);
    sine = here / norm;
    cosine = -rate / norm;
  }
  pivot_row_ = cosine * reduced_ + sine * turned_reduced_;
  turned_reduced_ = cosine * turned_reduced_ - sine * reduced_;
  reduced_.swap(pivot_row_);
  return std::atan2(sine, cosine);
}

void LinearProgramSolver::StoreBasicSolution(Eigen::VectorXd* x) const {
  x->resize(columns());
  for (Eigen::Index j = 0; j < columns(); ++j) (*x)[j] = at_upper_[static_cast<size_t>(j)] != 0 ? upper_[j] : 0.0;
  for (Eigen::Index i = 0; i < rows(); ++i) {
    const int basic = basis_[static_cast<size_t>(i)];
    if (basic < columns()) (*x)[basic] = std::clamp(values_[i], 0.0, upper_[basic]);
  }
}

/// A column that has its only entry in a row becomes basic there if its value is within its bounds; all other rows get
/// artificial variables.
void LinearProgramSolver::SetInitialBasis() {
  const Eigen::Index m = rows(), n = columns();
  tableau_ = A_;
  has_tableau_ = true;
  values_ = b_;
  sign_.setOnes(m);
  basis_.assign(static_cast<size_t>(m), -1);
  in_basis_.assign(static_cast<size_t>(n), 0);
  at_upper_.assign(static_cast<size_t>(n), 0);
  for (Eigen::Index j = 0; j < n; ++j) {
    Eigen::Index row = -1;
    int entries = 0;
    for (Eigen::Index i = 0; i < m && entries < 2; ++i) {
      if (A_(i, j) == 0.0) continue;
      row = i;
      ++entries;
    }
    if (entries != 1 || basis_[static_cast<size_t>(row)] >= 0 || std::abs(A_(row, j)) < kPivotTolerance) continue;
    const double value = b_[row] / A_(row, j);
    if (!(value >= 0.0 && value <= upper_[j])) continue;
    basis_[static_cast<size_t>(row)] = static_cast<int>(j);
    in_basis_[static_cast<size_t>(j)] = 1;
    tableau_.row(row) /= A_(row, j);
    values_[row] = value;
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    if (basis_[static_cast<size_t>(i)] >= 0) continue;
    basis_[static_cast<size_t>(i)] = static_cast<int>(n + i);
    if (values_[i] >= 0.0) continue;
    sign_[i] = -1.0;
    tableau_.row(i) *= -1.0;
    values_[i] *= -1.0;
  }
}

void LinearProgramSolver::ComputeReducedCosts(const Eigen::VectorXd& cost, double artificial_cost,
                                              Eigen::VectorXd* reduced) const {
  *reduced = cost;
  for (Eigen::Index i = 0; i < rows(); ++i) {
    const int basic = basis_[static_cast<size_t>(i)];
    const double basic_cost = basic < columns() ? cost[basic] : artificial_cost;
    if (basic_cost != 0.0) *reduced -= basic_cost * tableau_.row(i).transpose();
  }
}

/// Returns the column with the largest reduced cost that improves the objective, or the first one; -1: none does.
Eigen::Index LinearProgramSolver::EnteringColumn(bool first_index) const {
  Eigen::Index best = -1;
  double largest = kCostTolerance;
  for (Eigen::Index j = 0; j < columns(); ++j) {
    if (in_basis_[static_cast<size_t>(j)] != 0) continue;
    const double gain = at_upper_[static_cast<size_t>(j)] != 0 ? reduced_[j] : -reduced_[j];
    if (!(gain > largest)) continue;
    best = j;
    if (first_index) break;
    largest = gain;
  }
  return best;
}

double LinearProgramSolver::UpperOfBasic(Eigen::Index row) const {
  const int basic = basis_[static_cast<size_t>(row)];
  return basic < columns() ? upper_[basic] : artificial_upper_;
}

/// Harris' ratio test: among the rows that bound the step, up to a tolerance, the one with the largest pivot.
LinearProgramSolver::Step LinearProgramSolver::LargestStep(Eigen::Index column, double direction) const {
  const auto limit = [&](Eigen::Index row, double slack) {
    const double rate = -direction * tableau_(row, column);  // rate of the basic variable
    if (rate < -kPivotTolerance) return (values_[row] + slack) / -rate;
    if (rate > kPivotTolerance) return (UpperOfBasic(row) - values_[row] + slack) / rate;
    return kInfinity;
  };
  double bound = kInfinity;
  for (Eigen::Index i = 0; i < rows(); ++i) bound = std::min(bound, limit(i, kStepTolerance));
  if (upper_[column] <= bound) return {.length = upper_[column]};
  Step step{.length = kInfinity};
  double largest = 0.0;
  for (Eigen::Index i = 0; i < rows(); ++i) {
    const double pivot = std::abs(tableau_(i, column));
    if (!(pivot > largest) || limit(i, 0.0) > bound) continue;
    largest = pivot;
    step = {.length = std::max(limit(i, 0.0), 0.0),
            .row = static_cast<int>(i),
            .to_upper = -direction * tableau_(i, column) > 0.0};
  }
  return step;
}

void LinearProgramSolver::Pivot(Eigen::Index column, int row) {
  tableau_.row(row) /= tableau_(row, column);
  factors_of_rows_ = tableau_.col(column);
  factors_of_rows_[row] = 0.0;
  pivot_row_ = tableau_.row(row).transpose();
  tableau_.noalias() -= factors_of_rows_ * pivot_row_.transpose();
  const double factor = reduced_[column];
  reduced_ -= factor * pivot_row_;
  if (turned_reduced_.size() == 0) return;
  const double turned_factor = turned_reduced_[column];
  turned_reduced_ -= turned_factor * pivot_row_;
}

void LinearProgramSolver::Move(Eigen::Index column, double direction, const Step& step) {
  values_ -= step.length * direction * tableau_.col(column);
  const auto entering = static_cast<size_t>(column);
  if (step.row < 0) {
    at_upper_[entering] = at_upper_[entering] == 0 ? 1 : 0;
    return;
  }
  const auto row = static_cast<size_t>(step.row);
  const int leaving = basis_[row];
  if (leaving < columns()) {
    in_basis_[static_cast<size_t>(leaving)] = 0;
    at_upper_[static_cast<size_t>(leaving)] = step.to_upper ? 1 : 0;
  }
  values_[step.row] = (at_upper_[entering] != 0 ? upper_[column] : 0.0) + direction * step.length;
  basis_[row] = static_cast<int>(column);
  in_basis_[entering] = 1;
  at_upper_[entering] = 0;
  Pivot(column, step.row);
}

LinearProgramStatus LinearProgramSolver::Iterate(const Eigen::VectorXd& cost, double artificial_cost) {
  ComputeReducedCosts(cost, artificial_cost, &reduced_);
  int without_progress = 0;
  while (pivots_ < kMaxPivots) {
    const Eigen::Index column = EnteringColumn(without_progress > kPivotsWithoutProgress);
    if (column < 0) return LinearProgramStatus::kOptimal;
    const double direction = at_upper_[static_cast<size_t>(column)] != 0 ? -1.0 : 1.0;
    const Step step = LargestStep(column, direction);
    if (!std::isfinite(step.length)) return LinearProgramStatus::kUnbounded;
    without_progress = step.length > kStepTolerance ? 0 : without_progress + 1;
    Move(column, direction, step);
    ++pivots_;
  }
  return LinearProgramStatus::kStalled;
}

void LinearProgramSolver::FactorBasis() {
  const Eigen::Index m = rows(), n = columns();
  basis_matrix_.setZero(m, m);
  right_side_ = b_;
  for (Eigen::Index j = 0; j < n; ++j) {
    if (in_basis_[static_cast<size_t>(j)] != 0 || at_upper_[static_cast<size_t>(j)] == 0) continue;
    right_side_ -= upper_[j] * A_.col(j);
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    const int basic = basis_[static_cast<size_t>(i)];
    if (basic < n) {
      basis_matrix_.col(i) = A_.col(basic);
    } else {
      basis_matrix_(basic - n, i) = sign_[basic - n];
    }
  }
  factors_.compute(basis_matrix_);
}

/// Computes x, y and the objective from the basis and the original numbers.
void LinearProgramSolver::Refine(const Eigen::VectorXd& cost, double artificial_cost) {
  const Eigen::Index m = rows(), n = columns();
  basis_cost_.resize(m);
  x_.setZero(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    if (in_basis_[static_cast<size_t>(j)] == 0 && at_upper_[static_cast<size_t>(j)] != 0) x_[j] = upper_[j];
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    const int basic = basis_[static_cast<size_t>(i)];
    basis_cost_[i] = basic < n ? cost[basic] : artificial_cost;
  }
  FactorBasis();
  values_ = factors_.solve(right_side_);
  y_ = factors_.transpose().solve(basis_cost_);
  objective_ = 0.0;
  for (Eigen::Index i = 0; i < m; ++i) {
    const int basic = basis_[static_cast<size_t>(i)];
    if (basic < n) {
      x_[basic] = std::clamp(values_[i], 0.0, upper_[basic]);
    } else {
      objective_ += artificial_cost * std::max(values_[i], 0.0);
    }
  }
  objective_ += cost.dot(x_);
}

}  // namespace legopt
