#include "legopt/dataset/internal/com_reach.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

/// Returns the moving joints on the chain between two bodies: first up to the common ancestor, then down.
std::vector<int> JointsBetween(const RobotModel& robot, int from_body, int to_body) {
  std::vector<int> up = robot.body_chain(from_body), down = robot.body_chain(to_body);
  std::size_t common = 0;
  while (common < std::min(up.size(), down.size()) && up[common] == down[common]) ++common;
  std::vector<int> joints;
  for (std::size_t i = up.size(); i-- > common;) joints.push_back(robot.body_joint(up[i]));
  for (std::size_t i = common; i < down.size(); ++i) joints.push_back(robot.body_joint(down[i]));
  return joints;
}

/// Largest change of the distance between the two sides of a prismatic joint, from any value to any other.
double RangeOf(const Joint& joint) {
  if (joint.type != JointType::kPrismatic) return 0.0;
  return 2.0 * std::max(std::abs(joint.lower), std::abs(joint.upper));
}

}  // namespace

double ComReach_m(const RobotModel& robot, const Contact& contact) {
  Kinematics kinematics(robot);
  kinematics.UpdatePoses(robot.NeutralConfiguration());
  const Vector3d start = kinematics.link_pose(contact.link_index) * contact.X_LC.translation();
  double reach_m = 0.0;
  for (std::size_t i = 0; i < robot.links().size(); ++i) {
    const int link = static_cast<int>(i);
    if (robot.links()[i].mass == 0.0) continue;
    Vector3d at = start;
    double length_m = 0.0;
    for (const int index : JointsBetween(robot, robot.link_body(contact.link_index), robot.link_body(link))) {
      const Joint& joint = robot.joints()[static_cast<std::size_t>(index)];
      const Vector3d anchor = kinematics.link_pose(joint.parent_link) * joint.origin.translation();
      length_m += (anchor - at).norm() + RangeOf(joint);
      at = anchor;
    }
    length_m += (kinematics.link_pose(link) * robot.links()[i].com - at).norm();
    reach_m += robot.links()[i].mass / robot.total_mass() * length_m;
  }
  return reach_m;
}

}  // namespace legopt
