// Policy: progress is a pure function of status, pace and width; the estimate follows the recent rate and is silent
// without evidence.
#include "client/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/client_error.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;
using testing::Not;

ExperimentStatus Status(std::int64_t done, std::int64_t solved, std::int64_t total = 80) {
  ExperimentStatus status;
  status.id = 3;
  status.name = "quick";
  status.state = done == total ? "done" : "active";
  status.total = total;
  status.done = done;
  status.solved = solved;
  status.queued = total - done;
  return status;
}

TEST(FormatDuration, ReadsLikeAClock) {
  EXPECT_EQ(FormatDuration(Seconds(0)), "0:00");
  EXPECT_EQ(FormatDuration(Seconds(7.4)), "0:07");
  EXPECT_EQ(FormatDuration(Seconds(59.6)), "1:00");
  EXPECT_EQ(FormatDuration(Seconds(192)), "3:12");
  EXPECT_EQ(FormatDuration(Seconds(3723)), "1:02:03");
  EXPECT_EQ(FormatDuration(Seconds(-5)), "0:00");
}

TEST(ProgressBar, ShowsShareCountsRateAndEstimate) {
  const Pace pace{Seconds(4), 12.25, Seconds(2.3)};
  EXPECT_EQ(RenderProgressBar(Status(40, 38), pace, 70),
            "[===========>          ] 40/80  38 solved  12.2 jobs/s  0:04  ETA 0:02");
}

TEST(ProgressBar, IsFullOnlyAtTheEnd) {
  const Pace pace{Seconds(4), 12.0, Seconds(0.1)};
  EXPECT_THAT(RenderProgressBar(Status(79, 79), pace, 120), HasSubstr(">]"));
  EXPECT_THAT(RenderProgressBar(Status(80, 79), pace, 120), HasSubstr("=]"));
  EXPECT_THAT(RenderProgressBar(Status(80, 79), pace, 120), Not(HasSubstr("ETA")));
}

TEST(ProgressBar, NeverExceedsTheWidth) {
  ExperimentStatus status = Status(60, 55);
  status.dead = 3;
  status.failed = 2;
  for (int width = 0; width <= 140; ++width) {
    EXPECT_LE(RenderProgressBar(status, {Seconds(4000), 0.3, Seconds(100)}, width).size(),
              static_cast<std::size_t>(width));
  }
}

TEST(ProgressBar, SmallWidthKeepsTheCounts) {
  const std::string text = RenderProgressBar(Status(40, 38), {Seconds(4), 12.0, Seconds(2)}, 20);
  EXPECT_THAT(text, HasSubstr("40/80"));
  EXPECT_THAT(text, Not(HasSubstr("[")));
}

TEST(ProgressBar, TroubleIsVisibleAtOnce) {
  ExperimentStatus status = Status(10, 9);
  status.dead = 1;
  status.failed = 2;
  const std::string text = RenderProgressLine(status, {});
  EXPECT_THAT(text, HasSubstr("1 dead"));
  EXPECT_THAT(text, HasSubstr("2 cannot run"));
}

TEST(ProgressBar, NoRateNoEstimate) { EXPECT_THAT(RenderProgressLine(Status(0, 0), {}), HasSubstr("ETA -")); }

TEST(ProgressBar, SlowRatesArePerMinute) {
  EXPECT_THAT(RenderProgressLine(Status(1, 1), {Seconds(20), 0.05, Seconds(1580)}), HasSubstr("3.0 jobs/min"));
}

TEST(ProgressBar, ExperimentWithoutJobsIsComplete) {
  EXPECT_THAT(RenderProgressBar(Status(0, 0, 0), {}, 80), HasSubstr("0/0"));
}

ExperimentStatus Working(std::int64_t done, std::int64_t total) {
  ExperimentStatus status = Status(done, done, total);
  status.leased = 1;
  --status.queued;
  return status;
}

TEST(PaceMeter, KnowsNothingAtFirst) {
  PaceMeter meter;
  EXPECT_FALSE(meter.Observe(Seconds(0), Working(0, 100)).jobs_per_s.has_value());
  EXPECT_FALSE(meter.Observe(Seconds(5), Working(0, 100)).jobs_per_s.has_value());
}

TEST(PaceMeter, ResumedJobsAreNotSpeed) {
  PaceMeter meter;
  meter.Observe(Seconds(10), Working(50, 100));
  const Pace pace = meter.Observe(Seconds(15), Working(60, 100));
  EXPECT_DOUBLE_EQ(*pace.jobs_per_s, 2.0);
  EXPECT_DOUBLE_EQ(pace.remaining->count(), 20.0);
  EXPECT_DOUBLE_EQ(pace.elapsed.count(), 5.0);
}

TEST(PaceMeter, WaitingForWorkersIsNotSlowness) {
  PaceMeter meter;
  for (int second = 0; second <= 6; ++second) meter.Observe(Seconds(second), Status(0, 0, 100));
  EXPECT_DOUBLE_EQ(*meter.Observe(Seconds(7), Working(10, 100)).jobs_per_s, 10.0);
}

TEST(PaceMeter, LongJobsAreSlowness) {
  PaceMeter meter(Seconds(1000));
  for (int second = 0; second < 50; ++second) meter.Observe(Seconds(second), Working(0, 100));
  EXPECT_DOUBLE_EQ(*meter.Observe(Seconds(50), Working(1, 100)).jobs_per_s, 0.02);
}

TEST(PaceMeter, FollowsTheRecentRate) {
  PaceMeter meter(Seconds(10));
  for (int second = 0; second <= 100; ++second) meter.Observe(Seconds(second), Working(second * 10, 10'000));
  Pace pace;
  for (int second = 101; second <= 115; ++second) {
    pace = meter.Observe(Seconds(second), Working(1000 + (second - 100), 10'000));
  }
  EXPECT_DOUBLE_EQ(*pace.jobs_per_s, 1.0);
}

TEST(PaceMeter, StandstillLowersTheRate) {
  PaceMeter meter(Seconds(10));
  meter.Observe(Seconds(0), Working(0, 100));
  const double before = *meter.Observe(Seconds(5), Working(50, 100)).jobs_per_s;
  const double after = *meter.Observe(Seconds(9), Working(50, 100)).jobs_per_s;
  EXPECT_LT(after, before);
  for (int second = 10; second < 20; ++second) meter.Observe(Seconds(second), Working(50, 100));
  EXPECT_FALSE(meter.Observe(Seconds(20), Working(50, 100)).remaining.has_value());
}

TEST(Summary, CountsEveryEnd) {
  ExperimentStatus status = Status(77, 75);
  status.dead = 2;
  status.cancelled = 1;
  EXPECT_THAT(RenderSummary(status, Seconds(75)), HasSubstr("in 1:15:"));
  EXPECT_EQ(RenderSummary(status, Seconds(7)), "80 of 80 jobs in 7.0 s: 75 solved, 2 not solved, 2 dead, 1 cancelled");
}

TEST(ExperimentStatus, IsReadFromTheServersReply) {
  const auto experiments =
      ParseExperiments(nlohmann::json::parse(R"({"experiments":[{"id":4,"name":"a","state":"active",
      "jobs":{"queued":1,"leased":2,"done":3,"failed":4,"dead":5,"cancelled":6,"total":21},"solved":2}],"workers":[]})"));
  ASSERT_EQ(experiments.size(), 1U);
  EXPECT_EQ(experiments[0].finished(), 18);
  EXPECT_FALSE(experiments[0].over());
  EXPECT_EQ(experiments[0].solved, 2);
}

TEST(ExperimentStatus, TellsTheWindowsOfRunningMotions) {
  const auto status = ParseExperiments(nlohmann::json::parse(R"({"experiments":[{"id":4,"name":"a","state":"active",
      "jobs":{"queued":1,"leased":2,"done":3,"failed":0,"dead":0,"cancelled":0,"total":6},"solved":2,"running":[
      {"job":7,"task":"motion","worker":1,"progress_done":3,"progress_total":40},
      {"job":8,"task":"posture","worker":1,"progress_done":1,"progress_total":11},
      {"job":9,"task":"motion","worker":2,"progress_done":0,"progress_total":61}]}],"workers":[]})"))
                          .at(0);
  ASSERT_EQ(status.running.size(), 3U);
  EXPECT_EQ(status.running[0], (RunningJob{7, "motion", 1, 3, 40}));
  EXPECT_THAT(RenderProgressLine(status, {}), HasSubstr("windows 3/40, 0/61  "));
  EXPECT_THAT(RenderProgressBar(status, {}, 80), HasSubstr("windows 3/40, 0/61"));
  EXPECT_THAT(RenderProgressBar(status, {}, 40), testing::Not(HasSubstr("windows")));
}

TEST(StandstillReason, TellsWhatIsHeldBack) {
  const auto status = nlohmann::json::parse(R"({"experiments":[{"id":4,"name":"a","state":"active","hold":"held",
    "hold_reason":"the disk","priority":3,"jobs":{"total":1,"queued":1,"leased":0,"done":0,"failed":0,"dead":0,
    "cancelled":0},"solved":0}],"workers":[{"online":true,"leases":0}]})");
  EXPECT_EQ(StateText(ParseExperiments(status).at(0)), "held: the disk");
  EXPECT_EQ(ParseExperiments(status).at(0).priority, 3);
  EXPECT_EQ(StandstillReason(status), "experiment 4 is held: the disk; 'legopt release 4' lets it go on");
}

TEST(StandstillReason, TellsWhoIsMissing) {
  const auto reason = [](const char* workers) {
    return StandstillReason(nlohmann::json::parse(std::string(R"({"workers":)") + workers + "}"));
  };
  EXPECT_THAT(reason("[]"), HasSubstr("no worker is connected"));
  EXPECT_THAT(reason(R"([{"online":false,"leases":3}])"), HasSubstr("no worker is connected"));
  EXPECT_THAT(reason(R"([{"online":true,"leases":0}])"), HasSubstr("dataset"));
  EXPECT_EQ(reason(R"([{"online":true,"leases":0},{"online":true,"leases":2}])"), "");
}

TEST(ExperimentStatus, ForeignReplyIsAnError) {
  EXPECT_THROW(ParseExperiments(nlohmann::json::parse(R"({"experiments":[{"id":"x"}]})")), ClientError);
  EXPECT_THROW(ParseStatusText("{"), ClientError);
}

}  // namespace
}  // namespace legopt::client
