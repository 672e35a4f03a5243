#include "legopt/statics/static_equilibrium.h"

#include <algorithm>
#include <cmath>

#include "legopt/statics/internal/force_program.h"

namespace legopt {
StaticEquilibrium::StaticEquilibrium(const RobotModel& robot, double gravity_m_s2)
    : robot_(robot),
      gravity_m_s2_(gravity_m_s2),
      weight_N_(robot.total_mass() * gravity_m_s2),
      gravity_torques_(robot.num_dofs()),
      jacobian_(3, robot.tangent_size()),
      com_jacobian_(3, robot.tangent_size()),
      gravity_jacobian_(robot.num_dofs(), robot.tangent_size()) {}

void StaticEquilibrium::SetBalanceRows(const StanceForces& forces, const Eigen::Vector3d& com_W, double tolerance,
                                       Eigen::Index torque_rows, Eigen::Index columns) {
  const ForceProgram program{
      .com_W = com_W, .lift = 1.0, .tolerance = tolerance, .more_rows = torque_rows, .more_columns = columns};
  SetForceProgram(forces, program, &program_);
}

double StaticEquilibrium::Imbalance(const StanceForces& forces, const Eigen::Vector3d& com_W) {
  if (forces.num_generators() == 0) return 1.0;
  // The imbalance is the largest one, of no force at all, less r.
  SetBalanceRows(forces, com_W, 0.0, kBalanceRows, 1);
  auto& [A, b, range, upper] = program_;
  const Eigen::Index L = forces.num_generators(), first = b.size() - kBalanceRows;
  A.bottomRows(kBalanceRows).leftCols(L) = -A.topLeftCorner(kBalanceRows, L);
  b.tail(kBalanceRows) = -b.head(kBalanceRows);
  const double largest = std::max(1.0, b.cwiseAbs().maxCoeff());
  for (Eigen::Index i = 0; i < kBalanceRows; ++i) {
    for (const Eigen::Index row : {i, first + i}) {
      A(row, L) = 1.0;  // value + r <= right side + largest
      b[row] += largest;
      range[row] = LinearProgramSolver::kInfinity;
    }
  }
  upper[L] = largest;
  cost_.setZero(L + 1);
  cost_[L] = -1.0;
  if (solver_.Constrain(program_) != LinearProgramStatus::kOptimal ||
      solver_.Minimize(cost_) != LinearProgramStatus::kOptimal) {
    return largest;
  }
  return std::max(0.0, largest - solver_.x()[L]);
}

void StaticEquilibrium::SetTorqueRows(const StanceForces& forces, const Kinematics& kinematics) {
  const int n = robot_.num_dofs();
  kinematics.GravityTorques(gravity_m_s2_, gravity_torques_);
  Eigen::MatrixXd& all = shares_;
  all.setZero(n, forces.num_generators());
  int last_point = -1;
  for (int l = 0; l < forces.num_generators(); ++l) {
    const int point = forces.point_of(l);
    if (point != last_point) {
      const StanceForces::Point& where = forces.points()[static_cast<size_t>(point)];
      kinematics.PointJacobian(where.link, where.position_W, jacobian_);
      last_point = point;
    }
    all.col(l).noalias() = jacobian_.leftCols(n).transpose() * forces.directions().col(l);
  }
  loaded_.clear();
  for (int dof = 0; dof < n; ++dof) {
    const double limit = robot_.effort_limits()[dof];
    if (!IsLimited(dof) || all.row(dof).isZero(0.0)) continue;
    const auto index = static_cast<Eigen::Index>(loaded_.size());
    all.row(index) = all.row(dof) * (weight_N_ / limit);
    loaded_.push_back(dof);
  }
}

bool StaticEquilibrium::MinimizeRatio(const StanceForces& forces, const Kinematics& kinematics, double tolerance,
                                      bool resume, LinearProgramSolver& solver) {
  SetTorqueRows(forces, kinematics);
  const auto m = static_cast<Eigen::Index>(loaded_.size());
  const Eigen::Index L = forces.num_generators();
  SetBalanceRows(forces, kinematics.com(), tolerance, 2 * m, 1);
  auto& [A, b, range, upper] = program_;
  const Eigen::Index first = b.size() - 2 * m;
  // t = kLargestTorqueRatio - r, so that the torque rows are satisfied at first
  for (Eigen::Index i = 0; i < m; ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    const double gravity = gravity_torques_[dof] / robot_.effort_limits()[dof];
    A.row(first + 2 * i).head(L) = -shares_.row(i);
    A.row(first + 2 * i + 1).head(L) = shares_.row(i);
    A(first + 2 * i, L) = A(first + 2 * i + 1, L) = 1.0;
    b[first + 2 * i] = kLargestTorqueRatio - gravity;
    b[first + 2 * i + 1] = kLargestTorqueRatio + gravity;
  }
  upper[L] = kLargestTorqueRatio;
  cost_.setZero(L + 1);
  cost_[L] = -1.0;
  const LinearProgramStatus status = resume ? solver.Resume(program_) : solver.Constrain(program_);
  return status == LinearProgramStatus::kOptimal && solver.Minimize(cost_) == LinearProgramStatus::kOptimal;
}

void StaticEquilibrium::SetBoundedRatioRows(const StanceForces& forces, const Kinematics& kinematics, double tolerance,
                                            double ratio) {
  SetTorqueRows(forces, kinematics);
  const auto m = static_cast<Eigen::Index>(loaded_.size());
  const Eigen::Index L = forces.num_generators();
  SetBalanceRows(forces, kinematics.com(), tolerance, m, 0);
  const Eigen::Index first = program_.b.size() - m;
  program_.A.bottomLeftCorner(m, L) = -shares_.topRows(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    program_.b[first + i] = ratio - gravity_torques_[dof] / robot_.effort_limits()[dof];
    program_.range[first + i] = 2.0 * ratio;
  }
}

bool StaticEquilibrium::IsLoadedRatioBelow(const StanceForces& forces, const Kinematics& kinematics, double tolerance,
                                           double ratio) {
  SetBoundedRatioRows(forces, kinematics, tolerance, ratio);
  return bounded_solver_.Resume(program_) == LinearProgramStatus::kOptimal;
}

void StaticEquilibrium::ComputeLoadedRatio(const StanceForces& forces, const Kinematics& kinematics, double tolerance,
                                           bool with_gradient, LoadedRatio* result) {
  if (!MinimizeRatio(forces, kinematics, tolerance, true, loaded_solver_)) {
    result->ratio = LinearProgramSolver::kInfinity;
    return;
  }
  const int n = robot_.num_dofs();
  const Eigen::Index L = forces.num_generators(), m = static_cast<Eigen::Index>(loaded_.size());
  result->ratio = kLargestTorqueRatio - loaded_solver_.x()[L];
  if (!with_gradient) return;
  // The rate of the optimum is that of y . (b - A x) at fixed x, y. The torque rows are -+ tau_j / limit_j.
  const Eigen::VectorXd& y = loaded_solver_.multipliers();
  const Eigen::Index first = y.size() - 2 * m;
  weights_.setZero(n);
  for (Eigen::Index i = 0; i < m; ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    weights_[dof] = (y[first + 2 * i + 1] - y[first + 2 * i]) / robot_.effort_limits()[dof];
  }
  result->gradient.resize(robot_.tangent_size());
  kinematics.GravityTorqueJacobian(gravity_m_s2_, gravity_jacobian_);
  result->gradient.noalias() = gravity_jacobian_.transpose() * weights_;
  AddForceRates(forces, kinematics, loaded_solver_.x(), y, &result->gradient);
}

void StaticEquilibrium::AddForceRates(const StanceForces& forces, const Kinematics& kinematics,
                                      const Eigen::VectorXd& lambda, const Eigen::VectorXd& y,
                                      Eigen::VectorXd* gradient) {
  const Eigen::VectorXd negative = -weights_;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int l = 0;
  for (size_t k = 0; k < forces.points().size(); ++k) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  // unit: weights
    for (; l < forces.num_generators() && forces.point_of(l) == static_cast<int>(k); ++l) {
      force += lambda[l] * forces.directions().col(l);
    }
    sum += force;
    if (force.isZero(0.0)) continue;
    const StanceForces::Point& point = forces.points()[k];
    kinematics.AddPointTorqueGradient(point.link, point.position_W, weight_N_ * force, negative, gradient->data());
  }
  // The moments about the centre of mass change by -dc x sum of the forces.
  kinematics.ComJacobian(com_jacobian_);
  gradient->noalias() += com_jacobian_.transpose() * sum.cross(y.segment<3>(3));
}

bool StaticEquilibrium::IsLimited(int dof) const {
  const double limit = robot_.effort_limits()[dof];
  return std::isfinite(limit) && limit > 0.0;
}

bool StaticEquilibrium::IsLoaded(int dof) const {
  return std::find(loaded_.begin(), loaded_.end(), dof) != loaded_.end();
}

void StaticEquilibrium::SetForces(const StanceForces& forces, const Eigen::VectorXd& lambda,
                                  TorqueRatio* result) const {
  const Eigen::VectorXd& limits = robot_.effort_limits();
  result->torques = gravity_torques_;
  for (std::size_t i = 0; i < loaded_.size(); ++i) {
    const int dof = loaded_[i];
    result->torques[dof] -= shares_.row(static_cast<Eigen::Index>(i)).dot(lambda) * limits[dof];
  }
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    if (!IsLimited(dof)) continue;
    const double ratio = std::abs(result->torques[dof]) / limits[dof];
    if (!IsLoaded(dof)) result->proven_ratio = std::max(result->proven_ratio, ratio);
    if (!(ratio > result->ratio)) continue;
    result->ratio = ratio;
    result->dof = dof;
  }
  result->forces_N.assign(forces.points().size(), Eigen::Vector3d::Zero());
  for (int l = 0; l < forces.num_generators(); ++l) {
    result->forces_N[static_cast<size_t>(forces.point_of(l))] += weight_N_ * lambda[l] * forces.directions().col(l);
  }
}

TorqueRatio StaticEquilibrium::ComputeTorqueRatio(const StanceForces& forces, const Kinematics& kinematics) {
  TorqueRatio result;
  if (!MinimizeRatio(forces, kinematics, kBalanceTolerance, false, solver_)) {
    result.ratio = LinearProgramSolver::kInfinity;
    return result;
  }
  constexpr double kLargestForce = 1e3;  // weights
  const Eigen::VectorXd& y = solver_.multipliers();
  result.proven_ratio = std::max(0.0, kLargestTorqueRatio + DualBound(program_, cost_, y, kLargestForce));
  SetForces(forces, solver_.x().head(forces.num_generators()), &result);
  if (result.dof >= 0 && !IsLoaded(result.dof)) {
    result.decisive_dofs = {result.dof};
    return result;
  }
  constexpr double kNoMultiplier = 1e-9;
  const Eigen::Index first = y.size() - 2 * static_cast<Eigen::Index>(loaded_.size());
  for (std::size_t i = 0; i < loaded_.size(); ++i) {
    if (y.segment<2>(first + 2 * static_cast<Eigen::Index>(i)).cwiseAbs().maxCoeff() > kNoMultiplier) {
      result.decisive_dofs.push_back(loaded_[i]);
    }
  }
  return result;
}

TorqueRatio StaticEquilibrium::ComputeLeastForces(const StanceForces& forces, const Kinematics& kinematics) {
  TorqueRatio result = ComputeTorqueRatio(forces, kinematics);
  if (!std::isfinite(result.ratio)) return result;
  const Eigen::Index L = forces.num_generators();
  constexpr double kRounding = 1e-9;
  const double loaded_ratio = std::max(0.0, kLargestTorqueRatio - solver_.x()[L]);
  SetBoundedRatioRows(forces, kinematics, kBalanceTolerance, loaded_ratio + kRounding);
  bool found = false;
  if (loaded_ratio > 1.0) {
    // Only the joints that prove the ratio should be above their limits, if that is possible.
    const LinearProgram bounded = program_;
    const Eigen::Index first = program_.b.size() - static_cast<Eigen::Index>(loaded_.size());
    for (std::size_t i = 0; i < loaded_.size(); ++i) {
      if (std::ranges::find(result.decisive_dofs, loaded_[i]) != result.decisive_dofs.end()) continue;
      const Eigen::Index row = first + static_cast<Eigen::Index>(i);
      program_.b[row] -= loaded_ratio + kRounding - 1.0;
      program_.range[row] = 2.0;
    }
    found = solver_.Constrain(program_) == LinearProgramStatus::kOptimal;
    if (!found) program_ = bounded;
  }
  if (!found && solver_.Constrain(program_) != LinearProgramStatus::kOptimal) return result;
  cost_.setOnes(L);
  if (solver_.Minimize(cost_) != LinearProgramStatus::kOptimal) return result;
  result.ratio = 0.0;
  SetForces(forces, solver_.x().head(L), &result);
  return result;
}

std::optional<CollapseMotion> StaticEquilibrium::FindCollapse(const StanceForces& forces,
                                                              const Eigen::Vector3d& com_W) {
  CollapseMotion motion{.center_W = com_W, .velocity = -Eigen::Vector3d::UnitZ(), .turn = Eigen::Vector3d::Zero()};
  if (forces.num_generators() == 0) return motion;
  if (!(Imbalance(forces, com_W) > 0.0)) return std::nullopt;
  // Each row of the balance is there with both signs, the second time at the end.
  const Eigen::VectorXd& multipliers = solver_.multipliers();
  const Eigen::VectorXd y = multipliers.head<kBalanceRows>() - multipliers.tail<kBalanceRows>();
  motion.velocity = -y.head<3>();
  motion.turn = -y.tail<3>();
  constexpr double kLeastMargin = 1e-6;
  if (!(CollapseMargin(motion, forces, com_W) > kLeastMargin)) return std::nullopt;
  return motion;
}

}  // namespace legopt
