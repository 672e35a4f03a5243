#pragma once

#include <Eigen/Core>
#include <random>

#include "legopt/dataset/stance.h"
#include "legopt/robot/robot_model.h"
#include "words/task.h"

namespace legopt {

class Dataset;

/// Height of the lower sole above the highest target sole in the good initialisation, metres (paper).
inline constexpr double kGoodSoleHeight_m = 0.20;

/// Depth of the lower sole below the lowest target sole in the in-collision initialisation, metres (paper).
inline constexpr double kInCollisionSoleDepth_m = 0.05;

/// Starting configuration of one waypoint that is constrained by `stance` (docs/readings.md#initial-guess).
///
/// Joints: the dataset's nominal posture. Base: xy at the centre of the stance's positions; roll = pitch = 0 and yaw =
/// circular mean of the footholds' yaw; z such that the lower of the robot's soles (all feet of the dataset, lowest
/// corner of the foot's box) is kGoodSoleHeight_m above the highest, or kInCollisionSoleDepth_m below the lowest,
/// position of the stance. The 1 mm clearance of the sole offset is not part of these heights.
/// Returns n + 7 numbers (q, p, wxyz) with a unit quaternion. `stance` must not be empty (abort).
Eigen::VectorXd InitialGuess(const Dataset& dataset, const Stance& stance, Initialization initialization);

/// Adds independent uniform noise from [-half_width_rad, half_width_rad) to every actuated joint of `x` (n + 7;
/// prismatic joints take the number as metres) and clips to the limits; the base stays (docs/readings.md#restarts).
///
/// One 64-bit draw per joint in DOF order, mapped to a double by its upper 53 bits: the result is the same on every
/// machine and standard library, which std::uniform_real_distribution does not promise.
void PerturbJoints(const RobotModel& robot, std::mt19937_64& generator, double half_width_rad,
                   Eigen::Ref<Eigen::VectorXd> x);

}  // namespace legopt
