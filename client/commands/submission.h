#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/commands/options.h"

namespace legopt::client {

/// An experiment ready to be submitted.
struct Submission {
  std::string id;       ///< derived from the content, random with --again
  nlohmann::json spec;  ///< canonical
  std::int64_t num_jobs = 0;
  std::vector<std::string> left_out;     ///< problems that `max_stances` took away, a sentence for each task
  bool surprising = false;               ///< they were asked for by --problems, or a whole task went with them
  std::filesystem::path dataset_folder;  ///< what workers on this machine need
};

/// Records where the submission's dataset is, for later commands that read its results (submitted_datasets.h).
void RecordDataset(const Submission& submission);

/// Says on standard error what was left out, if that is surprising.
void WarnOfLosses(const Submission& submission);

/// Reads the suite, applies the filters, loads the dataset and builds the spec. Warns on standard error about what is
/// hardly meant in the dataset (plausibility.h). Throws InputError or ClientError;
/// nothing is sent.
Submission PrepareSubmission(const SuiteOptions& options);

/// "80 jobs: 2 methods x 2 initializations x 20 problems of a task x 1 repetition" for people.
std::string DescribeJobs(const nlohmann::json& spec);

}  // namespace legopt::client
