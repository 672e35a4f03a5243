#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "db/store.h"
#include "tests/temporary_folder.h"

namespace legopt::db {

using test::TemporaryFolder;

inline std::string HashOf(char digit) { return std::string(64, digit); }

/// Returns one method, posture from both initializations, `num_problems` problems: 2 * num_problems jobs.
inline NewExperiment SampleExperiment(std::int64_t experiment_id, std::int64_t first_job_id, std::int64_t first_cell_id,
                                      int num_problems = 2) {
  NewExperiment e;
  e.experiment_id = experiment_id;
  e.submission_id = "submission-" + std::to_string(experiment_id);
  e.name = "sample";
  e.spec_json = "{}";
  e.spec_hash = HashOf('c');
  e.seed = 1;
  e.wall_limit_us = 60'000'000;
  e.memory_limit_bytes = 1 << 30;
  e.submitted_at_us = 1000;
  e.dataset = {"garage", HashOf('d')};
  e.methods = {{"SQP", HashOf('a'), R"({"solver":"sqp"})", 0, 100, false}};
  for (int i = 0; i < num_problems; ++i) e.problems.push_back({Task::kPosture, i, 1});
  e.cells = {{first_cell_id, 0, Task::kPosture, Initialization::kGood, num_problems},
             {first_cell_id + 1, 0, Task::kPosture, Initialization::kInCollision, num_problems}};
  for (int cell = 0; cell < 2; ++cell) {
    for (int i = 0; i < num_problems; ++i) e.jobs.push_back({first_job_id++, cell, i, 0});
  }
  return e;
}

inline WorkerRecord SampleWorker(std::int64_t worker_id) {
  return {worker_id,
          1000 + worker_id,
          std::string("w").append(std::to_string(worker_id)),
          "host",
          42,
          2,
          "test build",
          "0123456789ab",
          "some processor",
          2,
          std::int64_t{1} << 30,
          0.5,
          5};
}

inline ResultRecord SampleResult(double cost = 400) {
  ResultRecord r;
  r.solver_status = SolveStatus::kConvergedFeasible;
  r.iterations = 12;
  r.wall_us = 2000;
  r.cpu_us = 1900;
  r.verdict_literal = Verdict::kSuccess;
  r.verdict_strict = Verdict::kSuccess;
  r.verdict_solid = r.verdict_physical = Verdict::kSuccess;
  r.cost = cost;
  r.waypoint_size = 3;
  r.waypoints = {1.5, -2.25, 1e-300};
  r.violations = {{Verdict::kFootPose, Rule::kLiteral, 0, "l_foot", 1e-4},
                  {Verdict::kContainment, Rule::kSolid, 0, "", 0.0},
                  {Verdict::kStep, Rule::kSolid, 0, "", 0.0}};
  return r;
}

}  // namespace legopt::db
