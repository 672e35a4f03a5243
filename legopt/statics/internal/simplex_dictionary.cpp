#include "legopt/statics/internal/simplex_dictionary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "legopt/types/invariant.h"

namespace legopt {
namespace {

constexpr double kSingular = 1e-11;  // pivot of the core as a share of its largest entry, below which it is singular

}  // namespace

void SimplexDictionary::Reset(const LinearProgram& program) {
  const Eigen::Index m = program.A.rows(), n = program.A.cols();
  CheckInvariant(m == program.b.size() && m == program.range.size() && n == program.upper.size(),
                 "the sizes of a linear program agree", m, n, program.b.size(), program.upper.size());
  program_ = &program;
  basic_.resize(static_cast<std::size_t>(m));
  std::iota(basic_.begin(), basic_.end(), static_cast<int>(n));
  nonbasic_.resize(static_cast<std::size_t>(n));
  std::iota(nonbasic_.begin(), nonbasic_.end(), 0);
  at_upper_.assign(static_cast<std::size_t>(n), 0);
  has_table_ = false;
}

bool SimplexDictionary::Replace(const LinearProgram& program) {
  if (basic_.empty() || program.A.rows() != rows() || program.A.cols() != columns()) return false;
  program_ = &program;
  has_table_ = false;
  for (Eigen::Index j = 0; j < columns(); ++j) {
    char& at_upper = at_upper_[static_cast<std::size_t>(j)];
    if (at_upper != 0 && !std::isfinite(UpperOfColumn(j))) at_upper = 0;
  }
  Refactor();
  if (core_rows_.empty()) return true;
  const double least = factors_.matrixLU().diagonal().cwiseAbs().minCoeff();
  return least > kSingular * core_.cwiseAbs().maxCoeff();
}

void SimplexDictionary::FindCore() {
  const Eigen::Index m = rows();
  core_rows_.clear();
  core_columns_.clear();
  core_places_.clear();
  slack_places_.assign(static_cast<std::size_t>(m), -1);
  for (Eigen::Index i = 0; i < m; ++i) {
    const int variable = basic(i);
    if (variable < columns()) {
      core_columns_.push_back(variable);
      core_places_.push_back(static_cast<int>(i));
    } else {
      slack_places_[static_cast<std::size_t>(variable - columns())] = static_cast<int>(i);
    }
  }
  for (int i = 0; i < m; ++i) {
    if (slack_places_[static_cast<std::size_t>(i)] < 0) core_rows_.push_back(i);
  }
}

void SimplexDictionary::Refactor() {
  FindCore();
  right_side_ = program_->b;
  for (Eigen::Index j = 0; j < columns(); ++j) {
    if (!IsAtUpper(j)) continue;
    const int variable = nonbasic(j);
    if (variable < columns()) {
      right_side_ -= program_->upper[variable] * program_->A.col(variable);
    } else {
      right_side_[variable - columns()] -= program_->range[variable - columns()];
    }
  }
  values_.resize(rows());
  residual_ = 0.0;
  const std::size_t k = core_rows_.size();
  if (k > 0) {
    core_ = program_->A(core_rows_, core_columns_);
    factors_.compute(core_);
    core_right_side_ = right_side_(core_rows_);
    core_values_ = factors_.solve(core_right_side_);
    core_right_side_.noalias() -= core_ * core_values_;
    residual_ = core_right_side_.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  }
  for (std::size_t c = 0; c < k; ++c) {
    const double value = core_values_[static_cast<Eigen::Index>(c)];
    values_[core_places_[c]] = value;
    right_side_ -= value * program_->A.col(core_columns_[c]);
  }
  for (Eigen::Index i = 0; i < rows(); ++i) {
    const int place = slack_places_[static_cast<std::size_t>(i)];
    if (place >= 0) values_[place] = right_side_[i];
  }
}

void SimplexDictionary::BuildTable() {
  if (has_table_) return;
  has_table_ = true;
  SortRows();
  const Eigen::Index m = rows(), n = columns();
  const auto k = static_cast<Eigen::Index>(core_rows_.size());
  for (Eigen::VectorXd& rates : rates_) rates.setZero(n);
  table_.resize(m, n);
  core_table_.resize(k, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const int variable = nonbasic(j);
    if (variable < n) {
      const auto column = program_->A.col(variable);
      table_.col(j) = column;
      for (Eigen::Index c = 0; c < k; ++c) core_table_(c, j) = column[core_rows_[static_cast<std::size_t>(c)]];
    } else {
      const auto at = std::lower_bound(core_rows_.begin(), core_rows_.end(), variable - static_cast<int>(n));
      table_.col(j).setZero();
      core_table_.col(j).setZero();
      core_table_(at - core_rows_.begin(), j) = 1.0;
    }
  }
  if (k == 0) return;
  core_table_ = factors_.solve(core_table_);
  core_parts_.resize(m, k);
  for (Eigen::Index c = 0; c < k; ++c) core_parts_.col(c) = program_->A.col(core_columns_[static_cast<std::size_t>(c)]);
  table_.noalias() -= core_parts_ * core_table_;
  for (Eigen::Index c = 0; c < k; ++c) table_.row(core_places_[static_cast<std::size_t>(c)]) = core_table_.row(c);
}

void SimplexDictionary::SortRows() {
  for (std::size_t c = 0; c < core_rows_.size(); ++c) {
    basic_[static_cast<std::size_t>(core_rows_[c])] = core_columns_[c];
    core_places_[c] = core_rows_[c];
  }
  right_side_ = values_;
  for (Eigen::Index i = 0; i < rows(); ++i) {
    int& place = slack_places_[static_cast<std::size_t>(i)];
    if (place < 0) continue;
    basic_[static_cast<std::size_t>(i)] = static_cast<int>(columns() + i);
    values_[i] = right_side_[place];
    place = static_cast<int>(i);
  }
  for (std::size_t c = 0; c < core_rows_.size(); ++c) {
    values_[core_places_[c]] = core_values_[static_cast<Eigen::Index>(c)];
  }
}

void SimplexDictionary::SetObjective(int objective, const Eigen::VectorXd& costs) {
  Eigen::VectorXd& rates = rates_[static_cast<std::size_t>(objective)];
  basic_costs_ = costs(basic_);
  rates = costs(nonbasic_);
  rates.noalias() -= table_.transpose() * basic_costs_;
}

void SimplexDictionary::Move(Eigen::Index column, double direction, const SimplexStep& step) {
  if (step.length != 0.0) values_ -= (step.length * direction) * table_.col(column).head(rows());
  char& at_upper = at_upper_[static_cast<std::size_t>(column)];
  if (step.row < 0) {
    at_upper = at_upper == 0 ? 1 : 0;
    return;
  }
  values_[step.row] = (at_upper != 0 ? UpperOfColumn(column) : 0.0) + direction * step.length;
  std::swap(basic_[static_cast<std::size_t>(step.row)], nonbasic_[static_cast<std::size_t>(column)]);
  at_upper = step.to_upper ? 1 : 0;
  Exchange(column, step.row);
}

void SimplexDictionary::Exchange(Eigen::Index column, Eigen::Index row) {
  const Eigen::Index m = rows();
  entering_ = table_.col(column);
  const double pivot = entering_[row];
  entering_[row] = 0.0;
  const double* const entering = entering_.data();
  for (Eigen::Index j = 0; j < columns(); ++j) {
    double* const other = table_.data() + j * m;
    if (j == column || other[row] == 0.0) continue;
    const double factor = other[row] / pivot;
    other[row] = factor;
    for (Eigen::Index i = 0; i < m; ++i) other[i] -= factor * entering[i];
    for (Eigen::VectorXd& rates : rates_) rates[j] -= factor * rates[column];
  }
  table_.col(column) = entering_ / -pivot;
  table_(row, column) = 1.0 / pivot;
  for (Eigen::VectorXd& rates : rates_) rates[column] /= -pivot;
}

void SimplexDictionary::StoreSolution(Eigen::VectorXd* x) const {
  x->setZero(columns());
  for (Eigen::Index j = 0; j < columns(); ++j) {
    const int variable = nonbasic(j);
    if (variable < columns() && IsAtUpper(j)) (*x)[variable] = program_->upper[variable];
  }
  for (Eigen::Index i = 0; i < rows(); ++i) {
    const int variable = basic(i);
    if (variable < columns()) (*x)[variable] = std::clamp(values_[i], 0.0, program_->upper[variable]);
  }
}

void SimplexDictionary::StoreMultipliers(const Eigen::VectorXd& costs, Eigen::VectorXd* y) {
  y->setZero(rows());
  for (Eigen::Index i = 0; i < rows(); ++i) {
    if (slack_places_[static_cast<std::size_t>(i)] >= 0) (*y)[i] = costs[columns() + i];
  }
  const std::size_t k = core_rows_.size();
  if (k == 0) return;
  core_right_side_.resize(static_cast<Eigen::Index>(k));
  for (std::size_t c = 0; c < k; ++c) {
    const int variable = core_columns_[c];
    core_right_side_[static_cast<Eigen::Index>(c)] = costs[variable] - y->dot(program_->A.col(variable));
  }
  core_multipliers_ = factors_.transpose().solve(core_right_side_);
  for (std::size_t c = 0; c < k; ++c) (*y)[core_rows_[c]] = core_multipliers_[static_cast<Eigen::Index>(c)];
}

bool SimplexDictionary::IsOptimal(const Eigen::VectorXd& costs, const Eigen::VectorXd& y, double tolerance) const {
  for (Eigen::Index j = 0; j < columns(); ++j) {
    const int variable = nonbasic(j);
    const double used = variable < columns() ? y.dot(program_->A.col(variable)) : y[variable - columns()];
    const double rate = costs[variable] - used;
    const double gain = IsAtUpper(j) ? rate : -rate;
    if (!(gain <= tolerance) && !(Upper(variable) <= 0.0)) return false;  // also NaN
  }
  return true;
}

void SimplexDictionary::StoreTableMultipliers(Eigen::VectorXd* y) const {
  y->setZero(rows());
  for (Eigen::Index j = 0; j < columns(); ++j) {
    const int variable = nonbasic(j);
    if (variable >= columns()) (*y)[variable - columns()] = -rate(0, j);
  }
}

}  // namespace legopt
