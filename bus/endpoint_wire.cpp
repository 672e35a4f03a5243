#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include "bus/endpoint_core.h"
#include "bus/field_check.h"

namespace legopt::bus {

// Receiving side of an endpoint, and encoding of its frames.

namespace {

bool IsRequest(FrameKind kind) { return kind == FrameKind::kRequest || kind == FrameKind::kRequestChunk; }

std::string Text(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace

// ---- Sending ----

FrameHeader EndpointCore::MakeHeader(FrameKind kind, std::int16_t type, const CallKey& key, EndpointId to) {
  FrameHeader header;
  header.kind = kind;
  header.type = type;
  header.deployment = transport_.deployment();
  header.sender = self_;
  header.destination = to;
  header.session = key.session;
  header.call_id = key.call_id;
  header.nonce = ++nonce_;
  header.role = key.role;
  return header;
}

void EndpointCore::SendSmall(const FrameHeader& header, std::string_view payload, Port port) {
  std::memcpy(buffer_.data() + kFrameHeaderBytes, payload.data(), payload.size());
  transport_.Send(port, Seal(header, payload.size()));
}

void EndpointCore::SendError(const CallKey& key, std::int16_t type, ErrorCode code, std::string_view text) {
  FrameHeader header = MakeHeader(FrameKind::kError, type, key, key.caller);
  header.code = static_cast<std::int16_t>(code);
  SendSmall(header, text);
}

void EndpointCore::SendAck(const ObjectKey& key, std::int16_t type, const ChunkAck& ack) {
  const FrameHeader header =
      MakeHeader(FrameKind::kChunkAck, type, {key.peer, key.session, key.call_id, key.role}, key.peer);
  const std::size_t bytes = WriteAck(ack, buffer_.data() + kFrameHeaderBytes);
  transport_.Send(Port::kBulk, Seal(header, bytes));
}

void EndpointCore::EmitChunk(const ObjectKey& key, std::int16_t type, const ChunkView& chunk) {
  const FrameKind kind = key.of_reply ? FrameKind::kReplyChunk : FrameKind::kRequestChunk;
  FrameHeader header = MakeHeader(kind, type, {key.peer, key.session, key.call_id, key.role}, key.peer);
  if (!key.of_reply) header.completed_below = std::min(CompletedBelow(), key.call_id);
  const std::size_t bytes = WriteChunk(chunk, buffer_.data() + kFrameHeaderBytes);
  transport_.Send(Port::kBulk, Seal(header, bytes));
}

// ---- Receiving ----

void EndpointCore::OnDatagram(Port /*port*/, std::span<const std::uint8_t> datagram) noexcept {
  try {
    FrameView frame;
    const FrameFault fault = OpenFrame(datagram, transport_.deployment(), self_, frame, transport_.key());
    if (fault == FrameFault::kNone) {
      Dispatch(frame);
    } else {
      CountFault(fault, frame);
    }
  } catch (...) {
    ++counters_.handler_failures;  // worst case: out of memory; the datagram is lost and its sender repeats it
  }
}

void EndpointCore::CountFault(FrameFault fault, const FrameView& frame) {
  switch (fault) {
    case FrameFault::kNone:
      return;
    case FrameFault::kSize:
      ++counters_.rejected_size;
      return;
    case FrameFault::kMalformed:
      ++counters_.rejected_malformed;
      return;
    case FrameFault::kDeployment:
      ++counters_.rejected_deployment;
      return;
    case FrameFault::kNotForUs:
      ++counters_.not_for_us;
      return;
    case FrameFault::kTag:
      ++counters_.rejected_tag;
      return;
    case FrameFault::kUnsigned:
      ++counters_.rejected_unsigned;
      if (IsRequest(frame.header.kind)) SendKeyHint(frame.header);
      return;
    case FrameFault::kField:
      ++counters_.rejected_field;
      return;
    case FrameFault::kVersion:
      ++counters_.rejected_version;
      if (IsRequest(frame.header.kind)) {
        SendError(CallerKey(frame.header), frame.header.type, ErrorCode::kVersionRefused,
                  "protocol version " + std::to_string(frame.header.version) + " refused: this party speaks version " +
                      std::to_string(kProtocolVersion) + "; use the same release on both sides");
      } else if (frame.header.kind == FrameKind::kError && HasExpectedRole(frame) &&
                 frame.header.code == static_cast<std::int16_t>(ErrorCode::kVersionRefused)) {
        OnError(frame.header, frame.payload);
      }
      return;
  }
}

// The server replies with the key of the caller's role. A frame with another role's key, although derived from the same
// full key, is no answer of the server.
bool EndpointCore::HasExpectedRole(const FrameView& frame) const {
  switch (frame.header.kind) {
    case FrameKind::kReply:
    case FrameKind::kError:
    case FrameKind::kReplyChunk:
      return frame.header.role == role_;
    case FrameKind::kRequest:
    case FrameKind::kRequestChunk:
    case FrameKind::kChunkAck:  // OnAck checks the role
    case FrameKind::kProof:
      return true;
  }
  return false;
}

void EndpointCore::Dispatch(const FrameView& frame) {
  if (!HasExpectedRole(frame)) {
    ++counters_.rejected_tag;
    return;
  }
  if (IsRequest(frame.header.kind) && !Admit(frame.header)) return;
  switch (frame.header.kind) {
    case FrameKind::kRequest:
      OnRequest(frame.header, Text(frame.payload));
      return;
    case FrameKind::kReply:
      OnReply(frame.header, frame.payload);
      return;
    case FrameKind::kError:
      OnError(frame.header, frame.payload);
      return;
    case FrameKind::kRequestChunk:
    case FrameKind::kReplyChunk:
      OnChunk(frame);
      return;
    case FrameKind::kChunkAck:
      OnAck(frame);
      return;
    case FrameKind::kProof:
      OnProof(frame);
      return;
  }
}

EndpointCore::Calls::iterator EndpointCore::FindOwnCall(const FrameHeader& header) {
  const auto call = header.session == session_ ? calls_.find(header.call_id) : calls_.end();
  if (call != calls_.end() && call->second.to == header.sender) return call;
  if (header.session == session_ && header.call_id < next_call_) {
    ++counters_.duplicate_replies;
    retry_policy_.RecordNeedlessRetry(header.call_id);
  } else {
    ++counters_.rejected_field;
  }
  return calls_.end();
}

void EndpointCore::UpdateRetryPolicy(const OpenCall& call) {
  if (call.large) return;
  const microseconds took = now() - (call.deadline - call.options.timeout);
  if (call.repeated) {
    retry_policy_.RecordCallEnd(took);
  } else {
    retry_policy_.RecordReply(took);
  }
}

void EndpointCore::OnReply(const FrameHeader& header, std::span<const std::uint8_t> payload) {
  const auto call = FindOwnCall(header);
  if (call == calls_.end()) return;
  UpdateRetryPolicy(call->second);
  ++counters_.calls_completed;
  CallResult result;
  result.status = CallResult::kOk;
  result.body = Text(payload);
  Finish(call, std::move(result));
}

void EndpointCore::OnError(const FrameHeader& header, std::span<const std::uint8_t> payload) {
  const auto call = FindOwnCall(header);
  if (call == calls_.end()) return;
  if (header.code == static_cast<std::int16_t>(ErrorCode::kBusy)) return;  // retried less and less often
  if (guard_ && header.code == static_cast<std::int16_t>(ErrorCode::kProveSession)) {
    OnChallenge(call, header, payload);
    return;
  }
  ++counters_.calls_rejected;
  CallResult result;
  result.status = CallResult::kRejected;
  result.code = static_cast<ErrorCode>(header.code);
  result.error = CleanText(Text(payload), kMaxPayloadBytes);
  Finish(call, std::move(result));
}

void EndpointCore::OnChunk(const FrameView& frame) {
  ChunkView chunk;
  if (!ReadChunk(frame.payload, options_.max_object_bytes, chunk)) {
    ++counters_.rejected_field;
    return;
  }
  if (frame.header.kind == FrameKind::kRequestChunk) {
    OnRequestChunk(frame.header, chunk);
  } else {
    OnReplyChunk(frame.header, chunk);
  }
}

void EndpointCore::OnRequestChunk(const FrameHeader& header, const ChunkView& chunk) {
  const ObjectKey object = PeerObject(header, false);
  const CallKey key = CallerKey(header);
  const auto verdict = replies_.Find(key).verdict;
  if (!Serves(header.type)) {
    if (chunk.ack_requested) OnRequest(header, {});  // is refused there
    return;
  }
  if (!MayCall(header.role, static_cast<MessageType>(header.type))) {
    if (chunk.ack_requested) RefuseRole(header);
    return;
  }
  if (verdict != ReplyCache::Verdict::kNew) {
    // The body is already complete. One answer per burst is enough.
    ++counters_.duplicate_chunks;
    if (!chunk.ack_requested) return;
    OnRequest(header, {});  // repeats the reply if there is one
    if (verdict == ReplyCache::Verdict::kOpen) SendAck(object, header.type, receiver_.CompleteAck(false));
    return;
  }
  BulkReceiver::Outcome outcome = receiver_.Accept(object, chunk, now());
  if (outcome.ack) SendAck(object, header.type, *outcome.ack);
  if (!outcome.body) return;
  OnRequest(header, std::move(*outcome.body));
  // A reply also acknowledges the request.
  if (replies_.Find(key).verdict == ReplyCache::Verdict::kOpen) {
    SendAck(object, header.type, receiver_.CompleteAck(false));
  }
}

void EndpointCore::OnReplyChunk(const FrameHeader& header, const ChunkView& chunk) {
  const ObjectKey object = PeerObject(header, true);
  const auto call = FindOwnCall(header);
  if (call == calls_.end()) {
    const bool ours = header.session == session_ && header.call_id < next_call_;
    if (ours && chunk.ack_requested) SendAck(object, header.type, receiver_.CompleteAck(true));
    return;
  }
  BulkReceiver::Outcome outcome = receiver_.Accept(object, chunk, now());
  if (outcome.ack) SendAck(object, header.type, *outcome.ack);
  if (!outcome.body) return;
  SendAck(object, header.type, receiver_.CompleteAck(true));
  ++counters_.calls_completed;
  CallResult result;
  result.status = CallResult::kOk;
  result.body = std::move(*outcome.body);
  Finish(call, std::move(result));
}

void EndpointCore::OnAck(const FrameView& frame) {
  const FrameHeader& header = frame.header;
  ChunkAck ack;
  // Bodies of this endpoint's calls are acknowledged under its own key.
  const bool of_own_call = header.session == session_ && header.role == role_;
  if (!ReadAck(frame.payload, ack) || (!ack.of_reply && !of_own_call)) {
    ++counters_.rejected_field;
    return;
  }
  const ObjectKey object = PeerObject(header, ack.of_reply);
  if (sender_.OnAck(object, ack, now()) || ack.of_reply || ack.complete) return;
  // The receiver of a reminder has lost the body, e.g. because it was restarted.
  const auto call = calls_.find(header.call_id);
  if (call == calls_.end() || call->second.to != header.sender || !call->second.large) return;
  SendRequest(call->first, call->second);
  ArmRetry(call->first, call->second);
}

// Parts of an endpoint that only deployments with a key need: proofs of sessions and rejection of replays (PROTOCOL.md,
// section 11).

// ---- Served party ----

bool EndpointCore::Admit(const FrameHeader& header) {
  if (!guard_) return true;
  switch (guard_->Check(header.sender, header.session, header.nonce, header.role)) {
    case ReplayGuard::Verdict::kFresh:
      return true;
    case ReplayGuard::Verdict::kReplayed:
      ++counters_.rejected_replay;
      return false;
    case ReplayGuard::Verdict::kUnproven:
      break;
  }
  ++counters_.requests_challenged;
  FrameHeader challenge = MakeHeader(FrameKind::kError, header.type, CallerKey(header), header.sender);
  challenge.code = static_cast<std::int16_t>(ErrorCode::kProveSession);
  WriteChallenge(guard_->challenge(), buffer_.data() + kFrameHeaderBytes);
  transport_.Send(Port::kControl, Seal(challenge, kChallengeBytes));
  return false;
}

void EndpointCore::OnProof(const FrameView& frame) {
  const FrameHeader& header = frame.header;
  const std::int64_t answer = ReadChallenge(frame.payload);
  if (!guard_ || answer == 0) {
    ++counters_.rejected_field;
  } else if (!guard_->Prove(header.sender, header.session, header.nonce, answer, header.role)) {
    ++counters_.rejected_replay;
  }
}

// Refuses a call that the caller's role does not permit; returns false if it is permitted.
bool EndpointCore::RefuseRole(const FrameHeader& header) {
  const auto type = static_cast<MessageType>(header.type);
  if (MayCall(header.role, type)) return false;
  ++counters_.rejected_role;
  SendError(CallerKey(header), header.type, ErrorCode::kRoleRefused,
            RoleRefusal(header.role, ToString(type), CallersOf(type)));
  return true;
}

// Informs a caller without a key, which cannot verify a tagged refusal, that a key is required. The rate is limited, so
// that a flood of unsigned requests does not cause a flood of answers.
void EndpointCore::SendKeyHint(const FrameHeader& header) {
  constexpr microseconds kInterval = std::chrono::milliseconds(100);
  constexpr std::string_view kHint = "this deployment uses a key: give the same one with --key-file or LEGOPT_KEY_FILE";
  if (now() < next_key_hint_) return;
  next_key_hint_ = now() + kInterval;
  FrameHeader hint = MakeHeader(FrameKind::kError, header.type, CallerKey(header), header.sender);
  hint.code = static_cast<std::int16_t>(ErrorCode::kKeyNeeded);
  std::copy(kHint.begin(), kHint.end(), buffer_.begin() + kFrameHeaderBytes);
  transport_.Send(Port::kControl, SealFrame(hint, kHint.size(), buffer_));
}

// ---- Caller ----

void EndpointCore::SendProof(const FrameHeader& challenged, std::int64_t challenge) {
  const FrameHeader proof =
      MakeHeader(FrameKind::kProof, challenged.type, {self_, session_, challenged.call_id, role_}, challenged.sender);
  WriteChallenge(challenge, buffer_.data() + kFrameHeaderBytes);
  transport_.Send(Port::kControl, Seal(proof, kChallengeBytes));
}

// Sends a proof and repeats the request immediately instead of after its interval. Done only a few times per call, so
// that a party that keeps sending challenges cannot keep this endpoint busy. Large bodies repeat their own chunks. No
// second proof of the same challenge is sent while one may be in flight: otherwise each of ten thousand callers would
// answer every repeat twice.
void EndpointCore::OnChallenge(Calls::iterator call, const FrameHeader& header, std::span<const std::uint8_t> payload) {
  constexpr int kPromptRepeats = 4;
  const std::int64_t challenge = ReadChallenge(payload);
  if (challenge == 0) {
    ++counters_.rejected_field;
    return;
  }
  const bool is_proven = challenge == last_challenge_ && now() - last_proof_ < retry_policy_.PendingProof();
  if (is_proven && call->second.prompt_repeats > 0) return;
  if (!is_proven) {
    last_challenge_ = challenge;
    last_proof_ = now();
    SendProof(header, challenge);
  }
  if (call->second.large || call->second.prompt_repeats >= kPromptRepeats) return;
  ++call->second.prompt_repeats;
  SendRequest(call->first, call->second);
}

}  // namespace legopt::bus
