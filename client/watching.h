#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "client/exit_codes.h"
#include "client/experiment_status.h"
#include "client/server_connection.h"

namespace legopt::client {

/// Called between two looks at an experiment, e.g. to see after children.
using WatchTick = std::function<void()>;

/// Looks at an experiment until it is over and shows its progress on standard error. Returns its last status. Under an
/// InterruptGuard an interruption throws ClientError (kInterrupted). A server that leaves `max_silent_calls` calls in a
/// row unanswered throws kUnreachable.
ExperimentStatus WatchExperiment(ServerConnection& server, std::int64_t experiment_id, const WatchTick& tick = {},
                                 int max_silent_calls = 1);

/// The exit code that an experiment's end deserves: kJobsFailed when jobs died or could not run, kInterrupted when it
/// was cancelled.
ExitCode OutcomeOf(const ExperimentStatus& status);

/// A sentence on jobs that died or could not run and where to look; empty when there are none.
/// `source_flags` as of ResultSource::flags().
std::string FailureHint(const ExperimentStatus& status, const std::string& source_flags);

}  // namespace legopt::client
