// Policy: progress is a pure function of status, rate, reason and width. The rate is the recent one and is omitted
// without evidence.
#include "client/report/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/client_error.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;
using testing::Not;

ExperimentStatus Status(std::int64_t done, std::int64_t solved, std::int64_t total = 80) {
  ExperimentStatus status;
  status.id = 3;
  status.name = "quick";
  status.state = done == total ? ExperimentState::kDone : ExperimentState::kActive;
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

ExperimentStatus After(ExperimentStatus status, double elapsed_s, std::optional<double> eta_s = {}) {
  status.elapsed_s = elapsed_s;
  status.eta_s = eta_s;
  return status;
}

TEST(ProgressBar, ShowsShareCountsRateAndEstimate) {
  EXPECT_EQ(RenderProgressBar(After(Status(40, 38), 4, 2.3), 12.25, "", 70),
            "[===========>          ] 40/80  38 solved  12.2 jobs/s  0:04  ETA 0:02");
}

TEST(ProgressBar, IsFullOnlyAtTheEnd) {
  EXPECT_THAT(RenderProgressBar(After(Status(79, 79), 4, 0.1), 12.0, "", 120), HasSubstr(">]"));
  EXPECT_THAT(RenderProgressBar(After(Status(80, 79), 4), 12.0, "", 120), HasSubstr("=]"));
  EXPECT_THAT(RenderProgressBar(After(Status(80, 79), 4), 12.0, "", 120), Not(HasSubstr("ETA")));
}

TEST(ProgressBar, NeverExceedsTheWidth) {
  ExperimentStatus status = After(Status(60, 55), 4000, 100);
  status.dead = 3;
  status.failed = 2;
  for (int width = 0; width <= 140; ++width) {
    for (const char* note : {"", "no worker is connected; start one with 'legopt-worker --slots 2'"}) {
      EXPECT_LE(RenderProgressBar(status, 0.3, note, width).size(), static_cast<std::size_t>(width));
    }
  }
}

TEST(ProgressBar, SmallWidthKeepsTheCounts) {
  const std::string text = RenderProgressBar(After(Status(40, 38), 4, 2), 12.0, "", 20);
  EXPECT_THAT(text, HasSubstr("40/80"));
  EXPECT_THAT(text, Not(HasSubstr("[")));
}

TEST(ProgressBar, TroubleIsVisibleAtOnce) {
  ExperimentStatus status = Status(10, 9);
  status.dead = 1;
  status.failed = 2;
  const std::string text = RenderProgressLine(status, {}, "");
  EXPECT_THAT(text, HasSubstr("1 dead"));
  EXPECT_THAT(text, HasSubstr("2 cannot run"));
}

TEST(ProgressBar, NoEstimateIsADash) { EXPECT_THAT(RenderProgressLine(Status(0, 0), {}, ""), HasSubstr("ETA -")); }

TEST(ProgressBar, SlowRatesArePerMinute) {
  EXPECT_THAT(RenderProgressLine(Status(1, 1), 0.05, ""), HasSubstr("3.0 jobs/min"));
}

TEST(ProgressBar, ExperimentWithoutJobsIsComplete) {
  EXPECT_THAT(RenderProgressBar(Status(0, 0, 0), {}, "", 80), HasSubstr("0/0"));
}

TEST(ProgressBar, TheReasonOfAStandstillTakesThePlaceOfRateAndEstimate) {
  const std::string note = "no worker is connected; start one with 'legopt-worker --slots 2'";
  const ExperimentStatus status = After(Status(40, 38), 61, 30);
  EXPECT_EQ(RenderProgressLine(status, 5.0, note), "experiment 3:  40/80  38 solved  1:01  " + note);
  EXPECT_EQ(RenderProgressBar(status, 5.0, note, 70),
            "[==========>          ] 40/80  38 solved  1:01  no worker is connected");
  EXPECT_THAT(RenderProgressBar(status, 5.0, note, 140), HasSubstr("--slots 2"));
  EXPECT_THAT(RenderProgressBar(status, 5.0, note, 30), HasSubstr("40/80  38 solved  no worker"));
}

TEST(StallNotice, WaitsAMomentAndIsNeverStale) {
  StallNotice note(Seconds(1));
  ExperimentStatus status = Status(1, 1);
  status.waiting_for = "no worker is connected";
  EXPECT_EQ(note.Observe(Seconds(0), status), "");
  EXPECT_EQ(note.Observe(Seconds(0.9), status), "");
  EXPECT_EQ(note.Observe(Seconds(1), status), "no worker is connected");
  status.waiting_for = "paused";
  EXPECT_EQ(note.Observe(Seconds(1.1), status), "paused") << "it stood still already";
  status.waiting_for = "";
  EXPECT_EQ(note.Observe(Seconds(1.2), status), "");
  status.waiting_for = "paused";
  EXPECT_EQ(note.Observe(Seconds(1.3), status), "");
}

ExperimentStatus Working(std::int64_t done, std::int64_t total) {
  ExperimentStatus status = Status(done, done, total);
  status.leased = 1;
  --status.queued;
  return status;
}

TEST(PaceMeter, KnowsNothingAtFirst) {
  PaceMeter meter;
  EXPECT_FALSE(meter.Observe(Seconds(0), Working(0, 100)).has_value());
  EXPECT_FALSE(meter.Observe(Seconds(5), Working(0, 100)).has_value());
}

TEST(PaceMeter, ResumedJobsAreNotSpeed) {
  PaceMeter meter;
  meter.Observe(Seconds(10), Working(50, 100));
  EXPECT_DOUBLE_EQ(*meter.Observe(Seconds(15), Working(60, 100)), 2.0);
}

TEST(PaceMeter, WaitingForWorkersIsNotSlowness) {
  PaceMeter meter;
  for (int second = 0; second <= 6; ++second) meter.Observe(Seconds(second), Status(0, 0, 100));
  EXPECT_DOUBLE_EQ(*meter.Observe(Seconds(7), Working(10, 100)), 10.0);
}

TEST(PaceMeter, StandingStillIsNotSlowness) {
  PaceMeter meter;
  meter.Observe(Seconds(0), Working(0, 100));
  meter.Observe(Seconds(1), Working(10, 100));
  ExperimentStatus paused = Status(10, 10, 100);
  paused.waiting_for = "paused";
  for (int second = 2; second <= 20; ++second) {
    EXPECT_FALSE(meter.Observe(Seconds(second), paused).has_value()) << "no rate either";
  }
  EXPECT_DOUBLE_EQ(*meter.Observe(Seconds(21), Working(20, 100)), 10.0);
}

TEST(PaceMeter, LongJobsAreSlowness) {
  PaceMeter meter(Seconds(1000));
  for (int second = 0; second < 50; ++second) meter.Observe(Seconds(second), Working(0, 100));
  EXPECT_DOUBLE_EQ(*meter.Observe(Seconds(50), Working(1, 100)), 0.02);
}

TEST(PaceMeter, FollowsTheRecentRate) {
  PaceMeter meter(Seconds(10));
  for (int second = 0; second <= 100; ++second) meter.Observe(Seconds(second), Working(second * 10, 10'000));
  std::optional<double> rate;
  for (int second = 101; second <= 115; ++second) {
    rate = meter.Observe(Seconds(second), Working(1000 + (second - 100), 10'000));
  }
  EXPECT_DOUBLE_EQ(*rate, 1.0);
}

TEST(PaceMeter, LongWorkLowersTheRate) {
  PaceMeter meter(Seconds(10));
  meter.Observe(Seconds(0), Working(0, 100));
  const double before = *meter.Observe(Seconds(5), Working(50, 100));
  const double after = *meter.Observe(Seconds(9), Working(50, 100));
  EXPECT_LT(after, before);
  for (int second = 10; second < 20; ++second) meter.Observe(Seconds(second), Working(50, 100));
  EXPECT_FALSE(meter.Observe(Seconds(20), Working(50, 100)).has_value());
}

TEST(Summary, CountsEveryEnd) {
  ExperimentStatus status = Status(77, 75);
  status.dead = 2;
  status.cancelled = 1;
  EXPECT_THAT(RenderSummary(After(status, 75)), HasSubstr("in 1:15:"));
  EXPECT_EQ(RenderSummary(After(status, 7)), "80 of 80 jobs in 7.0 s: 75 solved, 2 not solved, 2 dead, 1 cancelled");
}

TEST(Summary, TellsTheTimesOfTheExperiment) {
  ExperimentStatus status = After(Status(80, 80), 9);
  status.worked_s = 8.2;
  EXPECT_THAT(RenderSummary(status), HasSubstr("80 of 80 jobs in 9.0 s:"));
  EXPECT_EQ(FormatElapsed(status), "0:09");
  status.elapsed_s = 72'785;
  EXPECT_THAT(RenderSummary(status), HasSubstr("80 of 80 jobs in 20:13:05 (8.2 s of work):"));
  EXPECT_EQ(FormatElapsed(status), "0:08 of work");
}

TEST(ExperimentStatus, IsReadFromTheServersReply) {
  const auto experiments =
      ParseExperiments(nlohmann::json::parse(R"({"experiments":[{"id":4,"name":"a","state":"active",
      "jobs":{"queued":1,"leased":2,"done":3,"failed":4,"dead":5,"cancelled":6,"total":21},"solved":2,"rule":"solid"}],"workers":[]})"));
  ASSERT_EQ(experiments.size(), 1U);
  EXPECT_EQ(experiments[0].finished(), 18);
  EXPECT_FALSE(experiments[0].over());
  EXPECT_EQ(experiments[0].solved, 2);
}

TEST(ExperimentStatus, TellsTheWindowsOfRunningMotions) {
  const auto status = ParseExperiments(nlohmann::json::parse(R"({"experiments":[{"id":4,"name":"a","state":"active",
      "jobs":{"queued":1,"leased":2,"done":3,"failed":0,"dead":0,"cancelled":0,"total":6},"solved":2,"rule":"solid","running":[
      {"job":7,"task":"motion","worker":1,"progress_done":3,"progress_total":40},
      {"job":8,"task":"posture","worker":1,"progress_done":1,"progress_total":11},
      {"job":9,"task":"motion","worker":2,"progress_done":0,"progress_total":61}]}],"workers":[]})"))
                          .at(0);
  ASSERT_EQ(status.running.size(), 3U);
  EXPECT_EQ(status.running[0], (RunningJob{7, Task::kMotion, 1, 3, 40}));
  EXPECT_THAT(RenderProgressLine(status, {}, ""), HasSubstr("windows 3/40, 0/61  "));
  EXPECT_THAT(RenderProgressBar(status, {}, "", 80), HasSubstr("windows 3/40, 0/61"));
  EXPECT_THAT(RenderProgressBar(status, {}, "", 40), testing::Not(HasSubstr("windows")));
}

TEST(ExperimentStatus, StateTextTellsWhatKeepsItBack) {
  const auto status = nlohmann::json::parse(R"({"experiments":[{"id":4,"name":"a","state":"active","hold":"paused",
    "hold_reason":"the disk","priority":3,"jobs":{"total":1,"queued":1,"leased":0,"done":0,"failed":0,"dead":0,
    "cancelled":0},"solved":0,"rule":"solid"}]})");
  EXPECT_EQ(StateText(ParseExperiments(status).at(0)), "paused: the disk");
  EXPECT_EQ(ParseExperiments(status).at(0).priority, 3);
}

TEST(ExperimentStatus, TellsWhatTheServerForesees) {
  const auto status = ParseExperiments(nlohmann::json::parse(R"({"experiments":[{"id":4,"name":"a","state":"active",
    "jobs":{"total":1,"queued":1,"leased":0,"done":0,"failed":0,"dead":0,"cancelled":0},"solved":0,"rule":"solid",
    "submitter":"ann","dataset":"garage","methods":["SQP","Adam"],"tags":["paper"],"share":0.5,"eta_s":7.5,
    "waiting_for":"paused","spec_hash":"ab","submitted_at_us":5,"elapsed_s":9.5,"worked_s":null}]})"))
                          .at(0);
  EXPECT_EQ(status.submitter, "ann");
  EXPECT_EQ(status.dataset, "garage");
  EXPECT_EQ(status.methods, (std::vector<std::string>{"SQP", "Adam"}));
  EXPECT_EQ(status.tags, std::vector<std::string>{"paper"});
  EXPECT_EQ(status.share, 0.5);
  EXPECT_EQ(status.eta_s, 7.5);
  EXPECT_EQ(status.waiting_for, "paused");
  EXPECT_EQ(status.elapsed_s, 9.5);
  EXPECT_FALSE(status.worked_s.has_value());
}

TEST(ExperimentStatus, ForeignReplyIsAnError) {
  EXPECT_THROW(ParseExperiments(nlohmann::json::parse(R"({"experiments":[{"id":"x"}]})")), ClientError);
  EXPECT_THROW(ParseStatusText("{"), ClientError);
}

}  // namespace
}  // namespace legopt::client
