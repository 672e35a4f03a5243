#include "client/page/page_dataset.h"

#include <algorithm>
#include <cmath>

#include "client/page/page_holding.h"
#include "legopt/dataset/contact.h"
#include "legopt/geometry/collision_model.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "legopt/statics/equilibrium_polygon.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

Json PointJson(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// Position x y z, then the quaternion w x y z.
Json PoseJson(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d& p = pose.translation();
  return {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
}

Json LimitJson(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// Box of a contact in its link's frame, whose lower side is near the ground. Of a point: around its ball, at least 1
/// cm.
Eigen::AlignedBox3d DrawnBox(const Contact& contact) {
  if (contact.facts().shape != ContactShape::kBall) return contact.box_L;
  constexpr double kLeastHalf_m = 5e-3;
  const double half_m = std::max(contact.radius_m, kLeastHalf_m);
  const Eigen::Vector3d centre = contact.X_LC.translation();
  return {centre - Eigen::Vector3d(half_m, half_m, contact.radius_m),
          centre + Eigen::Vector3d(half_m, half_m, contact.radius_m)};
}

/// Outline that the page draws at a contact's target, in the link's frame: the lower side of a foot's box; the patch of
/// a hand; the ends of a bar.
Json OutlineJson(const Contact& contact) {
  Json outline = Json::array();
  if (contact.facts().supports) {
    const Eigen::AlignedBox3d box_L = DrawnBox(contact);
    for (const auto& [x, y] : {std::pair(box_L.min().x(), box_L.min().y()),
                               {box_L.max().x(), box_L.min().y()},
                               {box_L.max().x(), box_L.max().y()},
                               {box_L.min().x(), box_L.max().y()}}) {
      outline.push_back(PointJson({x, y, box_L.min().z()}));
    }
    return outline;
  }
  for (const Eigen::Vector3d& point_L : contact.points_L) outline.push_back(PointJson(point_L));
  return outline;
}

Json RobotJson(const Dataset& dataset, GeometryBlock* geometry) {
  const RobotModel& robot = dataset.robot();
  const CollisionModel& model = *dataset.collision_model();
  Json links = Json::array(), joints = Json::array(), feet = Json::array();
  for (std::size_t i = 0; i < robot.links().size(); ++i) {
    const Link& link = robot.links()[i];
    Json meshes = Json::array();
    for (const ShapeSpec& shape : link.collision)
      meshes.push_back(geometry->Add(Tessellate(shape, robot.read_guard())));
    const TriangleMesh pieces = LinkSurfaces(model, static_cast<int>(i));
    Json convex = pieces.triangles.empty() ? Json() : Json(geometry->Add(pieces));
    links.push_back({{"name", link.name},
                     {"mass_kg", link.mass},
                     {"com", PointJson(link.com)},
                     {"meshes", meshes},
                     {"convex", convex}});
  }
  for (const Joint& joint : robot.joints()) {
    joints.push_back({{"name", joint.name},
                      {"type", ToString(joint.type)},
                      {"parent", joint.parent_link},
                      {"child", joint.child_link},
                      {"origin", PoseJson(joint.origin)},
                      {"axis", PointJson(joint.axis)},
                      {"dof", joint.dof},
                      {"multiplier", joint.multiplier},
                      {"offset", joint.offset},
                      {"lower", LimitJson(joint.dof < 0 ? joint.lower : robot.lower_limits()[joint.dof])},
                      {"upper", LimitJson(joint.dof < 0 ? joint.upper : robot.upper_limits()[joint.dof])}});
  }
  for (const Contact& foot : dataset.contacts()) {
    const Eigen::AlignedBox3d box_L = DrawnBox(foot);
    feet.push_back({{"link", foot.link_index},
                    {"name", foot.name},
                    {"kind", ToString(foot.kind)},
                    {"lower", PointJson(box_L.min())},
                    {"upper", PointJson(box_L.max())},
                    {"outline", OutlineJson(foot)}});
  }
  return {{"name", robot.name()},
          {"weight_N", robot.total_mass() * dataset.gravity_m_s2()},
          {"dofs", DofNames(robot)},
          {"efforts", LimitsJson(robot.effort_limits())},
          {"velocities", LimitsJson(robot.velocity_limits())},
          {"links", links},
          {"joints", joints},
          {"feet", feet}};
}

Json SceneJson(const Dataset& dataset, GeometryBlock* geometry) {
  Json objects = Json::array();
  for (const SceneObject& object : dataset.scene().objects) {
    objects.push_back(
        {{"name", object.name}, {"mesh", geometry->Add(Tessellate(object.shape, dataset.scene().read_guard))}});
  }
  const TriangleMesh pieces = SceneSurfaces(*dataset.collision_model());
  return {{"objects", objects},
          {"convex", pieces.triangles.empty() ? Json() : Json(geometry->Add(pieces))},
          {"lower", PointJson(dataset.scene_bounds().min())},
          {"upper", PointJson(dataset.scene_bounds().max())}};
}

Json StanceJson(const Dataset& dataset, const Stance& stance) {
  Json feet = Json::array(), polygon = Json::array();
  for (const ContactTarget& target : stance.contacts) {
    feet.push_back({{"link", dataset.contact(target.contact).link_index},
                    {"contact", target.contact},
                    {"target", PoseJson(dataset.LinkTarget(target))}});
  }
  for (const Eigen::Vector2d& corner : BalancePolygon(dataset, stance)) {
    polygon.push_back({corner.x(), corner.y()});
  }
  return {{"feet", feet}, {"polygon", polygon}};
}

Json ProblemsJson(const Dataset& dataset, Task task, const std::set<int>& ids) {
  Json problems = Json::object();
  for (const ProblemDefinition& problem : dataset.problems(task)) {
    if (!ids.contains(problem.id)) continue;
    Json stances = Json::array();
    for (const Stance& stance : problem.stances) stances.push_back(StanceJson(dataset, stance));
    problems[std::to_string(problem.id)] = std::move(stances);
  }
  return problems;
}

// A test for the page: a configuration with every joint bent and the base rotated, and the expected link poses.
Json CheckJson(const RobotModel& robot) {
  constexpr double kShare = 0.3, kWidest = 1.0;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(robot.configuration_size());
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const double lower = std::max(robot.lower_limits()[dof], -kWidest);
    const double upper = std::min(robot.upper_limits()[dof], kWidest);
    x[dof] = lower + kShare * (upper - lower);
  }
  const Eigen::Vector3d axis(1, 2, 3);
  const Eigen::Quaterniond q(Eigen::AngleAxisd(1.0, axis.normalized()));
  MutablePartsOf(x).base_position() << 1, -2, 3;
  MutablePartsOf(x).set_base_quaternion(q);
  Kinematics kinematics(robot);
  kinematics.Update(x);
  Json poses = Json::array();
  for (std::size_t i = 0; i < robot.links().size(); ++i)
    poses.push_back(PoseJson(kinematics.link_pose(static_cast<int>(i))));
  return {{"x", std::vector<double>(x.begin(), x.end())}, {"poses", poses}};
}

Json MeshesJson(const GeometryBlock& geometry) {
  Json meshes = Json::array();
  for (const MeshRange& range : geometry.meshes()) {
    meshes.push_back({range.vertex_offset, range.vertices, range.index_offset, range.triangles});
  }
  return meshes;
}

}  // namespace

PageDataset DescribeDataset(const Dataset& dataset, const ProblemIds& problems, const std::string& block) {
  GeometryBlock geometry;
  PageDataset page;
  page.json = {{"name", dataset.name()}, {"hash", dataset.content_hash()}};
  page.json["robot"] = RobotJson(dataset, &geometry);
  page.json["scene"] = SceneJson(dataset, &geometry);
  for (const TaskDescription& task : kTasks) {
    page.json["problems"][ToString(task.task)] = ProblemsJson(dataset, task.task, problems[task.task]);
  }
  page.json["check"] = CheckJson(dataset.robot());
  page.json["geometry"] = {{"block", block}, {"meshes", MeshesJson(geometry)}};
  page.geometry = geometry.bytes();
  return page;
}

}  // namespace legopt::client
