#pragma once

#include "client/report/benchmark_table.h"

namespace legopt::client {

inline constexpr BenchmarkColumn kPostureGood = {Task::kPosture, Initialization::kGood};
inline constexpr BenchmarkColumn kPostureHard = {Task::kPosture, Initialization::kInCollision};
inline constexpr BenchmarkColumn kMotionGood = {Task::kMotion, Initialization::kGood};

/// Two methods; the second one has no motions.
inline BenchmarkTable ExampleTable() {
  BenchmarkTable table;
  table.experiment_id = 3;
  table.experiment = "table_1";
  table.dataset = "garage & co";
  table.rule = Rule::kLiteral;
  table.columns = {kPostureGood, kPostureHard, kMotionGood};
  table.rows = {{"SQP",
                 0,
                 100,
                 {{kPostureGood, {35, 35, 34, 396.4999, 0.0014567}},
                  {kPostureHard, {35, 30, 29, 401.5, 0.01236}},
                  {kMotionGood, {35, 35, 12, 0.134, 0.0023}}}},
                {"I-SQP|80%_a&b",
                 10,
                 80,
                 {{kPostureGood, {35, 35, 0, std::nullopt, std::nullopt}}, {kPostureHard, {35, 0, 0, {}, {}}}}}};
  return table;
}

}  // namespace legopt::client
