// Checks of the scene's meshes, of the robot, and of the robot at the stances.

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "legopt/geometry/collision_query.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/geometry/internal/mesh_repair.h"
#include "legopt/import/internal/dataset_check.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using Severity = DatasetDiagnostic::Severity;

constexpr double kFewOpenEdges = 0.01;

std::string InFolder(const Dataset& dataset, const std::string& file) {
  return std::filesystem::path(file).lexically_relative(dataset.folder()).generic_string();
}

/// Returns the faults of one mesh of the scene.
std::vector<DatasetDiagnostic> MeshFindings(const TriangleMesh& mesh, MeshFaults faults, const std::string& file,
                                            const std::string& object) {
  std::vector<DatasetDiagnostic> findings;
  const auto warn = [&](const char* check, int count, const char* message, const char* fix) {
    const std::string bodies = std::to_string(count) + " of " + std::to_string(faults.components) + " bodies";
    findings.push_back({Severity::kWarning, check, file, object, bodies, message, fix});
  };
  if (faults.inverted_components > 0) {
    const int cavities = RepairMesh(mesh, {.close = false}).counts.cavities;
    faults.inverted_components = std::max(0, faults.inverted_components - cavities);
    if (cavities > 0) {
      warn("cavities", cavities, "are hollow spaces in another body: the solver sees them filled",
           "no robot can stand inside; cut an opening into the body if one should");
    }
  }
  if (const int flat = CountFlatBodies(mesh); flat > 0) {
    warn("volume", flat, "have no volume: a robot can pass through them, since they have no inside",
         "give sheets a thickness: import with --repair, or 'legopt scene repair'");
  }
  if (faults.inverted_components > 0) {
    findings.push_back(
        {.severity = Severity::kError,
         .check = "winding",
         .file = file,
         .field = object,
         .value = std::to_string(faults.inverted_components) + " of " + std::to_string(faults.components) + " bodies",
         .message = "are wound inside out: the judge would measure wrong depths, and no surface looks up",
         .fix = "import with --repair, or run 'legopt scene repair'"});
  }
  if (faults.open_edges > 0) {
    const bool many = faults.open_edges > kFewOpenEdges * faults.edges;
    findings.push_back(
        {.severity = many ? Severity::kError : Severity::kWarning,
         .check = "holes",
         .file = file,
         .field = object,
         .value = std::to_string(faults.open_edges) + " of " + std::to_string(faults.edges) + " edges, in " +
                  std::to_string(faults.open_components) + " of " + std::to_string(faults.components) + " bodies",
         .message = many ? "are open: the mesh does not bound solids" : "are open; few enough to go on with",
         .fix = "import with --repair, or run 'legopt scene repair': holes get caps, sheets a thickness"});
  }
  return findings;
}

/// Returns a link and all links above it.
std::set<int> LinksAbove(const RobotModel& robot, int link) {
  std::set<int> links = {link};
  while (link > 0) {
    link = robot.joints()[static_cast<size_t>(robot.links()[static_cast<size_t>(link)].parent_joint)].parent_link;
    links.insert(link);
  }
  return links;
}

/// Returns the links of all legs: the chains from the trunk to the feet without the trunk and the links fixed to it.
std::set<int> LegLinks(const Dataset& dataset) {
  const RobotModel& robot = dataset.robot();
  const std::set<int> above_trunk = LinksAbove(robot, dataset.trunk().link);
  std::set<int> legs;
  for (const Contact& foot : dataset.feet()) {
    const std::set<int> above_foot = LinksAbove(robot, foot.link_index);
    std::ranges::set_symmetric_difference(above_trunk, above_foot, std::inserter(legs, legs.end()));
    legs.insert(foot.link_index);
  }
  std::erase_if(legs, [&](int link) { return robot.MovingJointsBetween(link, dataset.trunk().link) == 0; });
  return legs;
}

/// Returns trunk, arms and head: all links that do not belong to a leg.
std::vector<int> UpperLinks(const Dataset& dataset) {
  const std::set<int> legs = LegLinks(dataset);
  std::vector<int> links;
  for (int link = 0; link < std::ssize(dataset.robot().links()); ++link) {
    if (!legs.contains(link)) links.push_back(link);
  }
  return links;
}

/// Formats counts like "r_hand (5), utorso (1)".
std::string CountByLink(const Dataset& dataset, const std::map<int, std::set<int>>& problems) {
  std::string text;
  for (const auto& [link, ids] : problems) {
    text += (text.empty() ? "" : ", ") + dataset.robot().links()[static_cast<size_t>(link)].name + " (" +
            std::to_string(ids.size()) + ")";
  }
  return text;
}

/// Deepest contact of a set of links with the scene; link -1 if there is none.
struct Deepest {
  int link = -1;
  double depth_m = 0.0;
};

Deepest DeepestContact(CollisionQuery& query, const Kinematics& kinematics, std::span<const int> links) {
  Deepest deepest;
  for (const ProximityPair& contact : query.SceneContacts(kinematics, 0.0, links)) {
    if (-contact.distance_m > deepest.depth_m) deepest = {contact.link_a, -contact.distance_m};
  }
  return deepest;
}

}  // namespace

std::vector<DatasetDiagnostic> CheckSceneMeshes(const Dataset& dataset) {
  std::vector<DatasetDiagnostic> findings;
  int meshes = 0, bodies = 0;
  size_t triangles = 0;
  for (const SceneObject& object : dataset.scene().objects) {
    if (object.shape.kind != ShapeSpec::Kind::kMesh) continue;
    const TriangleMesh mesh = Tessellate(object.shape, dataset.scene().read_guard);
    const MeshFaults faults = FindMeshFaults(mesh);
    ++meshes;
    bodies += faults.components;
    triangles += mesh.triangles.size();
    for (DatasetDiagnostic& fault :
         MeshFindings(mesh, faults, InFolder(dataset, object.shape.mesh_file), object.name)) {
      findings.push_back(std::move(fault));
    }
  }
  if (!findings.empty()) return findings;
  return {{.severity = Severity::kInfo,
           .check = "winding",
           .file = "",
           .field = "",
           .value = std::to_string(dataset.scene().objects.size()) + " objects, " + std::to_string(meshes) +
                    " of them meshes with " + std::to_string(triangles) + " triangles in " + std::to_string(bodies) +
                    " bodies",
           .message = "closed and wound outwards",
           .fix = ""}};
}

std::vector<DatasetDiagnostic> CheckRobot(const Dataset& dataset) {
  const RobotModel& robot = dataset.robot();
  int shaped = 0;
  std::string inverted, open;
  for (const Link& link : robot.links()) {
    shaped += link.collision.empty() ? 0 : 1;
    bool any_open = false, any_inverted = false;
    for (const ShapeSpec& shape : link.collision) {
      if (shape.kind != ShapeSpec::Kind::kMesh) continue;
      const MeshFaults faults = FindMeshFaults(Tessellate(shape, robot.read_guard()));
      any_open = any_open || faults.open_edges > 0;
      any_inverted = any_inverted || faults.inverted_components > 0;
    }
    if (any_open) open += (open.empty() ? "" : ", ") + link.name;
    if (any_inverted) inverted += (inverted.empty() ? "" : ", ") + link.name;
  }
  std::string contacts;
  for (const Contact& contact : dataset.contacts()) {
    contacts += (contacts.empty() ? "" : ", ") + contact.name + " " + FormatFixed(contact.link_height_m(), 6) + " m";
  }
  std::vector<DatasetDiagnostic> findings = {
      {.severity = Severity::kInfo,
       .check = "robot",
       .file = "",
       .field = "",
       .value = "'" + robot.name() + "', " + std::to_string(robot.num_dofs()) + " degrees of freedom, " +
                FormatFixed(robot.total_mass(), 3) + " kg",
       .message = std::to_string(robot.links().size()) + " links, " + std::to_string(shaped) +
                  " with collision geometry; contacts and heights of their links: " + contacts,
       .fix = ""}};
  const auto warn = [&](const std::string& links, const char* message, const char* fix) {
    if (!links.empty()) findings.push_back({Severity::kWarning, "link meshes", "", links, "", message, fix});
  };
  warn(inverted, "have bodies that are wound inside out: the judge may measure wrong depths",
       "turn the triangles of these links' meshes round");
  warn(open,
       "have meshes that are not closed: the judge finds no obstacle inside that does not touch their surface; the "
       "solver uses their hulls",
       "close these meshes");
  return findings;
}

/// Collects the size of each mesh of scene or robot, in the frame of its owner, and the meshes whose up axis is not z.
class MeshSizes {
 public:
  explicit MeshSizes(const Dataset& dataset) : dataset_(dataset) {}

  void Add(const std::string& owner, const ShapeSpec& shape, const ReadGuard& guard) {
    if (shape.kind != ShapeSpec::Kind::kMesh) return;
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& vertex : Tessellate(shape, guard).vertices) box.extend(vertex);
    const Eigen::Vector3d size = box.sizes();
    sizes_ += (sizes_.empty() ? "" : "; ") + owner + " " + FormatGeneral(size.x(), 4) + " x " +
              FormatGeneral(size.y(), 4) + " x " + FormatGeneral(size.z(), 4);
    const std::string file = std::filesystem::path(shape.mesh_file).lexically_relative(dataset_.folder()).string();
    if (!RotationToZUp(shape.mesh_file).isIdentity()) not_z_up_ += (not_z_up_.empty() ? "" : ", ") + file;
    ++meshes_;
  }

  void Report(const std::string& part, const std::string& about_axis, std::vector<DatasetDiagnostic>* findings) const {
    if (meshes_ == 0) return;
    findings->push_back({.severity = Severity::kInfo,
                         .check = "mesh sizes",
                         .file = "",
                         .field = part,
                         .value = std::to_string(meshes_) + (meshes_ == 1 ? " mesh" : " meshes"),
                         .message = "extents along x, y and z in metres: " + sizes_,
                         .fix = ""});
    if (not_z_up_.empty()) return;
    findings->push_back({.severity = Severity::kInfo,
                         .check = "up axis",
                         .file = "",
                         .field = part,
                         .value = not_z_up_,
                         .message = about_axis,
                         .fix = ""});
  }

 private:
  const Dataset& dataset_;
  std::string sizes_, not_z_up_;
  int meshes_ = 0;
};

std::vector<DatasetDiagnostic> CheckMeshSizes(const Dataset& dataset) {
  MeshSizes of_scene(dataset), of_robot(dataset);
  for (const SceneObject& object : dataset.scene().objects) {
    of_scene.Add(object.name, object.shape, dataset.scene().read_guard);
  }
  for (const Link& link : dataset.robot().links()) {
    for (const ShapeSpec& shape : link.collision) of_robot.Add(link.name, shape, dataset.robot().read_guard());
  }
  std::vector<DatasetDiagnostic> findings;
  of_scene.Report("scene", "another axis than z points up in the file: the mesh is turned so that z does", &findings);
  of_robot.Report("robot",
                  "another axis than z points up in the file: link meshes keep the file's axes, as in other URDF tools",
                  &findings);
  return findings;
}

std::vector<DatasetDiagnostic> CheckTrunk(const Dataset& dataset) {
  const std::vector<int> links = UpperLinks(dataset);
  Kinematics kinematics(dataset.robot());
  CollisionQuery query(dataset.collision_model());
  const int height = dataset.robot().base_position_index() + 2;
  std::vector<DatasetDiagnostic> findings;
  for (const TaskDescription& description : ProblemTasks()) {
    const Task task = description.task;
    if (dataset.problems(task).empty()) continue;
    ProblemIds problems;
    std::map<int, std::set<int>> by_link;
    double deepest_m = 0.0;
    for (const ProblemDefinition& problem : dataset.problems(task)) {
      for (const Stance& stance : problem.stances) {
        Eigen::VectorXd x = InitialGuess(dataset, stance, Initialization::kGood);
        x[height] -= kGoodSoleHeight_m;
        kinematics.UpdatePoses(x);
        const Deepest found = DeepestContact(query, kinematics, links);
        if (found.link < 0) continue;
        problems[task].insert(problem.id);
        by_link[found.link].insert(problem.id);
        deepest_m = std::max(deepest_m, found.depth_m);
      }
    }
    DatasetDiagnostic& finding = findings.emplace_back();
    finding.check = "trunk in collision";
    finding.field = ToString(problems);
    finding.value = std::to_string(problems[task].size()) + " of " + std::to_string(dataset.problems(task).size()) +
                    " " + std::string(ToString(task)) + " problems";
    finding.message = "have trunk, arms or head in the scene in the nominal posture over a stance";
    if (by_link.empty()) continue;
    finding.severity = Severity::kWarning;
    finding.message +=
        ", at most " + FormatFixed(deepest_m, 2) + " m deep; deepest link " + CountByLink(dataset, by_link);
    finding.fix = "such problems are hard, not wrong; inspect them if no method solves them";
  }
  return findings;
}

}  // namespace legopt
