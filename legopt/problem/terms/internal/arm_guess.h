#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"

namespace legopt {

/// Returns the degrees of freedom between the trunk and the contact's link, from the trunk outwards.
std::vector<int> ArmDofs(const Dataset& dataset, const Contact& contact);

/// Sets the joints between trunk and hand, for every hand of the stance, such that the hand is near its target: of a
/// few hundred postures of the arm, drawn at random within the joints' limits and then around the best one, the one of
/// least error |p - p_target| + 2 l sin(angle / 2), with l = 0.3 m and the angle between the contact's axis and the
/// target's. Collisions do not count. `x`: configuration, n + 7; its base stays. The random numbers are the same each
/// time.
void BringHandsNear(const Dataset& dataset, const Stance& stance, Eigen::VectorXd& x);

}  // namespace legopt
