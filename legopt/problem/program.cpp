#include "legopt/problem/program.h"

#include <algorithm>

namespace legopt {

void LinearModel::Reset(int rows, int tangent_size, int num_waypoints) {
  rows_ = rows;
  stride_ = PaddedSize(tangent_size);
  num_waypoints_ = num_waypoints;
  const auto count = static_cast<size_t>(rows);
  const size_t entries = count * static_cast<size_t>(stride_);
  if (value_.size() < count) value_.resize(count);
  std::fill_n(value_.begin(), count, 0.0);
  for (int k = 0; k < num_waypoints; ++k) {
    if (jacobian_[k].size() < entries) jacobian_[k].resize(entries);
    std::fill_n(jacobian_[k].begin(), entries, 0.0);
  }
}

void LinearModel::Shift(const double* dx, int tangent_size) {
  for (int k = 0; k < num_waypoints_; ++k) {
    for (int i = 0; i < rows_; ++i) {
      double sum = 0.0;
      for (int j = 0; j < tangent_size; ++j) sum += row(k, i)[j] * dx[k * tangent_size + j];
      value(i) += sum;
    }
  }
}

bool Term::RelaxMargin(double /*share*/) { return false; }

bool Term::SetDisabled(bool /*aside*/) { return false; }

void Term::RowKeys(int rows, std::vector<int>& keys) {
  for (int i = 0; i < rows; ++i) keys.push_back(i);
}

std::int64_t Program::TermEvaluations() const {
  std::int64_t sum = 0;
  for (const auto& term : terms()) sum += term->evaluations();
  return sum;
}

void Program::PullBack(const double* /*dx*/, double* /*row*/) const {}

}  // namespace legopt
