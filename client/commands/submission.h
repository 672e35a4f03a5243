#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/commands/options.h"

namespace legopt::client {

/// An experiment ready for submission.
struct Submission {
  std::string id;       ///< derived from the content, random with --again
  nlohmann::json spec;  ///< canonical form
  std::int64_t num_jobs = 0;
  std::vector<std::string> left_out;     ///< a sentence for each task with problems removed by `max_stances`
  bool surprising = false;               ///< removed problems were requested by --problems, or all problems of a task
                                         ///< were removed
  std::filesystem::path dataset_folder;  ///< required by workers on this machine
};

/// Records the location of the submission's dataset for later commands that read its results (result_dataset.h).
void RecordDataset(const Submission& submission);

/// Warns on standard error about omitted problems if that is surprising.
void WarnAboutOmittedProblems(const Submission& submission);

/// Reads the suite, applies the filters, loads the dataset and builds the spec. Warns on standard error about
/// implausible values in the dataset (dataset_check.h). Throws InputError or ClientError; sends nothing.
Submission PrepareSubmission(const SuiteOptions& options);

/// Returns e.g. "80 jobs: 2 methods x 2 initializations x 20 problems of a task x 1 repetition".
std::string DescribeJobs(const nlohmann::json& spec);

}  // namespace legopt::client
