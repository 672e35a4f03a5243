// Parts of an endpoint that only deployments with a key need: proofs of sessions and rejection of replays (PROTOCOL.md,
// section 11).
#include <algorithm>
#include <string_view>

#include "bus/endpoint_core.h"

namespace legopt::bus {

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
