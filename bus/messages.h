// Every generated message of package legopt_msg, and which call each belongs to.
#pragma once

#include <cstdint>

#include "legopt_msg/cancel_reply.hpp"
#include "legopt_msg/cancel_request.hpp"
#include "legopt_msg/chunk.hpp"
#include "legopt_msg/chunk_ack.hpp"
#include "legopt_msg/control_reply.hpp"
#include "legopt_msg/control_request.hpp"
#include "legopt_msg/dataset_ref.hpp"
#include "legopt_msg/frame.hpp"
#include "legopt_msg/heartbeat_reply.hpp"
#include "legopt_msg/heartbeat_request.hpp"
#include "legopt_msg/hello_reply.hpp"
#include "legopt_msg/hello_request.hpp"
#include "legopt_msg/lease.hpp"
#include "legopt_msg/lease_reply.hpp"
#include "legopt_msg/lease_request.hpp"
#include "legopt_msg/lease_state.hpp"
#include "legopt_msg/method_reply.hpp"
#include "legopt_msg/method_request.hpp"
#include "legopt_msg/probe_reply.hpp"
#include "legopt_msg/probe_request.hpp"
#include "legopt_msg/query_reply.hpp"
#include "legopt_msg/query_request.hpp"
#include "legopt_msg/result_reply.hpp"
#include "legopt_msg/result_request.hpp"
#include "legopt_msg/shutdown_reply.hpp"
#include "legopt_msg/shutdown_request.hpp"
#include "legopt_msg/status_reply.hpp"
#include "legopt_msg/status_request.hpp"
#include "legopt_msg/submit_reply.hpp"
#include "legopt_msg/submit_request.hpp"

namespace legopt::bus {

// Version of the protocol that this build speaks. PROTOCOL.md, section 2.
inline constexpr std::int16_t kProtocolVersion = 3;

// Message type of a call: what stands in frame.type.
enum class MessageType : std::int16_t {
  kProbe = 1,      // who serves here?
  kHello = 2,      // worker registers
  kLease = 3,      // worker asks for jobs
  kHeartbeat = 4,  // worker renews its leases
  kResult = 5,     // worker delivers one attempt
  kMethod = 6,     // worker asks for the options behind a method hash
  kSubmit = 7,     // client submits an experiment
  kStatus = 8,     // client asks how things are
  kQuery = 9,      // client runs read-only SQL
  kCancel = 10,    // client cancels an experiment
  kShutdown = 11,  // client or launcher stops the server
  kControl = 12,   // client pauses, resumes, holds, releases, favours or retries an experiment
};
inline constexpr std::int16_t kLastMessageType = 12;

// CallOf<Request>::kType and CallOf<Request>::Reply: which call a request message opens, and what answers it.
template <class Request>
struct CallOf;
template <>
struct CallOf<legopt_msg::probe_request> {
  static constexpr MessageType kType = MessageType::kProbe;
  using Reply = legopt_msg::probe_reply;
};
template <>
struct CallOf<legopt_msg::hello_request> {
  static constexpr MessageType kType = MessageType::kHello;
  using Reply = legopt_msg::hello_reply;
};
template <>
struct CallOf<legopt_msg::lease_request> {
  static constexpr MessageType kType = MessageType::kLease;
  using Reply = legopt_msg::lease_reply;
};
template <>
struct CallOf<legopt_msg::heartbeat_request> {
  static constexpr MessageType kType = MessageType::kHeartbeat;
  using Reply = legopt_msg::heartbeat_reply;
};
template <>
struct CallOf<legopt_msg::result_request> {
  static constexpr MessageType kType = MessageType::kResult;
  using Reply = legopt_msg::result_reply;
};
template <>
struct CallOf<legopt_msg::method_request> {
  static constexpr MessageType kType = MessageType::kMethod;
  using Reply = legopt_msg::method_reply;
};
template <>
struct CallOf<legopt_msg::submit_request> {
  static constexpr MessageType kType = MessageType::kSubmit;
  using Reply = legopt_msg::submit_reply;
};
template <>
struct CallOf<legopt_msg::status_request> {
  static constexpr MessageType kType = MessageType::kStatus;
  using Reply = legopt_msg::status_reply;
};
template <>
struct CallOf<legopt_msg::query_request> {
  static constexpr MessageType kType = MessageType::kQuery;
  using Reply = legopt_msg::query_reply;
};
template <>
struct CallOf<legopt_msg::cancel_request> {
  static constexpr MessageType kType = MessageType::kCancel;
  using Reply = legopt_msg::cancel_reply;
};
template <>
struct CallOf<legopt_msg::control_request> {
  static constexpr MessageType kType = MessageType::kControl;
  using Reply = legopt_msg::control_reply;
};
template <>
struct CallOf<legopt_msg::shutdown_request> {
  static constexpr MessageType kType = MessageType::kShutdown;
  using Reply = legopt_msg::shutdown_reply;
};

}  // namespace legopt::bus
