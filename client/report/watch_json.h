#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "client/client_error.h"
#include "client/report/watch_view.h"

namespace legopt::client {

/// Progress events as JSON, one object per line, for programs. Every object has
///
///     "event": "progress", "silent" (the server does not answer), "back" (it answers again) or "end" (the last line),
///     "at_us": microseconds since 1970 by this machine's clock, "experiment": its id
///
/// A "progress" event also has "name", "state" ("active", "done", "cancelled"), "hold" ("none", "paused"),
/// "hold_reason", "waiting_for" (why it stalls; empty while it progresses), the numbers of jobs "total", "queued",
/// "leased", "done", "failed", "dead", "cancelled", "solved", the times "elapsed_s", "worked_s" (or null) and "eta_s"
/// (or null), the "share" of busy slots, and "running": {"job", "task", "worker", "done", "total"} of jobs with
/// reported progress. A "silent" event has "silent_s". An "end" event has "exit_code", "reason" (empty if the
/// experiment is over), and all members of the last "progress" event, if any.
///
/// A "progress" event is written at the start and at the end, when a value other than a time has changed, at most once
/// per `interval`, and every ten intervals without changes.
class WatchJson final : public WatchView {
 public:
  using Clock = std::function<Seconds()>;                 ///< monotonic
  using WallClock = std::function<std::int64_t()>;        ///< microseconds since 1970
  using Write = std::function<void(const std::string&)>;  ///< takes one line without its end

  WatchJson(std::int64_t experiment_id, Seconds interval, Clock clock, WallClock wall_clock, Write write);

  void Show(const ExperimentStatus& status) override;
  void ServerSilent(Seconds silence, Seconds patience) override;
  void ServerBack() override;
  void End(ExitCode exit_code, const std::string& reason);

 private:
  bool Due(const ExperimentStatus& status) const;
  nlohmann::ordered_json Event(const char* name) const;

  std::int64_t experiment_id_;
  Seconds interval_;
  Clock clock_;
  WallClock wall_clock_;
  Write write_;
  std::optional<ExperimentStatus> latest_, written_;
  Seconds written_at_{0};
};

}  // namespace legopt::client
