#include "tests/simulation/experiment_text.h"

#include <nlohmann/json.hpp>

namespace legopt::simulation {
namespace {

nlohmann::json Task(const char* name, int num_problems) {
  auto problems = nlohmann::json::array();
  auto waypoints = nlohmann::json::array();
  for (int i = 0; i < num_problems; ++i) {
    problems.push_back(i);
    waypoints.push_back(1);
  }
  return {{"task", name}, {"problems", problems}, {"waypoints", waypoints}};
}

}  // namespace

std::string ExperimentText(const std::string& name, int num_problems, double wall_limit_s, bool motions, bool again,
                           bool external) {
  const int num_motions = motions ? num_problems / 3 : 0;
  auto tasks = nlohmann::json::array({Task("posture", num_problems - num_motions)});
  if (num_motions > 0) tasks.push_back(Task("motion", num_motions));
  nlohmann::json method = {
      {"name", "SQP"},     {"hash", std::string(64, 'a')}, {"options", {{"name", "SQP"}, {"solver", "sqp"}}},
      {"multi_starts", 0}, {"sample_size", 100},           {"incremental", false}};
  if (external) {
    method["name"] = "mine (external)";
    method["hash"] = std::string(64, kExternalMethodDigit);
    method["options"] = {{"name", "mine (external)"},
                         {"solver", kExternalSolver},
                         {"options", {{"declaration", std::string(64, kSolverDigit)}}}};
  }
  nlohmann::json spec{{"spec_version", 1},
                      {"name", name},
                      {"seed", 7},
                      {"repetitions", 1},
                      {"dataset", {{"name", "garage"}, {"hash", std::string(64, 'd')}}},
                      {"tasks", tasks},
                      {"initializations", {"good"}},
                      {"methods", {method}},
                      {"limits", {{"wall_time_s", wall_limit_s}, {"memory_mb", 1024}}},
                      {"max_attempts", 3}};
  if (again) spec["again"] = true;
  return spec.dump();
}

}  // namespace legopt::simulation
