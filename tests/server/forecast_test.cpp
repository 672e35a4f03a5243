// Policy: the status of an experiment is correct at each moment of virtual time. It shows progress or the reason for a
// stall, an estimate only during progress, and the experiment's times, which survive restarts.

#include "server/forecast.h"

#include <gmock/gmock.h>

#include "server/status.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

using enum ControlAction;

class OutlookTest : public SchedulerTest {
 protected:
  nlohmann::json StatusOf(std::int64_t id = 1) {
    return StatusJson(*scheduler_, id, now_, store_error_).at("experiments").at(0);
  }
  std::string WaitingFor(std::int64_t id = 1) { return StatusOf(id).at("waiting_for"); }
  bool HasEstimate(std::int64_t id = 1) { return !StatusOf(id).at("eta_s").is_null(); }

  // Advances the time with a heartbeat every half second, like a live worker.
  void AdvanceBeating(microseconds duration, bus::EndpointId endpoint, const std::vector<legopt_msg::lease>& leases) {
    for (; duration > microseconds(0); duration -= milliseconds(500)) {
      Advance(milliseconds(500));
      Heartbeat(endpoint, leases);
    }
  }

  // Leases one job, works for this duration, delivers the result.
  void Solve(bus::EndpointId endpoint, microseconds wall) {
    const auto lease = LeaseOne(endpoint);
    AdvanceBeating(wall, endpoint, {lease});
    auto result = ResultFor(worker_ids_[endpoint], lease);
    result.wall_us = wall.count();
    Deliver(result);
  }

  std::string store_error_;
};

TEST_F(OutlookTest, NoWorkerIsConnected) {
  Submit(SampleSpec());
  EXPECT_THAT(WaitingFor(), HasSubstr("no worker is connected"));
  Hello(kFirst);
  EXPECT_THAT(WaitingFor(), Not(HasSubstr("no worker")));
}

TEST_F(OutlookTest, AWorkerThatLeftIsNotTakenForOneWithoutTheDataset) {
  Submit(SampleSpec());
  Hello(kFirst);
  Advance(seconds(30));
  EXPECT_THAT(WaitingFor(), HasSubstr("no worker is connected"));
}

TEST_F(OutlookTest, WorkersLoadTheDataset) {
  Submit(SampleSpec());
  HelloWithoutDataset(kFirst);
  EXPECT_EQ(WaitingFor(), "workers load the dataset");
  Hello(kFirst);
  EXPECT_THAT(WaitingFor(), Not(HasSubstr("load")));
}

TEST_F(OutlookTest, NoWorkerHasTheDataset) {
  Submit(SampleSpec());
  Hello(kFirst, 1, 'e', "another");
  EXPECT_THAT(WaitingFor(), HasSubstr("no worker has dataset 'garage' (dddddddddddd)"));
}

TEST_F(OutlookTest, APauseIsShownWithItsReasonAndWhatEndsIt) {
  Submit(SampleSpec());
  Hello(kFirst);
  Solve(kFirst, seconds(1));
  const auto lease = LeaseOne(kFirst);
  EXPECT_TRUE(HasEstimate());
  Control(1, kPause);
  EXPECT_EQ(WaitingFor(), "paused; 'legopt resume 1' continues it");
  EXPECT_FALSE(HasEstimate()) << "a job runs on, but what is left does not";
  Control(1, kResume);
  EXPECT_EQ(WaitingFor(), "");
  EXPECT_TRUE(HasEstimate());
  Control(1, kPauseNow, "the disk");
  EXPECT_EQ(WaitingFor(), "paused: the disk; 'legopt resume 1' continues it");
  EXPECT_FALSE(HasEstimate());
  Control(1, kResume);
  EXPECT_THAT(WaitingFor(), Not(HasSubstr("paused")));
}

TEST_F(OutlookTest, AnotherExperimentGoesFirst) {
  Submit(SampleSpec(), "s1");
  nlohmann::json urgent = SampleSpec();
  urgent["name"] = "urgent";
  Submit(urgent, "s2");
  Control(2, kPriority, "", 7);
  Hello(kFirst);
  LeaseOne(kFirst);
  EXPECT_EQ(WaitingFor(2), "");
  EXPECT_THAT(WaitingFor(1), HasSubstr("experiment 2 'urgent' goes first, by its priority of 7"));
  EXPECT_DOUBLE_EQ(StatusOf(2).at("share"), 1);
  EXPECT_DOUBLE_EQ(StatusOf(1).at("share"), 0);
}

TEST_F(OutlookTest, TheWorkersAreBusyWithAnother) {
  Submit(SampleSpec(), "s1");
  Hello(kFirst);
  LeaseOne(kFirst);
  nlohmann::json other = SampleSpec();
  other["name"] = "other";
  Submit(other, "s2");
  EXPECT_THAT(WaitingFor(2), HasSubstr("the workers are busy with experiment 1 'sample'"));
}

TEST_F(OutlookTest, TheDatabaseCannotBeWritten) {
  Submit(SampleSpec());
  Hello(kFirst);
  LeaseOne(kFirst);
  store_error_ = "database or disk is full";
  EXPECT_EQ(WaitingFor(), "the database cannot be written: database or disk is full");
  EXPECT_FALSE(HasEstimate());
}

TEST_F(OutlookTest, TheServerIsStopping) {
  Submit(SampleSpec());
  Hello(kFirst);
  scheduler_->set_draining(true);
  EXPECT_EQ(WaitingFor(), "the server is stopping");
}

TEST_F(OutlookTest, ASilentWorkerDoesNotMoveAnything) {
  Submit(SampleSpec());
  Hello(kFirst);
  Solve(kFirst, seconds(1));
  LeaseOne(kFirst);
  EXPECT_EQ(WaitingFor(), "");
  Advance(seconds(4));
  EXPECT_EQ(WaitingFor(), "nothing is heard of the workers that have its jobs");
  EXPECT_FALSE(HasEstimate());
  Advance(seconds(20));
  EXPECT_THAT(WaitingFor(), HasSubstr("no worker is connected"));
}

TEST_F(OutlookTest, AfterARestartItMovesAsSoonAsItsWorkersAreHeard) {
  Submit(SampleSpec());
  Hello(kFirst);
  Solve(kFirst, seconds(1));
  const auto lease = LeaseOne(kFirst);
  Restart();
  EXPECT_EQ(WaitingFor(), "nothing is heard of the workers that have its jobs");
  EXPECT_FALSE(HasEstimate());
  Heartbeat(kFirst, {lease});
  EXPECT_EQ(WaitingFor(), "");
  EXPECT_NEAR(StatusOf().at("eta_s").get<double>(), 3, 0.01) << "of three jobs; the store knows how long one takes";
}

TEST_F(OutlookTest, EstimatesFromWhatIsLeftAndTheSlotsThatWorkOnIt) {
  Submit(SampleSpec(10));
  Hello(kFirst, 2);
  Solve(kFirst, seconds(2));
  EXPECT_FALSE(HasEstimate()) << "nothing runs";
  const auto first = LeaseOne(kFirst);
  const auto second = LeaseOne(kFirst);
  EXPECT_DOUBLE_EQ(StatusOf().at("eta_s"), 10) << "nine jobs of 2 s on two slots";
  AdvanceBeating(seconds(1), kFirst, {first, second});
  EXPECT_NEAR(StatusOf().at("eta_s").get<double>(), 9, 1e-9);
}

TEST_F(OutlookTest, BesideOthersItCountsOnItsPart) {
  Submit(SampleSpec(9), "s1");
  Hello(kFirst, 2);
  Solve(kFirst, seconds(2));
  const auto lease = LeaseOne(kFirst);
  EXPECT_DOUBLE_EQ(StatusOf(1).at("eta_s"), 8) << "alone, 8 jobs of 2 s on two slots";
  nlohmann::json other = SampleSpec(9);
  other["submitter"] = "ann";
  Submit(other, "s2");
  EXPECT_DOUBLE_EQ(StatusOf(1).at("eta_s"), 16) << "half of the slots are ann's";
}

TEST_F(OutlookTest, CountsTheWindowsOfARunningMotion) {
  nlohmann::json spec = SampleSpec(2);
  spec["tasks"] = {{{"task", "motion"}, {"problems", {0, 1}}, {"waypoints", {150, 150}}}};
  Submit(spec);
  Hello(kFirst, 2);
  const auto done = LeaseOne(kFirst);
  const auto lease = LeaseOne(kFirst);
  EXPECT_FALSE(HasEstimate());
  AdvanceBeating(seconds(10), kFirst, {lease});
  HeartbeatWithProgress(kFirst, lease, 49, 77);
  EXPECT_FALSE(HasEstimate()) << "no motion has ended";
  auto result = ResultFor(worker_ids_[kFirst], done);
  result.wall_us = static_cast<std::int64_t>(10e6 * 77 / 49.5);
  Deliver(result);
  EXPECT_NEAR(StatusOf().at("eta_s").get<double>(), 10.0 / 49.5 * 27.5, 1e-3);
  const auto kind = StatusOf().at("kinds").at(0);
  EXPECT_EQ(kind.at("method"), "SQP");
  EXPECT_EQ(kind.at("task"), "motion");
  EXPECT_EQ(kind.at("initialization"), "good");
  EXPECT_EQ(kind.at("queued"), 0);
  EXPECT_NEAR(kind.at("s_per_waypoint").get<double>(), 10.0 / (150.0 * 49.5 / 77), 1e-8);  // rounded to microseconds
}

TEST_F(OutlookTest, TellsTheTimesOfTheExperiment) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  Advance(seconds(5));
  Hello(kFirst);
  Solve(kFirst, seconds(3));
  Control(1, kPause);
  Advance(seconds(60));
  EXPECT_DOUBLE_EQ(StatusOf().at("elapsed_s"), 68);
  EXPECT_NEAR(StatusOf().at("worked_s").get<double>(), 3, 0.6);
  Restart();
  EXPECT_NEAR(StatusOf().at("worked_s").get<double>(), 3, 0.6) << "read from the attempts";
  Control(1, kResume);
  Hello(kFirst);
  Solve(kFirst, seconds(2));
  Advance(seconds(30));
  EXPECT_DOUBLE_EQ(StatusOf().at("elapsed_s"), 70) << "until its end";
  EXPECT_NEAR(StatusOf().at("worked_s").get<double>(), 5, 1.2);
  EXPECT_EQ(WaitingFor(), "") << "what is over waits for nothing";
  Advance(seconds(120));
  EXPECT_TRUE(StatusOf().at("worked_s").is_null()) << "no longer in memory";
  EXPECT_DOUBLE_EQ(StatusOf().at("elapsed_s"), 70);
}

TEST_F(OutlookTest, NamesWhatWasSubmitted) {
  Submit(SampleSpec());
  for (const bool restarted : {false, true}) {
    if (restarted) Restart();
    EXPECT_EQ(StatusOf().at("dataset"), "garage");
    EXPECT_EQ(StatusOf().at("methods"), nlohmann::json({"SQP"}));
    EXPECT_EQ(StatusOf().at("spec_hash").get<std::string>().size(), 64U);
  }
}

}  // namespace
}  // namespace legopt::server
