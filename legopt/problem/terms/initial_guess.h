#pragma once

#include <Eigen/Core>
#include <random>

#include "legopt/dataset/problem_definition.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/task.h"

namespace legopt {

class Dataset;

/// Height of the lower contact patch above the highest target in the good initialisation, metres (paper).
inline constexpr double kGoodSoleHeight_m = 0.20;

/// Depth of the lower contact patch below the lowest target in the in-collision initialisation, metres (paper).
inline constexpr double kInCollisionSoleDepth_m = 0.05;

/// Returns the initial guess of one waypoint that is constrained by `stance` (docs/explanation/paper.md#initial-guess).
///
/// Joints: the dataset's nominal posture. Base: xy so that the trunk is at the centre of the stance's contact
/// positions; roll = pitch = 0; yaw is the circular mean of the contacts' yaw. The base's z places the lower of the
/// robot's contact patches (all feet of the dataset, lowest corner of the foot's box) kGoodSoleHeight_m above the
/// highest contact position, or kInCollisionSoleDepth_m below the lowest one. These heights do not include the 1 mm
/// clearance of the contact frame. If the stance has contacts of kind point, whose targets have no heading, xy and yaw
/// are those with which the contacts in the nominal posture fit their targets best, in least squares. Hands (palms and
/// rails) count only for xy, which then fits all contacts, and for the joints of their arms, which bring them near
/// their targets with the feet between the lowest and the highest foot's target (arm_guess.h). The result has n + 7
/// numbers (q, p, wxyz) with a unit quaternion. `stance` must not be empty (abort).
Eigen::VectorXd InitialGuess(const Dataset& dataset, const Stance& stance, Initialization initialization);

/// Returns whether the configuration of a window's first waypoint is the initial guess of all its waypoints: the solved
/// waypoint, or the guess for the first stance. True for robots with hands. A hand can often reach its target in
/// several ways, for example from both sides of a bar. Independent guesses may choose different ways, which no short
/// path joins.
bool GuessRepeatsInMotions(const Dataset& dataset);

/// Adds independent uniform noise from [-half_width_rad, half_width_rad) to every actuated joint of `x` (n + 7; for
/// prismatic joints the number is in metres) and clips to the limits; the base does not change
/// (docs/explanation/paper.md#restarts).
///
/// Uses one 64-bit random number per joint in DOF order, mapped to a double by its upper 53 bits. The result is the
/// same on every machine and standard library, which std::uniform_real_distribution does not guarantee.
void PerturbJoints(const RobotModel& robot, std::mt19937_64& generator, double half_width_rad,
                   Eigen::Ref<Eigen::VectorXd> x);

}  // namespace legopt
