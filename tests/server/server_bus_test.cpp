// The server on a simulated network in virtual time, with scripted workers and clients.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "bus/message_limits.h"
#include "server/server.h"
#include "tests/server/server_on_bus.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;

class ServerOnBadBus : public ServerOnBus {
 protected:
  ServerOnBadBus() : ServerOnBus(bus::FaultModel::StandardChaos()) {}
};

TEST_F(ServerOnBus, ExperimentIsWorkedOff) {
  AddWorkers(2);
  Submit(SampleSpec(50));
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  EXPECT_EQ(StatusOf(*submitted_), SubmitStatus::kCreated);
  EXPECT_EQ(store_.num_accepted(), 50);
  const auto status = Status();
  EXPECT_EQ(status["experiments"][0]["state"], "done");
  EXPECT_EQ(status["experiments"][0]["jobs"]["done"], 50);
  EXPECT_EQ(status["workers"].size(), 2U);
  EXPECT_GT(status["server"]["transport"]["requests_handled"], 0);
  EXPECT_EQ(status["server"]["requests"]["submit"]["requests"], 1);
  EXPECT_EQ(status["server"]["requests"]["result"]["requests"], 50);
  EXPECT_GT(status["server"]["requests"]["result"]["bytes"], 50);
  EXPECT_EQ(status["server"]["requests"]["shutdown"]["requests"], 0);
}

class GroupedCommits : public ServerOnBus {
 protected:
  // Sends submissions shortly one after the other and returns the number of commits.
  int CommitsFor(int submissions) {
    const int before = store_.commits;
    int answered = 0;
    for (int i = 0; i < submissions; ++i) {
      legopt_msg::submit_request request{};
      request.submission_id = "g" + std::to_string(++submission_);
      request.spec_json = SampleSpec(1).dump();
      client_.Call<legopt_msg::submit_reply>(bus::MessageType::kSubmit, request, [&](const auto&) { ++answered; });
      RunUntil([] { return false; }, 1ms);
    }
    EXPECT_TRUE(RunUntil([&] { return answered == submissions; }, 1s));
    return store_.commits - before;
  }

  int submission_ = 0;
};

TEST_F(GroupedCommits, AnIdleServerAnswersAtOnceAndABusyOneOncePerInterval) {
  RunUntil([] { return false; }, 100ms);
  EXPECT_EQ(CommitsFor(1), 1);
  RunUntil([] { return false; }, 100ms);
  const microseconds start = network_.now();
  const int commits = CommitsFor(40);
  const auto intervals = static_cast<int>((network_.now() - start) / ServerOptions{}.commit_interval);
  EXPECT_GE(commits, intervals / 2);
  EXPECT_LE(commits, intervals + 1);
  EXPECT_LT(commits, 30);
}

TEST_F(GroupedCommits, StatusCommitsBeforeItTells) {
  CommitsFor(1);
  Submit(SampleSpec(3), "late");
  nlohmann::json status = Status();  // arrives within the interval of the previous commit
  EXPECT_EQ(status["experiments"].size(), store_.LoadOpenState().experiments.size());
  EXPECT_EQ(status["experiments"].size(), 2U);
}

TEST_F(ServerOnBadBus, ChaosChangesNothing) {
  AddWorkers(2);
  Submit(SampleSpec(40));
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  EXPECT_EQ(store_.num_accepted(), 40);
}

TEST_F(ServerOnBadBus, RestartsChangeNothing) {
  AddWorkers(2);
  Submit(SampleSpec(60));
  for (int restart = 0; restart < 10 && !AllDone(); ++restart) {
    const std::int64_t before = store_.num_accepted();
    RunUntil([&] { return AllDone() || store_.num_accepted() > before + 3; });
    StartServer();
  }
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  EXPECT_EQ(store_.num_accepted(), 60);
  EXPECT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
}

TEST_F(ServerOnBus, NothingIsAcknowledgedOrLeasedWhileTheStoreFails) {
  Submit(SampleSpec(4));
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  store_.FailWith(db::StoreErrorCode::kFull);
  submitted_.reset();
  Submit(SampleSpec(6), "s2");
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 2s));
  EXPECT_FALSE(server_->store_healthy());
  AddWorkers(1);
  EXPECT_FALSE(RunUntil([&] { return server_->scheduler().num_leases() > 0; }, 3s));
  EXPECT_NE(Status()["server"]["store_error"], "") << "it keeps answering";
  store_.FailWith({});
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value() && AllDone(1) && AllDone(2); }));
  EXPECT_TRUE(server_->store_healthy());
  EXPECT_EQ(store_.num_accepted(), 10);
}

TEST_F(ServerOnBus, TheEndOfAnExperimentTellsWhatTheBusWentThrough) {
  AddWorkers(1);
  Submit(SampleSpec(5));
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  submitted_.reset();
  Submit(SampleSpec(2), "s2");
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  legopt_msg::cancel_request cancel{};
  cancel.experiment_id = 2;
  client_.Call<legopt_msg::cancel_reply>(bus::MessageType::kCancel, cancel, [](const auto&) {});
  ASSERT_TRUE(RunUntil([&] { return store_.health.size() == 2U; }));
  const auto first = nlohmann::json::parse(store_.health.at(1));
  EXPECT_EQ(first.at("results_accepted"), 5);
  EXPECT_GT(first.at("datagrams_received").get<int>(), 5);
  EXPECT_FALSE(first.contains("rejected_tag")) << "only what grew";
  const auto second = nlohmann::json::parse(store_.health.at(2));
  EXPECT_EQ(second.at("jobs_cancelled"), 2);
  EXPECT_FALSE(second.contains("results_accepted")) << "since its own submission";
}

// Regression found by the simulation: a deferred request failed while the store could not be read, and this ended the
// server.
TEST_F(ServerOnBus, RequestsWaitWhileReadingFails) {
  store_.FailWith(db::StoreErrorCode::kIo);
  store_.reading_fails = true;
  Submit(SampleSpec(3));
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 2s));
  store_.FailWith({});
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 2s));
  EXPECT_EQ(endpoint_->counters().handler_failures, 0U);
  store_.reading_fails = false;
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }, 5s));
  EXPECT_EQ(StatusOf(*submitted_), SubmitStatus::kCreated);
  EXPECT_TRUE(server_->store_healthy());
}

// Requests wait for the store up to a limit; callers repeat the requests beyond it.
TEST_F(ServerOnBus, BytesOfWaitingRequestsAreLimited) {
  store_.FailWith(db::StoreErrorCode::kIo);
  Submit(SampleSpec(3), "first");
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 1s));
  constexpr int kMore = 20;
  int answered = 0;
  for (int i = 0; i < kMore; ++i) {
    legopt_msg::submit_request request{};
    request.submission_id = "more" + std::to_string(i);
    request.spec_json = SampleSpec(1).dump();
    client_.Call<legopt_msg::submit_reply>(bus::MessageType::kSubmit, request, [&](const auto&) { ++answered; });
  }
  EXPECT_FALSE(RunUntil([&] { return answered > 0; }, 1s));
  store_.FailWith({});
  int at_once = 0;
  EXPECT_TRUE(RunUntil([&] { return (at_once = answered) > 0; }, 5s));
  EXPECT_LT(at_once, kMore) << "a specification has about 500 bytes";
  EXPECT_TRUE(RunUntil([&] { return answered == kMore; }, 60s)) << "nothing is lost";
}

TEST_F(ServerOnBus, TheDiskOfTheDatabaseHasAReserve) {
  disk_ = db::DiskSpace{1'000'000, 100'000'000'000};
  Submit(SampleSpec(3));
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }, 5s));
  EXPECT_EQ(StatusOf(*submitted_), SubmitStatus::kRefused);
  EXPECT_NE(submitted_->message.find("has 1 MB free"), std::string::npos) << submitted_->message;
}

TEST_F(ServerOnBus, StoreDefectEndsTheServer) {
  Submit(SampleSpec(4));
  store_.FailWith(db::StoreErrorCode::kCorrupt);
  EXPECT_THROW(RunUntil([&] { return submitted_.has_value(); }, 2s), db::StoreError);
}

TEST_F(ServerOnBus, ProbeDescribesTheServer) {
  std::optional<legopt_msg::probe_reply> probe;
  client_.Call<legopt_msg::probe_reply>(bus::MessageType::kProbe, legopt_msg::probe_request{},
                                        [&](const auto& reply) { probe = reply; });
  ASSERT_TRUE(RunUntil([&] { return probe.has_value(); }));
  EXPECT_EQ(probe->protocol_version, bus::kProtocolVersion);
  EXPECT_EQ(probe->server_version, "test");
  EXPECT_EQ(probe->server_instance, 1);
}

TEST_F(ServerOnBus, MethodOptionsAreServed) {
  Submit(SampleSpec(1));
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  std::vector<legopt_msg::method_reply> replies;
  for (const char digit : {'a', 'f'}) {
    legopt_msg::method_request request{};
    request.hash = HashOf(digit);
    client_.Call<legopt_msg::method_reply>(bus::MessageType::kMethod, request,
                                           [&](const auto& reply) { replies.push_back(reply); });
    ASSERT_TRUE(RunUntil([&] { return replies.size() == (digit == 'a' ? 1U : 2U); }));
  }
  EXPECT_EQ(StatusOf(replies[0]), MethodStatus::kFound);
  EXPECT_EQ(nlohmann::json::parse(replies[0].options_json)["solver"], "a");
  EXPECT_EQ(StatusOf(replies[1]), MethodStatus::kUnknown);
}

TEST_F(ServerOnBus, QueryWithoutADatabaseFileIsRefusedPolitely) {
  legopt_msg::query_request request{};
  request.sql = "SELECT 1";
  request.max_rows = 1;
  std::optional<legopt_msg::query_reply> answer;
  client_.Call<legopt_msg::query_reply>(bus::MessageType::kQuery, request, [&](const auto& reply) { answer = reply; });
  ASSERT_TRUE(RunUntil([&] { return answer.has_value(); }));
  EXPECT_EQ(StatusOf(*answer), QueryStatus::kRefused);
}

TEST_F(ServerOnBus, MalformedBodiesAreRejectedByField) {
  bus::CallResult result;
  bool done = false;
  client_.endpoint().Call(bus::kServer, bus::MessageType::kLease, "garbage", {}, [&](bus::CallResult&& r) {
    result = std::move(r);
    done = true;
  });
  ASSERT_TRUE(RunUntil([&] { return done; }));
  EXPECT_EQ(result.status, bus::CallResult::kRejected);
  EXPECT_EQ(result.code, bus::ErrorCode::kMalformed);
}

TEST_F(ServerOnBus, ShutdownIsAnsweredAndDrains) {
  bool answered = false;
  client_.Call<legopt_msg::shutdown_reply>(
      bus::MessageType::kShutdown, legopt_msg::shutdown_request{},
      [&](const auto& reply) { answered = StatusOf(reply) == ShutdownStatus::kStopping; });
  ASSERT_TRUE(RunUntil([&] { return answered; }));
  EXPECT_TRUE(server_->shutdown_requested());
}

}  // namespace
}  // namespace legopt::server
