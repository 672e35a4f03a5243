// Policy: workers that have gone stay visible for a while, those that said goodbye do not count as lost, and a drained
// worker gets no more jobs.

#include <gmock/gmock.h>

#include "server/status.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using std::chrono::hours;
using std::chrono::seconds;
using testing::ElementsAre;

class SchedulerWorkerTest : public SchedulerTest {
 protected:
  void SendLeavingHeartbeat(bus::EndpointId endpoint) {
    legopt_msg::heartbeat_request request{};
    request.worker_id = worker_ids_[endpoint];
    request.server_instance = options_.server_instance;
    request.leaving = 1;
    scheduler_->Heartbeat(now_, endpoint, request);
  }
  // Returns the kinds of events of the next seconds.
  std::vector<std::string> EventsWithin(int duration_s) {
    std::vector<std::string> kinds;
    for (int second = 0; second < duration_s; ++second) {
      now_.steady += seconds(1);
      now_.wall_us += 1'000'000;
      scheduler_->Tick(now_, ops_);
      for (const db::StoreOp& op : ops_) {
        if (const auto* event = std::get_if<db::RecordEvent>(&op)) kinds.push_back(event->kind);
      }
      Commit();
    }
    return kinds;
  }
  // Lets a worker lease and finish a job, so that it is in the store.
  void WorkOf(bus::EndpointId endpoint) {
    Submit(SampleSpec(1), "for " + std::to_string(endpoint));
    Hello(endpoint);
    Finish(endpoint, LeaseOne(endpoint));
  }
  nlohmann::json Workers() { return StatusJson(*scheduler_, 0, now_, "").at("workers"); }
};

TEST_F(SchedulerWorkerTest, OneThatIsGoneStaysVisibleWithTheAgeOfItsLastWord) {
  WorkOf(kFirst);
  EXPECT_THAT(EventsWithin(60), ElementsAre("worker_lost"));
  ASSERT_EQ(Workers().size(), 1U);
  EXPECT_FALSE(Workers()[0].at("online").get<bool>());
  EXPECT_DOUBLE_EQ(Workers()[0].at("silent_s").get<double>(), 60);
  Restart();
  EXPECT_DOUBLE_EQ(Workers().at(0).at("silent_s").get<double>(), 60) << "over a restart, too";
  Advance(hours(25));
  EXPECT_EQ(Workers().size(), 0U);
}

TEST_F(SchedulerWorkerTest, ManyThatAreGoneDoNotFillTheList) {
  options_.most_offline_shown = 3;
  Restart();
  for (int i = 0; i < 10; ++i) {
    WorkOf(2000 + i);
    Advance(seconds(1));
  }
  Advance(seconds(60));
  ASSERT_EQ(Workers().size(), 3U);
  EXPECT_EQ(Workers()[2].at("name"), "worker-2009") << "the latest ones";
}

TEST_F(SchedulerWorkerTest, AGoodbyeIsNoLoss) {
  WorkOf(kFirst);
  SendLeavingHeartbeat(kFirst);
  EXPECT_THAT(EventsWithin(2), ElementsAre("worker_left"));
  EXPECT_FALSE(Workers().at(0).at("online").get<bool>());
  EXPECT_THAT(EventsWithin(60), testing::IsEmpty());
}

TEST_F(SchedulerWorkerTest, ADrainedWorkerGetsNoMoreJobsAndIsTold) {
  Submit(SampleSpec(3));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  const auto reply = Control(worker_ids_[kFirst], ControlAction::kDrainWorker);
  EXPECT_EQ(StatusOf(reply), ControlStatus::kOk);
  EXPECT_EQ(reply.num_jobs, 1);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow);
  const auto beat = Heartbeat(kFirst, {lease});
  EXPECT_EQ(beat.status, EnumNumber(HeartbeatStatus::kDrain));
  EXPECT_EQ(beat.verdicts.at(0), EnumNumber(LeaseVerdict::kContinue)) << "what runs goes on";
  EXPECT_TRUE(Workers().at(0).at("draining").get<bool>());
  Hello(kFirst);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow) << "also after another hello";
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted);
  Hello(kSecond);
  EXPECT_EQ(LeaseOne(kSecond).job_id, 2);
}

TEST_F(SchedulerWorkerTest, OnlyAConnectedWorkerCanBeDrained) {
  EXPECT_EQ(StatusOf(Control(7, ControlAction::kDrainWorker)), ControlStatus::kUnknownExperiment);
  Hello(kFirst);
  Advance(seconds(60));
  EXPECT_EQ(StatusOf(Control(worker_ids_[kFirst], ControlAction::kDrainWorker)), ControlStatus::kRefused);
}

}  // namespace
}  // namespace legopt::server
