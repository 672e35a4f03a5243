// Policy: persistent effects of requests are limited, and a refusal names the limit and the numbers.

#include <gmock/gmock.h>

#include "server/budget.h"
#include "server/status.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr std::int64_t kMegabyte = 1'000'000;

class SchedulerBudget : public SchedulerTest {
 protected:
  legopt_msg::submit_reply SubmitBy(const std::string& submitter, const std::string& id, int jobs = 1) {
    auto spec = SampleSpec(jobs);
    spec["submitter"] = submitter;
    return Submit(spec, id);
  }
  void ExpectRefused(const legopt_msg::submit_reply& reply, const std::string& text) {
    EXPECT_EQ(StatusOf(reply), SubmitStatus::kRefused);
    EXPECT_THAT(reply.message, HasSubstr(text));
  }
  std::size_t StoredWorkers() { return store_.LoadOpenState().workers.size(); }
  // Registers a worker that does nothing else.
  void HelloOf(bus::EndpointId endpoint) {
    scheduler_->Hello(now_, endpoint, HelloRequest(endpoint), ops_);
    Commit();
  }
  bool IsKnown(bus::EndpointId endpoint) { return StatusOf(Heartbeat(endpoint, {})) == HeartbeatStatus::kOk; }
};

// --- Submissions -----------------------------------------------------------------------------------------------------

TEST_F(SchedulerBudget, OpenExperimentsOfOneSubmitterAndOfAll) {
  options_.max_open_experiments = 3;
  options_.max_open_experiments_per_submitter = 2;
  Restart();
  SubmitBy("ada", "a1");
  SubmitBy("ada", "a2");
  ExpectRefused(SubmitBy("ada", "a3"), "submitter 'ada' has 2 open experiments, and the server takes at most 2");
  EXPECT_EQ(StatusOf(SubmitBy("bob", "b1")), SubmitStatus::kCreated);
  ExpectRefused(SubmitBy("eve", "e1"), "the server has 3 open experiments and takes at most 3");
  Cancel(1);
  ExpectRefused(SubmitBy("eve", "e1"), "takes at most 3");
  Advance(options_.retention);
  EXPECT_EQ(StatusOf(SubmitBy("eve", "e1")), SubmitStatus::kCreated) << "the cancelled one has left the memory";
}

TEST_F(SchedulerBudget, JobsThatWereCancelledCountUntilTheyLeaveTheMemory) {
  options_.max_jobs_in_memory = 6;
  Restart();
  SubmitBy("ada", "a1", 4);
  Cancel(1);
  ExpectRefused(SubmitBy("ada", "a2", 4), "4 jobs of open and just ended experiments in memory");
  Advance(options_.retention);
  EXPECT_EQ(StatusOf(SubmitBy("ada", "a2", 4)), SubmitStatus::kCreated);
}

TEST_F(SchedulerBudget, BytesOfSpecifications) {
  options_.max_spec_bytes = 1500;
  options_.max_spec_bytes_per_submitter = 1000;
  Restart();
  SubmitBy("ada", "a1");
  ExpectRefused(SubmitBy("ada", "a2"), "the specifications of submitter 'ada' have");
  SubmitBy("bob", "b1");
  ExpectRefused(SubmitBy("eve", "e1"), "the specifications of open experiments have");
}

TEST_F(SchedulerBudget, NamesMethodsAndTagsOfStoredExperiments) {
  SubmitBy("ada", "a1");
  options_.max_summary_bytes = SummaryBytes(Summary()) + 100;
  Restart();
  EXPECT_EQ(StatusOf(Control(1, ControlAction::kTag, std::string(90, 't'))), ControlStatus::kOk);
  const auto refused = Control(1, ControlAction::kTag, "more");
  EXPECT_EQ(StatusOf(refused), ControlStatus::kRefused);
  EXPECT_THAT(refused.message, HasSubstr("delete experiments"));
  ExpectRefused(SubmitBy("ada", "a2"), "delete some");
  EXPECT_EQ(StatusOf(Control(1, ControlAction::kUntag, std::string(90, 't'))), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(SubmitBy("ada", "a2")), SubmitStatus::kCreated);
}

TEST_F(SchedulerBudget, ChangesThatAddAnEventHaveARate) {
  options_.control_burst = 4;
  options_.controls_per_s = 1;
  Restart();
  SubmitBy("ada", "a1");
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(StatusOf(Control(1, ControlAction::kPause)), ControlStatus::kOk);
    EXPECT_EQ(StatusOf(Control(1, ControlAction::kResume)), ControlStatus::kOk);
  }
  const auto refused = Control(1, ControlAction::kPause);
  EXPECT_EQ(StatusOf(refused), ControlStatus::kRefused);
  EXPECT_THAT(refused.message, HasSubstr("try again in a second"));
  EXPECT_EQ(StatusOf(Control(1, ControlAction::kPriority, "", 5)), ControlStatus::kRefused);
  EXPECT_EQ(StatusOf(Control(1, ControlAction::kRename, "other")), ControlStatus::kRefused);
  Advance(seconds(1));
  EXPECT_EQ(StatusOf(Control(1, ControlAction::kPause)), ControlStatus::kOk);
}

// --- Disk ------------------------------------------------------------------------------------------------------------

TEST_F(SchedulerBudget, SubmissionsLeaveAReserveOfTheDiskForResults) {
  options_.disk_reserve_bytes = 1000 * kMegabyte;
  disk_ = db::DiskSpace{1100 * kMegabyte, 100'000 * kMegabyte};
  Restart();
  EXPECT_EQ(StatusOf(SubmitBy("ada", "a1", 2)), SubmitStatus::kCreated);
  auto large = SampleSpec(10);
  large["repetitions"] = 100'000;
  ExpectRefused(Submit(large, "a2"),
                "has 1100 MB free; the experiment's 1000000 jobs need about 150 MB, and 1000 MB "
                "are reserved");
  disk_->free_bytes = 999 * kMegabyte;
  ExpectRefused(SubmitBy("ada", "a3"), "has 999 MB free");
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted) << "accepted jobs go on";
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
}

TEST_F(SchedulerBudget, ASmallDiskIsNotReservedAsAWhole) {
  EXPECT_EQ(ReserveOf({50 * kMegabyte, 100 * kMegabyte}, 1000 * kMegabyte), 5 * kMegabyte);
  disk_ = db::DiskSpace{50 * kMegabyte, 100 * kMegabyte};
  Restart();
  EXPECT_EQ(StatusOf(SubmitBy("ada", "a1")), SubmitStatus::kCreated);
}

// --- Workers ---------------------------------------------------------------------------------------------------------

TEST_F(SchedulerBudget, AWorkerIsStoredWithItsFirstLease) {
  Hello(kFirst);
  Advance(seconds(5));
  EXPECT_EQ(Control(worker_ids_[kFirst], ControlAction::kDrainWorker).num_jobs, 0);
  Hello(kSecond);
  EXPECT_EQ(StoredWorkers(), 0U);
  EXPECT_EQ(StatusJson(*scheduler_, 0, now_, "").at("workers").size(), 2U) << "but it is seen";
  Submit(SampleSpec());
  LeaseOne(kSecond);
  const auto stored = store_.LoadOpenState().workers;
  ASSERT_EQ(stored.size(), 1U);
  EXPECT_EQ(stored.begin()->second.endpoint, kSecond);
}

TEST_F(SchedulerBudget, ASilentWorkerThatNeverLeasedIsForgotten) {
  Hello(kFirst);
  Advance(minutes(1));
  EXPECT_EQ(scheduler_->workers().size(), 1U) << "offline";
  Advance(options_.new_worker_kept);
  EXPECT_EQ(scheduler_->workers().size(), 0U);
  EXPECT_EQ(StatusOf(Hello(kFirst)), HelloStatus::kOk);
}

TEST_F(SchedulerBudget, ManyHellosForgetTheLongestSilentWorkers) {
  options_.max_new_worker_bytes = 100'000;
  Restart();
  Hello(kFirst);
  constexpr int kSenders = 50'000;
  for (int i = 0; i < kSenders; ++i) {
    HelloOf(100'000 + i);
    if (i % 10 != 0) continue;
    now_.steady += microseconds(1000);
    EXPECT_TRUE(IsKnown(kFirst)) << "it is heard of all the time";
  }
  EXPECT_LT(scheduler_->workers().size(), 150U);
  EXPECT_EQ(StoredWorkers(), 0U);
  // A removed worker registers again if there is work.
  Submit(SampleSpec());
  Hello(100'000);
  LeaseOne(100'000);
}

// A reply has a limit; that a program says hello many times must not take the status from all users.
TEST_F(SchedulerBudget, ManyHellosDoNotFillTheStatus) {
  Submit(SampleSpec());
  Hello(kFirst);
  LeaseOne(kFirst);
  now_.steady += seconds(1);
  constexpr int kSenders = 20'000;
  for (int i = 0; i < kSenders; ++i) HelloOf(100'000 + i);
  const nlohmann::json status = StatusJson(*scheduler_, 0, now_, "");
  EXPECT_LT(status.dump().size(), std::size_t{4} << 20);
  EXPECT_EQ(status["workers"].size(), 1001U);
  EXPECT_EQ(status["workers"][0]["id"], worker_ids_[kFirst]) << "it has leased a job";
  EXPECT_EQ(status["server"]["workers_not_listed"], scheduler_->workers().size() - 1001U);
  EXPECT_GT(scheduler_->workers().size(), 2000U);
}

TEST_F(SchedulerBudget, AWorkerThatLeasedIsNotForgottenForOthers) {
  options_.max_new_worker_bytes = 20'000;
  Restart();
  Submit(SampleSpec());
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  now_.steady += seconds(1);
  for (int i = 0; i < 100; ++i) HelloOf(100'000 + i);
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted);
  EXPECT_TRUE(IsKnown(kFirst));
}

// The store has one worker for each address, so a worker that returns must get its former number.
TEST_F(SchedulerBudget, AStoredWorkerThatLeftTheMemoryComesBackAsTheSame) {
  options_.max_gone_workers = 2;
  options_.most_offline_shown = 10;
  Restart();
  Submit(SampleSpec(5));
  for (bus::EndpointId endpoint = 2001; endpoint <= 2005; ++endpoint) {
    Hello(endpoint);
    Finish(endpoint, LeaseOne(endpoint));
    Advance(seconds(30));
  }
  const std::int64_t first = worker_ids_[2001];
  EXPECT_EQ(scheduler_->workers().size(), 2U);
  EXPECT_EQ(Hello(2001).worker_id, first);
  Restart();
  EXPECT_EQ(scheduler_->workers().size(), 2U) << "also after a restart";
  EXPECT_EQ(Hello(2002).worker_id, worker_ids_[2002]);
  EXPECT_EQ(StoredWorkers(), 5U);
}

}  // namespace
}  // namespace legopt::server
