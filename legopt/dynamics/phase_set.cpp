#include "legopt/dynamics/phase_set.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "legopt/dynamics/internal/phase_polygon.h"
#include "legopt/statics/internal/force_program.h"

namespace legopt {
namespace {

constexpr Eigen::Index kPhaseColumns = 3;  // u > 0, u < 0, x, in units of the largest x
constexpr double kReach = 1e3;             // largest |u| in units of the largest x
constexpr double kStandardGravity_m_s2 = 9.81;
constexpr double kSameCorner = 1e-9;  // corners that are nearer count as one

}  // namespace

PhaseSetBuilder::PhaseSetBuilder(const RobotModel& robot, double gravity_m_s2, double effort_share)
    : robot_(robot),
      gravity_m_s2_(gravity_m_s2),
      effort_share_(effort_share),
      unit_N_(robot.total_mass() * (gravity_m_s2 > 0.0 ? gravity_m_s2 : kStandardGravity_m_s2)),
      kinematics_(robot),
      dynamics_(robot),
      gravity_torques_(robot.num_dofs()),
      at_rest_(Eigen::VectorXd::Zero(robot.tangent_size())),
      jacobian_(3, robot.tangent_size()) {}

void PhaseSetBuilder::FindLoaded(const StanceForces& forces) {
  const int n = robot_.num_dofs();
  const Eigen::Index L = forces.num_generators();
  shares_.resize(n, L);
  int last_point = -1;
  for (int l = 0; l < L; ++l) {
    const int point = forces.point_of(l);
    if (point != last_point) {
      const StanceForces::Point& where = forces.points()[static_cast<size_t>(point)];
      kinematics_.PointJacobian(where.link, where.position_W, jacobian_);
      last_point = point;
    }
    shares_.col(l).noalias() = jacobian_.leftCols(n).transpose() * forces.directions().col(l);
  }
  loaded_.clear();
  free_.clear();
  for (int dof = 0; dof < n; ++dof) {
    if (!std::isfinite(robot_.effort_limits()[dof])) continue;
    (shares_.row(dof).isZero(0.0) ? free_ : loaded_).push_back(dof);
  }
}

void PhaseSetBuilder::SetTorqueRows(const StanceForces& forces) {
  const Eigen::Index L = forces.num_generators();
  auto& [A, b, range, upper] = program_;
  const Eigen::Index first = b.size() - std::ssize(loaded_);
  for (Eigen::Index i = 0; i < std::ssize(loaded_); ++i) {
    const int dof = loaded_[static_cast<size_t>(i)];
    const double scale = 1.0 / robot_.effort_limits()[dof];
    A.row(first + i).head(L) = -scale * unit_N_ * shares_.row(dof);
    A(first + i, L) = scale * largest_x_ * start_.torques[dof];
    A(first + i, L + 1) = -A(first + i, L);
    A(first + i, L + 2) = scale * largest_x_ * steady_.torques[dof];
    b[first + i] = effort_share_ - scale * gravity_torques_[dof];
    range[first + i] = 2.0 * effort_share_;
  }
}

void PhaseSetBuilder::SetForces(const StanceForces& forces, double slack) {
  const Eigen::Index L = forces.num_generators();
  const ForceProgram program{.com_W = kinematics_.com(),
                             .lift = robot_.total_mass() * gravity_m_s2_ / unit_N_,
                             .tolerance = slack,
                             .more_rows = std::ssize(loaded_),
                             .more_columns = kPhaseColumns};
  SetForceProgram(forces, program, &program_);
  program_.upper[L] = program_.upper[L + 1] = kReach;
  program_.upper[L + 2] = 1.0;
  Eigen::MatrixXd& A = program_.A;
  const double unit = largest_x_ / unit_N_;
  A.block<3, 1>(0, L) = -unit * start_.force_N;
  A.block<3, 1>(3, L) = -unit * start_.moment_Nm;
  A.block<kBalanceRows, 1>(0, L + 1) = -A.block<kBalanceRows, 1>(0, L);
  A.block<3, 1>(0, L + 2) = -unit * steady_.force_N;
  A.block<3, 1>(3, L + 2) = -unit * steady_.moment_Nm;
}

LimitOwner PhaseSetBuilder::OwnerOf(const StanceForces& forces, const Eigen::VectorXd& multipliers) const {
  constexpr double kNoShare = 1e-9;
  const Eigen::Index first = multipliers.size() - std::ssize(loaded_);
  Eigen::Index joint = -1;
  if (!loaded_.empty() && multipliers.tail(std::ssize(loaded_)).cwiseAbs().maxCoeff(&joint) > kNoShare) {
    return {TimeLimit::kTorque, loaded_[static_cast<size_t>(joint)]};
  }
  // The contact whose forces come nearest to helping is the one at its limit.
  LimitOwner owner;
  double nearest = -LinearProgramSolver::kInfinity;
  for (int l = 0; l < forces.num_generators(); ++l) {
    const double help = multipliers.head(first).dot(program_.A.col(l).head(first));
    if (!(help > nearest)) continue;
    nearest = help;
    owner.index = forces.surface_of(l);
  }
  return owner;
}

void PhaseSetBuilder::Measure(const CurvePoint& point) {
  kinematics_.Update(point.x);
  kinematics_.GravityTorques(gravity_m_s2_, gravity_torques_);
  dynamics_.Compute(kinematics_, at_rest_, point.velocity, &start_);
  dynamics_.Compute(kinematics_, point.velocity, point.bend, &steady_);
  velocity_x_ = kLargestSpeedSquare;
  velocity_dof_ = -1;
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    const double ratio = robot_.velocity_limits()[dof] / std::abs(point.velocity[dof]);
    if (!(ratio * ratio < velocity_x_)) continue;
    velocity_x_ = ratio * ratio;
    velocity_dof_ = dof;
  }
}

LinearProgramStatus PhaseSetBuilder::Constrain(const StanceForces& forces, double slack) {
  SetForces(forces, slack);
  SetTorqueRows(forces);
  const LinearProgramStatus status = has_basis_ ? solver_.Resume(program_) : solver_.Constrain(program_);
  has_basis_ = status == LinearProgramStatus::kOptimal;
  return status;
}

LinearProgramStatus PhaseSetBuilder::Scale(const StanceForces& forces, double slack) {
  constexpr double kMargin = 4.0, kSmall = 1e-2, kSmallest = 1e-6, kAtBound = 1.0 - 1e-9;
  constexpr int kMostTrials = 12;
  largest_x_ = last_x_ > 0.0 ? std::min(velocity_x_, kMargin * last_x_) : velocity_x_;
  LinearProgramStatus status = LinearProgramStatus::kStalled;
  for (int trial = 0; trial < kMostTrials; ++trial) {
    status = Constrain(forces, slack);
    const bool whole = largest_x_ == velocity_x_;
    if (status == LinearProgramStatus::kOptimal) {
      if (solver_.Minimize(CostOf(Eigen::Vector2d::UnitY())) != LinearProgramStatus::kOptimal) {
        return LinearProgramStatus::kStalled;
      }
      const double share = solver_.x()[forces.num_generators() + 2];
      last_x_ = std::max(share, kSmallest) * largest_x_;
      const bool fits = (whole || share < kAtBound) && (share > kSmall || largest_x_ <= kSmallest * velocity_x_);
      if (fits) return status;
      largest_x_ = std::min(velocity_x_, (share < kAtBound ? kMargin : kMargin * kMargin) * last_x_);
    } else {
      if (whole) return status;
      largest_x_ = velocity_x_;  // perhaps only faster motions balance
    }
  }
  return status;
}

Eigen::VectorXd PhaseSetBuilder::CostOf(const Eigen::Vector2d& direction) const {
  Eigen::VectorXd cost = Eigen::VectorXd::Zero(program_.A.cols());
  cost.tail<kPhaseColumns>() << -direction.x(), direction.x(), -direction.y();
  return cost;
}

bool PhaseSetBuilder::FindCorners(const StanceForces& forces, std::vector<PhaseCorner>* corners) {
  const Eigen::Index u = forces.num_generators();
  double last_angle = 0.0;
  const auto visit = [&](const TurnedOptimum& optimum) {
    constexpr double kSameEdge = 1e-10;
    const Eigen::Vector2d at(optimum.x[u] - optimum.x[u + 1], optimum.x[u + 2]);
    const bool same_edge = corners->size() > 1 && optimum.angle - last_angle <= kSameEdge;
    last_angle = optimum.angle;
    if (same_edge) {
      corners->back().at = at;
    } else {
      // The edge from the corner before to this one.
      if (!corners->empty()) corners->back().owner = OwnerOf(forces, optimum.multipliers);
      corners->push_back({at, {}});
    }
    // Having passed the lower end, the search is complete at the height where it began.
    return optimum.angle <= std::numbers::pi || at.y() < corners->front().at.y() - kSameCorner;
  };
  // The last objective of Scale: towards +x.
  const LinearProgramStatus status =
      solver_.Turn(CostOf(Eigen::Vector2d::UnitY()), CostOf(-Eigen::Vector2d::UnitX()), visit);
  constexpr double kClosed = 1e-6;
  // The first corner again, or another one with the same x, if the upper end of the set is an edge.
  if (status != LinearProgramStatus::kOptimal) return false;
  if (std::abs(corners->back().at.y() - corners->front().at.y()) > kClosed) return false;
  corners->back().owner = OwnerOf(forces, solver_.multipliers());
  MergeCorners(kSameCorner, corners);
  MarkVelocityEdge(corners);
  return true;
}

void PhaseSetBuilder::MarkVelocityEdge(std::vector<PhaseCorner>* corners) const {
  constexpr double kLevel = 1e-9;
  if (largest_x_ != velocity_x_) return;
  for (size_t i = 0; i < corners->size(); ++i) {
    const double here = (*corners)[i].at.y(), next = (*corners)[(i + 1) % corners->size()].at.y();
    if (here > 1.0 - kLevel && next > 1.0 - kLevel) (*corners)[i].owner = {TimeLimit::kVelocity, velocity_dof_};
  }
}

PhaseSet PhaseSetBuilder::Compute(const StanceForces& forces, const CurvePoint& point, double slack) {
  Measure(point);
  FindLoaded(forces);
  PhaseSet set;
  const LinearProgramStatus status = Scale(forces, slack);
  if (status != LinearProgramStatus::kOptimal) {
    set.blocked_by = status == LinearProgramStatus::kInfeasible ? OwnerOf(forces, solver_.multipliers())
                                                                : LimitOwner{TimeLimit::kNumerical, -1};
    return set;
  }
  std::vector<PhaseCorner> corners;
  if (!FindCorners(forces, &corners)) {
    set.blocked_by = {TimeLimit::kNumerical, -1};
    return set;
  }
  // Joints that no contact loads need no forces.
  for (const int dof : free_) {
    const Eigen::Vector2d rates = largest_x_ * Eigen::Vector2d(start_.torques[dof], steady_.torques[dof]);
    const double limit = effort_share_ * robot_.effort_limits()[dof];
    const LimitOwner owner{TimeLimit::kTorque, dof};
    for (const double sign : {1.0, -1.0}) {
      ClipPolygon(sign * rates, limit - sign * gravity_torques_[dof], owner, kSameCorner, &corners);
    }
    if (corners.empty()) {
      set.blocked_by = owner;
      return set;
    }
  }
  return SetOf(corners, largest_x_);
}

}  // namespace legopt
