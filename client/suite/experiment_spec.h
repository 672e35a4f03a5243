#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/suite/suite.h"

namespace legopt {
class Dataset;
}

namespace legopt::client {

/// Properties of a dataset that the spec requires.
struct DatasetFacts {
  struct Problem {
    int id;
    int waypoints;
  };
  std::string name;
  std::string hash;                                ///< 64 hex digits
  EnumArray<Task, std::vector<Problem>> problems;  ///< ordered as in the file
  std::vector<std::string> joint_names = {};       ///< joint names of the robot, in the order of a solution; empty if
                                                   ///< unknown
};

DatasetFacts FactsOf(const Dataset& dataset);

/// Returns the canonical experiment spec that the server expands into jobs (spec_version 1): keys are sorted, defaults
/// and problems are explicit. Equal experiments have equal text.
///
/// `left_out`, if given, receives a sentence for each task that loses some or all problems to `max_stances`. Throws
/// `InputError` if a problem is not in the dataset, a task has no problems there, or no problems remain.
nlohmann::json BuildSpec(const Suite& suite, const DatasetFacts& dataset, std::vector<std::string>* left_out = nullptr);

/// Returns the submitter with whom workers are shared: LEGOPT_SUBMITTER if set (it may be empty), else the login name.
/// Throws `InputError` if it is not UTF-8 of at most 200 bytes.
std::string SubmitterName();

/// Returns the number of jobs in a spec: methods x initializations x problems of all tasks x repetitions.
std::int64_t CountJobs(const nlohmann::json& spec);

/// Returns the content-based id of a submission: BLAKE2b-128 of the spec's text including its submitter, 32 hex digits.
/// Submitting the same experiment again finds the existing one.
std::string ContentSubmissionId(const nlohmann::json& spec);

/// Returns a random id (32 hex digits), which creates a new experiment in any case.
std::string RandomSubmissionId();

}  // namespace legopt::client
