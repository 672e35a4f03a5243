// Policy: the estimate is a pure function of the remaining work. Single cases have one correct answer. Recorded
// histories of real runs are replayed on virtual slots, and every estimate in between is compared with the actual
// time.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "server/forecast.h"
#include "tests/server/recorded_history.h"

namespace legopt::server {
namespace {

constexpr double kLimit_s = 300;

// Returns two methods, each with postures (kinds 0 and 2) and motions (kinds 1 and 3).
WorkLeft TwoMethods() {
  WorkLeft left;
  left.kinds = {
      {0, Task::kPosture, 0, 0}, {0, Task::kMotion, 0, 0}, {1, Task::kPosture, 0, 0}, {1, Task::kMotion, 0, 0}};
  left.slots = 2;
  return left;
}

TEST(SecondsPerWaypoint, IsTimeOverWaypointsDealtWith) {
  WorkLeft left = TwoMethods();
  left.kinds[0] = {0, Task::kPosture, 6, 12};
  left.kinds[1] = {0, Task::kMotion, 30, 50};
  left.running = {{0, 1, 2.0, 0, 0, kLimit_s}, {1, 50, 10.0, 2, 10, kLimit_s}};
  const auto rates = SecondsPerWaypoint(left);
  EXPECT_DOUBLE_EQ(*rates[0], 7.5 / 12) << "a running job adds what it takes longer than expected";
  EXPECT_DOUBLE_EQ(*rates[1], 40 / 62.5) << "windows count";
}

TEST(SecondsPerWaypoint, BorrowsFromTheOtherStartAndFromNoOtherMethodOrTask) {
  WorkLeft left;
  left.kinds = {{0, Task::kPosture, 4, 2},
                {0, Task::kPosture, 0, 0},
                {1, Task::kPosture, 30, 3},
                {2, Task::kPosture, 0, 0},
                {0, Task::kMotion, 0, 0}};
  left.kinds.push_back({3, Task::kPosture, 9, 3});
  const auto rates = SecondsPerWaypoint(left);
  EXPECT_DOUBLE_EQ(*rates[1], 2) << "the same method from the other start";
  EXPECT_FALSE(rates[3].has_value()) << "another method";
  EXPECT_FALSE(rates[4].has_value()) << "another task";
}

TEST(EstimateRemaining, IsNoneWhileNothingRuns) {
  WorkLeft left = TwoMethods();
  left.kinds[0] = {0, Task::kPosture, 6, 12};
  left.queued = {{0, 1, 10}};
  EXPECT_FALSE(EstimateRemaining_s(left).has_value());
}

TEST(EstimateRemaining, IsNoneWhileAKindIsUnknown) {
  WorkLeft left = TwoMethods();
  left.kinds[0] = {0, Task::kPosture, 6, 12};
  left.running = {{0, 1, 0.1, 0, 0, kLimit_s}};
  left.queued = {{0, 1, 10}, {1, 24, 1}};
  EXPECT_FALSE(EstimateRemaining_s(left).has_value()) << "no motion has ended";
  left.kinds[3] = {1, Task::kMotion, 48, 24};
  EXPECT_FALSE(EstimateRemaining_s(left).has_value()) << "only one of the other method";
  left.running.push_back({1, 24, 10.0, 2, 10, kLimit_s});
  EXPECT_FALSE(EstimateRemaining_s(left).has_value()) << "windows of a motion that runs are no motion that has ended";
  left.kinds[1] = {0, Task::kMotion, 48, 24};
  EXPECT_TRUE(EstimateRemaining_s(left).has_value());
}

TEST(EstimateRemaining, DividesShortJobsBySlots) {
  WorkLeft left = TwoMethods();
  left.kinds[0] = {0, Task::kPosture, 60, 120};
  left.running = {{0, 1, 0.5, 0, 0, kLimit_s}};
  left.queued = {{0, 1, 100}};
  EXPECT_NEAR(*EstimateRemaining_s(left), 25, 0.5);
  left.queued = {{0, 1, 1'000'000}};
  EXPECT_NEAR(*EstimateRemaining_s(left), 250'000, 3000) << "many are not dealt one by one";
}

TEST(EstimateRemaining, DoesNotDivideAJob) {
  WorkLeft left = TwoMethods();
  const double rate = 10.0 / 49.5 * 77 / 100;
  left.kinds[1] = {0, Task::kMotion, 100 * rate, 100};
  left.running = {{1, 100, 10, 49, 77, kLimit_s}};
  EXPECT_NEAR(*EstimateRemaining_s(left), 10.0 / 49.5 * 27.5, 1e-9) << "one motion, 49 of 77 windows, two slots";
}

TEST(EstimateRemaining, CountsALongJobAtTheEndInFull) {
  WorkLeft left = TwoMethods();
  left.kinds[0] = {0, Task::kPosture, 1, 10};
  left.kinds[1] = {0, Task::kMotion, 20, 10};
  left.running = {{0, 1, 0, 0, 0, kLimit_s}, {0, 1, 0, 0, 0, kLimit_s}};
  left.queued = {{0, 1, 8}, {1, 50, 1}};
  EXPECT_NEAR(*EstimateRemaining_s(left), 0.5 + 100, 0.1);
}

TEST(EstimateRemaining, ASharedSlotTakesLonger) {
  WorkLeft left = TwoMethods();
  left.kinds[0] = {0, Task::kPosture, 100, 100};
  left.running = {{0, 1, 0, 0, 0, kLimit_s}};
  left.queued = {{0, 1, 99}};
  left.slots = 0.5;
  EXPECT_NEAR(*EstimateRemaining_s(left), 200, 5);
}

TEST(EstimateRemaining, AnOverdueJobIsNotTakenForDone) {
  WorkLeft left = TwoMethods();
  left.kinds[0] = {0, Task::kPosture, 1, 10};
  left.running = {{0, 1, 40, 0, 0, kLimit_s}};
  EXPECT_DOUBLE_EQ(*EstimateRemaining_s(left), 10);
  left.running[0].limit_s = 42;
  EXPECT_DOUBLE_EQ(*EstimateRemaining_s(left), 2);
}

// --- Recorded histories ----------------------------------------------------------------------------------------------

struct Judgement {
  double answered_share = 0;  // fraction of the requests
  double mean_error = 0;      // mean of |estimate - truth| / (truth + allowance)
  double worst_error = 0;
};

// Returns whether a job of each method and task with remaining jobs has ended.
bool EveryKindHasEnded(const WorkLeft& left) {
  std::set<std::size_t> open;
  for (const RunningWork& job : left.running) open.insert(job.kind);
  for (const QueuedWork& job : left.queued) open.insert(job.kind);
  return std::ranges::all_of(open, [&](std::size_t kind) {
    return std::ranges::any_of(left.kinds, [&](const JobKind& other) {
      return other.method == left.kinds[kind].method && other.task == left.kinds[kind].task && other.waypoints > 0;
    });
  });
}

// Assigns the recorded jobs to slots in their order and requests an estimate twice per second of virtual time.
Judgement Replay(const RecordedHistory& history, int slots) {
  constexpr double kStep_s = 0.5, kAllowance_s = 2;
  const std::vector<ReplayedJob> jobs = AssignToSlots(history.jobs, slots);
  double end_s = 0;
  for (const ReplayedJob& job : jobs) end_s = std::max(end_s, job.end_s);
  Judgement judgement;
  int asked = 0, answered = 0;
  for (double now_s = kStep_s; now_s < end_s; now_s += kStep_s) {
    ++asked;
    const WorkLeft left = RemainingWorkAt(history, jobs, now_s, slots);
    const auto estimate_s = EstimateRemaining_s(left);
    EXPECT_EQ(estimate_s.has_value(), EveryKindHasEnded(left)) << now_s << " s";
    if (!estimate_s) continue;
    ++answered;
    const double truth_s = end_s - now_s;
    const double error = std::abs(*estimate_s - truth_s) / (truth_s + kAllowance_s);
    judgement.mean_error += error;
    judgement.worst_error = std::max(judgement.worst_error, error);
  }
  judgement.answered_share = static_cast<double>(answered) / asked;
  judgement.mean_error /= std::max(answered, 1);
  return judgement;
}

void ExpectForeseen(const char* file, const Judgement& bound) {
  for (const int slots : {1, 2, 4}) {
    const Judgement judgement = Replay(ReadHistory(file), slots);
    EXPECT_GE(judgement.answered_share, bound.answered_share) << file << " on " << slots;
    EXPECT_LE(judgement.mean_error, bound.mean_error) << file << " on " << slots;
    EXPECT_LE(judgement.worst_error, bound.worst_error) << file << " on " << slots;
  }
}

// 500 postures and 40 motions by five methods in sequence: there is no estimate until the last method has finished a
// motion, and then little work is left.
TEST(RecordedHistories, ManyPosturesAndMotionsByMethods) { ExpectForeseen("quick.csv", {0.08, 0.4, 1.3}); }

TEST(RecordedHistories, OneMotionHasNoEstimateAsNoMotionHasEnded) {
  for (const int slots : {1, 2, 4}) EXPECT_EQ(Replay(ReadHistory("one_motion.csv"), slots).answered_share, 0);
}

// Estimates exist from the end of the first motion.
TEST(RecordedHistories, FivePosturesThenThreeMotions) { ExpectForeseen("mixed.csv", {0.43, 0.15, 0.5}); }

}  // namespace
}  // namespace legopt::server
