#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "client/exit_codes.h"
#include "client/experiment_status.h"
#include "client/progress_printer.h"
#include "client/server_connection.h"

namespace legopt::client {

/// Called between two looks at an experiment, e.g. to see after children.
using WatchTick = std::function<void()>;

/// What a server that cannot write its database (full disk, I/O error) means for who waits for it. It acknowledges and
/// leases nothing meanwhile, loses nothing, and goes on when it can write again.
class StoreTrouble {
 public:
  static constexpr Seconds kPatience{600};

  /// Takes the server's status; says on standard error when the trouble begins and when it is over; `printer` may be
  /// null. Throws ClientError (kDatabaseUnusable) when it lasts for longer than kPatience.
  void Look(const nlohmann::json& status, ProgressPrinter* printer);
  /// For whoever gives up waiting: throws ClientError (kDatabaseUnusable) while the trouble lasts.
  void ThrowIfAny() const;
  /// A few words for the progress; empty: no trouble.
  std::string note() const { return error_.empty() ? "" : "the database cannot be written"; }

 private:
  std::string error_;
  std::chrono::steady_clock::time_point since_;
};

/// Looks at an experiment until it is over and shows its progress on standard error. Returns its last status. Under an
/// InterruptGuard an interruption throws ClientError (kInterrupted). A server that leaves `max_silent_calls` calls in a
/// row unanswered throws kUnreachable. Shows a database that the server cannot write; then an interruption, or ten
/// minutes of it, throw kDatabaseUnusable.
ExperimentStatus WatchExperiment(ServerConnection& server, std::int64_t experiment_id, const WatchTick& tick = {},
                                 int max_silent_calls = 1);

/// The exit code that an experiment's end deserves: kJobsFailed when jobs died or could not run, kInterrupted when it
/// was cancelled.
ExitCode OutcomeOf(const ExperimentStatus& status);

/// A sentence on jobs that died or could not run and where to look; empty when there are none.
/// `source_flags` as of ResultSource::flags().
std::string FailureHint(const ExperimentStatus& status, const std::string& source_flags);

}  // namespace legopt::client
