// Policy: the messages of a watcher, and the time at which it gives up, are a function of the received statuses in
// virtual time.

#include "client/report/watching.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "client/report/progress.h"

namespace legopt::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class RecordingView final : public WatchView {
 public:
  void Show(const ExperimentStatus& /*status*/) override {}
  void ServerSilent(Seconds silence, Seconds patience) override {
    words.push_back("silent " + std::to_string(static_cast<int>(silence.count())) + " of " +
                    std::to_string(static_cast<int>(patience.count())));
  }
  void ServerBack() override { words.emplace_back("back"); }

  std::vector<std::string> words;
};

const ClientError kNoAnswer(ExitCode::kUnreachable, "no legopt-server answers");

ExitCode CodeOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const ClientError& error) {
    return error.code();
  }
  return ExitCode::kOk;
}

TEST(ServerPatience, SaysOnceThatTheServerIsSilentAndOnceThatItIsBack) {
  RecordingView view;
  ServerPatience patience(Seconds(600), {});
  patience.Answered(Seconds(0), view);
  for (int i = 1; i <= 20; ++i) patience.Silent(Seconds(5 * i), kNoAnswer, view);
  patience.Answered(Seconds(101), view);
  patience.Answered(Seconds(102), view);
  patience.Silent(Seconds(107), kNoAnswer, view);
  EXPECT_THAT(view.words, ElementsAre("silent 5 of 600", "back", "silent 5 of 600"));
}

TEST(ServerPatience, EndsWithTheCodeOfAnUnreachableServer) {
  RecordingView view;
  ServerPatience patience(Seconds(10), Seconds(0));
  patience.Silent(Seconds(5), kNoAnswer, view);
  EXPECT_EQ(CodeOf([&] { patience.Silent(Seconds(10), kNoAnswer, view); }), ExitCode::kUnreachable);
  ServerPatience none(Seconds(0), Seconds(0));
  EXPECT_EQ(CodeOf([&] { none.Silent(Seconds(5), kNoAnswer, view); }), ExitCode::kUnreachable);
}

TEST(ServerPatience, AServerThatNeverAnsweredIsNotWaitedFor) {
  RecordingView view;
  ServerPatience patience(Seconds(600), {});
  EXPECT_EQ(CodeOf([&] { patience.Silent(Seconds(5), kNoAnswer, view); }), ExitCode::kUnreachable);
  EXPECT_THAT(view.words, testing::IsEmpty());
}

ExperimentStatus Waiting(const std::string& reason, std::int64_t done = 0) {
  ExperimentStatus status;
  status.id = 3;
  status.total = 9;
  status.done = done;
  status.waiting_for = reason;
  return status;
}

TEST(StallTimeout, CountsTheTimeInWhichNothingMovesAndNamesTheReason) {
  StallTimeout deadline(Seconds(10));
  deadline.Look(Seconds(0), Waiting("no worker is connected"));
  deadline.Look(Seconds(9), Waiting("no worker is connected"));
  deadline.Look(Seconds(100), Waiting(""));  // a long job runs
  deadline.Look(Seconds(109), Waiting("no worker has dataset 'x'"));
  deadline.Look(Seconds(118), Waiting("no worker has dataset 'x'", 1));  // a job has ended in between
  deadline.Look(Seconds(127), Waiting("no worker has dataset 'x'", 1));
  try {
    deadline.Look(Seconds(128), Waiting("no worker has dataset 'x'", 1));
    FAIL() << "it goes on waiting";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kNoProgress);
    EXPECT_THAT(error.what(), HasSubstr("experiment 3 has not moved for 0:10: no worker has dataset 'x'"));
  }
}

TEST(StallTimeout, WithoutALimitItWaitsOn) {
  StallTimeout deadline(std::nullopt);
  for (int i = 0; i < 100; ++i) deadline.Look(Seconds(1e6 * i), Waiting("no worker is connected"));
}

nlohmann::json Reply(std::int64_t id, const std::string& hash, std::int64_t submitted_at_us) {
  return {
      {"experiments",
       {{{"id", id},
         {"name", "quick"},
         {"state", "active"},
         {"spec_hash", hash},
         {"submitted_at_us", submitted_at_us},
         {"solved", 0},
         {"rule", "solid"},
         {"jobs",
          {{"total", 1}, {"queued", 1}, {"leased", 0}, {"done", 0}, {"failed", 0}, {"dead", 0}, {"cancelled", 0}}}}}}};
}

TEST(WatchedExperiment, IsTheSameAfterARestart) {
  WatchedExperiment watched(3, "here");
  EXPECT_EQ(watched.Find(Reply(3, "aa", 7)).name, "quick");
  EXPECT_EQ(watched.Find(Reply(3, "aa", 7)).name, "quick");
}

TEST(WatchedExperiment, AnotherDatabaseEndsIt) {
  WatchedExperiment watched(3, "here");
  watched.Find(Reply(3, "aa", 7));
  const auto code = [&](const nlohmann::json& reply) { return CodeOf([&] { watched.Find(reply); }); };
  EXPECT_EQ(code(Reply(3, "bb", 7)), ExitCode::kDatabaseUnusable) << "another content";
  EXPECT_EQ(code(Reply(3, "aa", 8)), ExitCode::kDatabaseUnusable) << "submitted at another time";
  EXPECT_EQ(code({{"experiments", nlohmann::json::array()}}), ExitCode::kDatabaseUnusable) << "unknown there";
}

TEST(WatchedExperiment, OneThatNeverWasIsAnErrorOfTheUser) {
  WatchedExperiment watched(3, "here");
  EXPECT_EQ(CodeOf([&] { watched.Find({{"experiments", nlohmann::json::array()}}); }), ExitCode::kUsage);
}

TEST(ReasonWithOwnWorkers, ThoseThatAreNotConnectedYetLoad) {
  ExperimentStatus status;
  status.waiting_for = "no worker is connected";
  const nlohmann::json nobody = {{"workers", nlohmann::json::array()}};
  const nlohmann::json somebody = {{"workers", {{{"id", 1}, {"online", true}}}}};
  EXPECT_EQ(ReasonWithOwnWorkers(status, nobody), "the workers load the dataset");
  EXPECT_EQ(ReasonWithOwnWorkers(status, somebody), "no worker is connected");
  status.hold = ExperimentHold::kPaused;
  status.waiting_for = "paused: the disk";
  EXPECT_EQ(ReasonWithOwnWorkers(status, nobody), "paused: the disk");
  status = {};
  EXPECT_EQ(ReasonWithOwnWorkers(status, nobody), "") << "it moves";
}

class WatchJsonTest : public testing::Test {
 protected:
  ExperimentStatus Done(std::int64_t done) {
    ExperimentStatus status;
    status.id = 3;
    status.name = "quick";
    status.state = done == 4 ? ExperimentState::kDone : ExperimentState::kActive;
    status.total = 4;
    status.done = done;
    status.queued = 4 - done;
    status.elapsed_s = now_.count();
    return status;
  }
  void ShowAt(double now_s, const ExperimentStatus& status) {
    now_ = Seconds(now_s);
    view_.Show(status);
  }
  std::vector<std::string> Events() const {
    std::vector<std::string> events;
    for (const auto& line : lines_) events.push_back(line.at("event"));
    return events;
  }

  Seconds now_{0};
  std::vector<nlohmann::json> lines_;
  WatchJson view_{3, Seconds(1), [this] { return now_; }, [] { return std::int64_t{1'700'000'000'000'000}; },
                  [this](const std::string& line) { lines_.push_back(nlohmann::json::parse(line)); }};
};

TEST_F(WatchJsonTest, WritesChangesAtMostOncePerIntervalAndSometimesWithoutOne) {
  for (int i = 0; i <= 8; ++i) ShowAt(0.25 * i, Done(i < 2 ? 0 : 1));
  ASSERT_EQ(lines_.size(), 2U) << "at 0 and at 1 s";
  EXPECT_EQ(lines_[1].at("done"), 1);
  for (int second = 3; second <= 11; ++second) ShowAt(second, Done(1));
  EXPECT_EQ(lines_.size(), 3U);
  ShowAt(11.25, Done(4));
  EXPECT_EQ(lines_.size(), 4U) << "the end at once";
}

TEST_F(WatchJsonTest, EveryLineTellsWhatItIsAndOfWhich) {
  ShowAt(0, Done(1));
  view_.ServerSilent(Seconds(5), Seconds(600));
  view_.ServerBack();
  ShowAt(9, Done(4));
  view_.End(ExitCode::kOk, "");
  EXPECT_THAT(Events(), ElementsAre("progress", "silent", "back", "progress", "end"));
  for (const auto& line : lines_) {
    EXPECT_EQ(line.at("experiment"), 3);
    EXPECT_EQ(line.at("at_us"), 1'700'000'000'000'000);
  }
  EXPECT_EQ(lines_[1].at("silent_s"), 5);
  const auto& end = lines_.back();
  EXPECT_EQ(end.at("exit_code"), 0);
  EXPECT_EQ(end.at("reason"), "");
  EXPECT_EQ(end.at("state"), "done");
  for (const char* key :
       {"name", "hold", "hold_reason", "waiting_for", "total", "queued", "leased", "done", "failed", "dead",
        "cancelled", "solved", "rule", "elapsed_s", "worked_s", "eta_s", "share", "running"}) {
    EXPECT_TRUE(end.contains(key)) << key;
  }
}

TEST_F(WatchJsonTest, AnEndBeforeTheFirstAnswerIsToldToo) {
  view_.End(ExitCode::kUnreachable, "no legopt-server answers");
  ASSERT_EQ(lines_.size(), 1U);
  EXPECT_EQ(lines_[0].at("exit_code"), 3);
  EXPECT_THAT(lines_[0].at("reason").get<std::string>(), HasSubstr("no legopt-server"));
}

}  // namespace
}  // namespace legopt::client
