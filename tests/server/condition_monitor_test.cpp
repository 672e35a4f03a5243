// Policy: a condition that no message reports is recorded as one event when it begins, and again only after it has
// ended.

#include <gmock/gmock.h>

#include "server/event_monitors.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kGigabyte = 1'000'000'000;

class ConditionWatchTest : public SchedulerTest {
 protected:
  // Returns the kinds of events generated at this time.
  std::vector<std::string> Look(microseconds after) {
    Advance(after);
    Scheduler::Ops ops;
    watch_.Look(*scheduler_, now_, "", ops);
    std::vector<std::string> kinds;
    for (const db::StoreOp& op : ops) {
      const auto& event = std::get<db::RecordEvent>(op);
      kinds.push_back(event.kind);
      detail_ = event.detail;
    }
    return kinds;
  }

  std::string detail_;
  ConditionMonitor watch_{MonitorLimits(), [this] { return disk_; }};
};

TEST_F(ConditionWatchTest, ADiskThatIsNearlyFullIsReportedOnceUntilItHasRecovered) {
  disk_ = db::DiskSpace{30 * kGigabyte, 100 * kGigabyte};
  EXPECT_THAT(Look(seconds(3)), IsEmpty());
  disk_->free_bytes = 9 * kGigabyte;
  EXPECT_THAT(Look(seconds(3)), ElementsAre("disk_low"));
  EXPECT_THAT(detail_, HasSubstr("9000 of 100000 MB free (9 %)"));
  EXPECT_TRUE(watch_.disk_is_low());
  disk_->free_bytes = 11 * kGigabyte;  // hardly better
  EXPECT_THAT(Look(seconds(3)), IsEmpty());
  disk_->free_bytes = 9 * kGigabyte;
  EXPECT_THAT(Look(seconds(3)), IsEmpty());
  disk_->free_bytes = 30 * kGigabyte;
  EXPECT_THAT(Look(seconds(3)), IsEmpty());
  EXPECT_FALSE(watch_.disk_is_low());
  disk_->free_bytes = 1;
  EXPECT_THAT(Look(seconds(3)), ElementsAre("disk_low"));
}

TEST_F(ConditionWatchTest, AHugeDiskWithMuchRoomIsNotLow) {
  disk_ = db::DiskSpace{400 * kGigabyte, 10'000 * kGigabyte};
  EXPECT_THAT(Look(seconds(3)), IsEmpty());
}

TEST_F(ConditionWatchTest, AnExperimentThatStandsStillIsReportedOnceWithTheReason) {
  Submit(SampleSpec(2));
  EXPECT_THAT(Look(seconds(3)), IsEmpty());
  EXPECT_THAT(Look(seconds(50)), IsEmpty()) << "not yet for long";
  EXPECT_THAT(Look(seconds(15)), ElementsAre("no_progress"));
  EXPECT_THAT(detail_, HasSubstr("no worker is connected"));
  EXPECT_THAT(Look(seconds(100)), IsEmpty());
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  EXPECT_THAT(Look(seconds(2)), IsEmpty()) << "it moves";
  Finish(kFirst, lease);
  for (int i = 0; i < 40; ++i) Look(seconds(2));
  EXPECT_THAT(detail_, HasSubstr("no worker is connected")) << "its worker is gone: another standstill";
}

TEST_F(ConditionWatchTest, APauseIsNoStandstill) {
  Submit(SampleSpec(2));
  Control(1, ControlAction::kPause);
  EXPECT_THAT(Look(seconds(3)), IsEmpty());
  EXPECT_THAT(Look(seconds(1000)), IsEmpty());
}

}  // namespace
}  // namespace legopt::server
