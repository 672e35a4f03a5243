#pragma once

#include <ostream>

#include "bus/messages.h"
#include "legopt/types/reply.h"

namespace legopt {

/// Prints an enumeration value in failed expectations.
template <NamedEnum Enum>
std::ostream& operator<<(std::ostream& out, Enum value) {
  return out << ToString(value);
}

}  // namespace legopt

/// Conversions of the numbers in replies.
namespace legopt::server {

inline HelloStatus StatusOf(const legopt_msg::hello_reply& reply) { return HelloStatus{reply.status}; }
inline LeaseStatus StatusOf(const legopt_msg::lease_reply& reply) { return LeaseStatus{reply.status}; }
inline HeartbeatStatus StatusOf(const legopt_msg::heartbeat_reply& reply) { return HeartbeatStatus{reply.status}; }
inline ResultStatus StatusOf(const legopt_msg::result_reply& reply) { return ResultStatus{reply.status}; }
inline SubmitStatus StatusOf(const legopt_msg::submit_reply& reply) { return SubmitStatus{reply.status}; }
inline QueryStatus StatusOf(const legopt_msg::query_reply& reply) { return QueryStatus{reply.status}; }
inline ControlStatus StatusOf(const legopt_msg::control_reply& reply) { return ControlStatus{reply.status}; }
inline MethodStatus StatusOf(const legopt_msg::method_reply& reply) { return MethodStatus{reply.status}; }
inline DatasetStatus StatusOf(const legopt_msg::dataset_reply& reply) { return DatasetStatus{reply.status}; }
inline StoreDatasetStatus StatusOf(const legopt_msg::store_dataset_reply& reply) {
  return StoreDatasetStatus{reply.status};
}
inline ShutdownStatus StatusOf(const legopt_msg::shutdown_reply& reply) { return ShutdownStatus{reply.status}; }
inline ControlStatus StatusOf(const legopt_msg::cancel_reply& reply) { return ControlStatus{reply.status}; }

/// Returns the verdict on the first lease of the request.
inline LeaseVerdict VerdictOf(const legopt_msg::heartbeat_reply& reply) { return LeaseVerdict{reply.verdicts.at(0)}; }

}  // namespace legopt::server
