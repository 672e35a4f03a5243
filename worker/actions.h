#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "app/exit_codes.h"
#include "legopt_msg/heartbeat_request.hpp"
#include "legopt_msg/hello_request.hpp"
#include "legopt_msg/lease.hpp"
#include "legopt_msg/lease_request.hpp"
#include "legopt_msg/method_request.hpp"
#include "legopt_msg/result_request.hpp"

namespace legopt::worker {

using app::ExitCode;

/// Identifies one lease: the job, its attempt and the token.
struct LeaseKey {
  std::int64_t job_id = 0;
  std::int32_t attempt = 0;
  std::int64_t token = 0;
  auto operator<=>(const LeaseKey&) const = default;
};

// Actions that a Pool requests from its caller (pool.h). Processes:

/// Starts the job process of a slot. Pool::OnChildExited always reports its end.
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
/// Kills a job process with all its child processes.
struct KillChild {
  int slot = 0;
};

// Calls to the server. The Pool::On...Reply function of the call reports each answer or time-out once.
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

// Log lines for humans, and the exit.
enum class LogLevel { kDebug, kInfo, kWarning, kError };
struct LogLine {
  LogLevel level;
  std::string text;
};
/// Ends the worker; no action follows.
struct ExitWorker {
  ExitCode code;
};

using Action = std::variant<StartChild, AssignJob, CancelJob, KillChild, CallHello, CallLease, CallHeartbeat,
                            CallMethod, CallResult, LogLine, ExitWorker>;

}  // namespace legopt::worker
