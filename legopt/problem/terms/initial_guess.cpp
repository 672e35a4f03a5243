#include "legopt/problem/terms/initial_guess.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "legopt/dataset/dataset.h"
#include "legopt/math/random_numbers.h"
#include "legopt/problem/terms/internal/arm_guess.h"
#include "legopt/robot/configuration.h"

namespace legopt {
namespace {

/// Horizontal pose of the base.
struct BasePlace {
  Eigen::Vector2d position;
  double yaw_rad;
};

/// Returns the place at which the nominal positions of the contacts fit their targets best, in least squares: a point's
/// target says nothing about the robot's heading. `fallback_yaw_rad`: used if all nominal positions coincide.
BasePlace FittedPlace(const Dataset& dataset, const Stance& stance, double fallback_yaw_rad) {
  const auto n = static_cast<double>(stance.contacts.size());
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();
  for (const ContactTarget& target : stance.contacts) {
    from += dataset.contact(target.contact).nominal_position_B.head<2>() / n;
    to += target.position.head<2>() / n;
  }
  double along = 0.0, across = 0.0;
  for (const ContactTarget& target : stance.contacts) {
    const Eigen::Vector2d a = dataset.contact(target.contact).nominal_position_B.head<2>() - from;
    const Eigen::Vector2d b = target.position.head<2>() - to;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  const double yaw = along == 0.0 && across == 0.0 ? fallback_yaw_rad : std::atan2(across, along);
  return {.position = to - Eigen::Rotation2Dd(yaw) * from, .yaw_rad = yaw};
}

/// Returns the horizontal position of the base that fits all contacts best with this yaw, in least squares: hands far
/// ahead draw the trunk forwards.
Eigen::Vector2d PositionWithHands(const Dataset& dataset, const Stance& stance, double yaw_rad) {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  for (const ContactTarget& target : stance.contacts) {
    const Eigen::Vector2d nominal = dataset.contact(target.contact).nominal_position_B.head<2>();
    position += target.position.head<2>() - Eigen::Rotation2Dd(yaw_rad) * nominal;
  }
  return position / static_cast<double>(stance.contacts.size());
}

/// Returns true if a target says nothing about the robot's heading.
bool HasFreeRotation(const Dataset& dataset, const Stance& stance) {
  return std::ranges::any_of(stance.contacts, [&](const ContactTarget& target) {
    return dataset.contact(target.contact).facts().free_rotation != FreeRotation::kNone;
  });
}

/// Returns the stance without hands, which say little about the trunk's height and heading; all of it if there are only
/// hands.
Stance FeetOf(const Dataset& dataset, const Stance& stance) {
  Stance feet;
  for (const ContactTarget& target : stance.contacts) {
    if (dataset.contact(target.contact).facts().supports) feet.contacts.push_back(target);
  }
  return feet.contacts.empty() ? stance : feet;
}

}  // namespace

Eigen::VectorXd InitialGuess(const Dataset& dataset, const Stance& whole_stance, Initialization initialization) {
  const Stance stance = FeetOf(dataset, whole_stance);
  if (stance.contacts.empty()) {
    std::fprintf(stderr, "InitialGuess: the stance has no contacts\n");
    std::abort();
  }
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const ContactTarget& target : stance.contacts) {
    centre += target.position.head<2>();
    const Eigen::Vector2d forward = target.rotation.normalized().toRotationMatrix().col(0).head<2>();
    heading += forward.stableNormalized();  // circular mean: every contact's yaw has the same weight, whatever its tilt
    lowest = std::min(lowest, target.position.z());
    highest = std::max(highest, target.position.z());
  }
  centre /= static_cast<double>(stance.contacts.size());
  double yaw = std::atan2(heading.y(), heading.x());  // 0 if the contacts point in exactly opposite directions
  if (HasFreeRotation(dataset, stance)) {
    const BasePlace place = FittedPlace(dataset, stance, yaw);
    centre = place.position;
    yaw = place.yaw_rad;
  } else {  // the trunk is above the middle of the soles
    centre -= Eigen::Rotation2Dd(yaw) * dataset.trunk().nominal_position_B.head<2>();
  }
  const bool has_hands = whole_stance.contacts.size() > stance.contacts.size();
  if (has_hands) centre = PositionWithHands(dataset, whole_stance, yaw);
  const double sole =
      initialization == Initialization::kGood ? highest + kGoodSoleHeight_m : lowest - kInCollisionSoleDepth_m;

  Eigen::VectorXd x(dataset.robot().configuration_size());
  const auto parts = MutablePartsOf(x);
  parts.joints() = dataset.nominal_joints();
  parts.base_position() << centre, sole - dataset.nominal_sole_height_m();
  parts.set_base_quaternion({std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)});
  if (has_hands) {
    const double height = parts.base_position().z();
    parts.base_position().z() = 0.5 * (lowest + highest) - dataset.nominal_sole_height_m();  // feet on the ground
    BringHandsNear(dataset, whole_stance, x);
    parts.base_position().z() = height;
  }
  return x;
}

bool GuessRepeatsInMotions(const Dataset& dataset) {
  return std::ranges::any_of(dataset.contacts(), [](const Contact& contact) { return !contact.facts().supports; });
}

void PerturbJoints(const RobotModel& robot, std::mt19937_64& generator, double half_width_rad,
                   Eigen::Ref<Eigen::VectorXd> x) {
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const double noise = half_width_rad * (2 * UniformRandom(generator) - 1);
    x[dof] = std::clamp(x[dof] + noise, robot.lower_limits()[dof], robot.upper_limits()[dof]);
  }
}

}  // namespace legopt
