#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Mass properties of a body: links connected by fixed joints, in the frame of the first.
struct BodyMass {
  double mass = 0.0;                                  ///< kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      ///< m
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< rotational inertia about the centre of mass, kg m^2
};

/// Returns the mass properties of all bodies (RobotModel::num_bodies).
std::vector<BodyMass> BodyMassesOf(const RobotModel& robot);

}  // namespace legopt
