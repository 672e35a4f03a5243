#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "bus/spec_limits.h"
#include "db/records.h"

namespace legopt::server {

/// An experiment as a client submits it, checked. Jobs are ordered by method, task, initialisation, problem,
/// repetition.
struct ExperimentSpec {
  struct TaskProblems {
    Task task{};
    std::vector<int> problems;       ///< ids in the dataset, no duplicates
    std::vector<int> waypoints;      ///< of each problem
    std::int64_t wall_limit_us = 0;  ///< of one solve; (0, 7 days]
    std::int64_t effort_limit = 0;   ///< of one solve, in term evaluations; 0: none was told
  };

  std::string name;
  std::string submitter;  ///< who shares the workers with others under this name; empty: nobody said
  std::int64_t seed = 0;
  int repetitions = 1;
  db::DatasetRecord dataset;
  std::vector<TaskProblems> tasks;
  std::vector<Initialization> initializations;
  BuildRule builds = BuildRule::kOne;  ///< who may finish it
  Rule rule = Rule::kSolid;            ///< rule by which its results are counted
  bool again = false;                  ///< all is solved, whatever finished results of equal jobs there are
  std::vector<db::MethodRecord> methods;
  std::int64_t memory_limit_bytes = 0;  ///< of one job child; [64 MiB, 1 TiB]
  int max_attempts = 3;                 ///< 1 - 100
  std::string canonical_json;           ///< sorted keys, no white space
  std::string hash;                     ///< 64 hex digits, BLAKE2b-256 of canonical_json

  std::int64_t num_jobs() const;
};

/// The spec is not what lcmtypes/PROTOCOL.md describes. `what()` names the key, its value and the range.
class SpecError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Most jobs that one experiment may have.
inline constexpr std::int64_t kMaxJobsPerExperiment = bus::spec_limits::kMostJobs;

/// Throws SpecError. Every key is required but "max_attempts", "submitter", "builds", "again", "split", "rule",
/// "joint_names" and "limits.effort_limit"; an unknown key is an error.
ExperimentSpec ParseSpec(std::string_view text);

/// What one job is, from its index in the experiment's order (0 <= index < num_jobs()).
struct JobCoordinates {
  std::size_t method, task, initialization, problem, repetition;  ///< indices into the spec
};
JobCoordinates CoordinatesOf(const ExperimentSpec& spec, std::int64_t index);

}  // namespace legopt::server
