#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "bus/bulk_transfer.h"
#include "bus/endpoint.h"
#include "bus/replay_guard.h"
#include "bus/reply_cache.h"
#include "bus/wire.h"

namespace legopt::bus {

/// @file
/// Token bucket that limits bursts of small requests to a size that a receiver's buffer holds without loss. Larger
/// bursts must be expected to lose datagrams; paced traffic does not:
/// docs/explanation/reliability.md#what-lcm-and-udp-do. Private to bus.

/// Token bucket for small requests.
class Pacer {
 public:
  /// Time of the transport's steady clock.
  using microseconds = std::chrono::microseconds;
  static constexpr int kBurst = 48;             ///< requests sent without waiting
  static constexpr microseconds kInterval{25};  ///< minimum interval after that: 40,000 requests / s

  /// Takes a token for one request. Returns false if the request must wait.
  bool Take(microseconds now) {
    const auto earned = (now - refilled_) / kInterval;
    if (earned > 0) {
      tokens_ = static_cast<int>(std::min<std::int64_t>(kBurst, tokens_ + earned));
      refilled_ = tokens_ == kBurst ? now : refilled_ + earned * kInterval;
    }
    if (tokens_ == 0) return false;
    --tokens_;
    return true;
  }
  /// Time of the next token after Take() returned false.
  microseconds next() const { return refilled_ + kInterval; }

 private:
  int tokens_ = kBurst;
  microseconds refilled_{0};
};

// Adapts the interval before a caller's first retry, based on retries that turned out to be unnecessary. Private to
// bus.
//
// If datagrams queue for longer than the first interval, every request is repeated although nothing is lost. The
// repeats keep the queue full, so that a server that could otherwise serve all its callers never catches up. A reply
// to a finished call shows that a repeat was unnecessary. (Response times are no measure: with losses they include the
// wait for a repeat, so a delay derived from them would grow without bound.)

/// Adaptive interval before the first retry. Thread rule: none.
class RetryPolicy {
 public:
  /// Time of the transport's steady clock.
  using microseconds = std::chrono::microseconds;
  static constexpr microseconds kLeast = std::chrono::milliseconds(50);  ///< initial and minimum value
  static constexpr microseconds kMost = std::chrono::milliseconds(500);  ///< maximum value

  /// Returns the interval before the first repeat of a call: at least `wanted`, at most `longest` (>= wanted).
  microseconds First(microseconds wanted, microseconds longest) const {
    return learnt_ == kLeast ? wanted : std::clamp(learnt_, wanted, longest);
  }
  /// Returns how long a proof may be in flight: at most until the first repeat of a call, including jitter.
  microseconds PendingProof() const { return learnt_ * 3 / 4; }
  /// Records a reply to a finished call, which shows that its repeat was unnecessary. The interval grows only at the
  /// second late reply to the same call: a single one may be chance if some datagrams are lost and some late.
  void RecordNeedlessRetry(std::int64_t call) {
    if (std::exchange(late_, call) == call) learnt_ = std::min(std::max(learnt_, last_took_ * 5 / 4), kMost);
  }
  /// Records that a call ended `took` after its start, by a reply or by its deadline.
  void RecordCallEnd(microseconds took) { last_took_ = took; }
  /// Records that a call was answered without a repeat, `took` after its start.
  void RecordReply(microseconds took) {
    constexpr int kShare = 2;
    RecordCallEnd(took);
    if (2 * took < learnt_) learnt_ = std::max(learnt_ - learnt_ / kShare, kLeast);
  }

 private:
  microseconds learnt_ = kLeast;
  microseconds last_took_{0};
  std::int64_t late_ = 0;  // call of the last late reply
};

// Implementation of Endpoint. Private to bus; see endpoint.h for the contract.

/// Returns the key of the call to which a caller's frame belongs.
inline CallKey CallerKey(const FrameHeader& header) {
  return {header.sender, header.session, header.call_id, header.role};
}
/// Returns the key of the body to which a peer's frame belongs.
inline ObjectKey PeerObject(const FrameHeader& header, bool of_reply) {
  return {header.sender, header.session, header.call_id, of_reply, header.role};
}

/// Implementation of Endpoint. Functions without a comment are documented there.
class EndpointCore final : public DatagramReceiver, public std::enable_shared_from_this<EndpointCore> {
 public:
  /// See Endpoint.
  EndpointCore(Transport& transport, EndpointId self, std::uint64_t seed, const EndpointOptions& options);
  ~EndpointCore();
  EndpointCore(const EndpointCore&) = delete;
  EndpointCore& operator=(const EndpointCore&) = delete;

  EndpointId id() const { return self_; }
  microseconds now() const { return transport_.now(); }
  /// See Endpoint::Call.
  CallId Call(EndpointId to, MessageType type, std::string body, const CallOptions& options, CallCallback callback);
  void Abandon(CallId id);                               ///< see Endpoint
  void Serve(MessageType type, RequestHandler handler);  ///< see Endpoint
  /// See Endpoint::PollWith.
  void PollWith(std::span<pollfd> extra, microseconds max_wait);
  std::optional<microseconds> next_timer() const;
  std::size_t num_open_calls() const { return calls_.size(); }
  std::size_t held_bytes() const;
  const Counters& counters();

  /// Answers a call for a Responder. If `error` is 0, `body` is the reply; otherwise the text of a refusal.
  void Answer(const CallKey& key, std::int16_t error, std::string body);

  void OnDatagram(Port port, std::span<const std::uint8_t> datagram) noexcept override;

 private:
  struct OpenCall {
    EndpointId to = 0;
    MessageType type{};
    std::shared_ptr<const std::string> body;
    CallOptions options;
    CallCallback callback;
    microseconds deadline{0};
    microseconds next_retry{0};
    microseconds interval{0};
    bool large = false;      // the body travels as chunks
    bool repeated = false;   // a small request was sent again
    int prompt_repeats = 0;  // immediate repeats after a proof, see OnChallenge
  };
  using Calls = std::map<CallId, OpenCall>;  // ordered: the first one tells completed_below
  struct Timer {
    microseconds due;
    CallId call;
    bool operator>(const Timer& other) const { return std::tie(due, call) > std::tie(other.due, other.call); }
  };

  // Sending.
  FrameHeader MakeHeader(FrameKind kind, std::int16_t type, const CallKey& key, EndpointId to);
  void SendSmall(const FrameHeader& header, std::string_view payload, Port port = Port::kControl);
  void SendRequest(CallId id, const OpenCall& call);
  void SendReply(const CallKey& key, const ReplyCache::Reply& reply);
  // Returns the key of a body of one of this endpoint's calls.
  ObjectKey LocalObject(EndpointId peer, CallId id, bool of_reply) const {
    return {peer, session_, id, of_reply, role_};
  }
  void SendError(const CallKey& key, std::int16_t type, ErrorCode code, std::string_view text);
  void SendProof(const FrameHeader& challenged, std::int64_t challenge);
  void SendKeyHint(const FrameHeader& header);
  std::span<const std::uint8_t> Seal(const FrameHeader& header, std::size_t payload_bytes) {
    return SealFrame(header, payload_bytes, buffer_, transport_.key());
  }
  void SendAck(const ObjectKey& key, std::int16_t type, const ChunkAck& ack);
  void EmitChunk(const ObjectKey& key, std::int16_t type, const ChunkView& chunk);

  // Receiving.
  void Dispatch(const FrameView& frame);
  void CountFault(FrameFault fault, const FrameView& frame);
  bool Admit(const FrameHeader& header);  // returns false if the request must be dropped (only with a key)
  bool HasExpectedRole(const FrameView& frame) const;
  bool RefuseRole(const FrameHeader& header);
  void OnProof(const FrameView& frame);
  void OnChallenge(Calls::iterator call, const FrameHeader& header, std::span<const std::uint8_t> payload);
  void OnRequest(const FrameHeader& header, std::string body);
  Calls::iterator FindOwnCall(const FrameHeader& header);  // counts frames without an open call
  void OnReply(const FrameHeader& header, std::span<const std::uint8_t> payload);
  void UpdateRetryPolicy(const OpenCall& call);
  void OnError(const FrameHeader& header, std::span<const std::uint8_t> payload);
  void OnChunk(const FrameView& frame);
  void OnRequestChunk(const FrameHeader& header, const ChunkView& chunk);
  void OnReplyChunk(const FrameHeader& header, const ChunkView& chunk);
  void OnAck(const FrameView& frame);
  bool Serves(std::int16_t type) const {
    return type <= kLastMessageType && handlers_[static_cast<std::size_t>(type)] != nullptr;
  }
  void RunHandler(const FrameHeader& header, std::string body);
  void OnBodyDone(const ObjectKey& key, bool delivered);

  // Calls.
  void SendWaiting();
  void ArmRetry(CallId id, OpenCall& call);
  void Arm(CallId id, const OpenCall& call);
  void OnCallTimer(CallId id, microseconds now);
  void Finish(Calls::iterator call, CallResult result);
  void RunTimers();
  void RunCallbacks();
  std::int64_t CompletedBelow() const { return calls_.empty() ? next_call_ : calls_.begin()->first; }
  microseconds Jittered(microseconds interval);

  Transport& transport_;
  EndpointId self_;
  KeyRole role_;  // role of the own key, used for the own calls
  EndpointOptions options_;
  std::mt19937_64 random_;
  std::int64_t session_;
  std::int64_t nonce_ = 0;
  mutable Counters counters_;
  BulkSender sender_;
  BulkReceiver receiver_;
  ReplyCache replies_;
  std::optional<ReplayGuard> guard_;  // set only with a key
  microseconds next_key_hint_{0};
  std::array<std::shared_ptr<const RequestHandler>, kLastMessageType + 1> handlers_;
  Calls calls_;
  CallId next_call_ = 1;
  std::priority_queue<Timer, std::vector<Timer>, std::greater<>> timers_;
  Pacer pacer_;
  RetryPolicy retry_policy_;
  std::int64_t last_challenge_ = 0;  // last proven challenge; last_proof_ is its time
  microseconds last_proof_{0};
  std::deque<CallId> waiting_;                                // small requests delayed by the pacer
  std::deque<std::pair<CallCallback, CallResult>> finished_;  // callbacks to run once no caller's frame is on the stack
  bool polling_ = false;
  DatagramBuffer buffer_{};
};

}  // namespace legopt::bus
