// More callers than 4,096, a former limit of a party: each is served once, proves itself once, and is recognised
// later.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "bus/endpoint.h"
#include "bus/endpoint_core.h"
#include "tests/bus/test_bed.h"
#include "tests/doubles/simulated_network.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;

constexpr int kManyCallers = 5000;
constexpr EndpointId kFirstCaller = 1000;
constexpr std::int64_t kCallersDeployment = 1;

// Receive buffers of 4 MiB lose nothing here: this tests the memory of callers, not loss.
class ManyCallers : public testing::Test {
 protected:
  struct Caller {
    Caller(SimulatedNetwork& network, int number)
        : transport(network, kCallersDeployment, TestKey()),
          endpoint(transport, kFirstCaller + number, static_cast<std::uint64_t>(number) + 100) {}
    SimulatedTransport transport;
    Endpoint endpoint;
  };

  ManyCallers() {
    network_.SetFiltered();
    server_.Serve(MessageType::kShutdown, [this](Request&& request, Responder responder) {
      ++handled_;
      responder.Reply(std::move(request.body));
    });
    for (int i = 0; i < kManyCallers; ++i) callers_.push_back(std::make_unique<Caller>(network_, i));
  }

  // Every caller makes one call; returns how many were answered.
  int CallOnceEach() {
    int answered = 0;
    std::vector<Endpoint*> endpoints = {&server_};
    for (const auto& caller : callers_) {
      endpoints.push_back(&caller->endpoint);
      caller->endpoint.Call(kServer, MessageType::kShutdown, "x", {},
                            [&](CallResult&& result) { answered += result.status == CallResult::kOk ? 1 : 0; });
    }
    network_.Run(
        endpoints, [&] { return answered == kManyCallers; }, std::chrono::seconds(10));
    return answered;
  }

  SimulatedNetwork network_{1};
  SimulatedTransport server_transport_{network_, kCallersDeployment, TestKey()};
  Endpoint server_{server_transport_, kServer, 1};
  std::vector<std::unique_ptr<Caller>> callers_;
  int handled_ = 0;
};

TEST_F(ManyCallers, EachProvesItselfOnceAndIsServedOnceForEachCall) {
  EXPECT_EQ(CallOnceEach(), kManyCallers);
  EXPECT_EQ(server_.counters().requests_challenged, static_cast<std::uint64_t>(kManyCallers));
  EXPECT_EQ(CallOnceEach(), kManyCallers);
  EXPECT_EQ(handled_, 2 * kManyCallers);
  EXPECT_EQ(server_.counters().requests_challenged, static_cast<std::uint64_t>(kManyCallers))
      << "a session that is remembered need not prove itself again";
}

TEST(RetryPolicy, RepeatsInVainLengthenTheFirstIntervalAndPromptAnswersShortenIt) {
  RetryPolicy patience;
  const auto first = [&](int wanted_ms, int longest_ms) {
    return patience.First(milliseconds(wanted_ms), milliseconds(longest_ms));
  };
  EXPECT_EQ(first(50, 1000), milliseconds(50));
  EXPECT_EQ(first(200, 200), milliseconds(200)) << "as the call wants";
  EXPECT_EQ(first(10, 200), milliseconds(10)) << "as the call wants";
  patience.RecordCallEnd(milliseconds(200));
  EXPECT_EQ(first(50, 1000), milliseconds(50)) << "the repeat may have been what was answered";
  patience.RecordNeedlessRetry(1);
  patience.RecordNeedlessRetry(2);
  EXPECT_EQ(first(50, 1000), milliseconds(50)) << "one late reply of a call may be chance";
  patience.RecordNeedlessRetry(2);
  EXPECT_EQ(first(50, 1000), milliseconds(250));
  EXPECT_EQ(first(50, 100), milliseconds(100)) << "no longer than the call allows";
  patience.RecordReply(milliseconds(200));
  EXPECT_EQ(first(50, 1000), milliseconds(250)) << "not at once";
  for (int i = 0; i < 20; ++i) patience.RecordReply(milliseconds(1));
  EXPECT_EQ(first(50, 1000), milliseconds(50));
  patience.RecordCallEnd(std::chrono::seconds(10));
  patience.RecordNeedlessRetry(3);
  patience.RecordNeedlessRetry(3);
  EXPECT_EQ(first(50, 5000), RetryPolicy::kMost);
}

}  // namespace
}  // namespace legopt::bus
