#include "legopt/planning/certify/internal/balance_prover.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "legopt/robot/kinematics.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/statics/stance_forces.h"
#include "legopt/types/number_text.h"

namespace legopt::certify {
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

/// Distance of a point from a convex polygon, counter-clockwise with one corner or more; 0 inside.
double DistanceFrom(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& p) {
  if (polygon.size() > 2 && SignedDistanceToPolygon(polygon, p) <= 0.0) return 0.0;
  double least = (polygon.front() - p).norm();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d edge = polygon[(i + 1) % polygon.size()] - a;
    const double share = edge.squaredNorm() > 0.0 ? std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0) : 0.0;
    least = std::min(least, (a + share * edge - p).norm());
  }
  return least;
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

std::optional<std::string> RefuteBalance(const Dataset& dataset, const Stance& stance) {
  constexpr double kTolerances_m = 5e-3;  // more than the judge's for contacts and centre of mass together
  constexpr int kDigits = 4;
  const bool on_feet = StandsOnFeet(dataset, stance);
  std::vector<Eigen::Vector2d> polygon = TargetSupportPolygon(dataset, stance);
  if (!on_feet) {
    if (SlidesUnderLoad(dataset, stance)) return std::nullopt;  // the polygon depends on where the bars are gripped
    const EquilibriumPolygon equilibrium = ComputeEquilibriumPolygon(StanceForces(SurfacesOf(dataset, stance)));
    if (equilibrium.slide) return "no forces within friction and bounds hold the contacts in any posture";
    polygon = equilibrium.corners;
  }
  if (polygon.empty()) return std::nullopt;
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    if (contact.SlideOf(target) > 0.0) continue;
    const double distance_m = DistanceFrom(polygon, contact.OriginTarget(target).head<2>());
    const double reach_m = ComReach_m(dataset.robot(), contact);
    if (distance_m <= reach_m + kTolerances_m) continue;
    return "the centre of mass must be " + FormatGeneral(distance_m, kDigits) + " m or more from " + target.contact +
           ", and reaches " + FormatGeneral(reach_m, kDigits) + " m";
  }
  return std::nullopt;
}

}  // namespace legopt::certify
