#include "tests/bus/sample_messages.h"

#include "bus/wire.h"
#include "legopt/types/reply.h"

namespace legopt::bus::sample_internal {

void Agree(legopt_msg::capability& message) {
  constexpr std::size_t kDigits = 64;
  message.hash = std::string(kDigits, 'c');
}

void Agree(legopt_msg::chunk& message) {
  message.total_bytes = static_cast<std::int64_t>(kChunkBytes + message.data.size());
  message.index = 1;
}

void Agree(legopt_msg::lease_reply& message) {
  message.status = static_cast<std::int32_t>(LeaseStatus::kLeased);
  message.wanted_dataset.clear();  // sent without jobs only
}

void Agree(legopt_msg::lease_state& message) { message.progress_done = message.progress_total - 1; }

void Agree(legopt_msg::result_request& message) {
  message.waypoints = {1, -2, 3.5, 0, -0.0, 1e300};
  message.num_waypoints = 2;
  message.waypoint_size = 3;
  message.unsolved = {4, 5.5, -6, 7};
  message.num_unsolved = 2;
}

void Agree(legopt_msg::control_request& message) {
  message.action = static_cast<std::int8_t>(ControlAction::kPauseNow);
  message.reason = "the disk is being moved";
}

}  // namespace legopt::bus::sample_internal
