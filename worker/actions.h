#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "legopt_msg/heartbeat_request.hpp"
#include "legopt_msg/hello_request.hpp"
#include "legopt_msg/lease.hpp"
#include "legopt_msg/lease_request.hpp"
#include "legopt_msg/method_request.hpp"
#include "legopt_msg/result_request.hpp"
#include "programs/exit_codes.h"

namespace legopt::worker {

using programs::ExitCode;

/// Identity of one lease: which attempt of which job, under which token.
struct LeaseKey {
  std::int64_t job_id = 0;
  std::int32_t attempt = 0;
  std::int64_t token = 0;
  auto operator<=>(const LeaseKey&) const = default;
};

// What a Pool asks its surroundings to do (pool.h). Processes:

/// Starts the job process of a slot. Its end is always reported by Pool::OnChildExited.
struct StartChild {
  int slot = 0;
};
/// Sends a job to an idle job process.
struct AssignJob {
  int slot = 0;
  std::uint64_t sequence = 0;
  legopt_msg::lease lease;
  std::shared_ptr<const std::string> options_json;
};
/// Asks a job process to stop its job soon.
struct CancelJob {
  int slot = 0;
};
/// Kills a job process with everything that it started.
struct KillChild {
  int slot = 0;
};

// Calls to the server; each is answered once, by the Pool::On...Reply of its kind (also on time-out).
struct CallHello {
  legopt_msg::hello_request request;
};
struct CallLease {
  legopt_msg::lease_request request;
};
struct CallHeartbeat {
  legopt_msg::heartbeat_request request;
};
struct CallMethod {
  legopt_msg::method_request request;
};
struct CallResult {
  LeaseKey key;
  std::shared_ptr<const legopt_msg::result_request> request;
};

// For humans, and the end.
enum class LogLevel { kDebug, kInfo, kWarning, kError };
struct LogLine {
  LogLevel level;
  std::string text;
};
/// The worker is done; no action follows.
struct ExitWorker {
  ExitCode code;
};

using Action = std::variant<StartChild, AssignJob, CancelJob, KillChild, CallHello, CallLease, CallHeartbeat,
                            CallMethod, CallResult, LogLine, ExitWorker>;

}  // namespace legopt::worker
