#pragma once

namespace legopt::client {

/// What the exit status of `legopt` means. `legopt-server` and `legopt-worker` use the same numbers, so that a script
/// can tell the causes apart whichever program reported them. `legopt --help` prints `kExitCodeHelp`.
enum class ExitCode : int {
  kOk = 0,                ///< done
  kUsage = 2,             ///< wrong flag, bad input file (suite, dataset, solution file, SQL), or an output (standard
                          ///< output, a file asked for) that cannot be written
  kUnreachable = 3,       ///< no server answered in time, or waiting timed out
  kJobsFailed = 4,        ///< the experiment ended, but jobs crashed, died or could not run; or `evaluate` judged the
                          ///< file, but solutions of it could not be read
  kDatasetMismatch = 5,   ///< the dataset's content is not the one the experiment was made with
  kDatabaseUnusable = 6,  ///< missing, unwritable, damaged, or in use by another server
  kNetworkUnusable = 7,   ///< no multicast route, or the port belongs to another deployment
  kInterrupted = 8,       ///< cancelled by the user or interrupted by a signal
  kNewerDatabase = 9,     ///< the database was written by a newer legopt; this one leaves it alone
  kInternal = 70,         ///< a defect of legopt; please report it
  kMachine = 71,          ///< this machine gave out: no memory, no more processes, or one of the programs is not there
};

inline constexpr char kExitCodeHelp[] =
    "Exit codes:\n"
    "  0  done\n"
    "  2  wrong usage, bad input file, or output that cannot be written\n"
    "  3  server unreachable or time-out\n"
    "  4  jobs crashed, died or could not run; solutions could not be read\n"
    "  5  dataset mismatch\n"
    "  6  database unusable\n"
    "  7  network unusable\n"
    "  8  cancelled or interrupted\n"
    "  9  database of a newer legopt\n"
    " 70  a defect of legopt\n"
    " 71  out of memory or processes, or a program is missing";

}  // namespace legopt::client
