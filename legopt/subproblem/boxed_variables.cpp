#include "legopt/subproblem/boxed_variables.h"

#include <algorithm>

#include "legopt/subproblem/dense_kernels.h"

namespace legopt {
namespace {

using kernels::Lanes;
using kernels::Load;
using kernels::Store;

constexpr size_t kLanes = kernels::kLanes;

/// NaN candidates (0 / 0 of fixed variables) are passed over.
Lanes Larger(Lanes candidate, Lanes best) { return candidate > best ? candidate : best; }

}  // namespace

void BoxedVariables::Reset(size_t count) {
  const size_t padded = (count + kLanes - 1) / kLanes * kLanes;
  for (auto* v : {&value, &z_lower, &z_upper, &free, &step, &drive, &z_lower_step_, &z_upper_step_}) {
    v->assign(padded, 0.0);
  }
  lower.assign(padded, -1.0);
  upper.assign(padded, 1.0);
  below_.assign(padded, 1.0);
  above_.assign(padded, 1.0);
  inverse_below_.assign(padded, 1.0);
  inverse_above_.assign(padded, 1.0);
}

void BoxedVariables::SetFree(size_t i, double low, double high) {
  lower[i] = low;
  upper[i] = high;
  free[i] = 1.0;
}

void BoxedVariables::SetFixed(size_t i, double at) {
  value[i] = at;
  lower[i] = at - 1.0;  // any slack will do
  upper[i] = at + 1.0;
}

void BoxedVariables::Start() {
  constexpr double kLeastShare = 1e-15;  // of a box
  for (size_t i = 0; i < size(); ++i) {
    const double least = kLeastShare * (upper[i] - lower[i]);
    below_[i] = std::max(value[i] - lower[i], least);
    above_[i] = std::max(upper[i] - value[i], least);
  }
  InvertSlacks();
}

void BoxedVariables::InvertSlacks() {
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes mask = Load(&free[i]);
    Store(&inverse_below_[i], mask / Load(&below_[i]));
    Store(&inverse_above_[i], mask / Load(&above_[i]));
  }
}

double BoxedVariables::Gap() const {
  Lanes gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    gap += Load(&z_lower[i]) * Load(&below_[i]) + Load(&z_upper[i]) * Load(&above_[i]);
  }
  return kernels::Sum(gap);
}

double BoxedVariables::GapAfter(double length) const {
  Lanes gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes change = length * Load(&step[i]);
    gap += (Load(&z_lower[i]) + length * Load(&z_lower_step_[i])) * (Load(&below_[i]) + change) +
           (Load(&z_upper[i]) + length * Load(&z_upper_step_[i])) * (Load(&above_[i]) - change);
  }
  return kernels::Sum(gap);
}

void BoxedVariables::BarrierHessian(std::vector<double>& theta) const {
  theta.resize(size());
  for (size_t i = 0; i < size(); i += kLanes) {
    Store(&theta[i], Load(&z_lower[i]) * Load(&inverse_below_[i]) + Load(&z_upper[i]) * Load(&inverse_above_[i]));
  }
}

void BoxedVariables::Aim(double sigma, bool corrector) {
  const double second = corrector ? 1.0 : 0.0;
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes target = sigma * Load(&free[i]);
    const Lanes bend = second * Load(&step[i]);
    const Lanes to_lower = target - Load(&z_lower[i]) * Load(&below_[i]) - bend * Load(&z_lower_step_[i]);
    const Lanes to_upper = target - Load(&z_upper[i]) * Load(&above_[i]) + bend * Load(&z_upper_step_[i]);
    Store(&z_lower_step_[i], to_lower);
    Store(&z_upper_step_[i], to_upper);
    Store(&drive[i], to_lower * Load(&inverse_below_[i]) - to_upper * Load(&inverse_above_[i]));
  }
}

void BoxedVariables::CompleteDirection() {
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]);
    Store(&z_lower_step_[i], (Load(&z_lower_step_[i]) - Load(&z_lower[i]) * d) * Load(&inverse_below_[i]));
    Store(&z_upper_step_[i], (Load(&z_upper_step_[i]) + Load(&z_upper[i]) * d) * Load(&inverse_above_[i]));
  }
}

double BoxedVariables::InverseMaxStep() const {
  Lanes most = kernels::Broadcast(1.0);
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]);
    most = Larger(-d * Load(&inverse_below_[i]), most);
    most = Larger(d * Load(&inverse_above_[i]), most);
    most = Larger(-Load(&z_lower_step_[i]) / Load(&z_lower[i]), most);
    most = Larger(-Load(&z_upper_step_[i]) / Load(&z_upper[i]), most);
  }
  return std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
}

void BoxedVariables::Move(double length) {
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes change = length * Load(&step[i]);
    Store(&value[i], Load(&value[i]) + change);
    Store(&below_[i], Load(&below_[i]) + change);
    Store(&above_[i], Load(&above_[i]) - change);
    Store(&z_lower[i], Load(&z_lower[i]) + length * Load(&z_lower_step_[i]));
    Store(&z_upper[i], Load(&z_upper[i]) + length * Load(&z_upper_step_[i]));
  }
  InvertSlacks();
}

}  // namespace legopt
