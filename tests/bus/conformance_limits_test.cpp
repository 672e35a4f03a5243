// Limits and refusals that an Endpoint must enforce over every transport (PROTOCOL.md, sections 3, 8 and 10). Runs on
// the simulated network and on real multicast.
#include <algorithm>
#include <vector>

#include "bus/bus_error.h"
#include "bus/typed_calls.h"
#include "bus/wire.h"
#include "tests/bus/conformance_fixture.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class LimitConformance : public Conformance {};

TEST_P(LimitConformance, AnIllegalMessageNeverReachesAHandler) {
  ServeMessage<legopt_msg::cancel_request>(
      *server_, [&](const legopt_msg::cancel_request& request, EndpointId, ReplyTo<legopt_msg::cancel_reply> reply) {
        ++handled_;
        legopt_msg::cancel_reply message;
        message.status = 0;
        message.num_jobs = request.experiment_id;
        reply.Send(message);
      });
  std::optional<CallOutcome<legopt_msg::cancel_reply>> outcome;
  legopt_msg::cancel_request request{};
  request.experiment_id = 7;
  CallMessage(*client_, kServer, request, {},
              [&](CallOutcome<legopt_msg::cancel_reply>&& o) { outcome = std::move(o); });
  ASSERT_TRUE(bed_->RunUntil([&] { return outcome.has_value(); }));
  ASSERT_TRUE(outcome->ok()) << outcome->error;
  EXPECT_EQ(outcome->reply.num_jobs, 7);

  std::optional<CallResult> result;
  client_->Call(kServer, MessageType::kCancel, "not a message", {}, [&](CallResult&& r) { result = std::move(r); });
  ASSERT_TRUE(bed_->RunUntil([&] { return result.has_value(); }));
  EXPECT_EQ(result->code, ErrorCode::kMalformed);
  EXPECT_EQ(handled_, 1);
  EXPECT_EQ(server_->counters().rejected_body, 1U);
  request.experiment_id = 0;
  EXPECT_THROW(CallMessage(*client_, kServer, request, {}, {}), BusError);
}

TEST_P(LimitConformance, ForeignDeploymentsAreCountedAndIgnored) {
  if (GetParam() == BedKind::kBridged) GTEST_SKIP() << "a bridge carries what is of its deployment only";
  ServeEcho(*server_);
  Endpoint& foreigner = bed_->Add(kStranger, {}, TestBed::kDeployment + 1);
  std::optional<CallResult> result;
  CallOptions options;
  options.timeout = milliseconds(100);
  foreigner.Call(kServer, MessageType::kQuery, "hello", options, [&](CallResult&& r) { result = std::move(r); });
  ASSERT_TRUE(bed_->RunUntil([&] { return result.has_value(); }));
  EXPECT_EQ(result->status, CallResult::kTimeout);
  EXPECT_TRUE(bed_->RunUntil([&] { return server_->counters().rejected_deployment > 0; }));
  EXPECT_EQ(handled_, 0);
}

TEST_P(LimitConformance, AnotherVersionIsRefusedWithAReply) {
  ServeEcho(*server_);
  FrameHeader header;
  header.version = kProtocolVersion + 1;
  header.kind = FrameKind::kRequest;
  header.type = static_cast<std::int16_t>(MessageType::kQuery);
  header.deployment = TestBed::kDeployment;
  header.sender = kClient;
  header.destination = kServer;
  header.session = 5;
  header.call_id = 1;
  DatagramBuffer buffer{};
  bed_->Inject(Port::kControl, SealFrame(header, 0, buffer));
  ASSERT_TRUE(bed_->RunUntil([&] { return server_->counters().rejected_version == 1; }));
  Settle();
  EXPECT_EQ(handled_, 0);
  const auto& recorded = bed_->recorded();
  const bool refused = std::any_of(recorded.begin(), recorded.end(), [](const auto& entry) {
    FrameView frame;
    return OpenFrame(entry.second, TestBed::kDeployment, kClient, frame) == FrameFault::kNone &&
           frame.header.kind == FrameKind::kError &&
           frame.header.code == static_cast<std::int16_t>(ErrorCode::kVersionRefused);
  });
  EXPECT_TRUE(refused);
}

// Random bytes, a genuine request cut at every length, and a genuine request with every byte changed in turn.
TEST_P(LimitConformance, HostileDatagramsAreCountedAndChangeNothing) {
  ServeEcho(*server_);
  CallAndWait("innocent");
  const Datagram request = bed_->recorded().front().second;
  const int handled_before = handled_;
  const std::uint64_t rejected_before = server_->counters().rejected();
  std::mt19937_64 random(6);
  std::uint64_t injected = 0;
  const auto all_refused = [&] { return server_->counters().rejected() - rejected_before == injected; };
  const auto inject = [&](const Datagram& datagram) {
    bed_->Inject(injected % 2 == 0 ? Port::kControl : Port::kBulk, datagram);
    constexpr std::uint64_t kBurst = 50;  // the real network loses longer bursts
    if (++injected % kBurst == 0) {
      ASSERT_TRUE(bed_->RunUntil(all_refused)) << server_->counters().rejected();
    }
  };
  constexpr int kRandom = 500;
  for (int i = 0; i < kRandom; ++i) {
    Datagram datagram(1 + random() % kMaxDatagramBytes);
    for (auto& byte : datagram) byte = static_cast<std::uint8_t>(random());
    inject(datagram);
  }
  for (std::size_t length = 1; length < request.size(); ++length) {
    inject(Datagram(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(length)));
  }
  const std::size_t destination = 32;  // changing it addresses the frame to another party, which is no fault
  for (std::size_t at = 0; at < request.size(); ++at) {
    if (at >= destination && at < destination + 8) continue;
    Datagram datagram = request;
    datagram[at] = static_cast<std::uint8_t>(datagram[at] ^ (1 + random() % 255));
    inject(datagram);
  }
  EXPECT_TRUE(bed_->RunUntil(all_refused)) << server_->counters().rejected() - rejected_before << " of " << injected;
  EXPECT_EQ(handled_, handled_before);
  EXPECT_EQ(CallAndWait("still there").body, "<still there>");
}

TEST_P(LimitConformance, IllegalChunksAreRejectedWithoutHoldingMemory) {
  ServeEcho(*server_);
  FrameHeader header;
  header.kind = FrameKind::kRequestChunk;
  header.type = static_cast<std::int16_t>(MessageType::kQuery);
  header.deployment = TestBed::kDeployment;
  header.sender = kClient;
  header.destination = kServer;
  header.session = 5;
  header.call_id = 1;
  const auto send = [&](std::int64_t total, std::int32_t index, std::size_t bytes) {
    DatagramBuffer buffer{};
    const Datagram data(bytes, 1);
    ChunkView chunk;
    chunk.total_bytes = total;
    chunk.index = index;
    chunk.data = data;
    const std::size_t size = WriteChunk(chunk, buffer.data() + kFrameHeaderBytes);
    bed_->Inject(Port::kBulk, SealFrame(header, size, buffer));
  };
  send(0, 0, 0);
  send(-1, 0, 10);
  send(INT64_MAX, 0, kChunkBytes);
  send(std::int64_t{1} << 40, 0, kChunkBytes);
  send(3000, -1, kChunkBytes);
  send(3000, 3, kChunkBytes);
  send(3000, 2, kChunkBytes);
  send(3000, 0, 10);
  ASSERT_TRUE(bed_->RunUntil([&] { return server_->counters().rejected_field == 8; }));
  EXPECT_EQ(server_->held_bytes(), 0U);
}

TEST_P(LimitConformance, NoDatagramIsLargerThanTheLimit) {
  ServeEcho(*server_);
  CallAndWait(RandomBody(kLarge, 7));
  CallAndWait(RandomBody(kMaxPayloadBytes, 8));
  const auto& recorded = bed_->recorded();
  ASSERT_GT(recorded.size(), 2 * kLarge / kMaxDatagramBytes);
  std::size_t largest = 0;
  for (const auto& [port, datagram] : recorded) largest = std::max(largest, datagram.size());
  EXPECT_LE(largest, kMaxDatagramBytes);
}

TEST_P(LimitConformance, RepliesAreForgottenOnceTheCallerIsDone) {
  ServeEcho(*server_);
  constexpr int kCalls = 100;
  for (int i = 0; i < kCalls; ++i) CallAndWait(RandomBody(900, static_cast<std::uint64_t>(i)));
  EXPECT_LT(server_->held_bytes(), 2000U);  // only the last reply
}

TEST_P(LimitConformance, MemoryForRepliesIsBounded) {
  EndpointOptions options;
  options.max_cached_bytes = 20'000;
  bed_->Remove(*server_);
  server_ = &bed_->Add(kServer, options);
  ServeEcho(*server_);
  // While a call is open, its caller does not declare the later ones finished.
  std::optional<Responder> kept;
  server_->Serve(MessageType::kStatus, [&](Request&&, Responder responder) { kept = responder; });
  CallOptions patient;
  patient.timeout = std::chrono::minutes(30);
  bool first_done = false;
  client_->Call(kServer, MessageType::kStatus, "", patient, [&](CallResult&&) { first_done = true; });
  ASSERT_TRUE(bed_->RunUntil([&] { return kept.has_value(); }));
  constexpr int kCalls = 100;
  for (int i = 0; i < kCalls; ++i) {
    EXPECT_EQ(CallAndWait(RandomBody(900, static_cast<std::uint64_t>(i))).status, CallResult::kOk);
    EXPECT_LE(server_->held_bytes(), options.max_cached_bytes);
  }
  EXPECT_GT(server_->counters().replies_evicted, 0U);
  kept->Reply("done");
  EXPECT_TRUE(bed_->RunUntil([&] { return first_done; }));
}

TEST_P(LimitConformance, ServerIsBusyBeyondItsOpenRequests) {
  EndpointOptions options;
  options.max_open_requests = 3;
  bed_->Remove(*server_);
  server_ = &bed_->Add(kServer, options);
  std::vector<Responder> kept;
  server_->Serve(MessageType::kQuery, [&](Request&&, Responder responder) { kept.push_back(responder); });
  int answered = 0;
  CallOptions call;
  call.first_retry = milliseconds(5);
  constexpr int kCalls = 6;
  for (int i = 0; i < kCalls; ++i) {
    client_->Call(kServer, MessageType::kQuery, "x", call,
                  [&](CallResult&& r) { answered += r.status == CallResult::kOk ? 1 : 0; });
  }
  ASSERT_TRUE(bed_->RunUntil([&] { return server_->counters().requests_refused_busy >= 3; }));
  EXPECT_EQ(kept.size(), 3U);
  ASSERT_TRUE(bed_->RunUntil([&] {
    for (Responder& responder : kept) responder.Reply("ok");
    return answered == kCalls;
  }));
  EXPECT_EQ(client_->counters().calls_rejected, 0U);
}

TEST_P(LimitConformance, IncompleteBodiesAreForgottenAfterTheirLifetime) {
  EndpointOptions options;
  options.incoming_object_lifetime = milliseconds(50);
  bed_->Remove(*server_);
  server_ = &bed_->Add(kServer, options);
  ServeEcho(*server_);
  const CallId call = client_->Call(kServer, MessageType::kQuery, RandomBody(kLarge, 1), {}, {});
  ASSERT_TRUE(bed_->RunUntil([&] { return server_->held_bytes() > 0; }));
  client_->Abandon(call);
  EXPECT_TRUE(bed_->RunUntil([&] { return server_->held_bytes() == 0; }));
  EXPECT_EQ(server_->counters().objects_expired, 1U);
}

TEST_P(LimitConformance, BadOptionsThrow) {
  EXPECT_THROW(client_->Call(0, MessageType::kQuery, "", {}, {}), BusError);
  CallOptions options;
  options.timeout = seconds(0);
  EXPECT_THROW(client_->Call(kServer, MessageType::kQuery, "", options, {}), BusError);
  EXPECT_THROW(client_->Call(kServer, MessageType::kQuery, std::string((std::size_t{64} << 20) + 1, 'x'), {}, {}),
               BusError);
  EXPECT_THROW(bed_->Add(0), BusError);
}

INSTANTIATE_TEST_SUITE_P(Networks, LimitConformance,
                         testing::Values(BedKind::kSimulated, BedKind::kUdp, BedKind::kBridged), BedName);

}  // namespace
}  // namespace legopt::bus
