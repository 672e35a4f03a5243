#include "legopt/worldgen/internal/station_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/input/json.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/statics/stance_forces.h"

namespace legopt::worldgen {

Eigen::Vector3d PlaceOfStation(const Dataset& robot, std::size_t index, std::size_t count) {
  constexpr double kLeast_m = 4.0, kHeights = 4.5;
  const double spacing_m = std::max(kLeast_m, kHeights * robot.trunk_height_m());
  const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  const std::size_t column = index % columns, row = index / columns;
  return {spacing_m * static_cast<double>(column), spacing_m * static_cast<double>(row), 0.0};
}

namespace {

/// Returns a station moved to its place, with the names of its objects made unique.
Station PlacedStation(const Dataset& robot, const Station& station, std::size_t index, std::size_t count) {
  const Eigen::Vector3d place = PlaceOfStation(robot, index, count);
  Station placed = station;
  for (SceneObject& object : placed.objects) {
    object.name = "s" + std::to_string(index) + "-" + object.name;
    object.shape.pose.pretranslate(place);
  }
  for (ContactTarget& target : placed.stance.contacts) target.position += place;
  return placed;
}

}  // namespace

void WriteStations(const std::filesystem::path& source, const std::string& name, const std::string& comment,
                   std::span<const Station> stations, const std::filesystem::path& folder, const ReadGuard& guard) {
  const auto dataset = Dataset::Load(source, guard);
  DatasetDescription description = DescribeDataset(source);
  CopyRobot(*dataset, description, folder);
  description.name = name;
  description.scene_file = "scene.yaml";
  description.files.clear();
  for (const TaskDescription& task : ProblemTasks()) description.problem_files[task.task].clear();
  description.problem_files[Task::kPosture] = DescriptionOf(Task::kPosture).problem_file;
  std::string scene = "objects:\n";
  std::vector<ProblemDefinition> problems;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const Station placed = PlacedStation(*dataset, stations[i], i, stations.size());
    for (const SceneObject& object : placed.objects) {
      scene += "  - {name: " + Dump(nlohmann::json(object.name)) + ", shape: " + FormatPrimitive(object.shape) + "}\n";
    }
    problems.push_back({.id = static_cast<int>(i), .stances = {placed.stance}});
  }
  WriteTextFile(folder / "scene.yaml", scene);
  WriteTextFile(folder / description.problem_files[Task::kPosture],
                FormatProblems(problems, Task::kPosture, dataset->robot().name(), "stations"));
  WriteTextFile(folder / kDatasetFileName, FormatDatasetFile(description, comment));
  WriteManifestHashes(folder, guard);
}

namespace {

Method FinderMethod() {
  constexpr int kRestarts = 10;
  Method method = Method::Of("best");
  method.name = PlantedPosture::kMethod;
  method.multi_starts = kRestarts;
  method.physics = Physics::kEffort;
  // As in data/suites/contacts.yaml.
  method.contact_range_m = 0.06;
  auto options = method.options.As<BestOptions>();
  options.sqp.initial_penalty = 1e3;
  options.rescue_noise = 0.4;
  method.options = options;
  return method;
}

}  // namespace

PostureFinder::PostureFinder(const std::shared_ptr<const Dataset>& dataset)
    : dataset_(dataset),
      solver_(dataset),
      judge_(dataset),
      certifier_(dataset),
      method_(FinderMethod()),
      kinematics_(dataset->robot()),
      equilibrium_(dataset->robot(), dataset->gravity_m_s2()),
      query_(dataset->collision_model()) {}

double PostureFinder::TrunkDistance_m(const Kinematics& kinematics) {
  constexpr double kRange_m = 1.0;
  double distance_m = kRange_m;
  const int trunk = dataset_->trunk().link;
  for (const ProximityPair& pair : query_.SceneContacts(kinematics, kRange_m, std::span(&trunk, 1))) {
    distance_m = std::min(distance_m, pair.distance_m);
  }
  return distance_m;
}

PlantedPosture PostureFinder::Find(const ProblemDefinition& problem) {
  constexpr int kCertifierStarts = 6;
  PlantedPosture posture;
  if (!certifier_.Search(problem.stances.front(), 0, kCertifierStarts, {})) return posture;
  const SolveOutcome outcome = solver_.Solve(Task::kPosture, problem, Initialization::kGood, method_, SolveSettings{});
  return outcome.waypoints.size() == 1 ? Measure(problem, outcome.waypoints.front()) : posture;
}

PlantedPosture PostureFinder::Measure(const ProblemDefinition& problem, const Eigen::VectorXd& x) {
  PlantedPosture posture;
  posture.x = x;
  posture.accepted = judge_.Evaluate(Task::kPosture, problem, {&x, 1}).physical == Verdict::kSuccess;
  if (!posture.accepted) return posture;
  kinematics_.Update(posture.x);
  const StanceForces forces(SurfacesOf(*dataset_, problem.stances.front(), &kinematics_));
  posture.push_N = equilibrium_.ResistedPush_N(forces, kinematics_);
  posture.trunk_distance_m = TrunkDistance_m(kinematics_);
  return posture;
}

}  // namespace legopt::worldgen
