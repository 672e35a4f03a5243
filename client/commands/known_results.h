#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/commands/submission.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// What a submission would find of results that are there already.
struct KnownResults {
  struct OfBuild {
    std::string build_id;
    std::int64_t jobs = 0;  ///< for which this build has a finished result
  };
  std::optional<std::int64_t> experiment;  ///< of the same content, submitted before: nothing would be begun
  std::int64_t jobs = 0;                   ///< with a finished result of any build
  std::vector<OfBuild> builds;             ///< most jobs first; an experiment takes over from the one that finishes it
  bool any_build = false;                  ///< it takes over from all of them
  bool again = false;                      ///< all shall be solved anew, so that nothing is looked for
  bool truncated = false;                  ///< there are more than one query may tell
};

/// `source` may be null: nothing is known then. By the rules of the server (docs/database.md, "Taken over").
KnownResults FindKnownResults(const Submission& submission, ResultSource* source);

/// "40 of 60 jobs have a finished result of build 0f3c12ab34cd and take it over", for people.
std::string KnownResultsText(const KnownResults& known, std::int64_t num_jobs);

/// {"experiment", "again", "jobs", "any_build", "truncated", "builds": [{"build_id", "jobs"}]}
nlohmann::ordered_json KnownResultsJson(const KnownResults& known);

}  // namespace legopt::client
