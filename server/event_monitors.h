#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "db/database_file.h"
#include "db/store.h"
#include "server/scheduler.h"

namespace legopt::server {

/// Records bus and lease problems during an experiment. When the experiment ends, an event of kind "transport_health"
/// stores how much every counter has grown since its submission, or since the start of the server if that was later.
/// The detail is a JSON object of the counters that grew.
///
/// Thread rule: the server's thread.
class TransportHealth {
 public:
  using Listing = std::vector<std::pair<std::string_view, std::uint64_t>>;

  /// Registers an experiment that is open when the server starts.
  void Begin(std::int64_t experiment_id, const Listing& counters);
  /// Scans operations that are about to be committed, starting at index `first`, and appends events for those that end
  /// an experiment. `counters` is called only when an experiment begins or ends, because it may query the kernel.
  void Watch(std::size_t first, const std::function<Listing()>& counters, std::int64_t wall_us,
             std::vector<db::StoreOp>& ops);

 private:
  std::string GrowthOf(std::int64_t experiment_id, const Listing& counters) const;

  std::map<std::int64_t, std::map<std::string, std::uint64_t>> at_begin_;  ///< key: id of an open experiment
};

/// Limits of a ConditionMonitor.
struct MonitorLimits {
  microseconds interval{2'000'000};     ///< time between checks
  microseconds standstill{60'000'000};  ///< an experiment without progress for this long is reported
  double low_share = 0.10;              ///< a disk is low if the free share is below this and fewer than `low_bytes`
                                        ///< are free
  std::int64_t low_bytes = std::int64_t{50} << 30;
};

/// Detects conditions that no message reports, and records an event when one begins: "no_progress" (an active
/// experiment stalls; the event contains the reason; pauses, holds and waiting for other experiments are not stalls)
/// and "disk_low" (on the file system of the database).
///
/// Thread rule: the server's thread.
class ConditionMonitor {
 public:
  using DiskSpace = std::function<std::optional<db::DiskSpace>()>;

  /// `disk_space` may be empty; then no disk is monitored.
  ConditionMonitor(const MonitorLimits& limits, DiskSpace disk_space)
      : limits_(limits), disk_space_(std::move(disk_space)) {}

  /// Checks the conditions if the interval has passed, and appends the events.
  void Look(const Scheduler& scheduler, const Instant& now, const std::string& store_error, Scheduler::Ops& ops);

  /// Disk space at the last check; nullopt if unknown.
  const std::optional<db::DiskSpace>& disk() const { return disk_; }
  bool disk_is_low() const { return disk_low_; }

 private:
  void CheckDiskSpace(const Instant& now, Scheduler::Ops& ops);
  void CheckForStalls(const Scheduler& scheduler, const Instant& now, const std::string& store_error,
                      Scheduler::Ops& ops);

  MonitorLimits limits_;
  DiskSpace disk_space_;
  microseconds next_look_{0};
  std::optional<db::DiskSpace> disk_;
  bool disk_low_ = false;
  std::map<std::int64_t, microseconds> still_since_;  ///< key: experiment
  std::set<std::int64_t> reported_;                   ///< subset of still_since_ that has been reported
};

}  // namespace legopt::server
