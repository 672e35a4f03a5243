#pragma once

#include <array>
#include <initializer_list>
#include <string>
#include <string_view>

namespace legopt::programs {

/// What the exit status of `legopt`, `legopt-server` and `legopt-worker` means: one set, so that a script can tell the
/// causes apart whichever program reported them.
enum class ExitCode : int {
  kOk = 0,                ///< done
  kUsage = 2,             ///< wrong flag, bad input file (suite, dataset, solution file, SQL), or an output (standard
                          ///< output, a file asked for) that cannot be written; a worker of another protocol version
  kUnreachable = 3,       ///< no server answered in time, or waiting timed out
  kJobsFailed = 4,        ///< the experiment ended, but jobs crashed, died or could not run; or `evaluate` judged the
                          ///< file, but solutions of it could not be read
  kDatasetMismatch = 5,   ///< the dataset's content is not the one the experiment was made with
  kDatabaseUnusable = 6,  ///< missing, unwritable, damaged, or in use by another server
  kNetworkUnusable = 7,   ///< no multicast route, or the port belongs to another deployment
  kInterrupted = 8,       ///< cancelled by the user or interrupted by a signal
  kNewerDatabase = 9,     ///< the database was written by a newer legopt; this one leaves it alone
  kWorse = 10,            ///< `compare --fail-if-worse`: B is worse than A
  kOtherBits = 11,        ///< `replay`: the same status and verdicts, but not the same bits
  kOtherResult = 12,      ///< `replay`: another status or verdict, or none
  kCertificateMismatch = 13,  ///< a certificate of feasibility is about another dataset, or another state of it
  kEngineRefused = 14,        ///< the batch system refuses a pool, does not answer, or has ended all of its workers
  kNoProgress = 15,           ///< waiting ended by --give-up: nothing moved for so long
  kCutShort = 16,             ///< a limit (rows, bytes or time) was reached before the end of the result
  kNotPermitted = 17,         ///< the key is that of a role which may not do this
  kInternal = 70,             ///< a defect of legopt; please report it
  kMachine = 71,  ///< this machine gave out: no memory, no more processes, or one of the programs is not there
};

/// As `main` returns it.
constexpr int StatusOf(ExitCode code) { return static_cast<int>(code); }

struct ExitCodeText {
  ExitCode code;
  std::string_view text;
};

inline constexpr std::array<ExitCodeText, 19> kExitCodeTexts{{
    {ExitCode::kOk, "done"},
    {ExitCode::kUsage, "wrong usage, bad input file, or output that cannot be written"},
    {ExitCode::kUnreachable, "server unreachable or time-out"},
    {ExitCode::kJobsFailed, "jobs crashed, died or could not run; solutions could not be read"},
    {ExitCode::kDatasetMismatch, "dataset mismatch"},
    {ExitCode::kDatabaseUnusable, "database unusable"},
    {ExitCode::kNetworkUnusable, "network unusable"},
    {ExitCode::kInterrupted, "cancelled or interrupted"},
    {ExitCode::kNewerDatabase, "database of a newer legopt"},
    {ExitCode::kWorse, "compare: B is worse"},
    {ExitCode::kOtherBits, "replay: same status, other bits"},
    {ExitCode::kOtherResult, "replay: another result"},
    {ExitCode::kCertificateMismatch, "certificate of another dataset"},
    {ExitCode::kEngineRefused, "the batch system refuses or ended the pool"},
    {ExitCode::kNoProgress, "gave up: nothing moved for the time of --give-up"},
    {ExitCode::kCutShort, "a limit cut the result"},
    {ExitCode::kNotPermitted, "the role of the key does not permit this"},
    {ExitCode::kInternal, "a defect of legopt"},
    {ExitCode::kMachine, "out of memory or processes, or a program is missing"},
}};

/// What `--help` says of the codes that a program ends with, one a line; of all, given none.
std::string ExitCodeHelp(std::initializer_list<ExitCode> codes = {});

}  // namespace legopt::programs
