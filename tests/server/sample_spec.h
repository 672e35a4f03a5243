#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tests/db/store_samples.h"

namespace legopt::server {

using db::HashOf;

inline nlohmann::json MethodJson(const std::string& name, char digit) {
  return {
      {"name", name},      {"hash", HashOf(digit)}, {"options", {{"name", name}, {"solver", std::string(1, digit)}}},
      {"multi_starts", 0}, {"sample_size", 100},    {"incremental", false}};
}

/// Returns a specification of postures, good initialization, problems 0 .. num_problems - 1, one method: num_problems
/// jobs.
inline nlohmann::json SampleSpec(int num_problems = 4) {
  auto problems = nlohmann::json::array(), waypoints = nlohmann::json::array();
  for (int i = 0; i < num_problems; ++i) {
    problems.push_back(i);
    waypoints.push_back(1);
  }
  return {{"spec_version", 1},
          {"name", "sample"},
          {"seed", 7},
          {"repetitions", 1},
          {"dataset", {{"name", "garage"}, {"hash", HashOf('d')}}},
          {"tasks", {{{"task", "posture"}, {"problems", problems}, {"waypoints", waypoints}}}},
          {"initializations", {"good"}},
          {"methods", {MethodJson("SQP", 'a')}},
          {"limits", {{"wall_time_s", 60}, {"memory_mb", 1024}}},
          {"max_attempts", 3}};
}

}  // namespace legopt::server
