#include "legopt/dataset/dataset.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "legopt/dataset/internal/com_reach.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/geometry/internal/mesh.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

/// Returns the half extents, along the owner's axes, of a primitive centred at its pose.
Eigen::Vector3d HalfExtents(const ShapeSpec& shape) {
  const Eigen::Matrix3d R = shape.pose.linear();
  const double radius = shape.size.x();
  const Eigen::Vector3d along_axis = R.col(2).cwiseAbs() * (0.5 * shape.size.z());
  switch (shape.kind) {
    case ShapeSpec::Kind::kBox:
      return R.cwiseAbs() * (0.5 * shape.size);
    case ShapeSpec::Kind::kSphere:
      return Eigen::Vector3d::Constant(radius);
    case ShapeSpec::Kind::kCapsule:
      return along_axis + Eigen::Vector3d::Constant(radius);
    case ShapeSpec::Kind::kCylinder:
      // A disc with normal a has half extent r sqrt(1 - a_i^2) along axis i.
      return along_axis + radius * (1 - R.col(2).array().square()).max(0).sqrt().matrix();
    case ShapeSpec::Kind::kMesh:
      break;
  }
  return Eigen::Vector3d::Zero();
}

}  // namespace

Eigen::AlignedBox3d LinkBox(const Link& link, const ReadGuard& guard) {
  Eigen::AlignedBox3d box;
  for (const ShapeSpec& shape : link.collision) {
    if (shape.kind == ShapeSpec::Kind::kMesh) {
      for (const Eigen::Vector3d& vertex : LoadMesh(shape.mesh_file, shape.scale, guard).vertices) {
        box.extend(shape.pose * vertex);
      }
    } else {
      const Eigen::Vector3d half = HalfExtents(shape);
      box.extend(Eigen::AlignedBox3d(shape.pose.translation() - half, shape.pose.translation() + half));
    }
  }
  return box;
}

namespace {

namespace fs = std::filesystem;

/// Cache of bounding boxes of shapes in the frame of their owner; each mesh is read once per scale.
class ShapeBoxes {
 public:
  explicit ShapeBoxes(const ReadGuard& guard) : guard_(guard) {}

  /// Returns the box of a shape. `user` names the owner in errors. Throws InputError for a mesh that cannot be read.
  Eigen::AlignedBox3d Of(const ShapeSpec& shape, const std::string& user) {
    if (shape.kind != ShapeSpec::Kind::kMesh) return LinkBox({.name = user, .collision = {shape}});
    const auto key = std::tuple(shape.mesh_file, shape.scale.x(), shape.scale.y(), shape.scale.z());
    auto found = meshes_.find(key);
    if (found == meshes_.end()) found = meshes_.emplace(key, BoxOfMesh(shape, user)).first;
    return found->second.transformed(shape.pose);
  }

 private:
  Eigen::AlignedBox3d BoxOfMesh(const ShapeSpec& shape, const std::string& user) const {
    Eigen::AlignedBox3d box;
    try {
      for (const Eigen::Vector3d& vertex : LoadMesh(shape.mesh_file, shape.scale, guard_).vertices) box.extend(vertex);
    } catch (const InputError& error) {
      std::vector<InputError::Fault> faults = error.faults();
      for (InputError::Fault& fault : faults) fault.field = user + (fault.field.empty() ? "" : ": " + fault.field);
      throw InputError::Of(std::move(faults));
    }
    return box;
  }

  const ReadGuard& guard_;
  std::map<std::tuple<std::string, double, double, double>, Eigen::AlignedBox3d> meshes_;  ///< keyed by file and scale
};

/// Returns the box; throws InputError if it extends so far that single precision is coarser than the judge's tolerance.
const Eigen::AlignedBox3d& Near(const Eigen::AlignedBox3d& box, const std::string& user, const fs::path& file) {
  constexpr double kFurthest_m = 8192.0;  // above this, adjacent floats differ by about 1 mm
  const double furthest_m = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (furthest_m <= kFurthest_m) return box;
  throw InputError({.file = file.string(),
                    .field = user,
                    .value = FormatFixed(furthest_m, 6) + " m from the origin",
                    .message = "single precision cannot resolve 1 mm beyond 8192 m",
                    .fix = "is it in millimetres? Scale it to metres (scale: 0.001, or import with --scale 0.001), or "
                           "move it to the origin"});
}

bool IsHash(const std::string& text) {
  constexpr size_t kHashDigits = 64;
  return text.size() == kHashDigits && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

}  // namespace

std::shared_ptr<const Dataset> Dataset::Load(const fs::path& folder, const ReadGuard& guard) {
  const fs::path absolute = fs::weakly_canonical(folder);
  return std::shared_ptr<const Dataset>(new Dataset(absolute, DescribeDataset(absolute), guard));
}

Dataset::Dataset(fs::path folder, DatasetDescription description, const ReadGuard& guard)
    : folder_(std::move(folder)),
      description_(std::move(description)),
      // Hashes are verified before the robot is parsed: a damaged file should be reported as damaged, not as bad XML.
      robot_((VerifyListedFiles(), RobotModel::FromUrdfFile((folder_ / description_.robot_file).string(), guard))),
      scene_(ReadSceneFile(folder_ / description_.scene_file, guard)) {
  ResolveContentHash();
  CheckMass();
  MeasureShapes();
  ResolveContacts();
  ResolveLimits();
  ResolvePostures();
  ResolveFeet();
  ResolveUncheckedPairs();
  for (const TaskDescription& task : ProblemTasks()) {
    problems_[task.task] = ReadProblems(task.task, description_.problem_files[task.task]);
  }
}

std::string Dataset::file_for_errors() const {
  return description_.bare ? folder_.string() : (folder_ / kDatasetFileName).string();
}

std::string Dataset::HashFix() const { return "'legopt dataset hash " + folder_.string() + "' writes all hashes anew"; }

void Dataset::VerifyListedFiles() const {
  for (const auto& [path, expected] : description_.files) {
    const fs::path file = folder_ / path;
    if (!fs::is_regular_file(file)) {
      throw InputError({.file = file_for_errors(),
                        .field = "files",
                        .value = path,
                        .message = "the listed file does not exist",
                        .fix = "restore it, or remove its line when the dataset does not use it"});
    }
    if (!IsHash(expected)) {
      throw InputError({.file = file_for_errors(),
                        .field = "files." + path,
                        .value = expected,
                        .message = "is not a hash (64 lower-case hexadecimal digits)",
                        .fix = HashFix()});
    }
    const std::string found = HashFile(file);
    if (found != expected) {
      throw InputError({.file = file.string(),
                        .field = "content hash",
                        .value = found,
                        .message = "the file differs from dataset.yaml, which expects " + expected,
                        .fix = "restore the original file; if the change is intended: " + HashFix()});
    }
  }
}

void Dataset::ResolveContentHash() {
  std::vector<FileHash> manifest;
  std::map<std::string, std::string> unused = description_.files;
  for (const std::string& path : ListUsedFiles(folder_, description_, robot_, scene_)) {
    const auto listed = description_.files.find(path);
    manifest.push_back({.path = path, .hash = {}});
    if (listed != description_.files.end()) {
      manifest.back().hash = listed->second;  // hash already verified
      unused.erase(path);
      continue;
    }
    manifest.back().hash = HashFile(folder_ / path);
    if (!description_.bare) {
      throw InputError({.file = file_for_errors(),
                        .field = "files",
                        .value = path,
                        .message = "the dataset uses a file that is not listed",
                        .fix = "add the line '" + path + ": " + manifest.back().hash + "', or " + HashFix()});
    }
  }
  if (!unused.empty()) {
    throw InputError({.file = file_for_errors(),
                      .field = "files",
                      .value = unused.begin()->first,
                      .message = "a file is listed that the dataset does not use",
                      .fix = "remove its line, or " + HashFix()});
  }
  content_hash_ = ContentHash(description_, manifest);
}

void Dataset::CheckMass() const {
  if (robot_.total_mass() > 0.0) return;
  throw InputError({.file = robot_file().string(),
                    .field = "mass",
                    .value = "0",
                    .message = "the robot has no mass, so that balance and torques mean nothing",
                    .fix = "give its links <inertial> elements (COLLADA: a physics model)"});
}

void Dataset::MeasureShapes() {
  ShapeBoxes boxes(robot_.read_guard());  // the scene has the same guard
  for (const SceneObject& object : scene_.objects) {
    const std::string user = "scene object '" + object.name + "'";
    scene_bounds_.extend(Near(boxes.Of(object.shape, user), user, folder_ / description_.scene_file));
  }
  for (const Link& link : robot_.links()) {
    const std::string user = "link '" + link.name + "'";
    Eigen::AlignedBox3d& box = link_boxes_.emplace_back();
    for (const ShapeSpec& shape : link.collision) box.extend(Near(boxes.Of(shape, user), user, robot_file()));
  }
}

void Dataset::ResolveContacts() {
  std::vector<std::string> link_names;
  for (const Link& link : robot_.links()) link_names.push_back(link.name);
  for (const ContactDescription& contact : description_.contacts) {
    const int index = robot_.FindLink(contact.link);
    const std::string field = description_.PathOf(contact);
    if (index < 0) {
      throw InputError({.file = file_for_errors(),
                        .field = field,
                        .value = contact.link,
                        .message = "the robot has no such link",
                        .fix = SuggestName(contact.link, link_names)});
    }
    const Eigen::AlignedBox3d box = LinkBox(robot_.links()[static_cast<size_t>(index)], robot_.read_guard());
    if (box.isEmpty() || !(box.sizes().head<2>().minCoeff() > 0)) {
      throw InputError({.file = file_for_errors(),
                        .field = field,
                        .value = contact.link,
                        .message = "the link has no collision geometry",
                        .fix = "give the link a <collision> element in " + description_.robot_file});
    }
    contacts_.push_back(ResolveContact(contact, index, box));
    contacts_.back().com_reach_m = ComReach_m(robot_, contacts_.back());
  }
}

void Dataset::ResolveFeet() {
  for (const std::string& name : description_.support) feet_.push_back(contact(name));
  if (!feet_.empty()) return;
  std::ranges::copy_if(contacts_, std::back_inserter(feet_), [](const Contact& c) { return c.facts().supports; });
  if (!feet_.empty()) return;
  throw InputError({.file = file_for_errors(),
                    .field = "contacts",
                    .value = contacts_.front().name,
                    .message = "no contact is of kind sole or point",
                    .fix = "declare the robot's feet, too"});
}

int Dataset::ResolveJoint(const std::string& name, const std::string& key) const {
  std::vector<std::string> names = DofNames(robot_);
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  throw InputError(
      {.file = file_for_errors(),
       .field = key,
       .value = name,
       .message = "the robot has no such movable joint",
       .fix = description_.bare ? "a robot other than LegOpt's Atlas needs a dataset.yaml" : SuggestName(name, names)});
}

void Dataset::ResolveLimits() {
  for (const auto& [name, limit] : description_.effort_limits) {
    robot_.SetEffortLimit(ResolveJoint(name, "effort_limits"), limit);
  }
  for (const auto& [name, limit] : description_.velocity_limits) {
    robot_.SetVelocityLimit(ResolveJoint(name, "velocity_limits"), limit);
  }
}

Eigen::VectorXd Dataset::ResolveJoints(const std::map<std::string, double>& values, const std::string& key) const {
  Eigen::VectorXd joints = Eigen::VectorXd::Zero(robot_.num_dofs());
  for (const auto& [name, value] : values) joints[ResolveJoint(name, key)] = value;
  robot_.ClampJoints(joints);
  return joints;
}

void Dataset::ResolvePostures() {
  const int n = robot_.num_dofs();
  nominal_joints_ = ResolveJoints(description_.nominal_posture, "nominal_posture");
  self_collision_reference_ = ConfigurationAt(n, Eigen::Isometry3d::Identity());
  self_collision_reference_.head(n) = ResolveJoints(description_.self_collision_reference, "self_collision_reference");

  Eigen::VectorXd nominal = self_collision_reference_;
  nominal.head(n) = nominal_joints_;
  Kinematics kinematics(robot_);
  kinematics.Update(nominal);
  for (int link = 0; link < std::ssize(robot_.links()); ++link) {
    robot_bounds_.extend(kinematics.link_pose(link).translation());
    const Eigen::AlignedBox3d& box = link_boxes_[static_cast<size_t>(link)];
    if (!box.isEmpty()) robot_bounds_.extend(box.transformed(kinematics.link_pose(link)));
  }
  ResolveTrunk(kinematics);
  nominal_sole_height_m_ = std::numeric_limits<double>::infinity();
  for (Contact& contact : contacts_) {
    const Eigen::Isometry3d& X_BL = kinematics.link_pose(contact.link_index);
    contact.nominal_position_B = X_BL * contact.X_LC.translation();
    if (!contact.facts().supports) continue;
    if (contact.facts().shape == ContactShape::kBall) {
      nominal_sole_height_m_ = std::min(nominal_sole_height_m_, contact.nominal_position_B.z() - contact.radius_m);
      continue;
    }
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector3d corner = contact.box_L.corner(static_cast<Eigen::AlignedBox3d::CornerType>(c));
      const double z = (X_BL * corner).z();
      nominal_sole_height_m_ = std::min(nominal_sole_height_m_, z);
    }
  }
}

void Dataset::ResolveTrunk(const Kinematics& nominal) {
  if (description_.trunk.empty()) return;
  trunk_.link = robot_.FindLink(description_.trunk);
  if (trunk_.link < 0) {
    std::vector<std::string> names;
    for (const Link& link : robot_.links()) names.push_back(link.name);
    throw InputError({.file = file_for_errors(),
                      .field = "trunk",
                      .value = description_.trunk,
                      .message = "the robot has no such link",
                      .fix = SuggestName(description_.trunk, names)});
  }
  if (trunk_.link == 0) return;
  const Eigen::Isometry3d& X_BL = nominal.link_pose(trunk_.link);
  trunk_.X_LT.linear() = X_BL.linear().transpose();
  trunk_.nominal_position_B = X_BL.translation();
}

Eigen::Isometry3d Trunk::PoseOf(int other, const Kinematics& kinematics) const {
  return (kinematics.link_pose(link) * X_LT).inverse(Eigen::Isometry) * kinematics.link_pose(other);
}

void Dataset::ResolveUncheckedPairs() {
  if (!description_.self_collision) return;
  std::vector<std::string> names;
  for (const Link& link : robot_.links()) names.push_back(link.name);
  const auto find = [&](const std::string& name, size_t row) {
    const int link = robot_.FindLink(name);
    if (link >= 0) return link;
    throw InputError({.file = file_for_errors(),
                      .field = "self_collision.unchecked[" + std::to_string(row) + "]",
                      .value = name,
                      .message = "the robot has no such link",
                      .fix = SuggestName(name, names)});
  };
  std::vector<UncheckedPair>& pairs = unchecked_pairs_.emplace();
  for (const DatasetDescription::LinkNames& entry : description_.self_collision->unchecked) {
    const int a = find(entry.first, pairs.size()), b = find(entry.second, pairs.size());
    pairs.push_back({{std::min(a, b), std::max(a, b)}, entry.reason});
  }
}

std::vector<std::string> Dataset::ContactNames() const {
  std::vector<std::string> names;
  for (const Contact& contact : contacts_) names.push_back(contact.name);
  return names;
}

std::vector<ProblemDefinition> Dataset::ReadProblems(Task task, const std::string& file) const {
  if (file.empty()) return {};
  const std::string path = (folder_ / file).string();
  const std::string task_name{ToString(task)};
  ProblemFile problems = ReadProblemFile(path);
  if (problems.task && *problems.task != task) {
    throw InputError({.file = path,
                      .field = "task",
                      .value = std::string(ToString(*problems.task)),
                      .message = "the file is used for " + task_name + " problems",
                      .fix = "exchange the files, or correct the task"});
  }
  for (const ProblemDefinition& problem : problems.problems) {
    const std::string place = "problem " + std::to_string(problem.id);
    if (!Fits(task, problem)) {
      throw InputError({.file = path,
                        .field = place,
                        .value = std::to_string(problem.stances.size()) + " stances",
                        .message = DescribeStanceCounts(),
                        .fix = "correct the definition, or move the problem to the file of the other task"});
    }
    for (size_t s = 0; s < problem.stances.size(); ++s) {
      for (const ContactTarget& target : problem.stances[s].contacts) {
        const std::vector<std::string> names = ContactNames();
        if (std::find(names.begin(), names.end(), target.contact) != names.end()) {
          CheckProperties(contact(target.contact), target,
                          {.file = path, .field = place + ", stance " + std::to_string(s)});
          continue;
        }
        throw InputError({.file = path,
                          .field = place + ", stance " + std::to_string(s),
                          .value = target.contact,
                          .message = "the dataset has no such contact",
                          .fix = SuggestName(target.contact, names)});
      }
    }
  }
  return std::move(problems.problems);
}

void Dataset::CheckProperties(const Contact& contact, const ContactTarget& target, const TextSource& source) {
  const auto refuse = [&](const std::string& key) {
    throw InputError({.file = source.file,
                      .field = source.field + ", " + key + "." + contact.name,
                      .value = std::string(ToString(contact.kind)),
                      .message = "contacts of this kind have no " + key,
                      .fix = "remove it"});
  };
  if (target.friction && contact.facts().forces == ContactForces::kBounded) refuse("friction");
  if (target.slide_m && !contact.facts().slides) refuse("slide_m");
}

const std::shared_ptr<const CollisionModel>& Dataset::collision_model(SceneRepresentation scene,
                                                                      PairSelection pairs) const {
  LazyCollisionModel& lazy = collision_models_[scene][pairs];
  std::call_once(lazy.once, [&] {
    lazy.model = CollisionModel::Build(robot_, scene_, self_collision_reference_, collision_options(scene, pairs));
  });
  return lazy.model;
}

CollisionOptions Dataset::collision_options(SceneRepresentation scene, PairSelection pairs) const {
  return {.scene = scene, .pairs = pairs, .unchecked = unchecked_pairs_, .links = description_.link_shapes};
}

const ProblemDefinition& Dataset::problem(Task task, int id) const {
  const std::vector<ProblemDefinition>& all = problems(task);
  const auto found = std::find_if(all.begin(), all.end(), [id](const ProblemDefinition& p) { return p.id == id; });
  if (found != all.end()) return *found;
  std::string ids;
  for (const ProblemDefinition& problem : all) ids += (ids.empty() ? "" : ", ") + std::to_string(problem.id);
  throw InputError({.file = file_for_errors(),
                    .field = std::string(ToString(task)) + " problems",
                    .value = std::to_string(id),
                    .message = "there is no problem with this id",
                    .fix = ids.empty() ? "the dataset has no problems of this task" : "ids: " + ids});
}

const Contact& Dataset::contact(const std::string& name) const {
  const auto found = std::find_if(contacts_.begin(), contacts_.end(), [&](const Contact& c) { return c.name == name; });
  if (found != contacts_.end()) return *found;
  throw InputError({.file = file_for_errors(),
                    .field = "contacts",
                    .value = name,
                    .message = "the dataset has no such contact",
                    .fix = SuggestName(name, ContactNames())});
}

Eigen::Isometry3d Dataset::LinkTarget(const ContactTarget& target) const {
  return contact(target.contact).LinkTarget(target);
}

}  // namespace legopt
