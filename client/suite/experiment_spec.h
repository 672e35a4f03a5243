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

/// What the spec must know about a dataset.
struct DatasetFacts {
  struct Problem {
    int id;
    int waypoints;
  };
  std::string name;
  std::string hash;                           ///< 64 hex digits
  Per<Task, std::vector<Problem>> problems;   ///< in file order
  std::vector<std::string> joint_names = {};  ///< of the robot, in the order of a solution; empty: not told
};

DatasetFacts FactsOf(const Dataset& dataset);

/// The canonical experiment description that the server accepts and expands into jobs (spec_version 1): object keys are
/// sorted, every default is written out, problems are explicit. Equal experiments have equal text.
///
/// `left_out`, if given, gets a sentence for each task that loses problems to `max_stances`, all of them or some.
/// Throws `InputError` when a problem is not in the dataset, a task has no problems there, or nothing is left.
nlohmann::json BuildSpec(const Suite& suite, const DatasetFacts& dataset, std::vector<std::string>* left_out = nullptr);

/// Whose experiments these are, for those who share the workers: LEGOPT_SUBMITTER where it is set (it may be empty),
/// else the login name. Throws `InputError` when it is not UTF-8 of at most 200 bytes.
std::string SubmitterName();

/// Number of jobs that the server will make of a spec:
/// methods x initializations x problems of all tasks x repetitions.
std::int64_t CountJobs(const nlohmann::json& spec);

/// Identity of a submission: BLAKE2b-128 of the spec's text, its submitter included, 32 hex digits, so that one who
/// submits the same experiment again finds the one that exists.
std::string ContentSubmissionId(const nlohmann::json& spec);

/// A random identity (32 hex digits) for an experiment that shall be made anew.
std::string RandomSubmissionId();

}  // namespace legopt::client
