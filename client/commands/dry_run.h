#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/commands/submission.h"
#include "client/report/result_source.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// The jobs of one method of a spec on one task, and their cost in earlier results.
struct KnownCost {
  std::string method_hash;
  Task task{};
  std::int64_t jobs = 0;
  std::optional<double> job_cpu_s;  ///< mean CPU time of a job with the same options; nullopt without results
  bool same_dataset = false;        ///< results are on the spec's dataset; false: on others
};

/// Returns an element for every method and task of a canonical spec, in its order. `source` may be nullptr: then no
/// costs are known.
std::vector<KnownCost> FindKnownCosts(const nlohmann::json& spec, ResultSource* source);

/// Earlier results that a submission could reuse.
struct KnownResults {
  struct OfBuild {
    std::string build_id;
    std::int64_t jobs = 0;  ///< number of jobs for which this build has a finished result
  };
  std::optional<std::int64_t> experiment;  ///< earlier submission with the same content; nothing would be started
  std::int64_t jobs = 0;                   ///< number of jobs with a finished result of any build
  std::vector<OfBuild> builds;             ///< most jobs first; an experiment reuses results of the build that finishes
                                           ///< it
  bool any_build = false;                  ///< results of all builds are reused
  bool again = false;                      ///< all jobs are solved again, so no results are searched
  bool truncated = false;                  ///< there are more results than a query returns
};

/// Searches for reusable results by the server's rules (docs/reference/database.md, "Taken over"). `source` may be
/// nullptr: then no results are known.
KnownResults FindKnownResults(const Submission& submission, ResultSource* source);

/// Returns e.g. "40 of 60 jobs have a finished result of build 0f3c12ab34cd and take it over".
std::string KnownResultsText(const KnownResults& known, std::int64_t num_jobs);

/// Returns {"experiment", "again", "jobs", "any_build", "truncated", "builds": [{"build_id", "jobs"}]}.
nlohmann::ordered_json KnownResultsJson(const KnownResults& known);

/// Prints the output of --dry-run on standard output: dataset, jobs of each method and task with their expected CPU
/// time, omitted problems, the number of reusable results, and the longest possible solving time, with every job at its
/// time limit. `known`: source of earlier results; may be nullptr. `slots`: number of parallel jobs, or 0 if unknown
/// before the pool starts. `outlook`: last sentence, about the action that was not taken.
void PrintDryRun(const Submission& submission, ResultSource* known, int slots, const std::string& outlook);

/// Prints the dry run as JSON: submission_id, jobs, left_out, estimate, known_results, spec.
void PrintDryRunJson(const Submission& submission, ResultSource* known);

}  // namespace legopt::client
