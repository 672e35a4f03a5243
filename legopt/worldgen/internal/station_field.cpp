#include "legopt/worldgen/internal/station_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
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

/// Appends the objects of a station at its place, with names that are unique.
void AppendObjects(const Station& station, std::size_t index, const Eigen::Vector3d& place, std::string* scene) {
  for (SceneObject object : station.objects) {
    object.name = "s" + std::to_string(index) + "-" + object.name;
    object.shape.pose.pretranslate(place);
    *scene += "  - {name: " + Dump(nlohmann::json(object.name)) + ", shape: " + FormatPrimitive(object.shape) + "}\n";
  }
}

Stance Placed(Stance stance, const Eigen::Vector3d& place) {
  for (ContactTarget& target : stance.contacts) target.position += place;
  return stance;
}

}  // namespace

void WriteStations(const std::filesystem::path& source, const std::string& name, const std::string& comment,
                   const StationField& field, const std::filesystem::path& folder, const ReadGuard& guard) {
  const auto dataset = Dataset::Load(source, guard);
  DatasetDescription description = DescribeDataset(source);
  CopyRobot(*dataset, description, folder);
  description.name = name;
  description.scene_file = "scene.yaml";
  description.files.clear();
  for (const TaskDescription& task : ProblemTasks()) description.problem_files[task.task].clear();
  std::string scene = "objects:\n";
  std::map<Task, std::vector<ProblemDefinition>> problems;
  for (std::size_t i = 0; i < field.stations.size(); ++i) {
    const Eigen::Vector3d place = PlaceOfStation(*dataset, i, field.size());
    AppendObjects(field.stations[i], i, place, &scene);
    problems[Task::kPosture].push_back(
        {.id = static_cast<int>(i), .stances = {Placed(field.stations[i].stance, place)}});
  }
  for (std::size_t k = 0; k < field.courses.size(); ++k) {
    const std::size_t i = field.stations.size() + k;
    const Eigen::Vector3d place = PlaceOfStation(*dataset, i, field.size());
    AppendObjects(field.courses[k].station, i, place, &scene);
    ProblemDefinition& problem = problems[Task::kMotion].emplace_back(ProblemDefinition{static_cast<int>(k), {}});
    for (const Stance& stance : field.courses[k].stances) problem.stances.push_back(Placed(stance, place));
  }
  WriteTextFile(folder / "scene.yaml", scene);
  for (const auto& [task, list] : problems) {
    description.problem_files[task] = DescriptionOf(task).problem_file;
    WriteTextFile(folder / description.problem_files[task],
                  FormatProblems(list, task, dataset->robot().name(), "stations"));
  }
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
  // Not those of the suites: the problems of a seed must not change when LegOpt-best finds more of them.
  options.waypoint_chains = WaypointChains::kNever;
  options.window_backtracks = 0;
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

PlantedMotion PostureFinder::FindMotion(const ProblemDefinition& problem) {
  // Limits of effort, because a solve that fails can take minutes. Most solves that succeed need less.
  constexpr std::int64_t kPerPosture = 3'000, kPerStance = 6'000;  // evaluations of terms
  PlantedMotion motion;
  Method method = method_;
  method.multi_starts = 0;
  method.continuous_collision = ContinuousCollision::kRequired;
  SolveSettings settings;
  settings.effort_limit = kPerPosture;
  for (const Stance& stance : problem.stances) {
    const ProblemDefinition posture{.id = problem.id, .stances = {stance}};
    const SolveOutcome outcome = solver_.Solve(Task::kPosture, posture, Initialization::kGood, method, settings);
    if (outcome.waypoints.size() != 1 || !Measure(posture, outcome.waypoints.front()).accepted) return motion;
  }
  settings.effort_limit = kPerStance * std::ssize(problem.stances);
  const SolveOutcome outcome = solver_.Solve(Task::kBalanced, problem, Initialization::kGood, method, settings);
  if (outcome.windows_solved < outcome.windows) return motion;
  motion.waypoints = outcome.waypoints;
  motion.accepted = Accepts(problem, motion.waypoints);
  return motion;
}

bool PostureFinder::Accepts(const ProblemDefinition& problem, const std::vector<Eigen::VectorXd>& waypoints) {
  return judge_.Evaluate(Task::kBalanced, problem, waypoints).physical == Verdict::kSuccess;
}

}  // namespace legopt::worldgen
