#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "legopt/types/check.h"
#include "legopt/types/result.h"
#include "tests/temporary_folder.h"

namespace legopt::client {

using test::TemporaryFolder;

/// One job of a made-up experiment, with its result.
struct TestResult {
  int method = 0;  ///< index into TestExperiment::methods
  std::string initialization = "good";
  int problem = 0;
  std::string verdict = "success";
  double cost = 400.0;
  std::int64_t wall_us = 1500;
  std::vector<Eigen::VectorXd> waypoints = {};
  bool finished = true;  ///< false: stays queued
  std::vector<std::uint8_t> trace = {};
  bool dead = false;  ///< its only attempt was killed by signal 11
  int repetition = 0;
  std::int64_t cpu_us = -1;                    ///< negative: same as wall_us
  std::int64_t work_ns = 0;                    ///< 0: not counted
  std::int64_t switches = 0;                   ///< involuntary context switches
  SolveStatus status = SolveStatus::kNotRun;   ///< kNotRun: derived from the verdict
  std::vector<Eigen::VectorXd> unsolved = {};  ///< best point of a second window, with verdict "window_unsolved"
  int first_unsolved = 0;                      ///< index of that window's first waypoint
  std::vector<Violation> violations = {};      ///< largest values of the judge's checks
  std::int64_t starts = 0;                     ///< number of initial points; 0: not counted
};

struct TestMethod {
  std::string name;
  int multi_starts = 0;
  std::string collision = "solid";
  std::string options = "{}";  ///< canonical form of the method, as text
  int copy_of = -1;            ///< index of an earlier method with the same options; -1: none
};

struct TestExperiment {
  std::string name = "test";
  std::string dataset_name = "tiny";
  std::string dataset_hash = std::string(64, 'a');
  std::vector<TestMethod> methods = {{"SQP", 0}};
  std::string task = "posture";
  int num_waypoints = 1;            ///< number of waypoints of every problem
  std::vector<TestResult> results;  ///< no two for the same method, initialization, problem and repetition
  std::string build_id = "0123456789ab";
  std::int64_t wall_limit_us = 1'000'000;
  std::int64_t effort_limit = 0;  ///< effort limit of every job; 0: none
  Rule rule = Rule::kSolid;
  std::string text;  ///< if given, used for all texts that a worker sends: name, host, build, detail, message, log
};

/// Writes a database through the real store: experiment 1, one task, one job per result in order of `results` grouped
/// by cell.
void WriteTestDatabase(const std::filesystem::path& file, const TestExperiment& experiment);

/// Changes a database, bypassing the trigger of this name, if any, that forbids the change. The trigger is restored.
void AlterDatabase(const std::filesystem::path& file, const std::string& trigger, const std::string& change);

}  // namespace legopt::client
