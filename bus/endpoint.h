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

#include "bus/counters.h"
#include "bus/key_role.h"
#include "bus/messages.h"
#include "bus/transport.h"

/// @file
/// Layer 2 of the bus: calls between parties over an unreliable Transport.
///
/// A call is a request that is repeated, with exponential back-off and jitter, until its reply arrives or its time is
/// up. The other side handles each call once, however often the request arrives, and repeats its reply from a cache.
/// Bodies above one datagram travel as acknowledged chunks (window <= 32, hashed) on the bulk port; callers and
/// handlers do not notice. Semantics and limits: lcmtypes/PROTOCOL.md.
///
/// "Once" holds while both parties live: after a restart of the server, or when the reply cache overflows, a call may
/// reach a handler again or be refused; handlers of changing requests are therefore idempotent by their own ids.
///
/// Thread rule: one thread makes, polls and destroys an endpoint; handlers and callbacks run inside Poll on that thread
/// and may call everything but Poll; neither may destroy the endpoint. An exception from a handler is caught (see
/// Serve); one from a call's callback leaves Poll, and the endpoint stays usable. To answer from elsewhere, hand the
/// work back to this thread, e.g. by an eventfd given to PollWith.

namespace legopt::bus {

/// Why a request was refused, on the wire. PROTOCOL.md, section 8.
enum class ErrorCode : std::int16_t {
  kVersionRefused = 1,  ///< the peer speaks another protocol version
  kUnknownType = 2,     ///< nobody serves this message type there
  kMalformed = 3,       ///< body undecodable or a field out of range; the text names it
  kHandlerFailed = 4,   ///< the handler threw
  kTooLarge = 5,        ///< body or reply above the limit of an object
  kBusy = 6,            ///< too many open requests; the caller goes on retrying, so this ends no call
  kReplyGone = 7,       ///< handled before, but the reply is no longer cached
  kProveSession = 8,    ///< with a key: answered by the bus itself, ends no call
  kKeyNeeded = 9,       ///< the deployment has a key and the request was made without one
  kRoleRefused = 10,    ///< the caller's key is that of a role which may not make this call
};
/// "version_refused", "unknown_type", ...: the enumerator's name; "unknown" for anything else.
std::string_view ToString(ErrorCode code);

/// What a handler is given.
struct Request {
  EndpointId sender = 0;  ///< who asks; answered by the Responder
  KeyRole role{};         ///< role of the caller's key, which may make this call; without a key an operator
  MessageType type{};     ///< of the call
  std::string body;       ///< encoded as the sender had it; not checked yet
};

class EndpointCore;

/// The right to answer one request, once. Copyable and movable; may be kept and used later (e.g. after a commit), on
/// the endpoint's thread, also after the endpoint is gone (then it does nothing). Further answers are ignored. A
/// request whose responders are all destroyed unanswered stays open until its caller gives up.
class Responder {
 public:
  Responder() = default;
  /// Answers with an encoded message. One above the limit of an object becomes a refusal, kTooLarge.
  void Reply(std::string body);
  /// Ends the call with CallResult::kRejected; `text` (at most 500 bytes are sent) reaches the caller.
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

/// How long and how often a call is tried.
struct CallOptions {
  microseconds timeout = std::chrono::seconds(10);           ///< (0, 1 h]
  microseconds first_retry = std::chrono::milliseconds(50);  ///< > 0; doubles each time, +-25 % jitter
  microseconds max_retry = std::chrono::seconds(1);          ///< longest interval, >= first_retry
};

/// How a call ended.
struct CallResult {
  /// How a call ended.
  enum Status {
    kOk,       ///< with a reply
    kTimeout,  ///< its effect is unknown
    kRejected  ///< by an error reply
  };
  Status status = kTimeout;  ///< how
  std::string body;          ///< of the reply, kOk
  ErrorCode code{};          ///< kRejected
  std::string error;         ///< kRejected and kTimeout: a sentence for humans
};

using CallId = std::int64_t;  ///< positive, unique per endpoint
/// Called once, with the end of a call.
using CallCallback = std::function<void(CallResult&&)>;
/// Called once for each new request; answers now or later.
using RequestHandler = std::function<void(Request&&, Responder)>;

/// Limits of an endpoint's memory, in bytes where they do not count.
struct EndpointOptions {
  std::size_t max_object_bytes = std::size_t{64} << 20;  ///< largest body, either direction
  /// Replies kept for repeated requests. When exceeded, the oldest replies are forgotten.
  std::size_t max_cached_bytes = std::size_t{64} << 20;
  /// Incomplete incoming bodies. A body that does not fit waits (its chunks are not acknowledged).
  std::size_t max_incoming_bytes = std::size_t{256} << 20;
  std::size_t max_open_requests = 16384;  ///< requests handed to handlers and not answered; above: busy
  std::size_t max_peers = 65'536;         ///< callers remembered; the longest silent one is forgotten first
  microseconds incoming_object_lifetime = std::chrono::seconds(10);  ///< without a new chunk
};

/// One party: makes calls to others and serves theirs. endpoint.h says what holds, and the thread rule.
class Endpoint {
 public:
  /// `transport` must outlive the endpoint and serve it alone. `self` is positive; `seed` decides jitter and the
  /// session number (use RandomSeed() in programs, a fixed value in tests). Throws BusError (kInvalidOption).
  Endpoint(Transport& transport, EndpointId self, std::uint64_t seed, EndpointOptions options = {});
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  EndpointId id() const;     ///< as given at construction
  microseconds now() const;  ///< the transport's steady clock

  /// Starts a call. `callback` runs once, inside a later Poll, never inside Call; it may be empty. Order of calls to
  /// one peer is not kept. A body above max_object_bytes, or bad options, throw BusError (kInvalidOption).
  CallId Call(EndpointId to, MessageType type, std::string body, const CallOptions& options, CallCallback callback);
  /// Forgets a call; its callback is destroyed without being run. Unknown or finished ids are ignored.
  void Abandon(CallId call);

  /// Registers the handler of a message type; an empty one unregisters. Callers whose role may not make the call are
  /// refused before it (kRoleRefused). Exceptions from a handler are caught, counted
  /// and answered with kHandlerFailed.
  void Serve(MessageType type, RequestHandler handler);

  /// Receives, retries and times out; returns after `max_wait`, or early when something was handled. Re-entering
  /// aborts.
  void Poll(microseconds max_wait);
  /// The same, also returning when one of `extra` is ready (revents is filled in).
  void PollWith(std::span<pollfd> extra, microseconds max_wait);

  /// When Poll has something to do even if nothing arrives; empty when it has not. For drivers of virtual time.
  std::optional<microseconds> next_timer() const;

  /// Calls of ours still open, and bytes held for replies, incoming and outgoing bodies (for tests and status).
  std::size_t num_open_calls() const;
  /// See num_open_calls().
  std::size_t held_bytes() const;

  /// Refreshed from the transport at each call.
  const Counters& counters() const;

 private:
  std::shared_ptr<EndpointCore> core_;
};

/// 63 random bits from the operating system, above the role addresses.
EndpointId RandomEndpointId();
/// 64 random bits from the operating system.
std::uint64_t RandomSeed();

}  // namespace legopt::bus
