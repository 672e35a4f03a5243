#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/client_error.h"
#include "client/report/watch_view.h"
#include "client/service/experiment_status.h"
#include "client/service/server_connection.h"

namespace legopt::client {

/// What a server that cannot write its database (full disk, I/O error) means for who waits for it. It acknowledges and
/// leases nothing meanwhile, loses nothing, and goes on when it can write again.
class StoreTrouble {
 public:
  static constexpr Seconds kPatience{600};

  /// Takes the server's status; says on standard error when the trouble begins and when it is over; `view` may be
  /// null. Throws ClientError (kDatabaseUnusable) when it lasts for longer than kPatience.
  void Look(const nlohmann::json& status, WatchView* view);
  /// For whoever gives up waiting: throws ClientError (kDatabaseUnusable) while the trouble lasts.
  void ThrowIfAny() const;

 private:
  std::string error_;
  std::chrono::steady_clock::time_point since_;
};

/// Judges the silence of a server that has answered before. Times are any steady time and do not go back.
class ServerPatience {
 public:
  /// `first`: when it answered last; empty: never, then the first silence is the end.
  ServerPatience(Seconds patience, std::optional<Seconds> first) : patience_(patience), answered_(first) {}

  /// It has answered.
  void Answered(Seconds now, WatchView& view);
  /// A call has timed out with `error`. Throws it when the server has never answered, and a ClientError (kUnreachable)
  /// when it has not for `patience`.
  void Silent(Seconds now, const ClientError& error, WatchView& view);

 private:
  Seconds patience_;
  std::optional<Seconds> answered_;
  bool silent_ = false;
};

/// Ends a wait in which nothing moves. An experiment moves while a slot works on it or a job of it ends; pauses, holds
/// and a database that cannot be written count as standing still. Times as of ServerPatience.
class ProgressDeadline {
 public:
  /// Throws after `give_up` without progress; empty: never.
  explicit ProgressDeadline(std::optional<Seconds> give_up) : give_up_(give_up) {}

  /// Takes a look at the experiment. Throws ClientError (kNoProgress) with the reason for which it stands still.
  void Look(Seconds now, const ExperimentStatus& status);

 private:
  std::optional<Seconds> give_up_;
  std::optional<Seconds> moved_;  // last time
  std::int64_t finished_ = -1;
};

/// Takes care that a server that comes back still means the same experiment by its id.
class WatchedExperiment {
 public:
  WatchedExperiment(std::int64_t id, std::string address) : id_(id), address_(std::move(address)) {}

  /// The watched one of a status reply, a JSON object. Throws ClientError: kUsage when the server never knew it,
  /// kDatabaseUnusable when it knew it before, or another one by its id.
  ExperimentStatus Find(const nlohmann::json& reply);

 private:
  std::int64_t id_;
  std::string address_;
  std::optional<std::pair<std::string, std::int64_t>> identity_;  // content and time of submission
};

struct WatchOptions {
  static constexpr double kDefaultPatience_s = 600;

  Seconds patience{kDefaultPatience_s};  ///< how long a server that has answered before may be silent
  bool has_answered = false;             ///< it has, just now
  std::function<void()> tick = {};       ///< called between two looks, e.g. to see after children
  bool own_workers = false;              ///< the workers are children of ours: while none is connected, they load
  std::optional<Seconds> give_up = {};   ///< time without progress, or without an answer, after which to end
};

/// The reason why an experiment waits, for somebody whose own workers are starting: they load the dataset.
std::string ReasonWithOwnWorkers(const ExperimentStatus& status, const nlohmann::json& reply);

/// Looks at an experiment until it is over and shows it. Returns its last status. Survives a server that is restarted
/// (ServerPatience, WatchedExperiment, ProgressDeadline: their errors end it). Under an InterruptGuard an interruption
/// throws ClientError (kInterrupted) at once. Shows a database that the server cannot write; then an interruption, or
/// ten minutes of it, throw kDatabaseUnusable.
ExperimentStatus WatchExperiment(ServerConnection& server, std::int64_t experiment_id, WatchView& view,
                                 const WatchOptions& options = {});

/// The same on standard error, with the closing line.
ExperimentStatus WatchOnTerminal(ServerConnection& server, std::int64_t experiment_id,
                                 const WatchOptions& options = {});

/// The exit code that an experiment's end deserves: kJobsFailed when jobs died or could not run, kInterrupted when it
/// was cancelled.
ExitCode OutcomeOf(const ExperimentStatus& status);

/// A sentence on jobs that died or could not run and where to look; empty when there are none.
/// `source_flags` as of ResultSource::flags().
std::string FailureHint(const ExperimentStatus& status, const std::string& source_flags);

}  // namespace legopt::client
