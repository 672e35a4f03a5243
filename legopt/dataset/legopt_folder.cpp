#include "legopt/dataset/legopt_folder.h"

#include <algorithm>
#include <numbers>
#include <vector>

#include "legopt/dataset/scene_file.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr double kAtlasSoleOffset_m = 0.082351;  // lowest vertex of r_foot (0.081351) plus the tolerance (0.001)
constexpr double kKnee_rad = 50 * std::numbers::pi / 180;
constexpr double kHipAndAnkle_rad = -25 * std::numbers::pi / 180;
constexpr double kShoulder_rad = 1.3;
constexpr double kReferenceBack_rad = 20 * 3.1415 / 180;  // the original evaluator's approximation of pi

/// Returns the only element, as a path relative to the folder; throws for none or several.
std::string TheOnly(const fs::path& folder, std::vector<fs::path> found, const std::string& what) {
  std::sort(found.begin(), found.end());
  if (found.size() == 1) return found.front().lexically_relative(folder).generic_string();
  std::string names;
  for (const fs::path& path : found) names += (names.empty() ? "" : ", ") + path.lexically_relative(folder).string();
  throw InputError({.file = folder.string(),
                    .field = what,
                    .value = names,
                    .message = found.empty() ? "a LegOpt-style folder needs one, there is none" : "there are several",
                    .fix = "keep exactly one, or write a dataset.yaml that names it"});
}

}  // namespace

bool IsLegOptFolder(const fs::path& folder) {
  return std::ranges::any_of(ProblemTasks(), [&](const TaskDescription& task) {
    return fs::is_regular_file(folder / task.legopt_problem_file);
  });
}

DatasetDescription DescribeLegOptFolder(const fs::path& folder) {
  DatasetDescription description;
  description.bare = true;
  const fs::path absolute = fs::weakly_canonical(folder);
  description.name = absolute.filename().string();
  std::vector<fs::path> robots;
  for (const auto& entry : fs::recursive_directory_iterator(absolute)) {
    if (entry.is_regular_file() && entry.path().extension() == ".urdf") robots.push_back(entry.path());
  }
  std::vector<fs::path> meshes;
  for (const auto& entry : fs::directory_iterator(absolute)) {
    if (entry.is_regular_file() && IsMeshFile(entry.path())) meshes.push_back(entry.path());
  }
  description.robot_file = TheOnly(absolute, robots, "URDF file (*.urdf)");
  description.scene_file = TheOnly(absolute, meshes, "scene mesh (.stl, .obj, .dae, .ply)");
  for (const TaskDescription& task : ProblemTasks()) {
    if (!fs::is_regular_file(absolute / task.legopt_problem_file)) continue;
    description.problem_files[task.task] = task.legopt_problem_file;
  }
  SetBenchmarkConstants(&description);
  return description;
}

void SetBenchmarkConstants(DatasetDescription* description) {
  description->contacts = DescribeSoles({"l_foot", "r_foot"}, kAtlasSoleOffset_m);
  description->nominal_posture = {{"l_leg_kny", kKnee_rad},        {"r_leg_kny", kKnee_rad},
                                  {"l_leg_lhy", kHipAndAnkle_rad}, {"r_leg_lhy", kHipAndAnkle_rad},
                                  {"l_leg_uay", kHipAndAnkle_rad}, {"r_leg_uay", kHipAndAnkle_rad},
                                  {"l_arm_shx", -kShoulder_rad},   {"r_arm_shx", kShoulder_rad}};
  description->self_collision_reference = {{"back_lbz", kReferenceBack_rad}, {"back_ubx", kReferenceBack_rad}};
}

}  // namespace legopt
