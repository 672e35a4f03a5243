#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "db/store.h"

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

}  // namespace legopt::server
