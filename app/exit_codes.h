#pragma once

#include <array>
#include <initializer_list>
#include <string>
#include <string_view>

namespace legopt::app {

/// Exit codes of `legopt`, `legopt-server` and `legopt-worker`: a common set, so that a script can distinguish causes
/// regardless of the program.
enum class ExitCode : int {
  kOk = 0,     ///< success
  kUsage = 2,  ///< wrong flag, invalid input file (suite, dataset, solution file, SQL), unwritable output (standard
               ///< output or a file), or a worker with another protocol version
  kUnreachable = 3,      ///< no server answered in time, or waiting timed out
  kJobsFailed = 4,       ///< the experiment ended, but jobs crashed, died or could not run; `evaluate` could not read
                         ///< solutions of the file; `export` could not sample a motion; or `check-solver` found a fault
  kDatasetMismatch = 5,  ///< the dataset's content differs from that of the experiment
  kDatabaseUnusable = 6,  ///< missing, unwritable, damaged, or in use by another server
  kNetworkUnusable = 7,   ///< no multicast route, or the port belongs to another deployment
  kInterrupted = 8,       ///< cancelled by the user or interrupted by a signal
  kNewerDatabase = 9,     ///< the database was written by a newer legopt and was not changed
  kWorse = 10,            ///< `compare --fail-if-worse`: B is worse than A
  kOtherBits = 11,        ///< `replay`: same status and verdicts, but different bits
  kOtherResult = 12,  ///< `replay`: another status or verdict, or no result; `archive judge`: another verdict or cost
  kCertificateMismatch = 13,  ///< a certificate of feasibility belongs to another dataset, or to another version of it
  kEngineRefused = 14,        ///< the batch system refuses a pool, does not answer, or has ended all its workers
  kNoProgress = 15,           ///< waiting ended by --give-up: no progress for that time
  kCutShort = 16,             ///< a limit (rows, bytes or time) was reached before the end of the result
  kNotPermitted = 17,         ///< the role of the key does not permit this
  kInternal = 70,             ///< a defect of legopt; please report it
  kMachine = 71,  ///< resources of this machine exhausted: memory or processes; or one of the programs is missing
};

/// Returns the value for `main`.
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
    {ExitCode::kOtherResult, "replay, archive judge: another result"},
    {ExitCode::kCertificateMismatch, "certificate of another dataset"},
    {ExitCode::kEngineRefused, "the batch system refuses or ended the pool"},
    {ExitCode::kNoProgress, "gave up: nothing moved for the time of --give-up"},
    {ExitCode::kCutShort, "a limit cut the result"},
    {ExitCode::kNotPermitted, "the role of the key does not permit this"},
    {ExitCode::kInternal, "a defect of legopt"},
    {ExitCode::kMachine, "out of memory or processes, or a program is missing"},
}};

/// Returns the help text for the exit codes of a program, one per line; without arguments for all codes.
std::string ExitCodeHelp(std::initializer_list<ExitCode> codes = {});

}  // namespace legopt::app
