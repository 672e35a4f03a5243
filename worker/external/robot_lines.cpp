#include "worker/external/robot_lines.h"

#include <algorithm>
#include <array>
#include <string>

#include "legopt/problem/terms/waypoint_program.h"
#include "worker/external/line_channel.h"

namespace legopt::external {
namespace {

using nlohmann::json;

json VectorJson(const Eigen::Vector3d& vector) { return std::array<double, 3>{vector.x(), vector.y(), vector.z()}; }

// Null for the scene.
json LinkJson(const RobotModel& robot, int link) {
  return link == kScene ? json() : json(robot.links()[static_cast<std::size_t>(link)].name);
}

json ContactJson(const RobotModel& robot, int waypoint, const Contact& contact) {
  return {{"waypoint", waypoint},
          {"link", LinkJson(robot, contact.link_a)},
          {"other", LinkJson(robot, contact.link_b)},
          {"distance", contact.distance_m},
          {"depth", std::max(0.0, -contact.distance_m)},
          {"point", VectorJson(contact.point_a_W)},
          {"other_point", VectorJson(contact.point_b_W)},
          {"normal", VectorJson(contact.normal_W)}};
}

json FootholdJson(const Dataset& dataset, const Foothold& foothold) {
  const Eigen::Isometry3d target = dataset.FootTarget(foothold);
  const Eigen::Quaterniond rotation(target.linear());
  return {{"link", foothold.link},
          {"position", VectorJson(target.translation())},
          {"rotation", {rotation.w(), rotation.x(), rotation.y(), rotation.z()}}};
}

json JointNames(const RobotModel& robot) {
  json names = json::array();
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    names.push_back(robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))].name);
  }
  return names;
}

// Returns the rotation of the base from p_x, p_y, p_z, q_w, q_x, q_y, q_z after the joints.
Eigen::Quaterniond BaseRotation(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> x) {
  const Eigen::Index w = robot.num_dofs() + 3;
  return {x[w], x[w + 1], x[w + 2], x[w + 3]};
}

// Writes the tangent from one configuration to the other, by the shorter rotation: the inverse of Retract.
void WriteTangent(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to,
                  Eigen::Ref<Eigen::VectorXd> dx) {
  const Eigen::Index plain = robot.num_dofs() + 3;
  dx.head(plain) = to.head(plain) - from.head(plain);
  const Eigen::Quaterniond end = BaseRotation(robot, to);
  if (!(end.norm() > 0.0)) throw SolverFault("sent a waypoint whose quaternion is zero");
  Eigen::Quaterniond turn = end.normalized() * BaseRotation(robot, from).normalized().conjugate();
  if (turn.w() < 0.0) turn.coeffs() *= -1.0;
  const Eigen::AngleAxisd rotation(turn);
  dx.segment<3>(plain) = rotation.angle() * rotation.axis();
}

}  // namespace

json ContactsJson(Program& program) {
  json list = json::array();
  auto* chain = dynamic_cast<WaypointProgram*>(&program);
  if (chain == nullptr) return list;
  for (int waypoint = 0; waypoint < chain->num_waypoints(); ++waypoint) {
    for (const Contact& contact : chain->state(waypoint).contacts()) {
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
    for (const Foothold& foothold : chain->stance(waypoint).footholds) feet.push_back(FootholdJson(dataset, foothold));
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
    WriteTangent(chain->robot(), x.segment(t * size, size), waypoints[static_cast<std::size_t>(t)],
                 dx.segment(t * tangent, tangent));
  }
  return dx;
}

}  // namespace legopt::external
