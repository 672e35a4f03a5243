#include "legopt/import/internal/standing_stage.h"

#include <cmath>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/files/written_file.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSceneFile = "standing.yaml";
constexpr double kGround_m = 200.0;    // side of the ground
constexpr double kRamp_m = 40.0;       // side of the ramp
constexpr double kRampPlace_m = 40.0;  // x of its centre
constexpr double kThickness_m = 0.5;

/// Height of the ramp's centre: its lower edge is above the ground.
double RampHeight_m() { return 0.5 * kRamp_m * std::sin(StandingStage::kSlope_rad) + 2.0 * kThickness_m; }

std::string SceneText() {
  const Eigen::Isometry3d X_WR = StandingFrame(true) * Eigen::Translation3d(0.0, 0.0, -0.5 * kThickness_m);
  const auto vector = [](const Eigen::Vector3d& v) {
    return "[" + FormatNumber(v.x()) + ", " + FormatNumber(v.y()) + ", " + FormatNumber(v.z()) + "]";
  };
  return "objects:\n  - {name: ground, shape: box, size: " + vector({kGround_m, kGround_m, kThickness_m}) +
         ", position: " + vector({0.0, 0.0, -0.5 * kThickness_m}) +
         "}\n  - {name: ramp, shape: box, size: " + vector({kRamp_m, kRamp_m, kThickness_m}) +
         ", position: " + vector(X_WR.translation()) + ", rpy: " + vector({0.0, -StandingStage::kSlope_rad, 0.0}) +
         "}\n";
}

/// Links or copies every file of `from`, with its folders, except for the stage itself.
void LinkFiles(const fs::path& from, const fs::path& to) {
  for (auto entry = fs::recursive_directory_iterator(from); entry != fs::recursive_directory_iterator(); ++entry) {
    const fs::path name = entry->path().lexically_relative(from);
    if (name == StandingStage::kFolderName) {
      entry.disable_recursion_pending();
      continue;
    }
    if (entry->is_directory()) {
      fs::create_directories(to / name);
      continue;
    }
    std::error_code error;
    fs::create_hard_link(entry->path(), to / name, error);
    if (error) CopyOutputFile(entry->path(), to / name);
  }
}

}  // namespace

StandingStage::OwnFolder::OwnFolder(fs::path folder) : path(std::move(folder)) {
  fs::remove_all(path);
  fs::create_directory(path);
}

StandingStage::OwnFolder::~OwnFolder() {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

StandingStage::StandingStage(const DatasetDescription& description, const fs::path& folder, const ReadGuard& guard)
    : folder_(folder / kFolderName) {
  LinkFiles(folder, folder_.path);
  DatasetDescription stage = description;
  stage.scene_file = kSceneFile;
  stage.files.clear();
  for (std::string& file : stage.problem_files) file.clear();
  const TaskDescription& posture = DescriptionOf(Task::kPosture);
  stage.problem_files[Task::kPosture] = "standing.json";
  WriteTextFile(folder_.path / kSceneFile, SceneText());
  WriteTextFile(folder_.path / stage.problem_files[Task::kPosture], FormatProblems({}, posture.task, "", "standing"));
  fs::remove(folder_.path / kDatasetFileName);  // a link to the import's own file must not be overwritten
  WriteTextFile(folder_.path / kDatasetFileName, FormatDatasetFile(stage, "Stage of an import"));
  WriteManifestHashes(folder_.path, guard);
  dataset_ = Dataset::Load(folder_.path, guard);
}

Eigen::Isometry3d StandingFrame(bool on_ramp) {
  Eigen::Isometry3d X_WF = Eigen::Isometry3d::Identity();
  if (!on_ramp) return X_WF;
  X_WF.translation() = Eigen::Vector3d(kRampPlace_m, 0.0, RampHeight_m());
  X_WF.linear() = Eigen::AngleAxisd(-StandingStage::kSlope_rad, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return X_WF;
}

Stance StanceBelow(const Dataset& stage, const Eigen::VectorXd& x, const Eigen::Isometry3d& X_WF) {
  Kinematics kinematics(stage.robot());
  kinematics.UpdatePoses(x);
  Stance stance;
  for (const Contact& contact : stage.feet()) {
    const Eigen::Isometry3d X_WC = kinematics.link_pose(contact.link_index) * contact.X_LC;
    const Eigen::Vector3d forward = X_WC.linear().col(0);
    const double yaw = std::atan2(forward.y(), forward.x());
    ContactTarget target;
    target.contact = contact.name;
    target.position = X_WF * Eigen::Vector3d(X_WC.translation().x(), X_WC.translation().y(), 0.0);
    target.rotation =
        Eigen::Quaterniond(X_WF.linear()) * Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
    stance.contacts.push_back(target);
  }
  return stance;
}

}  // namespace legopt
