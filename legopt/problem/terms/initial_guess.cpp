#include "legopt/problem/terms/initial_guess.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "legopt/dataset/dataset.h"
#include "legopt/math/random_numbers.h"

namespace legopt {

Eigen::VectorXd InitialGuess(const Dataset& dataset, const Stance& stance, Initialization initialization) {
  if (stance.footholds.empty()) {
    std::fprintf(stderr, "InitialGuess: the stance has no footholds\n");
    std::abort();
  }
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const Foothold& foothold : stance.footholds) {
    centre += foothold.position.head<2>();
    const Eigen::Vector2d forward = foothold.rotation.normalized().toRotationMatrix().col(0).head<2>();
    heading += forward.stableNormalized();  // circular mean: every contact's yaw has the same weight, whatever its tilt
    lowest = std::min(lowest, foothold.position.z());
    highest = std::max(highest, foothold.position.z());
  }
  centre /= static_cast<double>(stance.footholds.size());
  const double yaw = std::atan2(heading.y(), heading.x());  // 0 if the contacts point in exactly opposite directions
  const double sole =
      initialization == Initialization::kGood ? highest + kGoodSoleHeight_m : lowest - kInCollisionSoleDepth_m;

  const int n = dataset.robot().num_dofs();
  Eigen::VectorXd x(dataset.robot().configuration_size());
  x.head(n) = dataset.nominal_joints();
  x.segment<3>(n) << centre, sole - dataset.nominal_sole_height_m();
  x.tail<4>() << std::cos(yaw / 2), 0, 0, std::sin(yaw / 2);
  return x;
}

void PerturbJoints(const RobotModel& robot, std::mt19937_64& generator, double half_width_rad,
                   Eigen::Ref<Eigen::VectorXd> x) {
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const double noise = half_width_rad * (2 * UniformRandom(generator) - 1);
    x[dof] = std::clamp(x[dof] + noise, robot.lower_limits()[dof], robot.upper_limits()[dof]);
  }
}

}  // namespace legopt
