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
                      .message = "is a task of postures, which have no duration",
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
  listing.columns = {"method",     "problem",    "stances",     "duration_s",  "s_per_stance", "optimal",
                     "greedy_s",   "uniform_s",  "reduced_s",   "velocity",    "torque",       "contact",
                     "blocked_at", "blocked_by", "grid_points", "grid_change", "fault"};
  for (const TimedSolution& solution : solutions) {
    std::vector<nlohmann::json>& row = listing.rows.emplace_back();
    row = {solution.method, solution.problem_id, solution.num_stances};
    row.resize(listing.columns.size());
    if (!solution.fault.empty()) {
      row.back() = solution.fault;
      continue;
    }
    const MotionTiming& timing = solution.timing;
    std::vector<nlohmann::json> values = {Finite(timing.shortest_s),
                                          Finite(timing.shortest_s / solution.num_stances),
                                          timing.optimal,
                                          Finite(timing.greedy_s),
                                          Finite(timing.uniform_s),
                                          Finite(timing.reduced_s)};
    if (std::isfinite(timing.shortest_s)) {
      values.insert(values.end(),
                    {timing.limits.velocity, timing.limits.torque, timing.limits.contact, nullptr, nullptr});
    } else {
      values[2] = nullptr;
      values.insert(values.end(), {nullptr, nullptr, nullptr, timing.blocked_at, timing.blocked_by});
    }
    values.insert(values.end(), {timing.grid_points, timing.grid_change});
    std::ranges::copy(values, row.begin() + 3);
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
    if (!(solution.timing.shortest_s > 0.0)) continue;  // a motion at rest has no ratios
    sum.greedy.push_back(solution.timing.greedy_s / solution.timing.shortest_s);
    if (std::isfinite(solution.timing.reduced_s)) {
      sum.reduced.push_back(solution.timing.reduced_s / solution.timing.shortest_s);
    }
  }
  Listing listing;
  listing.columns = {"method",
                     "motions",
                     "executable",
                     "median_s_per_stance",
                     "median_greedy_ratio",
                     "executable_reduced",
                     "median_reduced_ratio"};
  for (const auto& [method, sum] : sums) {
    const auto median = [](const std::vector<double>& values) {
      return values.empty() ? nlohmann::json() : Finite(Median(values));
    };
    listing.rows.push_back({method, sum.motions, sum.per_stance_s.size(), median(sum.per_stance_s), median(sum.greedy),
                            sum.reduced.size(), median(sum.reduced)});
  }
  return listing;
}

}  // namespace legopt::client
