#include "legopt/worldgen/internal/generation_record.h"

#include <nlohmann/json.hpp>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/input/json.h"

namespace legopt::worldgen {

using OrderedJson = nlohmann::ordered_json;

std::string DescribeGeneration(const DatasetOptions& options, const ProbeOptions& probe,
                               const PlannerOptions& planner) {
  const PairOptions pairs;
  OrderedJson root;
  root["format"] = "legopt-generation/1";
  root["seed"] = options.seed;
  if (options.proven) {
    root["proven_stances"] = HashFile(*options.proven);
  } else {
    root["stances"] = options.stances;
  }
  root["plans"] = {{"same_floor", options.same_floor},
                   {"different_floors", options.different_floors.value_or(DatasetOptions::kDifferentFloors)}};
  root["postures"] = options.postures;
  if (options.certified) root["certified"] = true;
  root["stance"] = {
      {"slope_rad", probe.slope_rad},     {"support_m", probe.support_m},
      {"clearance_m", probe.clearance_m}, {"reach_m", probe.reach_m},
      {"step_m", probe.step_m},           {"trunk_m", {probe.trunk_m.x(), probe.trunk_m.y(), probe.trunk_m.z()}},
      {"trunk_low_m", probe.trunk_low_m}};
  root["planner"] = {{"forward_m", planner.forward_m},
                     {"sideways_m", planner.sideways_m},
                     {"turn_rad", planner.turn_rad},
                     {"grid_m", planner.grid_m},
                     {"headings", planner.headings},
                     {"slides_m", planner.slides_m},
                     {"lengths_for_reach_m", ProbeOptions().reach_m},
                     {"height_cost", planner.height_cost},
                     {"turn_cost", planner.turn_cost},
                     {"first_epsilon", planner.first_epsilon},
                     {"epsilon_step", planner.epsilon_step},
                     {"max_expansions", planner.max_expansions},
                     {"extra_expansions", planner.extra_expansions}};
  root["pairs"] = {{"most", pairs.max_pairs}, {"same_m", pairs.same_m}, {"different_m", pairs.different_m}};
  return Dump(root, 1) + "\n";
}

}  // namespace legopt::worldgen
