#include "bus/endpoint_core.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "bus/bus_error.h"
#include "bus/codec.h"
#include "bus/field_check.h"

namespace legopt::bus {
namespace {

constexpr std::size_t kMaxErrorTextBytes = 500;

}  // namespace

EndpointCore::EndpointCore(Transport& transport, EndpointId self, std::uint64_t seed, const EndpointOptions& options)
    : transport_(transport),
      self_(self),
      role_(transport.key() == nullptr ? KeyRole::kOperator : transport.key()->role()),
      options_(options),
      random_(seed),
      session_(static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(INT64_MAX)) + 1),
      sender_(
          counters_, [this](const ObjectKey& key, std::int16_t type, const ChunkView& c) { EmitChunk(key, type, c); },
          [this](const ObjectKey& key, bool delivered) { OnBodyDone(key, delivered); }),
      receiver_(counters_, {options.max_incoming_bytes, options.incoming_object_lifetime},
                static_cast<std::int64_t>(random_() >> 2U) + 1),
      replies_(counters_, {options.max_cached_bytes, options.max_open_requests, options.max_peers}) {
  PrepareHashing();
  if (self < 1) throw BusError(BusErrorCode::kInvalidOption, "endpoint id: " + std::to_string(self) + ": must be > 0");
  if (options.max_object_bytes == 0 || options.max_object_bytes > kMaxMessageBytes) {
    throw BusError(BusErrorCode::kInvalidOption, "max_object_bytes: " + std::to_string(options.max_object_bytes) +
                                                     ": must be in 1 .. " + std::to_string(kMaxMessageBytes));
  }
  if (transport_.key() != nullptr) guard_.emplace(options.max_peers, random_());
  transport_.SetReceiver(this, self_);
}

EndpointCore::~EndpointCore() { transport_.SetReceiver(nullptr, self_); }

std::size_t EndpointCore::held_bytes() const {
  return replies_.held_bytes() + sender_.held_bytes() + receiver_.held_bytes();
}

const Counters& EndpointCore::counters() {
  const TransportCounters transport = transport_.counters();
  counters_.datagrams_sent = transport.datagrams_sent;
  counters_.datagrams_received = transport.datagrams_received;
  counters_.bytes_sent = transport.bytes_sent;
  counters_.bytes_received = transport.bytes_received;
  counters_.send_failures = transport.send_failures;
  counters_.kernel_drops = transport.kernel_drops;
  counters_.kernel_filtered = transport.kernel_filtered;
  return counters_;
}

// ---- Calls made by this endpoint ----

CallId EndpointCore::Call(EndpointId to, MessageType type, std::string body, const CallOptions& options,
                          CallCallback callback) {
  constexpr auto kLongestTimeout = std::chrono::hours(1);
  const auto refuse = [](const std::string& fault) { throw BusError(BusErrorCode::kInvalidOption, fault); };
  if (to < 1) refuse("call destination: " + std::to_string(to) + ": must be > 0");
  if (body.size() > options_.max_object_bytes) {
    refuse("call body: " + std::to_string(body.size()) + " bytes: limit " + std::to_string(options_.max_object_bytes));
  }
  if (options.timeout <= microseconds(0) || options.timeout > kLongestTimeout) {
    refuse("call timeout: " + std::to_string(options.timeout.count()) + " us: must be in (0, 1 h]");
  }
  if (options.first_retry <= microseconds(0) || options.max_retry < options.first_retry) {
    refuse("call first_retry, max_retry: must be > 0 and ascending");
  }
  const CallId id = next_call_++;
  OpenCall call;
  call.to = to;
  call.type = type;
  call.large = body.size() > kMaxPayloadBytes;
  call.body = std::make_shared<const std::string>(std::move(body));
  call.options = options;
  call.callback = std::move(callback);
  call.deadline = now() + options.timeout;
  call.interval = retry_policy_.First(options.first_retry, options.max_retry);
  OpenCall& open = calls_.emplace(id, std::move(call)).first->second;
  ++counters_.calls_started;
  if (open.large || (waiting_.empty() && pacer_.Take(now()))) {
    SendRequest(id, open);
    ArmRetry(id, open);
  } else {
    waiting_.push_back(id);
    open.next_retry = open.deadline;
    Arm(id, open);
  }
  return id;
}

void EndpointCore::SendRequest(CallId id, const OpenCall& call) {
  if (call.large) {
    sender_.Start(LocalObject(call.to, id, false), static_cast<std::int16_t>(call.type), call.body, now());
    return;
  }
  FrameHeader header =
      MakeHeader(FrameKind::kRequest, static_cast<std::int16_t>(call.type), {self_, session_, id, role_}, call.to);
  header.completed_below = CompletedBelow();
  SendSmall(header, *call.body);
}

void EndpointCore::SendWaiting() {
  while (!waiting_.empty()) {
    const auto call = calls_.find(waiting_.front());  // may be abandoned or finished by now
    if (call != calls_.end()) {
      if (!pacer_.Take(now())) return;
      SendRequest(call->first, call->second);
      ArmRetry(call->first, call->second);
    }
    waiting_.pop_front();
  }
}

microseconds EndpointCore::Jittered(microseconds interval) {
  constexpr std::uint64_t kSteps = 1024;
  const auto step = static_cast<std::int64_t>(random_() % kSteps);
  return interval * 3 / 4 + interval * step / (2 * static_cast<std::int64_t>(kSteps));
}

void EndpointCore::ArmRetry(CallId id, OpenCall& call) {
  // While a large body is being sent, its chunks are repeated instead; OnBodyDone arms the retry.
  if (call.large && sender_.Sending(LocalObject(call.to, id, false))) {
    call.next_retry = call.deadline;
  } else {
    call.next_retry = now() + Jittered(call.interval);
    call.interval = std::min(call.options.max_retry, call.interval * 2);
  }
  Arm(id, call);
}

void EndpointCore::Arm(CallId id, const OpenCall& call) {
  timers_.push({std::min(call.next_retry, call.deadline), id});
}

void EndpointCore::OnCallTimer(CallId id, microseconds now) {
  const auto found = calls_.find(id);
  if (found == calls_.end()) return;
  OpenCall& call = found->second;
  if (now >= call.deadline) {
    ++counters_.calls_timed_out;
    retry_policy_.RecordCallEnd(call.options.timeout);
    CallResult result;
    result.status = CallResult::kTimeout;
    result.error = "no answer to " + std::string(ToString(call.type)) + " within " +
                   std::to_string(call.options.timeout.count() / 1000) + " ms";
    Finish(found, std::move(result));
    return;
  }
  if (now < call.next_retry) return;  // an outdated timer
  ++counters_.requests_retried;
  call.repeated = true;
  if (call.large) {
    sender_.RequestAck(LocalObject(call.to, id, false), static_cast<std::int16_t>(call.type), call.body);
  } else {
    SendRequest(id, call);
  }
  ArmRetry(id, call);
}

void EndpointCore::OnBodyDone(const ObjectKey& key, bool delivered) {
  if (key.of_reply) return;
  const auto found = calls_.find(key.call_id);
  if (found == calls_.end()) return;
  if (!delivered) SendRequest(key.call_id, found->second);
  ArmRetry(key.call_id, found->second);
}

void EndpointCore::Finish(Calls::iterator call, CallResult result) {
  if (call->second.large) {
    // Removed from calls_ first: cancelling may send chunks of other calls, whose headers report the finished calls.
    const ObjectKey key = LocalObject(call->second.to, call->first, false);
    finished_.emplace_back(std::move(call->second.callback), std::move(result));
    receiver_.Drop(LocalObject(key.peer, key.call_id, true));
    calls_.erase(call);
    sender_.Cancel(key, now());
    return;
  }
  receiver_.Drop(LocalObject(call->second.to, call->first, true));
  finished_.emplace_back(std::move(call->second.callback), std::move(result));
  calls_.erase(call);
}

void EndpointCore::Abandon(CallId id) {
  const auto call = calls_.find(id);
  if (call == calls_.end()) return;
  const ObjectKey key = LocalObject(call->second.to, id, false);
  ++counters_.calls_abandoned;
  calls_.erase(call);
  receiver_.Drop(LocalObject(key.peer, id, true));
  sender_.Cancel(key, now());
}

void EndpointCore::Serve(MessageType type, RequestHandler handler) {
  const auto index = static_cast<std::int16_t>(type);
  if (index < 1 || index > kLastMessageType) {
    throw BusError(BusErrorCode::kInvalidOption,
                   "message type: " + std::to_string(index) + ": must be in 1 .. " + std::to_string(kLastMessageType));
  }
  auto& slot = handlers_[static_cast<std::size_t>(index)];
  slot = handler ? std::make_shared<const RequestHandler>(std::move(handler)) : nullptr;
}

// ---- Time ----

std::optional<microseconds> EndpointCore::next_timer() const {
  std::optional<microseconds> next;
  const auto consider = [&next](std::optional<microseconds> due) {
    if (due && (!next || *due < *next)) next = due;
  };
  if (!finished_.empty()) next = transport_.now();
  if (!timers_.empty()) consider(timers_.top().due);
  if (!waiting_.empty()) consider(pacer_.next());
  consider(sender_.next_timer());
  consider(receiver_.next_timer());
  return next;
}

void EndpointCore::RunTimers() {
  const microseconds time = now();
  while (!timers_.empty() && timers_.top().due <= time) {
    const CallId call = timers_.top().call;
    timers_.pop();
    OnCallTimer(call, time);
  }
  SendWaiting();
  sender_.OnTimer(time);
  receiver_.OnTimer(time);
}

void EndpointCore::RunCallbacks() {
  while (!finished_.empty()) {
    auto [callback, result] = std::move(finished_.front());
    finished_.pop_front();
    if (callback) callback(std::move(result));
  }
}

void EndpointCore::PollWith(std::span<pollfd> extra, microseconds max_wait) {
  if (polling_) {
    std::fprintf(stderr, "legopt bus: broken invariant: Endpoint::Poll of %lld re-entered from a handler or callback\n",
                 static_cast<long long>(self_));
    std::abort();
  }
  struct Flag {
    bool& value;
    explicit Flag(bool& v) : value(v) { value = true; }
    ~Flag() { value = false; }
  } flag(polling_);
  microseconds wait = std::max(max_wait, microseconds(0));
  if (const auto due = next_timer()) wait = std::clamp(*due - now(), microseconds(0), wait);
  transport_.Poll(extra, wait);
  RunTimers();
  RunCallbacks();
}

// ---- Calls served by this endpoint ----

void EndpointCore::RunHandler(const FrameHeader& header, std::string body) {
  const CallKey key = CallerKey(header);
  const auto handler = handlers_[static_cast<std::size_t>(header.type)];
  Responder responder(weak_from_this(), key.caller, key.session, key.call_id, key.role);
  ++counters_.requests_handled;
  std::string fault;
  try {
    (*handler)(Request{header.sender, header.role, static_cast<MessageType>(header.type), std::move(body)}, responder);
    return;
  } catch (const std::exception& error) {
    fault = error.what();
  } catch (...) {
    fault = "unknown exception";
  }
  ++counters_.handler_failures;
  responder.Reject(ErrorCode::kHandlerFailed, fault);
}

void EndpointCore::OnRequest(const FrameHeader& header, std::string body) {
  const CallKey key = CallerKey(header);
  if (!Serves(header.type)) {
    ++counters_.rejected_type;
    SendError(key, header.type, ErrorCode::kUnknownType,
              "no program serves " + std::string(ToString(static_cast<MessageType>(header.type))) + " here");
    return;
  }
  if (RefuseRole(header)) return;
  const ReplyCache::Lookup lookup = replies_.Open(key, header.type, header.completed_below);
  switch (lookup.verdict) {
    case ReplyCache::Verdict::kNew:
      RunHandler(header, std::move(body));
      return;
    case ReplyCache::Verdict::kBusy:
      ++counters_.requests_refused_busy;
      SendError(key, header.type, ErrorCode::kBusy, "too many open requests");
      return;
    case ReplyCache::Verdict::kEvicted:
      ++counters_.duplicate_requests;
      SendError(key, header.type, ErrorCode::kReplyGone, "handled before; the reply is no longer kept");
      return;
    case ReplyCache::Verdict::kAnswered:
      ++counters_.duplicate_requests;
      ++counters_.replies_resent;
      SendReply(key, lookup.reply);
      return;
    case ReplyCache::Verdict::kOpen:
    case ReplyCache::Verdict::kFinishedByCaller:
      ++counters_.duplicate_requests;
      return;
  }
}

void EndpointCore::Answer(const CallKey& key, std::int16_t error, std::string body) {
  if (error == 0 && body.size() > options_.max_object_bytes) {
    error = static_cast<std::int16_t>(ErrorCode::kTooLarge);
    body =
        "the reply has " + std::to_string(body.size()) + " bytes, limit " + std::to_string(options_.max_object_bytes);
  }
  if (error != 0) body = CleanText(std::move(body), kMaxErrorTextBytes);
  if (error == static_cast<std::int16_t>(ErrorCode::kMalformed)) ++counters_.rejected_body;
  const auto reply = replies_.Answer(key, error, std::make_shared<const std::string>(std::move(body)));
  if (reply) SendReply(key, *reply);
}

void EndpointCore::SendReply(const CallKey& key, const ReplyCache::Reply& reply) {
  if (reply.error != 0) {
    SendError(key, reply.type, static_cast<ErrorCode>(reply.error), *reply.body);
  } else if (reply.body->size() <= kMaxPayloadBytes) {
    SendSmall(MakeHeader(FrameKind::kReply, reply.type, key, key.caller), *reply.body);
  } else {
    const ObjectKey object{key.caller, key.session, key.call_id, true, key.role};
    if (!sender_.Sending(object)) sender_.Start(object, reply.type, reply.body, now());
  }
}

}  // namespace legopt::bus
