#include "bus/endpoint.h"

#include <sodium.h>

#include "bus/endpoint_core.h"

namespace legopt::bus {

std::uint64_t Counters::rejected() const {
  return rejected_size + rejected_malformed + rejected_version + rejected_deployment + rejected_tag +
         rejected_unsigned + rejected_replay + rejected_field + rejected_type + rejected_role + rejected_body +
         rejected_object;
}

std::vector<std::pair<std::string_view, std::uint64_t>> Counters::Listing() const {
  return {
      {"datagrams_sent", datagrams_sent},
      {"datagrams_received", datagrams_received},
      {"bytes_sent", bytes_sent},
      {"bytes_received", bytes_received},
      {"not_for_us", not_for_us},
      {"send_failures", send_failures},
      {"kernel_drops", kernel_drops},
      {"kernel_filtered", kernel_filtered},
      {"calls_started", calls_started},
      {"calls_completed", calls_completed},
      {"calls_rejected", calls_rejected},
      {"calls_timed_out", calls_timed_out},
      {"calls_abandoned", calls_abandoned},
      {"requests_retried", requests_retried},
      {"duplicate_replies", duplicate_replies},
      {"requests_handled", requests_handled},
      {"duplicate_requests", duplicate_requests},
      {"replies_resent", replies_resent},
      {"replies_evicted", replies_evicted},
      {"requests_refused_busy", requests_refused_busy},
      {"requests_challenged", requests_challenged},
      {"handler_failures", handler_failures},
      {"objects_sent", objects_sent},
      {"objects_received", objects_received},
      {"objects_expired", objects_expired},
      {"chunks_sent", chunks_sent},
      {"chunks_resent", chunks_resent},
      {"duplicate_chunks", duplicate_chunks},
      {"rejected_size", rejected_size},
      {"rejected_malformed", rejected_malformed},
      {"rejected_version", rejected_version},
      {"rejected_deployment", rejected_deployment},
      {"rejected_tag", rejected_tag},
      {"rejected_unsigned", rejected_unsigned},
      {"rejected_replay", rejected_replay},
      {"rejected_field", rejected_field},
      {"rejected_type", rejected_type},
      {"rejected_role", rejected_role},
      {"rejected_body", rejected_body},
      {"rejected_object", rejected_object},
  };
}

std::string_view ToString(ErrorCode code) {
  switch (code) {
    case ErrorCode::kVersionRefused:
      return "version_refused";
    case ErrorCode::kUnknownType:
      return "unknown_type";
    case ErrorCode::kMalformed:
      return "malformed";
    case ErrorCode::kHandlerFailed:
      return "handler_failed";
    case ErrorCode::kTooLarge:
      return "too_large";
    case ErrorCode::kBusy:
      return "busy";
    case ErrorCode::kReplyGone:
      return "reply_gone";
    case ErrorCode::kProveSession:
      return "prove_session";
    case ErrorCode::kKeyNeeded:
      return "key_needed";
    case ErrorCode::kRoleRefused:
      return "role_refused";
  }
  return "unknown";
}

void Responder::Reply(std::string body) {
  if (const auto core = core_.lock()) core->Answer({caller_, session_, call_, role_}, 0, std::move(body));
}

void Responder::Reject(ErrorCode code, std::string_view text) {
  if (const auto core = core_.lock()) {
    core->Answer({caller_, session_, call_, role_}, static_cast<std::int16_t>(code), std::string(text));
  }
}

Endpoint::Endpoint(Transport& transport, EndpointId self, std::uint64_t seed, EndpointOptions options)
    : core_(std::make_shared<EndpointCore>(transport, self, seed, options)) {}
Endpoint::~Endpoint() = default;

EndpointId Endpoint::id() const { return core_->id(); }
microseconds Endpoint::now() const { return core_->now(); }
CallId Endpoint::Call(EndpointId to, MessageType type, std::string body, const CallOptions& options,
                      CallCallback callback) {
  return core_->Call(to, type, std::move(body), options, std::move(callback));
}
void Endpoint::Abandon(CallId call) { core_->Abandon(call); }
void Endpoint::Serve(MessageType type, RequestHandler handler) { core_->Serve(type, std::move(handler)); }
void Endpoint::Poll(microseconds max_wait) { core_->PollWith({}, max_wait); }
void Endpoint::PollWith(std::span<pollfd> extra, microseconds max_wait) { core_->PollWith(extra, max_wait); }
std::optional<microseconds> Endpoint::next_timer() const { return core_->next_timer(); }
std::size_t Endpoint::num_open_calls() const { return core_->num_open_calls(); }
std::size_t Endpoint::held_bytes() const { return core_->held_bytes(); }
const Counters& Endpoint::counters() const { return core_->counters(); }

EndpointId RandomEndpointId() {
  constexpr std::uint64_t kFirst = std::uint64_t{1} << 32U;  // far above the role addresses
  constexpr auto kLast = static_cast<std::uint64_t>(INT64_MAX);
  return static_cast<EndpointId>(kFirst + RandomSeed() % (kLast - kFirst));
}

std::uint64_t RandomSeed() {
  PrepareHashing();
  std::uint64_t seed = 0;
  randombytes_buf(&seed, sizeof(seed));
  return seed;
}

}  // namespace legopt::bus
