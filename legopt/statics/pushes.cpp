#include <algorithm>
#include <cmath>
#include <numbers>

#include "legopt/statics/static_equilibrium.h"

namespace legopt {
namespace {

constexpr double kLargestPush = 10.0;  // weights

}  // namespace

Eigen::Vector3d PushDirection(int k) {
  const double angle = 2.0 * std::numbers::pi * k / kPushDirections;
  return {std::cos(angle), std::sin(angle), 0.0};
}

double StaticEquilibrium::UnloadedPush() const {
  const Eigen::VectorXd& limits = robot_.effort_limits();
  double bound = kLargestPush;
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    if (!IsLimited(dof) || IsLoaded(dof)) continue;
    const double gravity = gravity_torques_[dof], rate = -push_torques_[dof];
    if (std::abs(gravity) > limits[dof]) return -LinearProgramSolver::kInfinity;
    if (rate > 0.0) bound = std::min(bound, (limits[dof] - gravity) / rate);
    if (rate < 0.0) bound = std::min(bound, (limits[dof] + gravity) / -rate);
  }
  return bound;
}

void StaticEquilibrium::SetPushProgram(const StanceForces& forces, const Kinematics& kinematics, PushLimits limits) {
  if (limits == PushLimits::kContactsAndEfforts) {
    SetTorqueRows(forces, kinematics);
    kinematics.ComJacobian(com_jacobian_);
  } else {
    loaded_.clear();
  }
  push_limits_ = limits;
  push_column_ = forces.num_generators();
  const auto m = static_cast<Eigen::Index>(loaded_.size());
  SetBalanceRows(forces, kinematics.com(), kBalanceTolerance, m, 1);
  if (m == 0) return;
  program_.A.bottomLeftCorner(m, push_column_) = -shares_.topRows(m);
  program_.range.tail(m).setConstant(2.0);
  const Eigen::Index first = program_.b.size() - m;
  for (Eigen::Index i = 0; i < m; ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    program_.b[first + i] = 1.0 - gravity_torques_[dof] / robot_.effort_limits()[dof];
  }
}

void StaticEquilibrium::SetPushColumn(int direction) {
  const Eigen::Vector3d unit = PushDirection(direction);
  auto column = program_.A.col(push_column_);
  column.head<3>() = unit;
  push_bound_ = kLargestPush;
  if (push_limits_ == PushLimits::kContacts) return;
  push_torques_.noalias() = weight_N_ * (com_jacobian_.leftCols(robot_.num_dofs()).transpose() * unit);
  const Eigen::Index first = program_.b.size() - std::ssize(loaded_);
  for (std::size_t i = 0; i < loaded_.size(); ++i) {
    const int dof = loaded_[i];
    column[first + static_cast<Eigen::Index>(i)] = -push_torques_[dof] / robot_.effort_limits()[dof];
  }
  push_bound_ = UnloadedPush();
}

bool StaticEquilibrium::Resists(int direction, double push) {
  if (push_bound_ < push) return false;
  balanced_b_ = program_.b;
  program_.b -= push * program_.A.col(push_column_);
  program_.upper[push_column_] = 0.0;
  LinearProgramSolver& solver = resisting_solvers_[static_cast<size_t>(direction)];
  if (direction > 0 && !solver.has_basis()) solver = resisting_solvers_[static_cast<size_t>(direction) - 1];
  const bool resists = solver.Resume(program_) == LinearProgramStatus::kOptimal;
  program_.b = balanced_b_;
  return resists;
}

double StaticEquilibrium::LargestPush(LinearProgramSolver& solver, bool resume) {
  constexpr double kLeastBound = 1e-12;  // the solver needs room for a variable
  if (!std::isfinite(push_bound_)) return push_bound_;
  program_.upper[push_column_] = std::max(push_bound_, kLeastBound);
  cost_.setZero(push_column_ + 1);
  cost_[push_column_] = -1.0;
  const LinearProgramStatus status = resume ? solver.Resume(program_) : solver.Constrain(program_);
  if (status != LinearProgramStatus::kOptimal || solver.Minimize(cost_) != LinearProgramStatus::kOptimal) {
    return -LinearProgramSolver::kInfinity;
  }
  return solver.x()[push_column_];
}

void StaticEquilibrium::SetPushGradient(int direction, double push, const LinearProgramSolver& solver,
                                        const StanceForces& forces, const Kinematics& kinematics,
                                        Eigen::VectorXd* gradient) {
  // A push tilts the weight: torques without contact forces are those of gravity along e_z - push.
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() - push * PushDirection(direction);
  kinematics.GravityTorqueJacobian(gravity_m_s2_ * up, gravity_jacobian_);
  const Eigen::VectorXd& limits = robot_.effort_limits();
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    if (IsLoaded(dof) || !std::isfinite(limits[dof]) || !(limits[dof] > 0.0)) continue;
    constexpr double kAtLimit = 1e-9;
    const double torque = gravity_torques_[dof] - push * push_torques_[dof];
    if (std::abs(torque) < limits[dof] * (1.0 - kAtLimit)) continue;
    // At its limit, |tau| stays constant: d push = d tau / (d tau / d push).
    *gradient = (weight_N_ / push_torques_[dof]) * gravity_jacobian_.row(dof).transpose();
    return;
  }
  const Eigen::VectorXd& y = solver.multipliers();
  const auto m = static_cast<Eigen::Index>(loaded_.size());
  const Eigen::Index first = y.size() - m;
  weights_.setZero(robot_.num_dofs());
  for (Eigen::Index i = 0; i < m; ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    weights_[dof] = -y[first + i] / limits[dof];
  }
  *gradient = gravity_jacobian_.transpose() * weights_;
  AddForceRates(forces, kinematics, solver.x(), y, gradient);
  *gradient *= -weight_N_;  // the program minimises the negative push
}

void StaticEquilibrium::ComputeWeakestPush(const StanceForces& forces, const Kinematics& kinematics, double enough_N,
                                           bool with_gradient, WeakestPush* result) {
  SetPushProgram(forces, kinematics, PushLimits::kContactsAndEfforts);
  result->push_N = LinearProgramSolver::kInfinity;
  const double enough = enough_N / weight_N_;
  for (int k = 0; k < kPushDirections; ++k) {
    bool& is_weak = is_weak_[static_cast<size_t>(k)];
    LinearProgramSolver& solver = largest_push_solvers_[static_cast<size_t>(k)];
    SetPushColumn(k);
    if (!is_weak && Resists(k, enough)) continue;
    if (!solver.has_basis()) solver = resisting_solvers_[static_cast<size_t>(k)];
    const double push = LargestPush(solver, true);
    is_weak = push < enough;
    if (!is_weak || !(push * weight_N_ < result->push_N)) continue;
    result->push_N = push * weight_N_;
    if (!std::isfinite(push)) return;
    if (with_gradient) SetPushGradient(k, push, solver, forces, kinematics, &result->gradient);
  }
}

DirectedPushes StaticEquilibrium::ResistedPushes_N(const StanceForces& forces, const Kinematics& kinematics,
                                                   PushLimits limits) {
  SetPushProgram(forces, kinematics, limits);
  DirectedPushes pushes_N;
  for (int k = 0; k < kPushDirections; ++k) {
    SetPushColumn(k);
    pushes_N[static_cast<size_t>(k)] = LargestPush(solver_, k > 0) * weight_N_;
  }
  return pushes_N;
}

double StaticEquilibrium::ResistedPush_N(const StanceForces& forces, const Kinematics& kinematics) {
  return std::ranges::min(ResistedPushes_N(forces, kinematics, PushLimits::kContactsAndEfforts));
}

}  // namespace legopt
