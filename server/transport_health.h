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

/// What the bus and the leases went through while an experiment was open: at its end an event of kind
/// "transport_health" tells how much every counter has grown since its submission, or since the server's start when
/// that was later. The detail is a JSON object of the counters that grew.
///
/// Thread rule: the server's.
class TransportHealth {
 public:
  using Listing = std::vector<std::pair<std::string_view, std::uint64_t>>;

  /// An experiment that is open when the server starts.
  void Begin(std::int64_t experiment_id, const Listing& counters);
  /// Looks at operations that are about to be committed, from `first` on, and appends the events for those that end an
  /// experiment. `counters` is asked only then and at begins: it may have to ask the kernel.
  void Watch(std::size_t first, const std::function<Listing()>& counters, std::int64_t wall_us,
             std::vector<db::StoreOp>& ops);

 private:
  std::string GrowthOf(std::int64_t experiment_id, const Listing& counters) const;

  std::map<std::int64_t, std::map<std::string, std::uint64_t>> at_begin_;  ///< by open experiment
};

}  // namespace legopt::server
