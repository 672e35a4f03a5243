#pragma once

#include <optional>
#include <string>
#include <vector>

#include "test_database.h"

namespace legopt::client {

/// Adds the results of one method, one per problem from 0: a time in ms, or none if it failed after the full limit.
inline void AddTimes(int method, const std::vector<std::optional<double>>& times_ms, TestExperiment* experiment) {
  for (std::size_t i = 0; i < times_ms.size(); ++i) {
    TestResult result;
    result.method = method;
    result.problem = static_cast<int>(i);
    result.verdict = times_ms[i] ? "success" : "foot_pose";
    result.wall_us = times_ms[i] ? static_cast<std::int64_t>(*times_ms[i] * 1e3) : experiment->wall_limit_us;
    experiment->results.push_back(result);
  }
}

/// Adds the results of one method that solved each problem in 1 ms, with these costs.
inline void AddCosts(int method, const std::vector<double>& costs, TestExperiment* experiment) {
  for (std::size_t i = 0; i < costs.size(); ++i) {
    TestResult result;
    result.method = method;
    result.problem = static_cast<int>(i);
    result.cost = costs[i];
    result.wall_us = 1000;
    experiment->results.push_back(result);
  }
}

/// Returns the toy pool of tests/statistics/toy.h with a limit of 100 ms. C fails most often and looks best if only
/// solved problems are counted.
inline TestExperiment ToyPool() {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {"C"}};
  experiment.wall_limit_us = 100'000;
  AddTimes(0, {1, 2, 4, 8, std::nullopt}, &experiment);
  AddTimes(1, {2, 1, std::nullopt, 4, 16}, &experiment);
  AddTimes(2, {4, 4, 2, std::nullopt, std::nullopt}, &experiment);
  return experiment;
}

/// Returns two methods, A and B, on problems solved by both, then by only one of them, then by neither.
inline TestExperiment Discordant(int both, int only_a, int only_b, int neither) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  std::vector<std::optional<double>> a, b;
  const auto add = [&](int count, std::optional<double> of_a, std::optional<double> of_b) {
    a.insert(a.end(), static_cast<std::size_t>(count), of_a);
    b.insert(b.end(), static_cast<std::size_t>(count), of_b);
  };
  add(both, 2, 2);
  add(only_a, 2, std::nullopt);
  add(only_b, std::nullopt, 2);
  add(neither, std::nullopt, std::nullopt);
  AddTimes(0, a, &experiment);
  AddTimes(1, b, &experiment);
  return experiment;
}

}  // namespace legopt::client
