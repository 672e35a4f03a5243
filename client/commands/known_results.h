#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/commands/submission.h"
#include "client/report/result_source.h"

namespace legopt::client {

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

}  // namespace legopt::client
