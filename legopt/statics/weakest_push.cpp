#include <cmath>

#include "legopt/statics/internal/force_program.h"
#include "legopt/statics/static_equilibrium.h"

namespace legopt {

bool StaticEquilibrium::Resists(int direction, double push, const StanceForces& forces, const Kinematics& kinematics,
                                const Eigen::VectorXd& push_torques) {
  if (UnloadedPush(push_torques) < push) return false;
  const auto m = static_cast<Eigen::Index>(loaded_.size());
  SetBalanceRows(forces, kinematics.com(), kBalanceTolerance, m, 0);
  b_.head<3>() -= push * PushDirection(direction);
  const Eigen::Index first = b_.size() - m, L = forces.num_generators();
  for (Eigen::Index i = 0; i < m; ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    // -share of the contacts + slack = 1 - share of gravity and push, with slack in [0, 2]
    A_.row(first + i).head(L) = -shares_.row(i);
    b_[first + i] = 1.0 - (gravity_torques_[dof] - push * push_torques[dof]) / robot_.effort_limits()[dof];
    upper_[L + first + i] = 2.0;
  }
  LinearProgramSolver& solver = push_solvers_[static_cast<size_t>(direction)];
  return solver.Resume(A_, b_, upper_) || solver.Constrain(A_, b_, upper_) == LinearProgramStatus::kOptimal;
}

double StaticEquilibrium::LargestPush(int direction, const StanceForces& forces, const Kinematics& kinematics,
                                      const Eigen::VectorXd& push_torques) {
  const double bound = UnloadedPush(push_torques);
  if (!std::isfinite(bound)) return bound;
  SetBalanceRows(forces, kinematics.com(), kBalanceTolerance, 2 * static_cast<Eigen::Index>(loaded_.size()), 1);
  const Eigen::Index L = forces.num_generators();
  A_.block<3, 1>(0, L) = PushDirection(direction);
  SetPushRows(push_torques);
  constexpr double kLeastBound = 1e-12;  // the solver needs room for a variable
  upper_[L] = std::max(bound, kLeastBound);
  cost_.setZero(A_.cols());
  cost_[L] = -1.0;
  if (solver_.Constrain(A_, b_, upper_) != LinearProgramStatus::kOptimal ||
      solver_.Minimize(cost_) != LinearProgramStatus::kOptimal) {
    return -LinearProgramSolver::kInfinity;
  }
  return solver_.x()[L];
}

void StaticEquilibrium::SetPushGradient(int direction, double push, const StanceForces& forces,
                                        const Kinematics& kinematics, const Eigen::VectorXd& push_torques,
                                        Eigen::VectorXd* gradient) {
  // A push tilts the weight: torques without contact forces are those of gravity along e_z - push.
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() - push * PushDirection(direction);
  kinematics.GravityTorqueJacobian(gravity_m_s2_ * up, gravity_jacobian_);
  const Eigen::VectorXd& limits = robot_.effort_limits();
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    if (IsLoaded(dof) || !std::isfinite(limits[dof]) || !(limits[dof] > 0.0)) continue;
    constexpr double kAtLimit = 1e-9;
    const double torque = gravity_torques_[dof] - push * push_torques[dof];
    if (std::abs(torque) < limits[dof] * (1.0 - kAtLimit)) continue;
    // At its limit, |tau| stays constant: d push = d tau / (d tau / d push).
    *gradient = (weight_N_ / push_torques[dof]) * gravity_jacobian_.row(dof).transpose();
    return;
  }
  const Eigen::VectorXd& y = solver_.multipliers();
  const auto m = static_cast<Eigen::Index>(loaded_.size());
  const Eigen::Index first = y.size() - 2 * m;
  weights_.setZero(robot_.num_dofs());
  for (Eigen::Index i = 0; i < m; ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    weights_[dof] = (y[first + 2 * i + 1] - y[first + 2 * i]) / limits[dof];
  }
  *gradient = gravity_jacobian_.transpose() * weights_;
  AddForceRates(forces, kinematics, solver_.x(), y, gradient);
  *gradient *= -weight_N_;  // the program minimises the negative push
}

void StaticEquilibrium::ComputeWeakestPush(const StanceForces& forces, const Kinematics& kinematics, double enough_N,
                                           bool with_gradient, WeakestPush* result) {
  SetTorqueRows(forces, kinematics);
  kinematics.ComJacobian(com_jacobian_);
  result->push_N = LinearProgramSolver::kInfinity;
  for (int k = 0; k < kPushDirections; ++k) {
    const Eigen::VectorXd push_torques =
        weight_N_ * (com_jacobian_.leftCols(robot_.num_dofs()).transpose() * PushDirection(k));
    if (Resists(k, enough_N / weight_N_, forces, kinematics, push_torques)) continue;
    const double push = LargestPush(k, forces, kinematics, push_torques);
    if (!(push * weight_N_ < result->push_N)) continue;
    result->push_N = push * weight_N_;
    if (!std::isfinite(push)) return;
    if (with_gradient) SetPushGradient(k, push, forces, kinematics, push_torques, &result->gradient);
  }
}

}  // namespace legopt
