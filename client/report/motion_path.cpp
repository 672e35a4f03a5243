#include "client/report/motion_path.h"

#include <optional>

#include "legopt/types/input_error.h"

namespace legopt::client {

MotionPath ReadMotionPath(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints,
                          int size) {
  const int count = NumWaypoints(task, static_cast<int>(problem.stances.size()));
  MotionPath motion;
  for (int w = 0; w < count; ++w) {
    motion.stances.push_back(&problem.stances[static_cast<size_t>(StanceOfWaypoint(task, w))]);
  }
  if (HasTimeStamps(task)) {
    const std::optional<PathDiagnostic> fault = ParsePath(waypoints, count, size, &motion.path);
    if (fault) motion.fault = fault->detail;
    return motion;
  }
  if (std::ssize(waypoints) != count) {
    motion.fault = std::to_string(waypoints.size()) + " of " + std::to_string(count) + " waypoints";
    return motion;
  }
  motion.path.points.assign(waypoints.begin(), waypoints.end());
  for (int w = 0; w < count; ++w) {
    motion.path.times.push_back(w);
    motion.path.waypoints.push_back(static_cast<size_t>(w));
  }
  return motion;
}

MotionPath ReadMotionPath(Task task, const ProblemDefinition& problem, const Solution& solution, int size) {
  if (!solution.unreadable) return ReadMotionPath(task, problem, solution.waypoints, size);
  MotionPath motion;
  motion.fault = solution.unreadable->Describe();
  return motion;
}

const ProblemDefinition& DefinitionOf(const SolutionFile& file, const SolvedProblem& problem, const Dataset& dataset) {
  if (!problem.definition.stances.empty()) return problem.definition;
  for (const ProblemDefinition& posed : dataset.problems(file.task)) {
    if (posed.id == problem.definition.id) return posed;
  }
  throw InputError({.file = file.path,
                    .field = "problem " + std::to_string(problem.definition.id),
                    .value = "",
                    .message = "has no definition, neither here nor in the dataset '" + dataset.name() + "'",
                    .fix = "name the dataset that poses it with --dataset"});
}

}  // namespace legopt::client
