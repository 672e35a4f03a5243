#pragma once

#include <array>
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

#include "bus/bulk_receiver.h"
#include "bus/bulk_sender.h"
#include "bus/endpoint.h"
#include "bus/pacer.h"
#include "bus/replay_guard.h"
#include "bus/reply_cache.h"
#include "bus/retry_policy.h"
#include "bus/wire.h"

/// @file
/// Implementation of Endpoint. Private to bus; see endpoint.h for the contract.

namespace legopt::bus {

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
