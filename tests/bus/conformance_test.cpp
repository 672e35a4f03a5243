// Guarantees for calls and large bodies that an Endpoint must keep over every transport (PROTOCOL.md, sections 5 and
// 6). Runs on the simulated network and on real multicast.
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "bus/wire.h"
#include "tests/bus/conformance_fixture.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;

class CallConformance : public Conformance {};

TEST_P(CallConformance, SmallCall) {
  ServeEcho(*server_);
  const CallResult result = CallAndWait("question");
  EXPECT_EQ(result.status, CallResult::kOk);
  EXPECT_EQ(result.body, "<question>");
  EXPECT_EQ(handled_, 1);
  EXPECT_EQ(client_->num_open_calls(), 0U);
}

TEST_P(CallConformance, EmptyBody) {
  ServeEcho(*server_);
  EXPECT_EQ(CallAndWait("").body, "<>");
}

TEST_P(CallConformance, BodiesAroundTheSizeOfOneFrameAndOneChunk) {
  ServeEcho(*server_);
  for (const std::size_t size :
       {kMaxPayloadBytes - 3, kMaxPayloadBytes - 2, kMaxPayloadBytes - 1, kMaxPayloadBytes, kMaxPayloadBytes + 1,
        2 * kChunkBytes - 3, 2 * kChunkBytes - 2, 2 * kChunkBytes, 2 * kChunkBytes + 1}) {
    const std::string body = RandomBody(size, size);
    EXPECT_EQ(CallAndWait(body).body, "<" + body + ">") << size;
  }
}

TEST_P(CallConformance, LargeBodyBothWays) {
  ServeEcho(*server_);
  const std::string body = RandomBody(kLarge, 1);
  const CallResult result = CallAndWait(body);
  ASSERT_EQ(result.status, CallResult::kOk) << result.error;
  EXPECT_TRUE(result.body == "<" + body + ">");
  EXPECT_EQ(handled_, 1);
  EXPECT_EQ(client_->counters().objects_received, 1U);
  EXPECT_EQ(server_->counters().objects_received, 1U);
}

TEST_P(CallConformance, ManyCallsAtOnceAreEachHandledOnceAndAnsweredWithTheirOwnReply) {
  constexpr int kCalls = 500;
  std::map<std::string, int> seen;
  server_->Serve(MessageType::kQuery, [&](Request&& request, Responder responder) {
    ++seen[request.body];
    responder.Reply(request.body + "!");
  });
  std::set<std::string> answered;
  for (int i = 0; i < kCalls; ++i) {
    const std::string body = std::to_string(i);
    client_->Call(kServer, MessageType::kQuery, body, {}, [&, body](CallResult&& result) {
      if (result.body == body + "!") answered.insert(body);
    });
  }
  EXPECT_TRUE(bed_->RunUntil([&] { return answered.size() == kCalls; }));
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(kCalls));
  for (const auto& [body, count] : seen) EXPECT_EQ(count, 1) << body;
}

TEST_P(CallConformance, SeveralLargeBodiesAtOnce) {
  ServeEcho(*server_);
  Endpoint& other = bed_->Add(kStranger);
  int correct = 0;
  constexpr int kBodies = 4;
  for (int i = 0; i < kBodies; ++i) {
    const std::string body = RandomBody(kLarge / 3, static_cast<std::uint64_t>(i));
    Endpoint& caller = i % 2 == 0 ? *client_ : other;
    caller.Call(kServer, MessageType::kQuery, body, {},
                [&, body](CallResult&& result) { correct += result.body == "<" + body + ">" ? 1 : 0; });
  }
  EXPECT_TRUE(bed_->RunUntil([&] { return correct == kBodies; }));
  EXPECT_EQ(handled_, kBodies);
}

TEST_P(CallConformance, RepeatedDatagramsOfSmallAndLargeCallsAreHandledOnce) {
  ServeEcho(*server_);
  CallAndWait("small");
  const std::string body = RandomBody(kLarge / 10, 2);
  CallAndWait(body);
  Settle();
  const auto recorded = bed_->recorded();
  for (const auto& [port, datagram] : recorded) bed_->Inject(port, datagram);
  const auto noticed = [&] {
    // With a key, identical bytes are a replay; a retry has a new nonce.
    const Counters& server = server_->counters();
    return (keyed() ? server.rejected_replay : server.duplicate_requests) > 0 &&
           client_->counters().duplicate_replies > 0;
  };
  EXPECT_TRUE(bed_->RunUntil(noticed));
  Settle();
  EXPECT_EQ(handled_, 2);
  EXPECT_EQ(CallAndWait("after").body, "<after>");
  EXPECT_EQ(handled_, 3);
}

TEST_P(CallConformance, ARepeatedRequestGetsItsCachedReply) {
  ServeEcho(*server_);
  CallOptions options;
  options.timeout = std::chrono::seconds(30);
  options.first_retry = options.max_retry = std::chrono::seconds(10);  // the only repetition is the one below
  CallAndWait("once", options);
  const auto recorded = bed_->recorded();
  ASSERT_FALSE(recorded.empty());
  bed_->Inject(recorded[0].first, recorded[0].second);
  if (keyed()) {
    ASSERT_TRUE(bed_->RunUntil([&] { return server_->counters().rejected_replay == 1; }));
    EXPECT_EQ(server_->counters().replies_resent, 0U);
  } else {
    ASSERT_TRUE(bed_->RunUntil([&] { return client_->counters().duplicate_replies == 1; }));
    EXPECT_EQ(server_->counters().replies_resent, 1U);
  }
  EXPECT_EQ(handled_, 1);
}

TEST_P(CallConformance, AReplyMayComeLongAfterTheHandlerReturned) {
  std::optional<Responder> kept;
  server_->Serve(MessageType::kQuery, [&](Request&&, Responder responder) {
    ++handled_;
    kept = responder;
  });
  std::optional<CallResult> result;
  CallOptions options;
  options.first_retry = milliseconds(5);
  client_->Call(kServer, MessageType::kQuery, "later", options, [&](CallResult&& r) { result = std::move(r); });
  ASSERT_TRUE(bed_->RunUntil([&] { return server_->counters().duplicate_requests >= 2; }));
  EXPECT_EQ(handled_, 1);
  kept->Reply("now");
  kept->Reply("ignored");
  ASSERT_TRUE(bed_->RunUntil([&] { return result.has_value(); }));
  EXPECT_EQ(result->body, "now");
}

TEST_P(CallConformance, AReplyAfterTheTimeOutIsIgnored) {
  std::optional<Responder> kept;
  server_->Serve(MessageType::kQuery, [&](Request&&, Responder responder) { kept = responder; });
  CallOptions options;
  options.timeout = milliseconds(40);
  options.first_retry = milliseconds(10);
  int callbacks = 0;
  CallResult last;
  client_->Call(kServer, MessageType::kQuery, "late", options, [&](CallResult&& r) {
    ++callbacks;
    last = std::move(r);
  });
  ASSERT_TRUE(bed_->RunUntil([&] { return callbacks == 1 && kept.has_value(); }));
  EXPECT_EQ(last.status, CallResult::kTimeout);
  kept->Reply("too late");
  ASSERT_TRUE(bed_->RunUntil([&] { return client_->counters().duplicate_replies >= 1; }));
  EXPECT_EQ(callbacks, 1);
  EXPECT_EQ(client_->counters().calls_timed_out, 1U);
}

TEST_P(CallConformance, ACallToNobodyTimesOutAfterRepeats) {
  CallOptions options;
  options.timeout = std::chrono::seconds(3);
  options.first_retry = milliseconds(10);
  std::optional<CallResult> result;
  client_->Call(4242, MessageType::kQuery, "anyone?", options, [&](CallResult&& r) { result = std::move(r); });
  ASSERT_TRUE(bed_->RunUntil([&] { return result.has_value(); }));
  EXPECT_EQ(result->status, CallResult::kTimeout);
  EXPECT_NE(result->error.find("query"), std::string::npos);
  EXPECT_GE(client_->counters().requests_retried, 2U);
  EXPECT_EQ(client_->num_open_calls(), 0U);
}

TEST_P(CallConformance, ALargeCallToNobodyTimesOutAndLeavesNothing) {
  CallOptions options;
  options.timeout = milliseconds(150);
  std::optional<CallResult> result;
  client_->Call(4242, MessageType::kQuery, RandomBody(kLarge, 3), options,
                [&](CallResult&& r) { result = std::move(r); });
  ASSERT_TRUE(bed_->RunUntil([&] { return result.has_value(); }));
  EXPECT_EQ(result->status, CallResult::kTimeout);
  EXPECT_EQ(client_->held_bytes(), 0U);
}

TEST_P(CallConformance, AnAbandonedCallNeverCallsBack) {
  ServeEcho(*server_);
  int callbacks = 0;
  const CallId call = client_->Call(kServer, MessageType::kQuery, "x", {}, [&](CallResult&&) { ++callbacks; });
  client_->Abandon(call);
  client_->Abandon(call);
  Settle();
  EXPECT_EQ(callbacks, 0);
  EXPECT_EQ(client_->num_open_calls(), 0U);
}

TEST_P(CallConformance, RefusalsContainTheReason) {
  const CallResult unserved = CallAndWait("x");
  EXPECT_EQ(unserved.status, CallResult::kRejected);
  EXPECT_EQ(unserved.code, ErrorCode::kUnknownType);

  server_->Serve(MessageType::kQuery, [](Request&&, Responder) { throw std::runtime_error("no such table"); });
  const CallResult failed = CallAndWait("x");
  EXPECT_EQ(failed.status, CallResult::kRejected);
  EXPECT_EQ(failed.code, ErrorCode::kHandlerFailed);
  EXPECT_EQ(failed.error, "no such table");
  EXPECT_EQ(server_->counters().handler_failures, 1U);

  // A large request of a type without a handler is refused before its body is collected.
  server_->Serve(MessageType::kQuery, nullptr);
  EXPECT_EQ(CallAndWait(RandomBody(kLarge, 4)).code, ErrorCode::kUnknownType);
  EXPECT_LT(server_->held_bytes(), 1000U);  // only the earlier refusals
}

TEST_P(CallConformance, ARestartedServerGetsTheRequestAgain) {
  // The first server receives the body and dies without an answer.
  server_->Serve(MessageType::kQuery, [&](Request&&, Responder) { ++handled_; });
  for (const std::size_t size : {std::size_t{10}, kLarge}) {
    handled_ = 0;
    std::optional<CallResult> result;
    const std::string body = RandomBody(size, 9);
    client_->Call(kServer, MessageType::kQuery, body, {}, [&](CallResult&& r) { result = std::move(r); });
    ASSERT_TRUE(bed_->RunUntil([&] { return handled_ == 1; }));
    bed_->Remove(*server_);
    server_ = &bed_->Add(kServer);
    ServeEcho(*server_);
    ASSERT_TRUE(bed_->RunUntil([&] { return result.has_value(); }));
    EXPECT_EQ(result->status, CallResult::kOk) << result->error;
    EXPECT_TRUE(result->body == "<" + body + ">");
    server_->Serve(MessageType::kQuery, [&](Request&&, Responder) { ++handled_; });
  }
}

TEST_P(CallConformance, ResponderOutlivesItsEndpoint) {
  std::optional<Responder> kept;
  server_->Serve(MessageType::kQuery, [&](Request&&, Responder responder) { kept = responder; });
  client_->Call(kServer, MessageType::kQuery, "x", {}, {});
  ASSERT_TRUE(bed_->RunUntil([&] { return kept.has_value(); }));
  bed_->Remove(*server_);
  kept->Reply("to nobody");
  EXPECT_EQ(client_->num_open_calls(), 1U);
}

TEST_P(CallConformance, AnExceptionFromACallbackLeavesPollAndTheEndpointStaysUsable) {
  ServeEcho(*server_);
  client_->Call(kServer, MessageType::kQuery, "x", {}, [](CallResult&&) { throw std::runtime_error("callback"); });
  EXPECT_THROW(bed_->RunUntil([] { return false; }), std::runtime_error);
  EXPECT_EQ(CallAndWait("y").body, "<y>");
}

TEST_P(CallConformance, CallsFromHandlersAndCallbacksWork) {
  ServeEcho(*server_);
  std::string last;
  client_->Call(kServer, MessageType::kQuery, "a", {}, [&](CallResult&& first) {
    client_->Call(kServer, MessageType::kQuery, first.body, {}, [&](CallResult&& second) { last = second.body; });
  });
  EXPECT_TRUE(bed_->RunUntil([&] { return last == "<<a>>"; }));
}

INSTANTIATE_TEST_SUITE_P(Networks, CallConformance,
                         testing::Values(BedKind::kSimulated, BedKind::kSimulatedWithKey, BedKind::kUdp,
                                         BedKind::kBridged),
                         BedName);

}  // namespace
}  // namespace legopt::bus
