#pragma once

#include <poll.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bus/message_key.h"
#include "bus/messages.h"
#include "bus/transport.h"

namespace legopt::bus {

/// @file
/// Counters of an endpoint by cause, counted since construction and never reset.

/// Counters of an endpoint by cause.
struct Counters {
  // Datagrams.
  std::uint64_t datagrams_sent = 0;      ///< datagrams on both ports, including send_failures
  std::uint64_t datagrams_received = 0;  ///< datagrams on both ports that reached the endpoint
  std::uint64_t bytes_sent = 0;          ///< bytes in datagrams_sent
  std::uint64_t bytes_received = 0;      ///< bytes in datagrams_received
  std::uint64_t not_for_us = 0;          ///< well-formed, addressed to another party
  std::uint64_t send_failures = 0;       ///< refused by the kernel
  std::uint64_t kernel_drops = 0;        ///< lost because the receive buffer was full
  std::uint64_t kernel_filtered = 0;     ///< dropped by the socket filter

  // Calls made by this endpoint.
  std::uint64_t calls_started = 0;      ///< started by Endpoint::Call
  std::uint64_t calls_completed = 0;    ///< ended by a reply
  std::uint64_t calls_rejected = 0;     ///< ended by a refusal
  std::uint64_t calls_timed_out = 0;    ///< ended by their deadline
  std::uint64_t calls_abandoned = 0;    ///< ended by Endpoint::Abandon
  std::uint64_t requests_retried = 0;   ///< repeated requests
  std::uint64_t duplicate_replies = 0;  ///< replies to calls already finished

  // Calls served by this endpoint.
  std::uint64_t requests_handled = 0;       ///< handler invocations
  std::uint64_t duplicate_requests = 0;     ///< repeated requests that did not reach a handler
  std::uint64_t replies_resent = 0;         ///< answered from the cache
  std::uint64_t replies_evicted = 0;        ///< dropped from the full cache before the caller finished
  std::uint64_t requests_refused_busy = 0;  ///< refused because too many requests were open
  std::uint64_t requests_challenged = 0;    ///< requests of sessions without a proof (with a key)
  std::uint64_t handler_failures = 0;       ///< exceptions thrown by handlers

  // Large bodies.
  std::uint64_t objects_sent = 0;      ///< all chunks acknowledged
  std::uint64_t objects_received = 0;  ///< complete, with the correct hash
  std::uint64_t objects_expired = 0;   ///< given up incomplete, in either direction
  std::uint64_t chunks_sent = 0;       ///< first transmissions
  std::uint64_t chunks_resent = 0;     ///< repeats after a loss or as a reminder
  std::uint64_t duplicate_chunks = 0;  ///< received repeatedly

  // Rejected datagrams and messages by cause; each datagram is counted at most once.
  std::uint64_t rejected_size = 0;        ///< empty or above the limit
  std::uint64_t rejected_malformed = 0;   ///< not a frame: fingerprint, lengths, trailing bytes
  std::uint64_t rejected_version = 0;     ///< another protocol version
  std::uint64_t rejected_deployment = 0;  ///< another deployment
  std::uint64_t rejected_tag = 0;         ///< damaged; with a key also forged
  std::uint64_t rejected_unsigned = 0;    ///< datagram tagged without a key, in a deployment with one
  std::uint64_t rejected_replay = 0;      ///< request or proof that is repeated or too old (with a key)
  std::uint64_t rejected_field = 0;       ///< a field of the frame or chunk out of range
  std::uint64_t rejected_type = 0;        ///< request without a handler
  std::uint64_t rejected_role = 0;        ///< request that the role of its key does not permit (with a key)
  std::uint64_t rejected_body = 0;        ///< body not decodable, or a message field out of range
  std::uint64_t rejected_object = 0;      ///< hash mismatch, contradictory chunks, above the limit

  /// Sum of the rejected_* above.
  std::uint64_t rejected() const;
  /// Every counter as (name, value), in the order above; names are those of the fields.
  std::vector<std::pair<std::string_view, std::uint64_t>> Listing() const;
};

// Layer 2 of the bus: calls between parties over an unreliable Transport.
//
// A call is a request that is repeated, with exponential back-off and jitter, until its reply arrives or its time-out
// expires. The other side handles each call once, however often the request arrives, and repeats its reply from a
// cache. Bodies larger than a datagram are sent as acknowledged chunks (window <= 32, hashed) on the bulk port,
// transparently for callers and handlers. Semantics and limits: lcmtypes/PROTOCOL.md.
//
// Each call is handled once as long as both parties keep running. After a restart of the server, or if the reply cache
// overflows, a call may reach a handler again or be refused. Handlers of requests that change state are therefore
// idempotent, using their own ids.
//
// Thread rule: one thread creates, polls and destroys an endpoint. Handlers and callbacks run inside Poll on that
// thread. They may call everything except Poll and must not destroy the endpoint. Exceptions from a handler are caught
// (see Serve). An exception from a call's callback propagates out of Poll, and the endpoint stays usable. To answer
// from another thread, pass the work to this thread, e.g. with an eventfd given to PollWith.

/// Reason of a refusal, as sent. PROTOCOL.md, section 8.
enum class ErrorCode : std::int16_t {
  kVersionRefused = 1,  ///< the peer speaks another protocol version
  kUnknownType = 2,     ///< the peer has no handler for this message type
  kMalformed = 3,       ///< body not decodable or a field out of range; the text names it
  kHandlerFailed = 4,   ///< the handler threw an exception
  kTooLarge = 5,        ///< body or reply larger than the limit of an object
  kBusy = 6,            ///< too many open requests; the caller keeps retrying, so this ends no call
  kReplyGone = 7,       ///< handled before, but the reply is no longer in the cache
  kProveSession = 8,    ///< request for a proof, with a key; handled by the bus itself, ends no call
  kKeyNeeded = 9,       ///< the deployment has a key, but the request was made without one
  kRoleRefused = 10,    ///< the role of the caller's key does not permit this call
};
/// Returns the enumerator's name: "version_refused", "unknown_type", ...; "unknown" for any other value.
std::string_view ToString(ErrorCode code);

/// Request passed to a handler.
struct Request {
  EndpointId sender = 0;  ///< address of the caller; use the Responder to answer
  KeyRole role{};         ///< role of the caller's key, which permits this call; kOperator without a key
  MessageType type{};     ///< message type of the call
  std::string body;       ///< encoded as received, not validated
};

class EndpointCore;

/// Answers one request, once; further answers are ignored. Copyable and movable. May be kept and used later (e.g. after
/// a commit) on the endpoint's thread, even after the endpoint is destroyed (without effect then). If all responders of
/// a request are destroyed without an answer, the request stays open until its caller gives up.
class Responder {
 public:
  Responder() = default;
  /// Answers with an encoded message. A message larger than the limit of an object becomes a refusal (kTooLarge).
  void Reply(std::string body);
  /// Ends the call with CallResult::kRejected and `text`, truncated to 500 bytes.
  void Reject(ErrorCode code, std::string_view text);

 private:
  friend class EndpointCore;
  Responder(std::weak_ptr<EndpointCore> core, EndpointId caller, std::int64_t session, std::int64_t call, KeyRole role)
      : core_(std::move(core)), caller_(caller), session_(session), call_(call), role_(role) {}
  std::weak_ptr<EndpointCore> core_;
  EndpointId caller_ = 0;
  std::int64_t session_ = 0;
  std::int64_t call_ = 0;
  KeyRole role_{};
};

/// Time-out and retry intervals of a call.
struct CallOptions {
  microseconds timeout = std::chrono::seconds(10);           ///< (0, 1 h]
  microseconds first_retry = std::chrono::milliseconds(50);  ///< > 0; doubles each time, +-25 % jitter
  microseconds max_retry = std::chrono::seconds(1);          ///< longest interval, >= first_retry
};

/// How a call ended.
struct CallResult {
  /// How a call ended.
  enum Status {
    kOk,       ///< reply received
    kTimeout,  ///< no reply; the effect of the call is unknown
    kRejected  ///< error reply received
  };
  Status status = kTimeout;
  std::string body;   ///< body of the reply, for kOk
  ErrorCode code{};   ///< set for kRejected
  std::string error;  ///< message for humans, set for kRejected and kTimeout
};

using CallId = std::int64_t;  ///< positive, unique per endpoint
/// Called once, when a call ends.
using CallCallback = std::function<void(CallResult&&)>;
/// Called once for each new request; may answer immediately or later.
using RequestHandler = std::function<void(Request&&, Responder)>;

/// Resource limits of an endpoint.
struct EndpointOptions {
  std::size_t max_object_bytes = std::size_t{64} << 20;  ///< largest body, either direction
  /// Replies kept for repeated requests, in bytes. The oldest replies are dropped first.
  std::size_t max_cached_bytes = std::size_t{64} << 20;
  /// Total size of incomplete incoming bodies, in bytes. A body that does not fit waits (its chunks are not
  /// acknowledged).
  std::size_t max_incoming_bytes = std::size_t{256} << 20;
  std::size_t max_open_requests = 16384;  ///< requests passed to handlers and unanswered; more are refused as busy
  std::size_t max_peers = 65'536;         ///< callers remembered; the one silent for the longest time is dropped first
  microseconds incoming_object_lifetime = std::chrono::seconds(10);  ///< maximum time without a new chunk
};

/// One party of a deployment: makes calls to other parties and serves theirs. Guarantees and thread rule: endpoint.h.
class Endpoint {
 public:
  /// `transport` must outlive the endpoint and be used by it only. `self` is positive. `seed` determines jitter and the
  /// session number (use RandomSeed() in programs, a fixed value in tests). Throws BusError (kInvalidOption).
  Endpoint(Transport& transport, EndpointId self, std::uint64_t seed, EndpointOptions options = {});
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  EndpointId id() const;
  microseconds now() const;  ///< time of the transport's steady clock

  /// Starts a call. `callback` runs once inside a later Poll, never inside Call; it may be empty. Calls to one peer may
  /// be reordered. Throws BusError (kInvalidOption) for a body larger than max_object_bytes or invalid options.
  CallId Call(EndpointId to, MessageType type, std::string body, const CallOptions& options, CallCallback callback);
  /// Abandons a call. Its callback is destroyed without being run. Unknown or finished ids are ignored.
  void Abandon(CallId call);

  /// Registers the handler of a message type; an empty handler unregisters it. Callers whose role does not permit the
  /// call are refused before the handler runs (kRoleRefused). Exceptions from a handler are caught, counted and
  /// answered with kHandlerFailed.
  void Serve(MessageType type, RequestHandler handler);

  /// Receives, retries and times out. Returns after `max_wait`, or earlier if something was handled. Calling it from
  /// within itself aborts.
  void Poll(microseconds max_wait);
  /// Like Poll, but also returns when one of `extra` is ready (sets revents).
  void PollWith(std::span<pollfd> extra, microseconds max_wait);

  /// Returns the next time at which Poll has work without any arrival; empty if there is none. For drivers of virtual
  /// time.
  std::optional<microseconds> next_timer() const;

  /// Number of this endpoint's open calls.
  std::size_t num_open_calls() const;
  /// Bytes held for replies, incoming and outgoing bodies (for tests and status).
  std::size_t held_bytes() const;

  /// Counters, updated from the transport at each call of this function.
  const Counters& counters() const;

 private:
  std::shared_ptr<EndpointCore> core_;
};

/// Returns 63 random bits from the operating system, greater than the role addresses.
EndpointId RandomEndpointId();
/// Returns 64 random bits from the operating system.
std::uint64_t RandomSeed();

}  // namespace legopt::bus
