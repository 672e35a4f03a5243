#pragma once

namespace legopt::worker {

/// What the exit status of `legopt-worker` means; the numbers are those of `legopt` (client/exit_codes.h).
enum ExitCode : int {
  kExitOk = 0,
  kExitUsage = 2,            ///< wrong flag, unusable dataset, or a server of another protocol version
  kExitUnreachable = 3,      ///< no server within --wait-server, or results that could not be delivered at the end
  kExitDatasetMismatch = 5,  ///< the server's jobs need another content of a dataset that this worker has
  kExitNetworkUnusable = 7,  ///< no multicast route, or the port belongs to something else
  kExitInterrupted = 8,      ///< told to stop at once while jobs were running
  kExitInternal = 70,        ///< job processes cannot be started, or a defect
};

}  // namespace legopt::worker
