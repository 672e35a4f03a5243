#include "legopt/planning/path_clearance.h"

#include <algorithm>
#include <cmath>

#include "legopt/robot/configuration.h"
#include "legopt/robot/interpolation.h"

namespace legopt {
namespace {

/// Maximum number of levels: the smallest intervals are 1 / 1024 of a piece.
constexpr std::size_t kMaxLevels = 12;

}  // namespace

PathClearance::PathClearance(const RobotModel& robot, CollisionQuery& query, double range_m)
    : robot_(&robot), query_(&query), range_m_(range_m), pair_index_(robot.links().size() * robot.links().size(), -1) {
  int index = 0;
  for (const auto& [first, second] : query.model().checked_pairs()) {
    pair_index_[static_cast<std::size_t>(first) * robot.links().size() + static_cast<std::size_t>(second)] = index++;
  }
}

PathClearance::Sample& PathClearance::Level(std::size_t level) {
  while (levels_.size() <= level) levels_.emplace_back(*robot_);
  return levels_[level];
}

void PathClearance::Place(double s, Sample* sample) {
  InterpolateConfiguration(from_, to_, s, x_);
  sample->kinematics.UpdatePoses(x_);
  sample->scene_m.assign(robot_->links().size(), range_m_);
  sample->pairs_m.assign(query_->model().checked_pairs().size(), range_m_);
  sample->nearest = {};
  sample->nearest.distance_m = range_m_;
  for (const ProximityPair& contact : query_->Contacts(sample->kinematics, range_m_, &memory_)) {
    const auto first = static_cast<std::size_t>(contact.link_a);
    double* distance_m = &sample->scene_m[first];
    if (contact.link_b != kScene) {
      const int pair = pair_index_[first * robot_->links().size() + static_cast<std::size_t>(contact.link_b)];
      distance_m = &sample->pairs_m[static_cast<std::size_t>(pair)];
    }
    *distance_m = std::min(*distance_m, contact.distance_m);
    if (contact.distance_m < sample->nearest.distance_m) sample->nearest = contact;
  }
}

bool PathClearance::IsFreeAt(const Sample& sample) {
  if (sample.nearest.distance_m >= kClearance_m) return true;
  obstacle_ = sample.nearest;
  return false;
}

bool PathClearance::Excluded(const Sample& a, const Sample& b) const {
  const auto excluded = [](double d_a, double d_b, double segment) {
    return 0.5 * (d_a + d_b - segment) >= kClearance_m;
  };
  const CollisionModel& model = query_->model();
  for (std::size_t link = 0; link < a.scene_m.size(); ++link) {
    const CollisionModel::Ball& ball = model.link_ball(static_cast<int>(link));
    if (ball.radius < 0.0) continue;
    const double segment = MaxDisplacement(ball, a.kinematics.link_pose(static_cast<int>(link)),
                                           b.kinematics.link_pose(static_cast<int>(link)));
    if (!excluded(a.scene_m[link], b.scene_m[link], segment)) return false;
  }
  for (std::size_t i = 0; i < a.pairs_m.size(); ++i) {
    const auto& [first, second] = model.checked_pairs()[i];
    const auto relative = [first = first, second = second](const Sample& sample) {
      return sample.kinematics.link_pose(first).inverse(Eigen::Isometry) * sample.kinematics.link_pose(second);
    };
    const double segment = MaxDisplacement(model.link_ball(second), relative(a), relative(b));
    if (!excluded(a.pairs_m[i], b.pairs_m[i], segment)) return false;
  }
  return true;
}

bool PathClearance::Bisect(std::size_t level, double s_a, const Sample& a, double s_b, const Sample& b) {
  if (level >= kMaxLevels) return true;
  if (turn_ * (s_b - s_a) <= kLargestTurn && Excluded(a, b)) return true;
  const double s = 0.5 * (s_a + s_b);
  Sample& middle = Level(level);
  Place(s, &middle);
  return IsFreeAt(middle) && Bisect(level + 1, s_a, a, s, middle) && Bisect(level + 1, s, middle, s_b, b);
}

bool PathClearance::IsFree(Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to) {
  from_ = from;
  to_ = to;
  x_.resize(from.size());
  const auto start = PartsOf(from_), end = PartsOf(to_);
  const double half = std::min(
      1.0, std::abs(start.quaternion_coefficients().normalized().dot(end.quaternion_coefficients().normalized())));
  const double joints = start.num_joints() == 0 ? 0.0 : (end.joints() - start.joints()).cwiseAbs().maxCoeff();
  turn_ = std::max(joints, 2.0 * std::acos(half));
  Sample& a = Level(0);
  Sample& b = Level(1);
  Place(0.0, &a);
  Place(1.0, &b);
  return IsFreeAt(a) && IsFreeAt(b) && Bisect(2, 0.0, a, 1.0, b);
}

}  // namespace legopt
