#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "bus/message_limits.h"
#include "db/records.h"

namespace legopt::server {

/// A validated experiment specification. Jobs are ordered by method, task, initialization, problem, repetition.
struct ExperimentSpec {
  struct TaskProblems {
    Task task{};
    std::vector<int> problems;       ///< ids in the dataset, no duplicates
    std::vector<int> waypoints;      ///< number of waypoints of each problem
    std::int64_t wall_limit_us = 0;  ///< wall-time limit of a solve; (0, 7 days]
    std::int64_t effort_limit = 0;   ///< effort limit of a solve in term evaluations; 0: none given
  };

  std::string name;
  std::string submitter;  ///< name under which workers are shared with other submitters; may be empty
  std::int64_t seed = 0;
  int repetitions = 1;
  db::DatasetRecord dataset;
  std::vector<TaskProblems> tasks;
  std::vector<Initialization> initializations;
  BuildPolicy builds = BuildPolicy::kOne;  ///< builds that may finish it
  Rule rule = Rule::kSolid;                ///< rule that counts its results
  bool again = false;                      ///< solve all jobs, even if identical jobs have finished results
  std::vector<db::MethodRecord> methods;
  std::int64_t memory_limit_bytes = 0;  ///< limit of a job process; [64 MiB, 1 TiB]
  int max_attempts = 3;                 ///< 1 .. 100
  std::string canonical_json;           ///< sorted keys, no white space
  std::string hash;                     ///< 64 hex digits, BLAKE2b-256 of canonical_json

  std::int64_t num_jobs() const;
};

/// The spec violates lcmtypes/PROTOCOL.md. `what()` names the key, its value and the allowed range.
class SpecError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Maximum number of jobs of an experiment.
inline constexpr std::int64_t kMaxJobsPerExperiment = bus::spec_limits::kMaxJobs;

/// Parses and validates a spec; throws SpecError. All keys are required except "max_attempts", "submitter", "builds",
/// "again", "split", "rule", "joint_names" and "limits.effort_limit"; an unknown key is an error.
ExperimentSpec ParseSpec(std::string_view text);

/// Indices of a job in its spec, computed from its index in the experiment's job order (0 <= index < num_jobs()).
struct JobCoordinates {
  std::size_t method, task, initialization, problem, repetition;
};
JobCoordinates CoordinatesOf(const ExperimentSpec& spec, std::int64_t index);

}  // namespace legopt::server
