#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "legopt/types/check.h"
#include "legopt/types/job.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// Progress of a running job.
struct RunningJob {
  std::int64_t job = 0;
  Task task{};
  std::int64_t worker = 0;
  std::int64_t done = 0, total = 0;  ///< windows if the task is solved by windows, else attempts

  bool operator==(const RunningJob&) const = default;
};

/// Progress of an experiment, as reported by the server.
struct ExperimentStatus {
  std::int64_t id = 0;
  std::string name;
  ExperimentState state = ExperimentState::kActive;
  std::int64_t total = 0;   ///< number of jobs; sum of the six counts below
  std::int64_t queued = 0;  ///< wait for a worker
  std::int64_t leased = 0;  ///< are running
  std::int64_t done = 0;    ///< have a result, whatever the verdict
  std::int64_t failed = 0;  ///< cannot run
  std::int64_t dead = 0;    ///< used up their attempts
  std::int64_t cancelled = 0;
  Rule rule = Rule::kSolid;     ///< rule that counts its results
  std::int64_t solved = 0;      ///< number of successes by `rule` among `done`
  std::int64_t taken_over = 0;  ///< number of results in `done` that were reused from other experiments

  ExperimentHold hold = ExperimentHold::kNone;
  std::string hold_reason;  ///< reason of the pause; may be empty
  int priority = 0;         ///< larger numbers are leased first

  std::vector<RunningJob> running;  ///< leased jobs with reported progress

  BuildPolicy builds = BuildPolicy::kOne;
  std::string build_id;  ///< build that finishes it; empty: not started, or unknown

  std::string submitter;  ///< empty if unknown
  std::string dataset;
  std::vector<std::string> methods, tags;
  double share = 0;             ///< share of the busy slots, 0 .. 1
  std::optional<double> eta_s;  ///< estimated seconds until its end; nullopt while it stalls or too little is known
  std::string waiting_for;      ///< why an active experiment stalls; empty while it progresses

  std::vector<std::string> missing;  ///< messages about capabilities that every worker lacks

  std::string spec_hash;
  std::int64_t submitted_at_us = 0;  ///< microseconds since 1970, server clock
  double elapsed_s = 0;              ///< time since its submission, or until its end if it is over
  std::optional<double> worked_s;    ///< time during which a job was leased; nullopt if the server no longer stores it

  std::int64_t finished() const { return done + failed + dead + cancelled; }
  bool over() const { return state != ExperimentState::kActive; }
};

/// Returns whether both have equal contents, except times and estimates.
bool SameProgress(const ExperimentStatus& a, const ExperimentStatus& b);

/// Parses the experiments of a status reply. Throws ClientError (kInternal) if the JSON is not a status reply.
std::vector<ExperimentStatus> ParseExperiments(const nlohmann::json& status);

/// Returns "active", "done", "cancelled", or why an active experiment is not worked on: "paused", "held: the reason".
std::string StateText(const ExperimentStatus& status);

/// Returns the server's message about a database that it cannot write; empty if there is no error.
std::string StoreError(const nlohmann::json& status);

/// Parses the text of a status reply. Throws ClientError (kInternal) if it is invalid.
nlohmann::json ParseStatusText(const std::string& text);

}  // namespace legopt::client
