#include "legopt/problem/terms/internal/statics_terms.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/statics/stance_forces.h"
#include "legopt/types/check.h"

namespace legopt {
namespace {

/// Slack of the balance in the torque ratio: less than the judge's, and enough for rounding at the polygon's edges.
constexpr double kBalanceSlack = 1e-4;

}  // namespace

std::vector<HalfPlane> BalanceEdges(const Dataset& dataset, const Stance& stance, Physics physics,
                                    const BalanceInset& inset) {
  const bool on_feet = StandsOnFeet(dataset, stance);
  const std::vector<Eigen::Vector2d> support = TargetSupportPolygon(dataset, stance);
  const auto of_support = [&] { return support.empty() ? std::vector<HalfPlane>() : Edges(support); };
  if (on_feet && physics == Physics::kNone) return of_support();
  const EquilibriumPolygon polygon = ComputeEquilibriumPolygon(StanceForces(SurfacesOf(dataset, stance)));
  if (polygon.corners.empty()) return of_support();
  std::vector<HalfPlane> edges = Edges(polygon.corners);
  double perimeter = 0.0;
  for (size_t i = 0; i < polygon.corners.size(); ++i) {
    perimeter += (polygon.corners[(i + 1) % polygon.corners.size()] - polygon.corners[i]).norm();
  }
  // The area by the perimeter is at most the radius of the largest circle inside.
  const double radius_m = perimeter > 0.0 ? PolygonArea(polygon.corners) / perimeter : 0.0;
  const double inset_m = std::min(inset.most_m, inset.share * radius_m);
  for (HalfPlane& edge : edges) edge.offset += inset_m;
  if (!on_feet) return edges;
  const bool inside = std::ranges::all_of(polygon.corners, [&](const Eigen::Vector2d& corner) {
    return SignedDistanceToPolygon(support, corner) <= inset_m;
  });
  if (!inside) std::ranges::copy(Edges(support), std::back_inserter(edges));
  return edges;
}

FreeTorqueTerm::FreeTorqueTerm(int waypoint, WaypointState& state, const Dataset& dataset, const Stance& stance)
    : Term({"torques of free joints", TermKind::kInequality, waypoint, 1}),
      state_(&state),
      gravity_m_s2_(dataset.gravity_m_s2()),
      torques_(dataset.robot().num_dofs()),
      jacobian_(dataset.robot().num_dofs(), dataset.robot().tangent_size()) {
  const RobotModel& robot = dataset.robot();
  std::set<int> loaded;
  for (const ContactTarget& target : stance.contacts) {
    if (!target.carries) continue;
    for (const int body : robot.body_chain(robot.link_body(dataset.contact(target.contact).link_index))) {
      loaded.insert(robot.joints()[static_cast<size_t>(robot.body_joint(body))].dof);
    }
  }
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    if (std::isfinite(robot.effort_limits()[dof]) && !loaded.contains(dof)) free_.push_back(dof);
  }
}

void FreeTorqueTerm::FindNear() {
  const Kinematics& kinematics = state_->kinematics();
  kinematics.GravityTorques(gravity_m_s2_, torques_);
  near_.clear();
  for (const int dof : free_) {
    if (std::abs(torques_[dof]) > kNearEffortShare * kinematics.model().effort_limits()[dof]) near_.push_back(dof);
  }
}

void FreeTorqueTerm::ComputeResiduals(std::vector<double>& residuals) {
  FindNear();
  const Eigen::VectorXd& limits = state_->kinematics().model().effort_limits();
  for (const int dof : near_) residuals.push_back(std::abs(torques_[dof]) / limits[dof] - kEffortShare);
}

void FreeTorqueTerm::RowKeys(int /*rows*/, std::vector<int>& keys) {
  FindNear();
  for (const int dof : near_) keys.push_back(2 * dof + (torques_[dof] < 0.0 ? 1 : 0));
}

void FreeTorqueTerm::ComputeModel(LinearModel& model) {
  FindNear();
  const Kinematics& kinematics = state_->kinematics();
  const int size = kinematics.model().tangent_size();
  model.Reset(static_cast<int>(near_.size()), size, 1);
  if (near_.empty()) return;
  kinematics.GravityTorqueJacobian(gravity_m_s2_, jacobian_);
  for (int i = 0; i < model.rows(); ++i) {
    const int dof = near_[static_cast<size_t>(i)];
    const double limit = kinematics.model().effort_limits()[dof];
    model.value(i) = std::abs(torques_[dof]) / limit - kEffortShare;
    const double scale = std::copysign(1.0 / limit, torques_[dof]);
    for (int j = 0; j < size; ++j) model.row(0, i)[j] = scale * jacobian_(dof, j);
  }
}

LoadedTorqueTerm::LoadedTorqueTerm(int waypoint, WaypointState& state, const Dataset& dataset, const Stance& stance)
    : Term({"torques of loaded joints", TermKind::kInequality, waypoint, 1}),
      state_(&state),
      forces_(SurfacesOf(dataset, stance)),
      equilibrium_(dataset.robot(), dataset.gravity_m_s2()) {}

void LoadedTorqueTerm::Compute(bool with_gradient) {
  if (revision_ == state_->revision() && (has_gradient_ || !with_gradient)) return;
  // That a ratio is below is found faster than the ratio itself, but the ratio answers both questions.
  is_near_ =
      is_near_ || !equilibrium_.IsLoadedRatioBelow(forces_, state_->kinematics(), kBalanceSlack, kNearEffortShare);
  if (is_near_) {
    equilibrium_.ComputeLoadedRatio(forces_, state_->kinematics(), kBalanceSlack, with_gradient, &result_);
    is_near_ = result_.ratio >= kNearEffortShare;
  }
  if (!is_near_) {
    result_.ratio = std::numeric_limits<double>::infinity();
    with_gradient = true;
  }
  revision_ = state_->revision();
  has_gradient_ = with_gradient;
}

void LoadedTorqueTerm::ComputeResiduals(std::vector<double>& residuals) {
  Compute(false);
  if (std::isfinite(result_.ratio)) residuals.push_back(result_.ratio - kEffortShare);
}

void LoadedTorqueTerm::ComputeModel(LinearModel& model) {
  Compute(true);
  const int size = static_cast<int>(state_->kinematics().model().tangent_size());
  if (!std::isfinite(result_.ratio)) return model.Reset(0, size, 1);
  model.Reset(1, size, 1);
  model.value(0) = result_.ratio - kEffortShare;
  Eigen::Map<Eigen::VectorXd>(model.row(0, 0), size) = result_.gradient;
}

LoadedPushTerm::LoadedPushTerm(int waypoint, WaypointState& state, const Dataset& dataset, const Stance& stance)
    : Term({"push within effort limits", TermKind::kInequality, waypoint, 1}),
      state_(&state),
      forces_(SurfacesOf(dataset, stance)),
      equilibrium_(dataset.robot(), dataset.gravity_m_s2()),
      required_N_(stance.push_N.value_or(0.0) + 0.5 * kPushTolerance_N),
      weight_N_(dataset.robot().total_mass() * dataset.gravity_m_s2()) {}

void LoadedPushTerm::Compute(bool with_gradient) {
  if (revision_ == state_->revision() && (has_gradient_ || !with_gradient)) return;
  equilibrium_.ComputeWeakestPush(forces_, state_->kinematics(), kNearPushShare * required_N_, with_gradient, &result_);
  revision_ = state_->revision();
  has_gradient_ = with_gradient;
}

void LoadedPushTerm::ComputeResiduals(std::vector<double>& residuals) {
  Compute(false);
  if (std::isfinite(result_.push_N)) residuals.push_back((required_N_ - result_.push_N) / weight_N_);
}

void LoadedPushTerm::ComputeModel(LinearModel& model) {
  Compute(true);
  const int size = static_cast<int>(state_->kinematics().model().tangent_size());
  if (!std::isfinite(result_.push_N)) return model.Reset(0, size, 1);
  model.Reset(1, size, 1);
  model.value(0) = (required_N_ - result_.push_N) / weight_N_;
  Eigen::Map<Eigen::VectorXd>(model.row(0, 0), size) = -result_.gradient / weight_N_;
}

std::vector<HalfSpace> PushHalfSpaces(const Dataset& dataset, const Stance& stance) {
  const StanceForces forces(SurfacesOf(dataset, stance));
  const double weight_N = dataset.robot().total_mass() * dataset.gravity_m_s2();
  const double share = (stance.push_N.value_or(0.0) + 0.5 * kPushTolerance_N) / weight_N;
  std::vector<HalfSpace> half_spaces;
  for (int k = 0; k < kPushDirections; ++k) {
    const Eigen::Vector2d push = share * PushDirection(k).head<2>();
    const std::vector<Eigen::Vector2d> corners = ComputePushPolygon(forces, push);
    if (corners.empty()) continue;
    for (const HalfPlane& edge : Edges(corners)) {
      const double slope = edge.normal.dot(push);
      half_spaces.push_back({.normal_W = {edge.normal.x(), edge.normal.y(), slope},
                             .offset_m = edge.offset - slope * forces.origin_W().z()});
    }
  }
  return half_spaces;
}

PushTerm::PushTerm(int waypoint, WaypointState& state, std::vector<HalfSpace> half_spaces)
    : Term({"push", TermKind::kInequality, waypoint, 1}), state_(&state), half_spaces_(std::move(half_spaces)) {
  near_.reserve(half_spaces_.size());
  com_jacobian_.setZero(3, state.kinematics().model().tangent_size());
}

void PushTerm::FindNear() {
  const Eigen::Vector3d com_W = state_->kinematics().com();
  near_.clear();
  for (size_t i = 0; i < half_spaces_.size(); ++i) {
    if (half_spaces_[i].Distance(com_W) > -kNearPush_m) near_.push_back(static_cast<int>(i));
  }
}

void PushTerm::ComputeResiduals(std::vector<double>& residuals) {
  FindNear();
  const Eigen::Vector3d com_W = state_->kinematics().com();
  for (const int i : near_) residuals.push_back(half_spaces_[static_cast<size_t>(i)].Distance(com_W));
}

void PushTerm::RowKeys(int /*rows*/, std::vector<int>& keys) {
  FindNear();
  keys.insert(keys.end(), near_.begin(), near_.end());
}

void PushTerm::ComputeModel(LinearModel& model) {
  FindNear();
  const int size = state_->kinematics().model().tangent_size();
  model.Reset(static_cast<int>(near_.size()), size, 1);
  if (near_.empty()) return;
  state_->kinematics().ComJacobian(com_jacobian_);
  const Eigen::Vector3d com_W = state_->kinematics().com();
  for (int i = 0; i < model.rows(); ++i) {
    const HalfSpace& half_space = half_spaces_[static_cast<size_t>(near_[static_cast<size_t>(i)])];
    model.value(i) = half_space.Distance(com_W);
    Eigen::Map<Eigen::VectorXd>(model.row(0, i), size).noalias() = com_jacobian_.transpose() * half_space.normal_W;
  }
}

}  // namespace legopt
