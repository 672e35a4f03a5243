#include "client/report/solution_items.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

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

}  // namespace

std::vector<SolutionItem> SolutionItems(const SolutionFile& file, const Dataset& dataset) {
  std::vector<SolutionItem> items;
  for (const SolvedProblem& problem : file.problems) {
    const ProblemDefinition& definition = DefinitionOf(file, problem, dataset);
    for (const Solution& solution : problem.solutions) items.push_back({&definition, &solution});
  }
  return items;
}

std::string ReadSolutionPath(Task task, const Solution& solution, int num_waypoints, int size, TimedPath* path) {
  if (solution.unreadable) return solution.unreadable->Describe();
  if (IsTimed(task)) {
    const std::optional<PathDiagnostic> fault = ParsePath(solution.waypoints, num_waypoints, size, path);
    return fault ? fault->detail : "";
  }
  if (std::ssize(solution.waypoints) != num_waypoints) {
    return std::to_string(solution.waypoints.size()) + " of " + std::to_string(num_waypoints) + " waypoints";
  }
  path->points = solution.waypoints;
  for (int w = 0; w < num_waypoints; ++w) {
    path->times.push_back(w);
    path->waypoints.push_back(static_cast<std::size_t>(w));
  }
  return "";
}

nlohmann::json FiniteOrNull(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

nlohmann::json MedianOrNull(std::vector<double> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  return FiniteOrNull(values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]));
}

}  // namespace legopt::client
