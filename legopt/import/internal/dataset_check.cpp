#include "legopt/import/internal/dataset_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "legopt/geometry/collision_query.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/import/internal/balance_check.h"
#include "legopt/import/internal/self_collision_pairs.h"
#include "legopt/import/internal/used_contacts.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/internal/urdf_check.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

std::string Size(const Eigen::AlignedBox3d& box) {
  return FormatGeneral(box.sizes().x(), 4) + " x " + FormatGeneral(box.sizes().y(), 4) + " x " +
         FormatGeneral(box.sizes().z(), 4) + " m";
}

class PlausibilityCheck {
 public:
  explicit PlausibilityCheck(const Dataset& dataset) : dataset_(dataset) {}

  std::vector<DatasetDiagnostic> Run() {
    CheckSizes();
    CheckLimits();
    CheckMasses();
    CheckEfforts();
    const std::string file = dataset_.robot_file().string();
    for (UrdfDiagnostic& remark : ReviewUrdf(CheckUrdf(ReadUrdfFile(file), file))) {
      Warn("robot", remark.field, remark.value, remark.message, remark.fix);
    }
    return std::move(findings_);
  }

 private:
  void Warn(const std::string& check, const std::string& field, const std::string& value, const std::string& message,
            const std::string& fix) {
    findings_.push_back({DatasetDiagnostic::Severity::kWarning, check, "", field, value, message, fix});
  }

  void CheckSizes() {
    constexpr double kWideScene_m = 200.0, kLargeRobot_m = 10.0;
    if (dataset_.scene_bounds().sizes().maxCoeff() > kWideScene_m) {
      Warn("units", "scene", Size(dataset_.scene_bounds()), "is large for a legged robot; is it in millimetres?",
           "if so, import it with --scale 0.001 (or write scale: 0.001 of a mesh in scene.yaml)");
    }
    if (dataset_.robot_bounds().sizes().maxCoeff() > kLargeRobot_m) {
      Warn("units", "robot", Size(dataset_.robot_bounds()), "is large for a robot; is it in millimetres?" + Furthest(),
           "if so, write metres in the URDF (scale=\"0.001 0.001 0.001\" of a mesh)");
    }
  }

  /// Returns the joint with the largest distance from its parent link.
  std::string Furthest() const {
    const Joint* furthest = nullptr;
    for (const Joint& joint : dataset_.robot().joints()) {
      if (furthest == nullptr || joint.origin.translation().norm() > furthest->origin.translation().norm()) {
        furthest = &joint;
      }
    }
    if (furthest == nullptr) return "";
    return " The joint '" + furthest->name + "' is " + FormatGeneral(furthest->origin.translation().norm(), 4) + " m" +
           " from the link before it";
  }

  void CheckLimits() {
    constexpr double kTurn_rad = 2.0 * std::numbers::pi + 0.1;
    std::string degrees, equal;
    for (const Joint& joint : dataset_.robot().joints()) {
      if (joint.type != JointType::kRevolute && joint.type != JointType::kPrismatic) continue;
      const std::string range =
          joint.name + " (" + FormatGeneral(joint.lower, 4) + " .. " + FormatGeneral(joint.upper, 4) + ")";
      const bool turns = joint.lower < -kTurn_rad || joint.upper > kTurn_rad;
      if (joint.type == JointType::kRevolute && turns) degrees += (degrees.empty() ? "" : ", ") + range;
      if (joint.lower == joint.upper) equal += (equal.empty() ? "" : ", ") + range;
    }
    if (!degrees.empty()) {
      Warn("units", degrees, "", "have limits of more than a turn; are they in degrees?",
           "limits are in radians: 90 degrees are 1.5708");
    }
    if (!equal.empty()) {
      Warn("robot", equal, "", "have a lower limit equal to the upper one, and cannot move",
           "give them a range, or type fixed");
    }
  }

  /// Checks masses per body: of links connected by fixed joints, one may carry the mass of all.
  void CheckMasses() {
    const RobotModel& robot = dataset_.robot();
    std::vector<double> mass(static_cast<size_t>(robot.num_bodies()), 0.0);
    std::vector<std::string> shaped(mass.size());
    for (int link = 0; link < std::ssize(robot.links()); ++link) {
      const auto body = static_cast<size_t>(robot.link_body(link));
      const Link& part = robot.links()[static_cast<size_t>(link)];
      mass[body] += part.mass;
      if (shaped[body].empty() && !part.collision.empty()) shaped[body] = part.name;
    }
    std::string without;
    for (size_t body = 0; body < mass.size(); ++body) {
      if (mass[body] == 0.0 && !shaped[body].empty()) without += (without.empty() ? "" : ", ") + shaped[body];
    }
    if (without.empty()) return;
    Warn("robot", without, "0 kg", "have shapes, but no mass: balance and torques are those of a lighter robot",
         "give them <inertial> elements");
  }

  /// Efforts decide by the physical rule. Files often have 0 or a large number where a limit is not known.
  void CheckEfforts() {
    constexpr double kLargest_Nm = 2e3;
    std::string unknown, large;
    int num_unknown = 0;
    const RobotModel& robot = dataset_.robot();
    for (int dof = 0; dof < robot.num_dofs(); ++dof) {
      const Joint& joint = robot.joints()[static_cast<size_t>(robot.dof_joint(dof))];
      if (joint.effort == Joint::kNoLimit) {
        unknown += (unknown.empty() ? "" : ", ") + joint.name;
        ++num_unknown;
      } else if (joint.type != JointType::kPrismatic && joint.effort > kLargest_Nm) {
        large += (large.empty() ? "" : ", ") + joint.name + " (" + FormatGeneral(joint.effort, 4) + " N m)";
      }
    }
    if (!unknown.empty()) {
      findings_.push_back({DatasetDiagnostic::Severity::kInfo, "efforts", dataset_.robot_file().filename().string(),
                           num_unknown == robot.num_dofs() ? "all joints" : unknown, "effort missing, 0 or less",
                           "have no effort limit: the physical rule permits any torque there",
                           "give <limit> an effort above 0, in N m (N of a prismatic joint)"});
    }
    if (!large.empty()) {
      Warn("efforts", large, "", "have implausible effort limits: the physical rule permits such torques",
           "give <limit> the joint's largest torque in N m");
    }
  }

  const Dataset& dataset_;
  std::vector<DatasetDiagnostic> findings_;
};

}  // namespace

bool IsSceneTooLarge(const Dataset& dataset) {
  constexpr double kFactor = 1000.0;
  const double robot_m = dataset.robot_bounds().sizes().maxCoeff();
  return robot_m > 0.0 && dataset.scene_bounds().sizes().maxCoeff() > kFactor * robot_m;
}

std::vector<DatasetDiagnostic> CheckPlausibility(const Dataset& dataset) { return PlausibilityCheck(dataset).Run(); }

namespace {

void Append(std::vector<DatasetDiagnostic> more, std::vector<DatasetDiagnostic>* findings) {
  std::move(more.begin(), more.end(), std::back_inserter(*findings));
}

/// Returns the feet's targets of all problems: the checks compare them with the ground below.
UsedContactList UsedFeetOf(const Dataset& dataset) {
  UsedContactList contacts;
  const auto is_hand = [&](const ContactTarget& target) { return !dataset.contact(target.contact).facts().supports; };
  for (const TaskDescription& task : ProblemTasks()) {
    std::vector<ProblemDefinition> problems = dataset.problems(task.task);
    for (ProblemDefinition& problem : problems) {
      for (Stance& stance : problem.stances) std::erase_if(stance.contacts, is_hand);
    }
    contacts.Add(task.task, problems);
  }
  return contacts;
}

}  // namespace

std::vector<DatasetDiagnostic> CheckDataset(const Dataset& dataset) {
  std::vector<DatasetDiagnostic> findings = CheckRobot(dataset);
  Append(CheckUncheckedPairs(dataset), &findings);
  Append(CheckPlausibility(dataset), &findings);
  Append(CheckSceneMeshes(dataset), &findings);
  Append(CheckMeshSizes(dataset), &findings);
  Append(CheckBalance(dataset), &findings);
  const UsedContactList contacts = UsedFeetOf(dataset);
  if (contacts.all().empty()) {
    findings.push_back({.severity = DatasetDiagnostic::Severity::kWarning,
                        .check = "problems",
                        .file = kDatasetFileName,
                        .field = "problems",
                        .value = "0",
                        .message = "the dataset poses no problems",
                        .fix = "'legopt generate problems --from DATASET --out NEW' makes some"});
    return findings;
  }
  if (AnyError(findings)) return findings;
  const Terrain terrain(CollectSceneTriangles(dataset.scene()));
  findings.push_back(DiagnoseQuaternionOrder(CollectQuaternionEvidence(contacts.all(), terrain)));
  if (findings.back().severity == DatasetDiagnostic::Severity::kError) return findings;
  Append(CheckContactHeights(dataset, contacts.all(), terrain), &findings);
  if (AnyError(findings)) return findings;
  Append(CheckSoles(dataset, contacts.all(), terrain), &findings);
  Append(CheckFootCollisions(dataset, contacts.all()), &findings);
  Append(CheckTrunk(dataset), &findings);
  return findings;
}

// Checks of single contacts: position, support of the contact patch, collisions of the foot.

namespace {

using Severity = DatasetDiagnostic::Severity;

constexpr double kOnSurface_m = 2e-3;

std::string Millimetres(double length_m) { return FormatFixed(1e3 * length_m, 1) + " mm"; }

std::string Degrees(double angle_rad) { return FormatFixed(angle_rad * 180.0 / std::numbers::pi, 1) + " deg"; }

/// A subset of the contacts: the problems that use them, and one quantity of each contact.
struct Group {
  std::vector<double> values;
  ProblemIds problems;

  void Add(const UsedContact& used, double value) {
    values.push_back(value);
    for (const auto& [task, ids] : used.problems) problems[task].insert(ids.begin(), ids.end());
  }
  std::string Count(size_t all) const { return std::to_string(values.size()) + " of " + std::to_string(all); }
  double Median() {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  }
};

/// Returns true if a gap equals the contact frame offset, which suggests that the file's author added the offset once
/// too often.
bool IsSoleOffset(double gap_m, const Dataset& dataset) {
  return std::ranges::any_of(
      dataset.feet(), [&](const Contact& contact) { return std::abs(gap_m - contact.link_height_m()) < kOnSurface_m; });
}

DatasetDiagnostic Hovering(Group group, size_t all, const Dataset& dataset) {
  const double median = group.Median();
  DatasetDiagnostic finding{.severity = Severity::kWarning,
                            .check = "hovering feet",
                            .file = "",
                            .field = ToString(group.problems),
                            .value = group.Count(all) + " contacts, median " + Millimetres(median),
                            .message = "stand above the surface",
                            .fix =
                                "nothing is changed, so that results stay comparable with others on these files; lower "
                                "the poses of problems of your own"};
  if (IsSoleOffset(median, dataset)) {
    finding.message +=
        "; the height is the sole offset, which was applied once too often when the file was made (as "
        "in the original benchmark)";
  }
  return finding;
}

/// Returns the share of 45 points of the contact patch that lie on the surface, with the foot lowered onto the ground;
/// of a point contact 1.
double SupportedShare(const Contact& contact, const ContactTarget& target, const Ground& ground,
                      const Terrain& terrain) {
  constexpr int kAlong = 9, kAcross = 5;
  constexpr double kTolerance_m = 3e-3;
  constexpr double kInset_m = 2e-3;  // a contact patch may end at the edge of its slab
  if (contact.facts().shape == ContactShape::kBall) return 1.0;
  const Eigen::Matrix3d rotation = target.rotation.normalized().toRotationMatrix();
  const auto at = [](double low, double high, int k, int n) {
    return low + kInset_m + (high - low - 2.0 * kInset_m) * k / (n - 1);
  };
  const Eigen::AlignedBox2d patch = contact.Patch();
  int supported = 0;
  for (int i = 0; i < kAlong; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const Eigen::Vector3d p =
          ground.point + rotation * Eigen::Vector3d(at(patch.min().x(), patch.max().x(), i, kAlong),
                                                    at(patch.min().y(), patch.max().y(), j, kAcross), 0.0);
      supported += terrain.Highest(p.x(), p.y(), p.z() - kTolerance_m, p.z() + kTolerance_m).triangle >= 0 ? 1 : 0;
    }
  }
  return static_cast<double>(supported) / (kAlong * kAcross);
}

}  // namespace

std::vector<DatasetDiagnostic> CheckContactHeights(const Dataset& dataset, std::span<const UsedContact> contacts,
                                                   const Terrain& terrain) {
  Group on, hovering, sunk, lost;
  for (const UsedContact& used : contacts) {
    const Ground ground = FindGround(terrain, used.target.position);
    Group& group = !ground.found                  ? lost
                   : ground.gap_m > kOnSurface_m  ? hovering
                   : ground.gap_m < -kOnSurface_m ? sunk
                                                  : on;
    group.Add(used, ground.gap_m);
  }
  const size_t all = contacts.size();
  const Severity off = 2 * on.values.size() < all ? Severity::kError : Severity::kWarning;
  std::vector<DatasetDiagnostic> findings = {
      {.severity = off == Severity::kError ? off : Severity::kInfo,
       .check = "feet on surfaces",
       .file = "",
       .field = "",
       .value = on.Count(all) + " contacts",
       .message = "lie within 2 mm of a surface (" + std::to_string(hovering.values.size()) + " hovering, " +
                  std::to_string(sunk.values.size()) + " sunk, " + std::to_string(lost.values.size()) + " without)",
       .fix = ""}};
  if (off == Severity::kError) {
    findings.front().message += "; most do not: the problems do not belong to this scene";
    findings.front().fix = "check scene, unit of length and frame";
  }
  if (!hovering.values.empty()) findings.push_back(Hovering(hovering, all, dataset));
  if (!sunk.values.empty()) {
    findings.push_back({.severity = Severity::kWarning,
                        .check = "sunk feet",
                        .file = "",
                        .field = ToString(sunk.problems),
                        .value = sunk.Count(all) + " contacts, median " + Millimetres(sunk.Median()),
                        .message = "lie below the surface, so that the foot will be in collision",
                        .fix = "raise these poses"});
  }
  if (!lost.values.empty()) {
    findings.push_back({.severity = Severity::kWarning,
                        .check = "feet on surfaces",
                        .file = "",
                        .field = ToString(lost.problems),
                        .value = lost.Count(all) + " contacts",
                        .message = "have no surface within 0.3 m above or below",
                        .fix = "check these poses, and the scene for a hole below them"});
  }
  return findings;
}

std::vector<DatasetDiagnostic> CheckSoles(const Dataset& dataset, std::span<const UsedContact> contacts,
                                          const Terrain& terrain) {
  constexpr double kWhole = 0.999, kEnough = 0.75;
  constexpr double kSameNormal_rad = 5.0 * std::numbers::pi / 180.0;
  Group whole, poor, tilted;
  double steepest = 0.0;
  for (const UsedContact& used : contacts) {
    const Ground ground = FindGround(terrain, used.target.position);
    if (!ground.found) continue;
    const Eigen::Vector3d normal = used.target.rotation.normalized() * Eigen::Vector3d::UnitZ();
    const double angle = std::acos(std::clamp(normal.dot(ground.normal), -1.0, 1.0));
    if (angle > kSameNormal_rad) tilted.Add(used, angle);
    steepest = std::max(steepest, std::acos(std::clamp(normal.z(), -1.0, 1.0)));
    const double share = SupportedShare(dataset.contact(used.target.contact), used.target, ground, terrain);
    if (share >= kWhole) whole.Add(used, share);
    if (share < kEnough) poor.Add(used, share);
  }
  std::vector<DatasetDiagnostic> findings = {{.severity = Severity::kInfo,
                                              .check = "soles",
                                              .file = "",
                                              .field = "",
                                              .value = whole.Count(contacts.size()) + " contacts",
                                              .message = "rest with the whole sole; steepest foot " + Degrees(steepest),
                                              .fix = ""}};
  if (!poor.values.empty()) {
    findings.push_back(
        {.severity = Severity::kWarning,
         .check = "soles",
         .file = "",
         .field = ToString(poor.problems),
         .value = poor.Count(contacts.size()) + " contacts",
         .message = "have less than 75 % of the sole on the surface",
         .fix = "the judge does not ask for more than the foot's pose; move them if they ought to hold"});
  }
  if (!tilted.values.empty()) {
    findings.push_back({.severity = Severity::kWarning,
                        .check = "soles",
                        .file = "",
                        .field = ToString(tilted.problems),
                        .value = tilted.Count(contacts.size()) + " contacts, median " + Degrees(tilted.Median()),
                        .message = "are tilted against the surface below them by more than 5 deg",
                        .fix = "the z axis of a pose is the surface's normal"});
  }
  return findings;
}

std::vector<DatasetDiagnostic> CheckFootCollisions(const Dataset& dataset, std::span<const UsedContact> contacts) {
  constexpr double kJudgeDepth_m = 1e-3;
  Kinematics kinematics(dataset.robot());
  CollisionQuery query(dataset.collision_model());
  Group colliding;
  double deepest = 0.0;
  for (const UsedContact& used : contacts) {
    if (dataset.contact(used.target.contact).facts().free_rotation != FreeRotation::kNone)
      continue;  // its link may turn
    const int link = dataset.contact(used.target.contact).link_index;
    Eigen::VectorXd x = dataset.self_collision_reference();
    kinematics.UpdatePoses(x);
    const Eigen::Isometry3d base = dataset.LinkTarget(used.target) * kinematics.link_pose(link).inverse();
    MutablePartsOf(x).base_position() = base.translation();
    MutablePartsOf(x).set_base_quaternion(Eigen::Quaterniond(base.linear()));
    kinematics.UpdatePoses(x);
    double depth = 0.0;
    for (const ProximityPair& contact : query.SceneContacts(kinematics, 0.0, std::span(&link, 1))) {
      depth = std::max(depth, -contact.distance_m);
    }
    if (depth <= kJudgeDepth_m) continue;
    colliding.Add(used, depth);
    deepest = std::max(deepest, depth);
  }
  if (colliding.values.empty()) {
    return {{.severity = Severity::kInfo,
             .check = "feet in collision",
             .file = "",
             .field = "",
             .value = colliding.Count(contacts.size()) + " contacts",
             .message = "no foot at its target touches the scene deeper than 1 mm",
             .fix = ""}};
  }
  return {
      {.severity = Severity::kWarning,
       .check = "feet in collision",
       .file = "",
       .field = ToString(colliding.problems),
       .value = colliding.Count(contacts.size()) + " contacts, at most " + Millimetres(deepest),
       .message = "put the foot into the scene although it is exactly at its target: hardly anybody can solve these",
       .fix = "check the contact frames (sole_offset_m in format 1), and move these poses"}};
}

}  // namespace legopt
