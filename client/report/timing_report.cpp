#include "client/report/timing_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "legopt/judge/internal/path_examiner.h"
#include "legopt/math/parallel.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

nlohmann::json Finite(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

double Median(std::vector<double> values) {
  std::ranges::sort(values);
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

/// Returns the path of a solution, or the reason why it is none.
std::string ReadPath(Task task, const Solution& solution, int num_waypoints, int size, TimedPath* path) {
  if (solution.unreadable) return solution.unreadable->Describe();
  if (IsTimed(task)) {
    const std::optional<PathDiagnostic> fault = ParsePath(solution.waypoints, num_waypoints, size, path);
    return fault ? fault->detail : "";
  }
  if (std::ssize(solution.waypoints) != num_waypoints) {
    return std::to_string(solution.waypoints.size()) + " of " + std::to_string(num_waypoints) + " waypoints";
  }
  path->points = solution.waypoints;
  for (int w = 0; w < num_waypoints; ++w) path->times.push_back(w);
  return "";
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

}  // namespace

std::vector<TimedSolution> TimeSolutions(const SolutionFile& file, const Dataset& dataset, int threads) {
  if (!DescriptionOf(file.task).windowed) {
    throw InputError({.file = file.path,
                      .field = "task",
                      .value = std::string(ToString(file.task)),
                      .message = "postures take no time",
                      .fix = "give a file of motions"});
  }
  struct Item {
    const ProblemDefinition* problem;
    const Solution* solution;
  };
  std::vector<Item> items;
  for (const SolvedProblem& problem : file.problems) {
    const ProblemDefinition& definition = DefinitionOf(file, problem, dataset);
    for (const Solution& solution : problem.solutions) items.push_back({&definition, &solution});
  }
  std::vector<std::unique_ptr<MotionTimer>> timers;
  for (int k = 0; k < threads; ++k) timers.push_back(std::make_unique<MotionTimer>(dataset));
  std::vector<TimedSolution> timed(items.size());
  ForEachIndex(threads, items.size(), [&](int worker, size_t i) {
    const auto& [problem, solution] = items[i];
    const auto stances = static_cast<int>(problem->stances.size());
    const int count = NumWaypoints(file.task, stances);
    timed[i] = {
        .method = solution->method, .problem_id = problem->id, .num_stances = stances, .fault = "", .timing = {}};
    TimedPath path;
    timed[i].fault = ReadPath(file.task, *solution, count, dataset.robot().configuration_size(), &path);
    if (!timed[i].fault.empty()) return;
    std::vector<const Stance*> of_waypoints;
    for (int w = 0; w < count; ++w) {
      of_waypoints.push_back(&problem->stances[static_cast<size_t>(StanceOfWaypoint(file.task, w))]);
    }
    try {
      timed[i].timing = timers[static_cast<size_t>(worker)]->Compute(of_waypoints, path.times, path.points);
    } catch (const InputError& error) {
      timed[i].fault = error.fault().message + ": " + error.fault().field + " " + error.fault().value;
    }
  });
  return timed;
}

Listing ListingOf(const std::vector<TimedSolution>& solutions) {
  Listing listing;
  listing.columns = {"method",    "problem",  "stances", "duration_s", "s_per_stance", "greedy_s",   "uniform_s",
                     "reduced_s", "velocity", "torque",  "contact",    "blocked_at",   "blocked_by", "grid_points"};
  for (const TimedSolution& solution : solutions) {
    const MotionTiming& timing = solution.timing;
    if (!solution.fault.empty()) {
      std::vector<nlohmann::json> row(listing.columns.size());
      row[0] = solution.method;
      row[1] = solution.problem_id;
      row[2] = solution.num_stances;
      row[12] = solution.fault;
      listing.rows.push_back(std::move(row));
      continue;
    }
    const bool exists = std::isfinite(timing.shortest_s);
    const auto share = [&](double value) { return exists ? nlohmann::json(value) : nlohmann::json(); };
    listing.rows.push_back({solution.method, solution.problem_id, solution.num_stances, Finite(timing.shortest_s),
                            Finite(timing.shortest_s / solution.num_stances), Finite(timing.greedy_s),
                            Finite(timing.uniform_s), Finite(timing.reduced_s), share(timing.limits.velocity),
                            share(timing.limits.torque), share(timing.limits.contact),
                            exists ? nlohmann::json() : nlohmann::json(timing.blocked_at),
                            exists ? nlohmann::json() : nlohmann::json(timing.blocked_by), timing.grid_points});
  }
  return listing;
}

Listing SummaryOf(const std::vector<TimedSolution>& solutions) {
  struct Sum {
    int motions = 0;
    std::vector<double> per_stance_s, greedy, reduced;
  };
  std::map<std::string, Sum> sums;
  for (const TimedSolution& solution : solutions) {
    Sum& sum = sums[solution.method];
    ++sum.motions;
    if (!solution.fault.empty() || !std::isfinite(solution.timing.shortest_s)) continue;
    sum.per_stance_s.push_back(solution.timing.shortest_s / solution.num_stances);
    sum.greedy.push_back(solution.timing.greedy_s / solution.timing.shortest_s);
    sum.reduced.push_back(solution.timing.reduced_s / solution.timing.shortest_s);
  }
  Listing listing;
  listing.columns = {
      "method", "motions", "executable", "median_s_per_stance", "median_greedy_ratio", "median_reduced_ratio"};
  for (const auto& [method, sum] : sums) {
    const auto median = [](const std::vector<double>& values) {
      return values.empty() ? nlohmann::json() : Finite(Median(values));
    };
    listing.rows.push_back({method, sum.motions, sum.per_stance_s.size(), median(sum.per_stance_s), median(sum.greedy),
                            median(sum.reduced)});
  }
  return listing;
}

}  // namespace legopt::client
