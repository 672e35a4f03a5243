#pragma once

namespace legopt::worker {

/// Behaviour of the job processes of the supervision tests; selected by the lease's problem_id.
enum class Misbehaviour : int {
  kNone,              ///< returns at once
  kSegfault,          ///< writes through a wild pointer
  kAbort,             ///< after two lines on standard error
  kLoop,              ///< never returns, calls nothing
  kAllocateByNew,     ///< operator new, endlessly
  kAllocateByMalloc,  ///< malloc endlessly, result unchecked
  kHugeVector,        ///< one impossible std::vector
  kGarbage,           ///< writes random bytes to the channel, then continues
  kForgedFrame,       ///< a well-formed frame that only a supervisor may write
  kLyingResult,       ///< a well-formed result of another job
  kSilentExit,        ///< exit(0) in the middle of a job
  kCloseChannel,      ///< closes its channel and hangs
  kUntilCancelled,    ///< returns when asked to stop
  kForkBomb,          ///< starts as many processes as possible; reports their number
  kIsolatedCall,      ///< an isolated call, whose answer is the message of the result
  kExec,              ///< tries to exec another program
  kThread,            ///< starts a thread, which must work
  kThrow,             ///< std::runtime_error
  kChatter,           ///< megabytes of log, then a crash
};

}  // namespace legopt::worker
