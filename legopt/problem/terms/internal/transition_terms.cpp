#include "legopt/problem/terms/internal/transition_terms.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "legopt/robot/configuration.h"

namespace legopt {
namespace {

/// Returns R_to R_from^T as the quaternion with w >= 0.
Eigen::Quaterniond RelativeRotation(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  Eigen::Quaterniond turn = PartsOf(to).base_rotation() * PartsOf(from).base_rotation().conjugate();
  if (turn.w() < 0.0) turn.coeffs() *= -1.0;
  return turn;
}

}  // namespace

void ConfigurationDifference(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                             Eigen::Ref<Eigen::VectorXd> difference) {
  const auto parts = MutableTangentPartsOf(difference);
  parts.linear() = PartsOf(to).linear() - PartsOf(from).linear();
  parts.base_rotation() = 2.0 * RelativeRotation(from, to).vec();
}

VelocityCostTerm::VelocityCostTerm(int waypoint, int unit, const WaypointState& from, const WaypointState& to)
    : Term({"velocity cost", TermKind::kCost, waypoint, 2, unit}), from_(&from), to_(&to) {
  difference_.setZero(from.kinematics().model().tangent_size());
}

void VelocityCostTerm::ComputeResiduals(std::vector<double>& residuals) {
  ConfigurationDifference(from_->configuration(), to_->configuration(), difference_);
  residuals.insert(residuals.end(), difference_.begin(), difference_.end());
}

void VelocityCostTerm::ComputeModel(LinearModel& model) {
  ConfigurationDifference(from_->configuration(), to_->configuration(), difference_);
  const auto size = static_cast<int>(difference_.size());
  const int linear = from_->kinematics().model().base_rotation_index();
  model.Reset(size, size, 2);
  for (int i = 0; i < size; ++i) model.value(i) = difference_[i];
  for (int i = 0; i < linear; ++i) {
    model.row(0, i)[i] = -1.0;
    model.row(1, i)[i] = 1.0;
  }
  // World increments: q <- (1, phi_to / 2) q (1, -phi_from / 2), hence 2 de = (w I - [e]x) phi_to - (w I + [e]x)
  // phi_from.
  const Eigen::Quaterniond turn = RelativeRotation(from_->configuration(), to_->configuration());
  const Eigen::Vector3d e = turn.vec();
  Eigen::Matrix3d cross;
  cross << 0.0, -e.z(), e.y(), e.z(), 0.0, -e.x(), -e.y(), e.x(), 0.0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double w = i == j ? turn.w() : 0.0;
      model.row(0, linear + i)[linear + j] = -w - cross(i, j);
      model.row(1, linear + i)[linear + j] = w - cross(i, j);
    }
  }
}

namespace {

constexpr int kQuarters = 4;

double DistanceOfPair(const std::vector<ProximityPair>& contacts, int pair_id) {
  for (const ProximityPair& contact : contacts) {
    if (contact.pair_id == pair_id) return contact.distance_m;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

SweptCollisionTerm::SweptCollisionTerm(int waypoint, WaypointState& from, WaypointState& to, const RobotModel& robot,
                                       CollisionQuery& query, double margin_m, double range_m, double preference_weight,
                                       double step_m, Sweep sweep)
    : Term({"swept collision", preference_weight > 0.0 ? TermKind::kPreference : TermKind::kInequality, waypoint, 2, -1,
            preference_weight}),
      from_(&from),
      to_(&to),
      robot_(&robot),
      query_(&query),
      margin_m_(margin_m),
      range_m_(range_m),
      step_m_(step_m),
      sweep_(sweep),
      quarters_{Kinematics(robot), Kinematics(robot), Kinematics(robot)},
      kinematics_(robot),
      x_(robot.configuration_size()),
      gradient_(robot.tangent_size()),
      displacements_(robot.links().size(), 0.0),
      steps_(robot.links().size(), 1) {
  links_.reserve(robot.links().size());
}

void SweptCollisionTerm::ComputeResiduals(std::vector<double>& residuals) {
  if (disabled_) return;
  Refresh();
  for (const Row& row : rows_) residuals.push_back(margin_m_ - row.contact.distance_m);
}

void SweptCollisionTerm::ComputeModel(LinearModel& model) {
  if (disabled_) return model.Reset(0, robot_->tangent_size(), 2);
  Refresh();
  const int straight = robot_->base_rotation_index();
  model.Reset(static_cast<int>(rows_.size()), robot_->tangent_size(), 2);
  double placed_at = 0.0;
  BaseRotationDerivatives turn;
  for (int i = 0; i < model.rows(); ++i) {
    const auto& [contact, s] = rows_[static_cast<size_t>(i)];
    if (s != placed_at) {
      InterpolateConfiguration(from_->configuration(), to_->configuration(), s, x_);
      kinematics_.UpdatePoses(x_);
      turn = DifferentiateBaseRotation(from_->configuration(), to_->configuration(), s);
      placed_at = s;
    }
    model.value(i) = margin_m_ - contact.distance_m;
    gradient_.setZero();
    kinematics_.AddPointGradient(contact.link_a, contact.point_a_W, contact.normal_W, -1.0, gradient_.data());
    if (contact.link_b != kScene) {
      kinematics_.AddPointGradient(contact.link_b, contact.point_b_W, contact.normal_W, 1.0, gradient_.data());
    }
    double* const from = model.row(0, i);
    double* const to = model.row(1, i);
    for (int j = 0; j < straight; ++j) {
      from[j] = (1.0 - s) * gradient_[j];
      to[j] = s * gradient_[j];
    }
    Eigen::Map<Eigen::Vector3d>(from + straight).noalias() =
        turn.from.transpose() * TangentPartsOf(gradient_).base_rotation();
    Eigen::Map<Eigen::Vector3d>(to + straight).noalias() =
        turn.to.transpose() * TangentPartsOf(gradient_).base_rotation();
  }
}

void SweptCollisionTerm::RowKeys(int /*rows*/, std::vector<int>& keys) {
  if (disabled_) return;
  Refresh();
  for (const Row& row : rows_) keys.push_back(row.contact.pair_id);
}

std::span<const SweptCollisionTerm::Row> SweptCollisionTerm::rows() {
  Refresh();
  return rows_;
}

int SweptCollisionTerm::num_steps(int link) {
  Refresh();
  return steps_[static_cast<size_t>(link)];
}

void SweptCollisionTerm::Refresh() {
  if (from_revision_ == from_->revision() && to_revision_ == to_->revision()) return;
  rows_.clear();
  const int most_steps = ChooseSteps();
  if (most_steps > 1) {
    CollectRows(most_steps);
    KeepNearestSamples();
  }
  from_revision_ = from_->revision();
  to_revision_ = to_->revision();
}

int SweptCollisionTerm::ChooseSteps() {
  MeasureDisplacements();
  int most = 1;
  for (size_t link = 0; link < steps_.size(); ++link) {
    int& steps = steps_[link];
    steps = 1;
    while (steps < kMaxSteps && kQuarters * displacements_[link] > step_m_ * steps) steps *= 2;
    most = std::max(most, steps);
  }
  return most;
}

void SweptCollisionTerm::MeasureDisplacements() {
  std::fill(displacements_.begin(), displacements_.end(), 0.0);
  const Kinematics* before = &from_->kinematics();
  for (int quarter = 1; quarter < kQuarters; ++quarter) {
    Kinematics& here = quarters_[static_cast<size_t>(quarter - 1)];
    InterpolateConfiguration(from_->configuration(), to_->configuration(), static_cast<double>(quarter) / kQuarters,
                             x_);
    here.UpdatePoses(x_);
    UpdateDisplacements(*before, here);
    before = &here;
  }
  UpdateDisplacements(*before, to_->kinematics());
}

void SweptCollisionTerm::UpdateDisplacements(const Kinematics& before, const Kinematics& after) {
  for (size_t i = 0; i < displacements_.size(); ++i) {
    const int link = static_cast<int>(i);
    const CollisionModel::Ball& ball = query_->model().link_ball(link);
    if (ball.radius < 0.0) continue;
    displacements_[i] =
        std::max(displacements_[i], MaxDisplacement(ball, before.link_pose(link), after.link_pose(link)));
  }
}

void SweptCollisionTerm::CollectRows(int most_steps) {
  for (int k = 1; k < most_steps; ++k) {
    links_.clear();
    for (size_t link = 0; link < steps_.size(); ++link) {
      if (k % (most_steps / steps_[link]) == 0) links_.push_back(static_cast<int>(link));
    }
    const double s = static_cast<double>(k) / most_steps;  // exact
    const Kinematics& sample = PlaceSample(k, most_steps);
    const std::span<const ProximityPair> found =
        sweep_ == Sweep::kWithAll ? query_->Contacts(sample, range_m_, &from_->memory())
                                  : query_->SceneContacts(sample, range_m_, links_, &from_->memory());
    for (const ProximityPair& contact : found) rows_.push_back({contact, s});
  }
}

const Kinematics& SweptCollisionTerm::PlaceSample(int k, int most_steps) {
  const int quarters = kQuarters * k / most_steps;
  if (quarters * most_steps == kQuarters * k) return quarters_[static_cast<size_t>(quarters - 1)];
  InterpolateConfiguration(from_->configuration(), to_->configuration(), static_cast<double>(k) / most_steps, x_);
  kinematics_.UpdatePoses(x_);
  return kinematics_;
}

void SweptCollisionTerm::KeepNearestSamples() {
  std::sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) {
    return std::tie(a.contact.pair_id, a.contact.distance_m, a.s) <
           std::tie(b.contact.pair_id, b.contact.distance_m, b.s);
  });
  const auto same_pair = [](const Row& a, const Row& b) { return a.contact.pair_id == b.contact.pair_id; };
  rows_.erase(std::unique(rows_.begin(), rows_.end(), same_pair), rows_.end());
  rows_.erase(std::remove_if(rows_.begin(), rows_.end(), [this](const Row& row) { return !Matters(row); }),
              rows_.end());
  std::sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) {
    return std::tie(a.s, a.contact.link_a, a.contact.pair_id) < std::tie(b.s, b.contact.link_a, b.contact.pair_id);
  });
}

bool SweptCollisionTerm::Matters(const Row& row) {
  const double d = row.contact.distance_m;
  if (d < margin_m_) return true;
  const int pair = row.contact.pair_id;
  return d < DistanceOfPair(from_->contacts(), pair) && d < DistanceOfPair(to_->contacts(), pair);
}

}  // namespace legopt
