#include "client/report/timing_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "client/report/motion_path.h"
#include "client/report/solution_items.h"
#include "legopt/math/parallel.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
std::vector<TimedSolution> TimeSolutions(const SolutionFile& file, const Dataset& dataset, int threads) {
  if (!DescriptionOf(file.task).windowed) {
    throw InputError({.file = file.path,
                      .field = "task",
                      .value = std::string(ToString(file.task)),
                      .message = "is a task of postures, which have no duration",
                      .fix = "give a file of motions"});
  }
  const std::vector<SolutionItem> items = SolutionItems(file, dataset);
  std::vector<std::unique_ptr<MotionTimer>> timers;
  for (int k = 0; k < threads; ++k) timers.push_back(std::make_unique<MotionTimer>(dataset));
  std::vector<TimedSolution> timed(items.size());
  ForEachIndex(threads, items.size(), [&](int worker, size_t i) {
    const auto& [problem, solution] = items[i];
    const MotionPath motion = ReadMotionPath(file.task, *problem, *solution, dataset.robot().configuration_size());
    timed[i] = {.method = solution->method,
                .problem_id = problem->id,
                .num_stances = static_cast<int>(problem->stances.size()),
                .fault = motion.fault,
                .timing = {}};
    if (!timed[i].fault.empty()) return;
    try {
      timed[i].timing =
          timers[static_cast<size_t>(worker)]->Compute(motion.stances, motion.path.times, motion.path.points);
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
    std::vector<nlohmann::json> values = {FiniteOrNull(timing.shortest_s),
                                          FiniteOrNull(timing.shortest_s / solution.num_stances),
                                          timing.optimal,
                                          FiniteOrNull(timing.greedy_s),
                                          FiniteOrNull(timing.uniform_s),
                                          FiniteOrNull(timing.reduced_s)};
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
    listing.rows.push_back({method, sum.motions, sum.per_stance_s.size(), MedianOrNull(sum.per_stance_s),
                            MedianOrNull(sum.greedy), sum.reduced.size(), MedianOrNull(sum.reduced)});
  }
  return listing;
}

}  // namespace legopt::client
