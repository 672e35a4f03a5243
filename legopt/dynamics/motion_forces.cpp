#include "legopt/dynamics/motion_forces.h"

#include <algorithm>
#include <cmath>

namespace legopt {
namespace {

constexpr Eigen::Index kWrenchSize = 6;
constexpr double kGravityUnit_m_s2 = 9.81;

/// Variables of the program after the forces, with their costs. Each cost is so large that an earlier aim of
/// MotionForces is not given up for a later one.
enum ForceColumn : Eigen::Index { kSlackUsed, kSlackExceeded, kRatio, kRatioExceeded, kNumForceColumns };
constexpr double kColumnCosts[kNumForceColumns] = {1e2, 1e4, 1.0, 1e3};
constexpr double kForceCost = 1e-4;

bool HasLimit(double effort) { return std::isfinite(effort) && effort > 0.0; }

}  // namespace

MotionForces::MotionForces(const RobotModel& robot, double gravity_m_s2)
    : robot_(robot),
      gravity_m_s2_(gravity_m_s2),
      unit_N_(robot.total_mass() * (gravity_m_s2 > 0.0 ? gravity_m_s2 : kGravityUnit_m_s2)),
      free_torques_(robot.num_dofs()),
      jacobian_(3, robot.tangent_size()) {}

void MotionForces::SetLoads(const StanceForces& forces, const Kinematics& kinematics, const InertialForces& inertial) {
  const int n = robot_.num_dofs();
  kinematics.GravityTorques(gravity_m_s2_, free_torques_);
  free_torques_ += inertial.torques;
  demand_.head<3>() = inertial.force_N / unit_N_;
  demand_[2] += robot_.total_mass() * gravity_m_s2_ / unit_N_;
  demand_.tail<3>() = inertial.moment_Nm / unit_N_;
  const Eigen::Vector3d com = kinematics.com() - forces.origin_W();
  shares_.resize(n, forces.num_generators());
  wrenches_.resize(kWrenchSize, forces.num_generators());
  int last_point = -1;
  for (int l = 0; l < forces.num_generators(); ++l) {
    const int point = forces.point_of(l);
    if (point != last_point) {
      const StanceForces::Point& where = forces.points()[static_cast<size_t>(point)];
      kinematics.PointJacobian(where.link, where.position_W, jacobian_);
      last_point = point;
    }
    const Eigen::Vector3d direction = forces.directions().col(l);
    shares_.col(l).noalias() = unit_N_ * (jacobian_.leftCols(n).transpose() * direction);
    wrenches_.col(l) << direction, forces.moments().col(l) - com.cross(direction);
  }
  loaded_.clear();
  for (int dof = 0; dof < n; ++dof) {
    if (HasLimit(robot_.effort_limits()[dof]) && !shares_.row(dof).isZero(0.0)) loaded_.push_back(dof);
  }
}

void MotionForces::SetProgram(const StanceForces& forces, double slack) {
  const Eigen::Index L = forces.num_generators();
  const auto num_bounds = static_cast<Eigen::Index>(forces.bounds().size());
  const Eigen::Index rows = 2 * (kWrenchSize + std::ssize(loaded_)) + num_bounds;
  auto& [A, b, range, upper] = program_;
  A.setZero(rows, L + kNumForceColumns);
  b.setZero(rows);
  range.setConstant(rows, LinearProgramSolver::kInfinity);
  Eigen::Index row = 0;
  // |a . lambda - value| <= used + exceeded
  const auto bound_difference = [&, &A = A, &b = b](const Eigen::RowVectorXd& a, double value, ForceColumn used,
                                                    ForceColumn exceeded) {
    for (const double sign : {1.0, -1.0}) {
      A.row(row).head(L) = sign * a;
      A(row, L + used) = A(row, L + exceeded) = -1.0;
      b[row++] = sign * value;
    }
  };
  for (Eigen::Index i = 0; i < kWrenchSize; ++i) {
    bound_difference(wrenches_.row(i), demand_[i], kSlackUsed, kSlackExceeded);
  }
  for (const int dof : loaded_) {
    const double limit = robot_.effort_limits()[dof];
    bound_difference(shares_.row(dof) / limit, free_torques_[dof] / limit, kRatio, kRatioExceeded);
  }
  for (const StanceForces::NormalBound& bound : forces.bounds()) {
    for (int l = 0; l < forces.num_generators(); ++l) {
      if (forces.surface_of(l) == bound.surface) A(row, l) = 1.0;
    }
    b[row++] = bound.maximum;
  }
  upper.setConstant(A.cols(), LinearProgramSolver::kInfinity);
  upper.head(L) = forces.upper();
  upper[L + kSlackUsed] = slack;
  upper[L + kRatio] = 1.0;
  cost_.setZero(A.cols());
  cost_.head(L).setConstant(kForceCost);
  for (Eigen::Index i = 0; i < kNumForceColumns; ++i) cost_[L + i] = kColumnCosts[i];
}

RealizedForces MotionForces::ForcesOf(const StanceForces& forces, const Eigen::VectorXd& lambda) const {
  RealizedForces result;
  result.forces_N.assign(forces.points().size(), Eigen::Vector3d::Zero());
  for (int l = 0; l < forces.num_generators(); ++l) {
    result.forces_N[static_cast<size_t>(forces.point_of(l))] += unit_N_ * lambda[l] * forces.directions().col(l);
  }
  result.torques = free_torques_ - shares_ * lambda;
  result.imbalance = (wrenches_ * lambda - demand_).cwiseAbs().maxCoeff();
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    const double limit = robot_.effort_limits()[dof];
    if (HasLimit(limit)) result.torque_ratio = std::max(result.torque_ratio, std::abs(result.torques[dof]) / limit);
  }
  return result;
}

RealizedForces MotionForces::Compute(const StanceForces& forces, const Kinematics& kinematics,
                                     const InertialForces& inertial, double slack) {
  SetLoads(forces, kinematics, inertial);
  SetProgram(forces, slack);
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(forces.num_generators());
  if (solver_.Constrain(program_) == LinearProgramStatus::kOptimal &&
      solver_.Minimize(cost_) == LinearProgramStatus::kOptimal) {
    lambda = solver_.x().head(forces.num_generators());
  }
  return ForcesOf(forces, lambda);
}

}  // namespace legopt
