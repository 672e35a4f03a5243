#include "legopt/solvers/subproblem/boxed_variables.h"

#include <algorithm>

#include "legopt/solvers/subproblem/dense_kernels.h"

namespace legopt {
namespace {

using kernels::Lanes;
using kernels::Load;
using kernels::Store;

constexpr size_t kLanes = kernels::kLanes;

/// Ignores NaN candidates (0 / 0 of fixed variables).
Lanes Larger(Lanes candidate, Lanes best) { return candidate > best ? candidate : best; }

double Largest(Lanes v) { return std::max(std::max(v[0], v[1]), std::max(v[2], v[3])); }

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
  lower[i] = at - 1.0;  // any slack works
  upper[i] = at + 1.0;
}

void BoxedVariables::Start() {
  constexpr double kMinShare = 1e-15;  // relative to the box
  for (size_t i = 0; i < size(); ++i) {
    const double least = kMinShare * (upper[i] - lower[i]);
    below_[i] = std::max(value[i] - lower[i], least);
    above_[i] = std::max(upper[i] - value[i], least);
  }
  Move(0.0);
}

void BoxedVariables::UpdateGap() {
  Lanes lower_gap = {}, upper_gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    lower_gap += Load(&z_lower[i]) * Load(&below_[i]);
    upper_gap += Load(&z_upper[i]) * Load(&above_[i]);
  }
  gap_ = kernels::Sum(lower_gap + upper_gap);
}

void BoxedVariables::BarrierHessian(AlignedDoubles& theta) const {
  theta.resize(size());
  for (size_t i = 0; i < size(); i += kLanes) {
    Store(&theta[i], Load(&z_lower[i]) * Load(&inverse_below_[i]) + Load(&z_upper[i]) * Load(&inverse_above_[i]));
  }
}

// -dz / z is 1 + r and 1 - q; the slacks shrink by -r and q, relatively.
double BoxedVariables::InverseMaxAffineStep() const {
  Lanes most = kernels::Broadcast(1.0);
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]);
    const Lanes r = d * Load(&inverse_below_[i]), q = d * Load(&inverse_above_[i]);
    most = Larger(Larger(-r, 1.0 + r), most);
    most = Larger(Larger(q, 1.0 - q), most);
  }
  return Largest(most);
}

double BoxedVariables::GapAfterAffine(double length) const {
  Lanes lower_gap = {}, upper_gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes change = length * Load(&step[i]);
    const Lanes r = change * Load(&inverse_below_[i]), q = change * Load(&inverse_above_[i]);
    lower_gap += Load(&z_lower[i]) * ((1.0 - length) - r) * (Load(&below_[i]) + change);
    upper_gap += Load(&z_upper[i]) * ((1.0 - length) + q) * (Load(&above_[i]) - change);
  }
  return kernels::Sum(lower_gap + upper_gap);
}

void BoxedVariables::Correct(double sigma) {
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]), below = Load(&inverse_below_[i]), above = Load(&inverse_above_[i]);
    const Lanes r = d * below, q = d * above;
    const Lanes e_lower = sigma * below + Load(&z_lower[i]) * r * (1.0 + r);
    const Lanes e_upper = sigma * above - Load(&z_upper[i]) * q * (1.0 - q);
    Store(&z_lower_step_[i], e_lower);
    Store(&z_upper_step_[i], e_upper);
    Store(&drive[i], e_lower - e_upper);
  }
}

double BoxedVariables::CompleteDirection() {
  Lanes most = kernels::Broadcast(1.0);
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes d = Load(&step[i]);
    const Lanes r = d * Load(&inverse_below_[i]), q = d * Load(&inverse_above_[i]);
    const Lanes lower_z = Load(&z_lower[i]), upper_z = Load(&z_upper[i]);
    const Lanes lower_step = Load(&z_lower_step_[i]) - lower_z * (1.0 + r);
    const Lanes upper_step = Load(&z_upper_step_[i]) - upper_z * (1.0 - q);
    Store(&z_lower_step_[i], lower_step);
    Store(&z_upper_step_[i], upper_step);
    most = Larger(-r, most);
    most = Larger(q, most);
    most = Larger(-lower_step / lower_z, most);
    most = Larger(-upper_step / upper_z, most);
  }
  return Largest(most);
}

void BoxedVariables::Move(double length) {
  Lanes lower_gap = {}, upper_gap = {};
  for (size_t i = 0; i < size(); i += kLanes) {
    const Lanes change = length * Load(&step[i]), mask = Load(&free[i]);
    const Lanes below = Load(&below_[i]) + change, above = Load(&above_[i]) - change;
    const Lanes lower_z = Load(&z_lower[i]) + length * Load(&z_lower_step_[i]);
    const Lanes upper_z = Load(&z_upper[i]) + length * Load(&z_upper_step_[i]);
    lower_gap += lower_z * below;
    upper_gap += upper_z * above;
    Store(&value[i], Load(&value[i]) + change);
    Store(&below_[i], below);
    Store(&above_[i], above);
    Store(&z_lower[i], lower_z);
    Store(&z_upper[i], upper_z);
    Store(&inverse_below_[i], mask / below);
    Store(&inverse_above_[i], mask / above);
  }
  gap_ = kernels::Sum(lower_gap + upper_gap);
}

}  // namespace legopt
