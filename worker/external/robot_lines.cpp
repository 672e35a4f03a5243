#include "worker/external/robot_lines.h"

#include <algorithm>
#include <array>
#include <string>

#include "legopt/problem/terms/waypoint_program.h"
#include "legopt/robot/configuration.h"
#include "worker/external/line_channel.h"

namespace legopt::external {
namespace {

using nlohmann::json;

json VectorJson(const Eigen::Vector3d& vector) { return std::array<double, 3>{vector.x(), vector.y(), vector.z()}; }

// Null for the scene.
json LinkJson(const RobotModel& robot, int link) {
  return link == kScene ? json() : json(robot.links()[static_cast<std::size_t>(link)].name);
}

json ContactJson(const RobotModel& robot, int waypoint, const ProximityPair& contact) {
  return {{"waypoint", waypoint},
          {"link", LinkJson(robot, contact.link_a)},
          {"other", LinkJson(robot, contact.link_b)},
          {"distance", contact.distance_m},
          {"depth", std::max(0.0, -contact.distance_m)},
          {"point", VectorJson(contact.point_a_W)},
          {"other_point", VectorJson(contact.point_b_W)},
          {"normal", VectorJson(contact.normal_W)}};
}

json ContactTargetJson(const Dataset& dataset, const ContactTarget& target) {
  const Contact& contact = dataset.contact(target.contact);
  const Eigen::Isometry3d X_WL = contact.LinkTarget(target);
  const Eigen::Quaterniond rotation(X_WL.linear());
  return {{"link", contact.link},
          {"position", VectorJson(X_WL.translation())},
          {"rotation", {rotation.w(), rotation.x(), rotation.y(), rotation.z()}}};
}

json JointNames(const RobotModel& robot) {
  json names = json::array();
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    names.push_back(robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))].name);
  }
  return names;
}

// Writes the tangent from one configuration to the other, by the shorter rotation: the inverse of Retract.
void WriteTangent(Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to,
                  Eigen::Ref<Eigen::VectorXd> dx) {
  const auto start = PartsOf(from), goal = PartsOf(to);
  const auto step = MutableTangentPartsOf(dx);
  step.linear() = goal.linear() - start.linear();
  const Eigen::Quaterniond end = goal.base_quaternion();
  if (!(end.norm() > 0.0)) throw SolverFault("sent a waypoint whose quaternion is zero");
  Eigen::Quaterniond turn = end.normalized() * start.base_rotation().conjugate();
  if (turn.w() < 0.0) turn.coeffs() *= -1.0;
  const Eigen::AngleAxisd rotation(turn);
  step.base_rotation() = rotation.angle() * rotation.axis();
}

}  // namespace

json ContactsJson(Program& program) {
  json list = json::array();
  auto* chain = dynamic_cast<WaypointProgram*>(&program);
  if (chain == nullptr) return list;
  for (int waypoint = 0; waypoint < chain->num_waypoints(); ++waypoint) {
    for (const ProximityPair& contact : chain->state(waypoint).contacts()) {
      list.push_back(ContactJson(chain->robot(), waypoint, contact));
    }
  }
  return list;
}

json RobotJson(const Program& program, const Eigen::VectorXd& x) {
  const auto* chain = dynamic_cast<const WaypointProgram*>(&program);
  if (chain == nullptr) return {};
  const Dataset& dataset = chain->dataset();
  json start = json::array(), footholds = json::array();
  for (int waypoint = 0; waypoint < chain->num_waypoints(); ++waypoint) {
    const Eigen::VectorXd at = x.segment(Eigen::Index{waypoint} * chain->point_size(), chain->point_size());
    start.push_back(std::vector<double>(at.begin(), at.end()));
    json feet = json::array();
    for (const ContactTarget& target : chain->stance(waypoint).contacts)
      feet.push_back(ContactTargetJson(dataset, target));
    footholds.push_back(std::move(feet));
  }
  return {{"dataset", dataset.folder().string()},
          {"urdf", dataset.robot_file().string()},
          {"joints", JointNames(chain->robot())},
          {"start", std::move(start)},
          {"footholds", std::move(footholds)}};
}

Eigen::VectorXd TangentTo(const Program& program, const Eigen::VectorXd& x,
                          const std::vector<Eigen::VectorXd>& waypoints) {
  const auto* chain = dynamic_cast<const WaypointProgram*>(&program);
  if (chain == nullptr) throw SolverFault("sent 'waypoints' where there is no robot: 'x' is asked for");
  const Eigen::Index size = chain->point_size(), tangent = chain->tangent_size();
  const auto fits = [&](const Eigen::VectorXd& waypoint) { return waypoint.size() == size; };
  if (std::ssize(waypoints) != chain->num_waypoints() || !std::ranges::all_of(waypoints, fits)) {
    throw SolverFault("sent other 'waypoints' than " + std::to_string(chain->num_waypoints()) + " of " +
                      std::to_string(size) + " numbers");
  }
  Eigen::VectorXd dx(tangent * chain->num_waypoints());
  for (Eigen::Index t = 0; t < chain->num_waypoints(); ++t) {
    WriteTangent(x.segment(t * size, size), waypoints[static_cast<std::size_t>(t)], dx.segment(t * tangent, tangent));
  }
  return dx;
}

}  // namespace legopt::external
