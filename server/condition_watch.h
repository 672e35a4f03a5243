#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "db/file_system.h"
#include "server/scheduler.h"

namespace legopt::server {

/// What a ConditionWatch compares with.
struct ConditionLimits {
  microseconds interval{2'000'000};     ///< between looks
  microseconds standstill{60'000'000};  ///< an experiment that has not moved for so long is reported
  double low_share = 0.10;              ///< a disk with less free is low, if it has also less than `low_bytes` free
  std::int64_t low_bytes = std::int64_t{50} << 30;
};

/// Looks for conditions that nobody reports by a message, and records an event when one begins: "no_progress" (an
/// active experiment stands still, with the reason; pauses, holds and work for other experiments are no standstill) and
/// "disk_low" (of the file system with the database).
///
/// Thread rule: the server's.
class ConditionWatch {
 public:
  using DiskSpace = std::function<std::optional<db::DiskSpace>()>;

  /// `disk_space` may be empty: no disk is watched.
  ConditionWatch(const ConditionLimits& limits, DiskSpace disk_space)
      : limits_(limits), disk_space_(std::move(disk_space)) {}

  /// Looks if it is time, and appends the events.
  void Look(const Scheduler& scheduler, const Instant& now, const std::string& store_error, Scheduler::Ops& ops);

  /// As of the last look; empty: unknown.
  const std::optional<db::DiskSpace>& disk() const { return disk_; }
  bool disk_is_low() const { return disk_low_; }

 private:
  void LookAtDisk(const Instant& now, Scheduler::Ops& ops);
  void LookAtExperiments(const Scheduler& scheduler, const Instant& now, const std::string& store_error,
                         Scheduler::Ops& ops);

  ConditionLimits limits_;
  DiskSpace disk_space_;
  microseconds next_look_{0};
  std::optional<db::DiskSpace> disk_;
  bool disk_low_ = false;
  std::map<std::int64_t, microseconds> still_since_;  ///< by experiment
  std::set<std::int64_t> reported_;                   ///< of these
};

}  // namespace legopt::server
