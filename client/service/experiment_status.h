#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "words/job.h"
#include "words/result.h"
#include "words/task.h"

namespace legopt::client {

/// How far a running job is.
struct RunningJob {
  std::int64_t job = 0;
  Task task{};
  std::int64_t worker = 0;
  std::int64_t done = 0, total = 0;  ///< windows where the task is solved by windows, else attempts

  bool operator==(const RunningJob&) const = default;
};

/// How far an experiment has come, as the server tells it.
struct ExperimentStatus {
  std::int64_t id = 0;
  std::string name;
  ExperimentState state = ExperimentState::kActive;
  std::int64_t total = 0;       ///< jobs; the six counts below add up to it
  std::int64_t queued = 0;      ///< wait for a worker
  std::int64_t leased = 0;      ///< are being worked on
  std::int64_t done = 0;        ///< have their result, whatever the verdict
  std::int64_t failed = 0;      ///< cannot run
  std::int64_t dead = 0;        ///< used up their attempts
  std::int64_t cancelled = 0;   ///< withdrawn
  Rule rule = Rule::kSolid;     ///< rule by which results are counted
  std::int64_t solved = 0;      ///< successes by `rule`, among `done`
  std::int64_t taken_over = 0;  ///< of `done`: results that jobs of other experiments made

  Hold hold = Hold::kNone;
  std::string hold_reason;  ///< when held
  int priority = 0;         ///< larger begins earlier

  std::vector<RunningJob> running;  ///< of `leased`: those that told their progress

  BuildRule builds = BuildRule::kOne;
  std::string build_id;  ///< that finishes it; empty: not begun, or not told

  std::string submitter;  ///< who submitted it; empty: not told
  std::string dataset;
  std::vector<std::string> methods, tags;
  double share = 0;             ///< of the slots that work at the moment, 0 .. 1
  std::optional<double> eta_s;  ///< seconds until its end; none while it stands still or too little is known
  std::string waiting_for;      ///< why an active one stands still; empty: it moves

  std::vector<std::string> missing;  ///< messages about capabilities that every worker lacks

  std::string spec_hash;             ///< of its content
  std::int64_t submitted_at_us = 0;  ///< since 1970, by the server's clock
  double elapsed_s = 0;              ///< since its submission, until its end if it is over
  std::optional<double> worked_s;    ///< of these, a job of it was leased; none when the server has forgotten

  std::int64_t finished() const { return done + failed + dead + cancelled; }
  bool over() const { return state != ExperimentState::kActive; }
};

/// Whether a reader would see a difference: everything but times and what is estimated from them.
bool SameProgress(const ExperimentStatus& a, const ExperimentStatus& b);

/// Reads the experiments of a status reply. Throws ClientError (kInternal) when the text is not what a server sends.
std::vector<ExperimentStatus> ParseExperiments(const nlohmann::json& status);

/// "active", "done", "cancelled", or what keeps an active one back: "paused", "held: the reason".
std::string StateText(const ExperimentStatus& status);

/// What the server says about a database that it cannot write at the moment; empty when all is well.
std::string StoreError(const nlohmann::json& status);

/// Parses the text of a status reply; same error.
nlohmann::json ParseStatusText(const std::string& text);

}  // namespace legopt::client
