#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/client_error.h"
#include "client/report/progress.h"
#include "client/service/experiment_status.h"
#include "client/service/server_connection.h"

namespace legopt::client {

/// Detects a server that cannot write its database (full disk, I/O error). Such a server acknowledges and leases
/// nothing, loses no data, and resumes when it can write again.
class StoreOutageMonitor {
 public:
  static constexpr Seconds kPatience{600};

  /// Checks a status reply; reports on standard error when the trouble begins and ends. `view` may be nullptr. Throws
  /// ClientError (kDatabaseUnusable) if it lasts longer than kPatience.
  void Look(const nlohmann::json& status, WatchView* view);
  /// Throws ClientError (kDatabaseUnusable) during the trouble; for callers that stop waiting.
  void ThrowIfAny() const;

 private:
  std::string error_;
  std::chrono::steady_clock::time_point since_;
};

/// Limits the silence of a server that has answered before. Times are any monotonic time.
class ServerPatience {
 public:
  /// `first`: time of its last answer; nullopt: never, then the first timeout is an error.
  ServerPatience(Seconds patience, std::optional<Seconds> first) : patience_(patience), answered_(first) {}

  /// Records an answer.
  void Answered(Seconds now, WatchView& view);
  /// Records that a call timed out with `error`. Throws it if the server has never answered, and a ClientError
  /// (kUnreachable) if it has not answered for `patience`.
  void Silent(Seconds now, const ClientError& error, WatchView& view);

 private:
  Seconds patience_;
  std::optional<Seconds> answered_;
  bool silent_ = false;
};

/// Ends a wait without progress. Progress means that a slot works on the experiment or a job ends; pauses, holds and a
/// database that cannot be written are not progress. Times are as in ServerPatience.
class StallTimeout {
 public:
  /// Throws after `give_up` without progress; nullopt: never.
  explicit StallTimeout(std::optional<Seconds> give_up) : give_up_(give_up) {}

  /// Checks the experiment. Throws ClientError (kNoProgress) with the reason for the stall.
  void Look(Seconds now, const ExperimentStatus& status);

 private:
  std::optional<Seconds> give_up_;
  std::optional<Seconds> moved_;  // time of the last progress
  std::int64_t finished_ = -1;
};

/// Verifies that the id still refers to the same experiment after a server restart.
class WatchedExperiment {
 public:
  WatchedExperiment(std::int64_t id, std::string address) : id_(id), address_(std::move(address)) {}

  /// Returns the watched experiment of a status reply, a JSON object. Throws ClientError: kUsage if the server never
  /// had it, kDatabaseUnusable if it disappeared or the id now refers to another experiment.
  ExperimentStatus Find(const nlohmann::json& reply);

 private:
  std::int64_t id_;
  std::string address_;
  std::optional<std::pair<std::string, std::int64_t>> identity_;  // content hash and time of submission
};

struct WatchOptions {
  static constexpr double kDefaultPatience_s = 600;

  Seconds patience{kDefaultPatience_s};  ///< maximum silence of a server that has answered before
  bool has_answered = false;             ///< the server has just answered
  std::function<void()> tick = {};       ///< called between two status calls, e.g. to supervise children
  bool own_workers = false;              ///< the workers are children of this process: while none is connected, they
                                         ///< are loading
  std::optional<Seconds> give_up = {};   ///< maximum time without progress or without an answer
};

/// Returns why an experiment waits, if this process is starting its workers: they load the dataset.
std::string ReasonWithOwnWorkers(const ExperimentStatus& status, const nlohmann::json& reply);

/// Polls and shows an experiment until it is over; returns its last status. Continues after a server restart (the
/// errors of ServerPatience, WatchedExperiment and StallTimeout end it). Under an InterruptGuard an interruption
/// throws ClientError (kInterrupted) immediately. Reports a database that the server cannot write; then an
/// interruption, or ten minutes in this state, throw kDatabaseUnusable.
ExperimentStatus WatchExperiment(ServerConnection& server, std::int64_t experiment_id, WatchView& view,
                                 const WatchOptions& options = {});

/// Watches an experiment on standard error and prints the final line.
ExperimentStatus WatchOnTerminal(ServerConnection& server, std::int64_t experiment_id,
                                 const WatchOptions& options = {});

/// Returns the exit code for the end of an experiment: kJobsFailed if jobs died or failed, kInterrupted if it was
/// cancelled.
ExitCode OutcomeOf(const ExperimentStatus& status);

/// Returns a sentence on dead and failed jobs and how to inspect them; empty if there are none. `source_flags`: see
/// ResultSource::flags().
std::string FailureHint(const ExperimentStatus& status, const std::string& source_flags);

}  // namespace legopt::client
