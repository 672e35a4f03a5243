#include "legopt/import/importer.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/files/written_file.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/geometry/internal/terrain.h"
#include "legopt/import/internal/contact_choice.h"
#include "legopt/import/internal/copied_robot.h"
#include "legopt/import/internal/copied_scene.h"
#include "legopt/import/internal/dataset_check.h"
#include "legopt/import/internal/self_collision_pairs.h"
#include "legopt/import/internal/srdf.h"
#include "legopt/import/internal/standing_check.h"
#include "legopt/import/internal/standing_stage.h"
#include "legopt/import/internal/trunk_choice.h"
#include "legopt/import/internal/used_contacts.h"
#include "legopt/input/json.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using Severity = DatasetDiagnostic::Severity;

constexpr const char* kLevelGround =
    "objects:\n  - {name: ground, shape: box, size: [40, 40, 0.5], position: [0, 0, -0.25]}\n";

class Importer {
 public:
  Importer(const ImportOptions& options, const fs::path& folder)
      : options_(options),
        folder_(fs::weakly_canonical(folder)),
        sources_(FindSources(options.source, options.files)) {}

  /// Imports the dataset. Errors refer to the user's files, not to the copies.
  ImportReport Import() {
    try {
      return Make();
    } catch (const InputError& error) {
      std::vector<InputError::Fault> faults = error.faults();
      for (InputError::Fault& fault : faults) fault.file = OriginOf(fault.file).string();
      throw InputError::Of(std::move(faults));
    }
  }

 private:
  ImportReport Make() {
    NoteSources();
    WriteRobot();
    CheckMeshScale();
    CheckNominalPosture();
    WriteScene();
    WriteProblems();
    ChooseConstants();
    ChooseTrunk();
    ChooseLinkPairs();
    report_.standing = StandingCheck({.search_posture = description_.nominal_posture.empty(), .prove = options_.prove},
                                     folder_, options_.read_guard, &description_, &report_.findings)
                           .Run(*robot_, standing_);
    WriteTextFile(folder_ / kDatasetFileName,
                  FormatDatasetFile(description_, "Made by `legopt import` from " + options_.source.string()));
    WriteManifestHashes(folder_, options_.read_guard);
    const auto dataset = Dataset::Load(folder_, options_.read_guard);
    report_.content_hash = dataset->content_hash();
    for (DatasetDiagnostic& finding : CheckDataset(*dataset)) report_.findings.push_back(std::move(finding));
    CheckScale(*dataset);
    return std::move(report_);
  }

  /// Makes a scene that is a thousand times as large as the robot an error, unless the user gave its scale.
  void CheckScale(const Dataset& dataset) {
    if (options_.scene.scale || !IsSceneTooLarge(dataset)) return;
    for (DatasetDiagnostic& finding : report_.findings) {
      if (finding.check != "units" || finding.field != "scene") continue;
      finding.severity = Severity::kError;
      finding.message = "is more than 1000 times as large as the robot; is it in millimetres?";
      finding.fix = "import with --scale 0.001 if it is, or with --scale 1 if the size is right";
    }
  }

  /// Returns the source of a file in the folder; returns other paths unchanged.
  fs::path OriginOf(const fs::path& file) const {
    fs::path inside = file.lexically_relative(folder_);
    if (inside.empty() || *inside.begin() == "..") return file;
    if (*inside.begin() == StandingStage::kFolderName) inside = inside.lexically_relative(StandingStage::kFolderName);
    const std::string name = inside.generic_string();
    if (name == kRobotFileName) return sources_.robot;
    if (name == description_.scene_file) return sources_.scene;
    for (const TaskDescription& task : ProblemTasks()) {
      if (name == task.problem_file) return sources_.problems[task.task];
    }
    if (name == kDatasetFileName) return options_.source;
    return inside;
  }

  std::string InSource(const fs::path& file) const { return file.lexically_relative(sources_.folder).generic_string(); }

  void Note(Severity severity, const std::string& check, const std::string& field, const std::string& value,
            const std::string& message, const std::string& fix = "") {
    report_.findings.push_back({severity, check, "", field, value, message, fix});
  }

  void NoteSources() {
    std::string problems;
    for (const fs::path& file : sources_.problems) {
      if (!file.empty()) problems += ", " + InSource(file);
    }
    Note(Severity::kInfo, "files", "",
         InSource(sources_.robot) + (sources_.scene.empty() ? "" : ", " + InSource(sources_.scene)) + problems,
         sources_.collada ? "robot by COLLADA kinematics, turned into a URDF" : "robot by URDF");
  }

  void WriteRobot() {
    std::vector<DatasetDiagnostic> findings;
    if (sources_.collada) {
      ColladaRobot robot = ReadColladaRobot(sources_.robot);
      WriteColladaRobot(robot, folder_);
      findings = std::move(robot.findings);
    } else {
      findings = CopyUrdfRobot(sources_.robot, folder_,
                               {.visuals = with_visuals_,
                                .repair = !KeepsMeshes(),
                                .mesh_scale = options_.mesh_scale.value_or(1.0),
                                .meshes = options_.meshes,
                                .read_guard = options_.read_guard});
    }
    robot_findings_ = {report_.findings.size(), findings.size()};
    for (DatasetDiagnostic& finding : findings) report_.findings.push_back(std::move(finding));
    description_.robot_file = kRobotFileName;
    robot_ = std::make_unique<RobotModel>(
        RobotModel::FromUrdfFile((folder_ / kRobotFileName).string(), options_.read_guard));
    GuessStanding();
  }

  /// Returns true for a robot whose meshes stay as they are, which keeps the results of existing datasets and of the
  /// benchmark.
  bool KeepsMeshes() const {
    const bool remade = !options_.files.robot && fs::is_regular_file(options_.source / kDatasetFileName);
    return remade || SourceIsBenchmarkRobot();
  }

  /// Throws if a link's mesh is much larger than the distances between the links, as meshes in millimetres are.
  void CheckMeshScale() const {
    constexpr double kMostTimes = 30.0;
    if (options_.mesh_scale || sources_.collada || KeepsMeshes()) return;
    Kinematics kinematics(*robot_);
    kinematics.UpdatePoses(robot_->NeutralConfiguration());
    Eigen::AlignedBox3d origins;
    for (int link = 0; link < std::ssize(robot_->links()); ++link) {
      origins.extend(kinematics.link_pose(link).translation());
    }
    const double skeleton_m = origins.sizes().maxCoeff();
    for (const Link& link : robot_->links()) {
      Link meshes = link;
      std::erase_if(meshes.collision, [](const ShapeSpec& shape) { return shape.kind != ShapeSpec::Kind::kMesh; });
      const Eigen::AlignedBox3d box = LinkBox(meshes, options_.read_guard);
      if (box.isEmpty() || !(skeleton_m > 0.0)) continue;
      const double times = box.sizes().maxCoeff() / skeleton_m;
      if (times <= kMostTimes) continue;
      throw InputError({sources_.robot.string(), "link '" + link.name + "': mesh",
                        FormatGeneral(box.sizes().maxCoeff(), 4) + " m",
                        "is " + FormatFixed(times, 0) +
                            " times as long as the largest distance of two links; are the meshes in millimetres?",
                        "import with --mesh-scale 0.001 if they are, or with --mesh-scale 1 if the size is right"});
    }
  }

  /// Writes the robot again, with the visual geometry of the links without collision geometry.
  void RewriteWithVisuals() {
    with_visuals_ = true;
    const auto [first, count] = robot_findings_;
    const auto begin = report_.findings.begin() + static_cast<std::ptrdiff_t>(first);
    report_.findings.erase(begin, begin + static_cast<std::ptrdiff_t>(count));
    fs::remove_all(folder_ / kRobotMeshFolder);
    fs::remove(folder_ / kRobotFileName);
    WriteRobot();
  }

  void GuessStanding() {
    standing_ = robot_->NeutralConfiguration();
    srdf_ = ReadSrdf(sources_.robot, *robot_);
    for (const std::string& fault : srdf_.faults) {
      Note(Severity::kWarning, "SRDF", fault, "", "cannot be read, so its postures, groups and pairs do not count",
           "correct the file, or remove it");
    }
    const std::optional<SrdfState> state = FindStandingState(sources_.robot, *robot_);
    if (!state) return;
    for (const auto& [name, value] : state->joints) {
      standing_[robot_->joints()[static_cast<std::size_t>(robot_->FindJoint(name))].dof] = value;
    }
    robot_->ClampJoints(standing_);
    Note(Severity::kInfo, "SRDF", state->file.filename().string(), state->name,
         "contacts are measured, and the nominal posture is searched, near this state");
  }

  /// Throws if a requested joint value exceeds the limits. Dataset::Load reports unknown joints.
  void CheckNominalPosture() const {
    for (const auto& [name, value] : options_.nominal_posture) {
      const int found = robot_->FindJoint(name);
      if (found < 0) continue;
      const Joint& joint = robot_->joints()[static_cast<size_t>(found)];
      if (joint.type == JointType::kFixed || (value >= joint.lower && value <= joint.upper)) continue;
      const auto text = [](double number) { return Dump(nlohmann::json(number)); };
      throw InputError({"", "--nominal", name + "=" + text(value),
                        "is outside of the joint's limits, " + text(joint.lower) + " .. " + text(joint.upper),
                        "give a value between them, in radians (a prismatic joint: in metres)"});
    }
  }

  void WriteScene() {
    if (sources_.scene.empty()) {
      description_.scene_file = "scene.yaml";
      WriteTextFile(folder_ / description_.scene_file, kLevelGround);
      Note(Severity::kInfo, "scene", "", "", "there is none: level ground of 40 x 40 m, z = 0; others: --scene");
      triangles_ = CollectSceneTriangles(ReadSceneFile(folder_ / description_.scene_file, options_.read_guard));
      return;
    }
    CopiedScene scene =
        CopySceneFiles(sources_.scene, folder_,
                       {.root = sources_.folder, .repair = options_.scene, .read_guard = options_.read_guard});
    description_.scene_file = scene.file;
    report_.scene = std::move(scene.objects);
    for (DatasetDiagnostic& finding : scene.findings) report_.findings.push_back(std::move(finding));
    triangles_ = CollectSceneTriangles(ReadSceneFile(folder_ / description_.scene_file, options_.read_guard));
  }

  void WriteProblems() {
    UsedContactList contacts;
    std::vector<std::pair<Task, ProblemFile>> files;
    for (const TaskDescription& task : ProblemTasks()) {
      const fs::path& path = sources_.problems[task.task];
      if (path.empty()) continue;
      files.emplace_back(task.task, ReadProblemFile(path));
      contacts.Add(task.task, files.back().second.problems);
    }
    CollectFeet(contacts);
    for (auto& [task, file] : files) WriteProblemFile(task, contacts, &file);
    if (!files.empty()) return;
    const TaskDescription& any = kTasks.front();  // a dataset must list a problem file
    description_.problem_files[any.task] = any.problem_file;
    WriteTextFile(folder_ / any.problem_file, FormatProblems({}, any.task, robot_->name(), options_.name));
  }

  QuaternionEvidence Weigh(const UsedContactList& contacts) const {
    return CollectQuaternionEvidence(contacts.all(), Terrain(triangles_));
  }

  /// Decides the quaternion order. The files of a folder may have different authors, so each is checked alone. If that
  /// is inconclusive, for example for feet rotated by 0 or 180 degrees only, all files are checked together.
  bool IsXFirst(Task task, const ProblemFile& file, const UsedContactList& all) {
    UsedContactList contacts;
    contacts.Add(task, file.problems);
    const QuaternionEvidence own = Weigh(contacts);
    const QuaternionEvidence evidence = own.verdict() == QuaternionEvidence::Verdict::kEither ? Weigh(all) : own;
    if (evidence.verdict() != QuaternionEvidence::Verdict::kXFirst) return false;
    Note(Severity::kInfo, "quaternion order", std::string(ToString(task)) + " problems", evidence.Describe(),
         "quaternions were x y z w and have been turned into w x y z");
    return true;
  }

  void WriteProblemFile(Task task, const UsedContactList& all, ProblemFile* file) {
    const bool x_first = IsXFirst(task, *file, all);
    const std::string name(DescriptionOf(task).problem_file);
    description_.problem_files[task] = name;
    if (!x_first) {
      CopyOutputFile(sources_.problems[task], folder_ / name);
      return;
    }
    for (ProblemDefinition& problem : file->problems) {
      for (Stance& stance : problem.stances) {
        for (ContactTarget& target : stance.contacts) target.rotation = ReadAsXFirst(target.rotation);
      }
    }
    WriteTextFile(folder_ / name, FormatProblems(file->problems, task, file->robot, file->scenario));
  }

  /// Collects the contacts that the problems use, which are named like links, in the order of their first use. If there
  /// are two, the left one comes first, as the generator requires.
  void CollectFeet(const UsedContactList& contacts) {
    for (const UsedContact& used : contacts.all()) {
      const std::string& link = used.target.contact;
      if (std::find(problem_feet_.begin(), problem_feet_.end(), link) == problem_feet_.end()) {
        problem_feet_.push_back(link);
      }
    }
    if (problem_feet_.size() == 2 && LateralPosition_m(problem_feet_[0]) < LateralPosition_m(problem_feet_[1])) {
      std::swap(problem_feet_[0], problem_feet_[1]);
    }
  }

  /// Returns y of a link in the base frame, with all joints at 0 or the nearest limit; 0 if there is no such link.
  double LateralPosition_m(const std::string& name) const {
    const int link = robot_->FindLink(name);
    if (link < 0) return 0.0;
    Kinematics kinematics(*robot_);
    kinematics.UpdatePoses(robot_->NeutralConfiguration());
    return kinematics.link_pose(link).translation().y();
  }

  void ChooseConstants() {
    const bool known = fs::is_regular_file(options_.source / kDatasetFileName);
    DatasetDescription constants;
    if (known) {
      constants = ReadDatasetFile(options_.source);
      has_pair_rule_ = !options_.files.robot;
    } else if (IsBenchmarkRobot()) {
      has_pair_rule_ = true;
      SetBenchmarkConstants(&constants);
      Note(Severity::kInfo, "constants", "", "",
           "the robot has the joints and feet of the benchmark's Atlas, and gets its constants");
    }
    description_.name = options_.name;
    description_.gravity_m_s2 = constants.gravity_m_s2;
    description_.nominal_posture = constants.nominal_posture;
    description_.self_collision_reference = constants.self_collision_reference;
    if (has_pair_rule_) {
      description_.trunk = constants.trunk;
      description_.self_collision = constants.self_collision;
      description_.link_shapes = constants.link_shapes;
    }
    if (!options_.nominal_posture.empty()) description_.nominal_posture = options_.nominal_posture;
    ContactRequest request{.wanted = options_.contacts,
                           .sole_offset_m = options_.sole_offset_m,
                           .known = constants.contacts,
                           .used = problem_feet_,
                           .leg_tips = srdf_.leg_tips,
                           .file = sources_.robot};
    try {
      FindContacts(request);
    } catch (const UnclearContacts& unclear) {
      if (!options_.ask_contacts || unclear.ends().empty()) throw;
      request.wanted = options_.ask_contacts(unclear.ends());
      if (request.wanted.empty()) throw;
      description_.contacts = ChooseContacts(*robot_, standing_, request, &report_.findings);
    }
  }

  void FindContacts(const ContactRequest& request) {
    try {
      description_.contacts = ChooseContacts(*robot_, standing_, request, &report_.findings);
    } catch (const UnclearContacts& unclear) {
      if (with_visuals_ || sources_.collada) throw;
      ChooseWithVisuals(request, unclear);
    }
  }

  /// Feet may have visual geometry only. `unclear`: thrown if they are not clear with it, either.
  void ChooseWithVisuals(const ContactRequest& request, const UnclearContacts& unclear) {
    try {
      RewriteWithVisuals();
      description_.contacts = ChooseContacts(*robot_, standing_, request, &report_.findings);
    } catch (const UnclearContacts&) {
      throw unclear;
    } catch (const InputError& error) {
      if (!unclear.ends().empty()) throw unclear;
      InputError::Fault fault = error.fault();
      fault.message += " (needed because no end link of the robot has collision geometry)";
      throw InputError(fault);
    }
    CheckMeshScale();
  }

  /// Finds the trunk, unless the constants say which link it is.
  void ChooseTrunk() {
    const bool named = !options_.trunk.empty();
    if (named && robot_->FindLink(options_.trunk) < 0) {
      std::vector<std::string> names;
      for (const Link& link : robot_->links()) names.push_back(link.name);
      throw InputError(
          {"", "--trunk", options_.trunk, "the robot has no such link", SuggestName(options_.trunk, names)});
    }
    if (named) description_.trunk = options_.trunk;
    if (named || has_pair_rule_) return;
    description_.trunk = FindTrunk(*robot_, description_.contacts);
    Note(Severity::kInfo, "trunk", "", description_.trunk,
         description_.trunk == robot_->links().front().name
             ? "the root link: heights and reach are measured from it; choose another link with --trunk LINK"
             : "found: the legs carry it; it is not the root link; choose another link with --trunk LINK");
  }

  /// Samples the link pairs, unless the constants come with a rule. The original benchmark compares hulls with scenes
  /// and pairs by the reference posture; its robot and datasets made of a dataset keep that.
  void ChooseLinkPairs() {
    if (!has_pair_rule_) description_.link_shapes = LinkRepresentation::kPieces;
    const bool sampled = options_.self_collision_samples ? *options_.self_collision_samples > 0 : !has_pair_rule_;
    if (!sampled) return;
    PairSamplingOptions sampling;
    if (options_.self_collision_samples) sampling.samples = *options_.self_collision_samples;
    sampling.seed = static_cast<std::uint64_t>(options_.self_collision_seed);
    SampledDescription found = SampleSelfCollision(*robot_, description_.nominal_posture, sampling);
    description_.self_collision = std::move(found.pairs);
    description_.self_collision_reference.clear();
    for (DatasetDiagnostic& finding : found.findings) report_.findings.push_back(std::move(finding));
    for (DatasetDiagnostic& finding : ExcludeSrdfPairs(srdf_, *robot_, &*description_.self_collision)) {
      report_.findings.push_back(std::move(finding));
    }
  }

  bool IsBenchmarkRobot() const { return HasBenchmarkNames(*robot_); }

  /// Returns false for a robot that cannot be read, which is reported when it is copied.
  bool SourceIsBenchmarkRobot() const {
    try {
      return HasBenchmarkNames(RobotModel::FromUrdfFile(sources_.robot.string(), options_.read_guard));
    } catch (const InputError&) {
      return false;
    }
  }

  static bool HasBenchmarkNames(const RobotModel& robot) {
    DatasetDescription benchmark;
    SetBenchmarkConstants(&benchmark);
    const auto has_joint = [&](const auto& entry) { return robot.FindJoint(entry.first) >= 0; };
    return std::all_of(benchmark.nominal_posture.begin(), benchmark.nominal_posture.end(), has_joint) &&
           std::all_of(benchmark.self_collision_reference.begin(), benchmark.self_collision_reference.end(),
                       has_joint) &&
           std::all_of(benchmark.contacts.begin(), benchmark.contacts.end(),
                       [&](const ContactDescription& contact) { return robot.FindLink(contact.link) >= 0; });
  }

  const ImportOptions& options_;
  fs::path folder_;
  SourceLayout sources_;
  DatasetDescription description_;
  std::unique_ptr<RobotModel> robot_;
  Eigen::VectorXd standing_;  ///< guess of a posture that stands, n + 7: of the SRDF, or joints at 0
  SrdfContent srdf_;
  bool with_visuals_ = options_.collision_from_visual;        ///< use them for links without collision geometry
  std::pair<std::size_t, std::size_t> robot_findings_{0, 0};  ///< first one and number, in the report
  TriangleMesh triangles_;
  std::vector<std::string> problem_feet_;
  bool has_pair_rule_ = false;  ///< the source or the benchmark decides which link pairs are compared
  ImportReport report_;
};

}  // namespace

void ImportOptions::Validate() const {
  const auto refuse = [](const char* field, const std::string& value, const char* message, const char* fix) {
    throw InputError({"", field, value, message, fix});
  };
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
  if (!plain) refuse("--name", name, "must consist of letters, digits, '-' and '_'", "e.g. my-biped");
  if (sole_offset_m && !(*sole_offset_m >= 0.0 && std::isfinite(*sole_offset_m))) {
    refuse("--sole-offset", FormatFixed(*sole_offset_m, 6), "must not be negative", "leave it out");
  }
  if (mesh_scale && !(*mesh_scale > 0.0 && std::isfinite(*mesh_scale))) {
    refuse("--mesh-scale", FormatFixed(*mesh_scale, 6), "must be positive", "write 0.001 for meshes in millimetres");
  }
  constexpr int kMostSamples = 10'000'000;
  if (self_collision_samples && !(*self_collision_samples >= 0 && *self_collision_samples <= kMostSamples)) {
    refuse("--self-collision-samples", std::to_string(*self_collision_samples), "must lie in 0..10000000",
           "leave it out for 10000");
  }
  if (self_collision_seed < 0) {
    refuse("--self-collision-seed", std::to_string(self_collision_seed), "must not be negative", "leave it out");
  }
  scene.Validate();
}

ImportReport ImportDataset(const ImportOptions& options, const fs::path& folder) {
  options.Validate();
  return Importer(options, folder).Import();
}

}  // namespace legopt
