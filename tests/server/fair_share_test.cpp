// Fair sharing: submitters, and the experiments of each, get equal shares of CPU time for any job lengths. First the
// accounts alone, then the scheduler with a pool of slots, in virtual time. Bounds are derived, not measured.

#include "server/fair_share.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;

bool Any(std::int64_t) { return true; }

// One slot that executes the served jobs: each uses the expected time of its experiment.
class Accounts : public testing::Test {
 protected:
  void Add(std::int64_t id, const std::string& submitter, std::int64_t job_us, int priority = 0,
           const std::string& dataset = "d") {
    shares_.Add(id, submitter, priority, dataset);
    shares_.SetWaiting(id, true);
    job_us_[id] = job_us;
  }
  std::int64_t Serve() {
    const std::int64_t id = shares_.First(Any).value();
    shares_.Begin(id, job_us_[id]);
    shares_.End(id, job_us_[id], job_us_[id]);
    used_us_[id] += job_us_[id];
    return id;
  }
  void ServeUntil(std::int64_t total_us) {
    for (std::int64_t sum = 0; sum < total_us; sum += job_us_[Serve()]) {
    }
  }

  FairShare shares_;
  std::map<std::int64_t, std::int64_t> job_us_, used_us_;
};

TEST_F(Accounts, TheOlderComesFirstAmongEquals) {
  Add(2, "b", 10);
  Add(1, "a", 10);
  Add(3, "a", 10);
  std::string order;
  for (int i = 0; i < 6; ++i) order += std::to_string(Serve());
  EXPECT_EQ(order, "123212") << "a and b in turns, 1 and 3 in turns";
}

TEST_F(Accounts, LongAndShortJobsGetTheSameTime) {
  Add(1, "a", 1000);
  Add(2, "a", 10);
  ServeUntil(100'000);
  EXPECT_NEAR(static_cast<double>(used_us_[1]), static_cast<double>(used_us_[2]), 1010);
}

TEST_F(Accounts, ASubmitterOfManyExperimentsGetsNoMoreThanOneOfOne) {
  for (int i = 1; i <= 3; ++i) Add(i, "a", 10 * i);
  Add(4, "b", 50);
  ServeUntil(60'000);
  EXPECT_NEAR(static_cast<double>(used_us_[4]), 30'000, 100);
  for (int i = 1; i <= 3; ++i) EXPECT_NEAR(static_cast<double>(used_us_[i]), 10'000, 200) << i;
}

TEST_F(Accounts, ANewcomerIsServedAtOnceAndNotPaidForThePast) {
  Add(1, "a", 1000);
  ServeUntil(1'000'000);
  for (int i = 0; i < 5; ++i) shares_.Begin(1, 700'000);  // on all slots, expected to be long
  Add(2, "b", 1000);
  EXPECT_EQ(Serve(), 2);
  for (int i = 0; i < 5; ++i) shares_.End(1, 700'000, 1000);
  used_us_.clear();
  ServeUntil(100'000);
  EXPECT_NEAR(static_cast<double>(used_us_[1]), static_cast<double>(used_us_[2]), 7000) << "what ran is made up for";
}

TEST_F(Accounts, WhoDoesNotWaitSavesNothing) {
  Add(1, "a", 10);
  Add(2, "b", 10);
  Add(3, "b", 10);
  shares_.SetWaiting(2, false);  // paused
  ServeUntil(10'000);
  EXPECT_EQ(used_us_[2], 0);
  shares_.SetWaiting(2, true);
  used_us_.clear();
  ServeUntil(10'000);
  EXPECT_NEAR(static_cast<double>(used_us_[1]), 5000, 20);
  EXPECT_NEAR(static_cast<double>(used_us_[2]), 2500, 20);
  shares_.SetWaiting(1, false);
  ServeUntil(10'000);
  shares_.SetWaiting(1, true);
  used_us_.clear();
  ServeUntil(10'000);
  EXPECT_NEAR(static_cast<double>(used_us_[1]), 5000, 20);
}

TEST_F(Accounts, LeavingForAMomentDoesNotClearAnAccount) {
  Add(1, "a", 10);
  Add(2, "b", 10);
  for (int i = 0; i < 100; ++i) {
    shares_.SetWaiting(1, false);
    shares_.SetWaiting(1, true);
    Serve();
  }
  EXPECT_EQ(used_us_[1], used_us_[2]);
}

TEST_F(Accounts, WhoWasAloneOwesNothingForIt) {
  Add(1, "a", 10);
  ServeUntil(1'000'000);
  shares_.SetWaiting(1, false);
  Add(2, "b", 10);
  shares_.SetWaiting(1, true);
  ServeUntil(100);
  EXPECT_EQ(used_us_[2], 50);
}

TEST_F(Accounts, WaitingForWhatNobodyHasChangesNothingForOthers) {
  Add(1, "a", 10, 0, "rare");
  Add(2, "b", 10, 0, "rare");
  const auto common = [](std::int64_t id) { return id > 2; };  // experiments with the other dataset are not accepted
  const auto serve = [&](int count) {
    std::map<std::int64_t, int> served;
    for (int i = 0; i < count; ++i) {
      const std::int64_t id = shares_.First(common).value();
      shares_.Begin(id, 10);
      shares_.End(id, 10, 10);
      ++served[id];
    }
    return served;
  };
  Add(3, "c", 10);
  serve(1000);
  Add(4, "a", 10);  // has waited for the other dataset all the time
  EXPECT_EQ(serve(100), (std::map<std::int64_t, int>{{3, 50}, {4, 50}}));
  for (const int id : {3, 4}) shares_.SetWaiting(id, false);
  Add(5, "e", 10);  // no experiment waits for this dataset at the moment
  for (const int id : {3, 4}) shares_.SetWaiting(id, true);
  EXPECT_EQ(serve(99), (std::map<std::int64_t, int>{{3, 33}, {4, 33}, {5, 33}}));
}

TEST_F(Accounts, PassedOverForItsDatasetItKeepsItsPlace) {
  Add(1, "a", 10, 0, "rare");
  Add(2, "b", 10);
  const auto common = [](std::int64_t id) { return id != 1; };
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(shares_.First(common), 2);
    shares_.Begin(2, 10);
    shares_.End(2, 10, 10);
  }
  EXPECT_EQ(shares_.First([](std::int64_t) { return false; }), std::nullopt);
  Add(3, "c", 10);  // competes with 2, so begins with its virtual time rather than that of 1
  for (int i = 0; i < 100; ++i) EXPECT_EQ(Serve(), 1);
  ServeUntil(300);
  EXPECT_EQ(used_us_[2], 100);
  EXPECT_EQ(used_us_[3], 100);
}

TEST_F(Accounts, PrioritiesComeBeforeShares) {
  Add(1, "a", 10, 0);
  Add(2, "b", 10, 5);
  Add(3, "c", 10, -5);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(Serve(), 2);
  shares_.Begin(2, 1000);
  shares_.SetPriority(2, 0);  // running jobs are transferred as well
  for (int i = 0; i < 100; ++i) EXPECT_EQ(Serve(), 1);
  shares_.End(2, 1000, 1000);
  for (int i = 0; i < 2; ++i) Serve();
  EXPECT_EQ(used_us_[1], 1010);
  for (const int id : {1, 2}) shares_.Remove(id);
  EXPECT_EQ(Serve(), 3);
  shares_.Remove(3);
  EXPECT_EQ(shares_.First(Any), std::nullopt);
}

// Several slots, jobs of unpredictable length, wrong estimates, and competing submitters that come and go. The served
// submitter has the least virtual time and is charged at most one estimate. At most all slots' estimates are
// corrected, its own upwards and another's downwards. So no waiting submitter is behind its share by more than (2
// slots + 1) jobs, plus the running ones.
TEST(FairShareProperty, WaitingSubmittersAreNeverFarBehindTheirShare) {
  constexpr int kSlots = 5, kSubmitters = 6;
  constexpr std::int64_t kLongest_us = 1000;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    const auto below = [&random](std::int64_t bound) { return static_cast<std::int64_t>(random()) % bound; };
    FairShare shares;
    std::map<std::int64_t, std::int64_t> used_us;
    std::vector<bool> waits(kSubmitters + 1, true);
    for (int id = 1; id <= kSubmitters; ++id) {
      shares.Add(id, "submitter " + std::to_string(id), 0, "d");
      shares.SetWaiting(id, true);
    }
    struct Run {
      std::int64_t ends, id, expected_us, uses_us;
    };
    std::deque<Run> slots;
    std::int64_t now = 0, total_us = 0;
    for (int step = 0; step < 3000; ++step) {
      while (slots.size() < kSlots) {
        const std::int64_t id = shares.First(Any).value();
        // Lengths differ between experiments, and estimates are arbitrary.
        const Run run{0, id, 1 + below(kLongest_us), 1 + below(kLongest_us * id / kSubmitters)};
        shares.Begin(id, run.expected_us);
        slots.push_back({now + run.uses_us, id, run.expected_us, run.uses_us});
      }
      const auto next =
          std::min_element(slots.begin(), slots.end(), [](const Run& a, const Run& b) { return a.ends < b.ends; });
      now = next->ends;
      shares.End(next->id, next->expected_us, next->uses_us);
      used_us[next->id] += next->uses_us;
      total_us += next->uses_us;
      slots.erase(next);
      const auto other = static_cast<std::size_t>(2 + below(kSubmitters - 1));
      if (below(10) == 0) waits[other] = !waits[other];
      shares.SetWaiting(static_cast<std::int64_t>(other), waits[other]);
      // The first submitter waits all the time.
      ASSERT_GE(used_us[1] + kSlots * kLongest_us, total_us / kSubmitters - (2 * kSlots + 1) * kLongest_us)
          << "seed " << seed << " step " << step;
    }
  }
}

// --- The scheduler with a pool ---------------------------------------------------------------------------------------

class SharedPool : public SchedulerTest {
 protected:
  SharedPool() {
    options_.lease = 24h;  // heartbeats are not tested here
    Restart();
  }

  std::int64_t SubmitAs(const std::string& submitter, int num_jobs, microseconds job_time) {
    nlohmann::json spec = SampleSpec(num_jobs);
    if (!submitter.empty()) spec["submitter"] = submitter;
    const auto reply = Submit(spec, "submission " + std::to_string(job_time_.size()));
    EXPECT_EQ(StatusOf(reply), SubmitStatus::kCreated) << reply.message;
    EXPECT_FALSE(job_time_.contains(reply.experiment_id));
    job_time_[reply.experiment_id] = job_time;
    return reply.experiment_id;
  }

  void StartSlots(int count, int batch = 1) {
    batch_ = batch;
    for (int i = 0; i < count; ++i) {
      slots_.push_back({kFirst + i, {}, microseconds(0)});
      Hello(kFirst + i);
    }
  }

  // Every slot executes its jobs in the order received, and requests more when it has none.
  void Work(microseconds duration) {
    const microseconds end = now_.steady + duration;
    while (true) {
      microseconds next = end;
      for (Slot& slot : slots_) {
        if (slot.held.empty()) {
          const auto jobs = Lease(slot.endpoint, batch_).jobs;
          for (const auto& job : jobs) first_lease_.emplace(job.experiment_id, now_.steady);
          slot.held.assign(jobs.begin(), jobs.end());
          if (slot.held.empty()) continue;
          slot.ends = now_.steady + job_time_[slot.held.front().experiment_id];
        }
        next = std::min(next, slot.ends);
      }
      Advance(next - now_.steady);
      if (now_.steady >= end) return;
      for (Slot& slot : slots_) {
        if (slot.held.empty() || slot.ends > now_.steady) continue;
        FinishFirst(slot);
      }
    }
  }

  void SubmitShortBehindLong(const std::string& first, const std::string& second) {
    const auto behind = SubmitAs(first, 5000, 1s);
    StartSlots(4);
    Work(60s);
    const microseconds submitted = now_.steady;
    const auto suite = SubmitAs(second, 40, 1s);
    Work(30s);
    EXPECT_LE(first_lease_.at(suite) - submitted, 1s) << "as soon as a slot is free";
    ASSERT_TRUE(finished_.contains(suite));
    EXPECT_LE(finished_.at(suite) - submitted, 22s) << "40 jobs on half of four slots";
    EXPECT_FALSE(finished_.contains(behind));
  }

  double Used_s(std::int64_t experiment) { return std::chrono::duration<double>(used_[experiment]).count(); }

  std::map<std::int64_t, microseconds> job_time_, used_, first_lease_, finished_;

 private:
  struct Slot {
    bus::EndpointId endpoint;
    std::deque<legopt_msg::lease> held;
    microseconds ends;
  };

  void FinishFirst(Slot& slot) {
    const std::int64_t experiment = slot.held.front().experiment_id;
    auto result = ResultFor(worker_ids_[slot.endpoint], slot.held.front());
    result.cpu_us = job_time_[experiment].count();
    EXPECT_EQ(StatusOf(Deliver(result)), ResultStatus::kAccepted);
    used_[experiment] += job_time_[experiment];
    if (Summary(experiment).state == db::ExperimentState::kDone) finished_[experiment] = now_.steady;
    slot.held.pop_front();
    if (!slot.held.empty()) slot.ends = now_.steady + job_time_[slot.held.front().experiment_id];
  }

  std::vector<Slot> slots_;
  int batch_ = 1;
};

TEST_F(SharedPool, TenTimesLongerJobsGetTheSameCpuTime) {
  const auto longer = SubmitAs("ada", 1000, 1s);
  const auto shorter = SubmitAs("bob", 10'000, 100ms);
  StartSlots(4);
  Work(200s);
  EXPECT_NEAR(Used_s(longer), 400, 10) << "half of four slots";
  EXPECT_NEAR(Used_s(shorter), 400, 10);
}

TEST_F(SharedPool, SeveralJobsAtOnceDoNotChangeThat) {
  const auto longer = SubmitAs("ada", 2000, 1s);
  const auto shorter = SubmitAs("bob", 20'000, 100ms);
  StartSlots(4, 64);
  Work(400s);
  // Prefetched jobs, mostly short ones, are charged but not executed yet.
  EXPECT_NEAR(Used_s(longer) / Used_s(shorter), 1, 0.1);
}

TEST_F(SharedPool, ThreeExperimentsGetNoMoreThanOne) {
  std::vector<std::int64_t> of_ada;
  for (int i = 0; i < 3; ++i) of_ada.push_back(SubmitAs("ada", 2000, 300ms));
  const auto of_bob = SubmitAs("bob", 2000, 300ms);
  StartSlots(4);
  Work(120s);
  EXPECT_NEAR(Used_s(of_bob), 240, 5);
  for (const auto id : of_ada) EXPECT_NEAR(Used_s(id), 80, 5) << id;
}

TEST_F(SharedPool, AShortSuiteDoesNotWaitForTheLongOneOfAnother) { SubmitShortBehindLong("ada", "bob"); }
TEST_F(SharedPool, AShortSuiteDoesNotWaitForALongOneOfOnesOwn) { SubmitShortBehindLong("ada", "ada"); }
TEST_F(SharedPool, AShortSuiteDoesNotWaitForALongOneWhenNobodyHasAName) { SubmitShortBehindLong("", ""); }

TEST_F(SharedPool, APausedExperimentSavesNothing) {
  const auto paused = SubmitAs("ada", 5000, 1s);
  const auto other = SubmitAs("bob", 5000, 1s);
  StartSlots(2);
  Control(paused, ControlAction::kPauseNow, "why");
  Work(100s);
  EXPECT_EQ(Used_s(paused), 0);
  Control(paused, ControlAction::kResume);
  used_.clear();
  Work(100s);
  EXPECT_NEAR(Used_s(paused), 100, 3);
  EXPECT_NEAR(Used_s(other), 100, 3);
}

TEST_F(SharedPool, AfterARestartItIsFairFromThenOn) {
  const auto first = SubmitAs("ada", 5000, 1s);
  StartSlots(2);
  Work(100s);
  const auto second = SubmitAs("bob", 5000, 1s);
  Restart();
  for (int i = 0; i < 2; ++i) Hello(kFirst + i);
  used_.clear();
  Work(100s);
  EXPECT_NEAR(Used_s(first), 100, 3);
  EXPECT_NEAR(Used_s(second), 100, 3);
}

// The wall-time limit of hours is only a safety net. If it were charged in advance, a newcomer would have one slot
// until a job has ended.
TEST_F(SharedPool, NewcomerGetsItsShareOfManySlotsAtOnce) {
  constexpr int kSlots = 8;
  nlohmann::json spec = SampleSpec(100);
  spec["limits"].update({{"wall_time_s", 72'000}, {"effort_limit", 10'000'000}});
  spec["submitter"] = "ada";
  Submit(spec, "known");
  Hello(kFirst, kSlots);
  auto known = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst));
  known.cpu_us = 10'000'000;
  Deliver(known);
  spec["submitter"] = "bob";
  const auto newcomer = Submit(spec, "newcomer").experiment_id;
  int of_the_newcomer = 0;
  for (int slot = 0; slot < kSlots; ++slot) of_the_newcomer += LeaseOne(kFirst).experiment_id == newcomer ? 1 : 0;
  EXPECT_NEAR(of_the_newcomer, 0.5 * kSlots, 1);
}

// A crashed job reports no CPU time. It is charged for its duration, otherwise its experiment would never stop.
TEST_F(SharedPool, FailedAttemptsAreChargedForTheirTime) {
  nlohmann::json spec = SampleSpec(1000);
  spec["submitter"] = "ada";
  Submit(spec, "crashing");
  spec["submitter"] = "bob";
  Submit(spec, "other");
  Hello(kFirst);
  std::map<std::int64_t, int> leases;
  for (int i = 0; i < 100; ++i) {
    const auto lease = LeaseOne(kFirst);
    ++leases[lease.experiment_id];
    Advance(1s);
    auto result = ResultFor(worker_ids_[kFirst], lease,
                            lease.experiment_id == 1 ? ReportedOutcome::kCrashed : ReportedOutcome::kFinished);
    if (lease.experiment_id == 2) result.cpu_us = 1'000'000;
    Deliver(result);
  }
  EXPECT_NEAR(leases[1], 50, 1);
}

TEST_F(SharedPool, WhatAWorkerCannotHaveUsedIsNotBelieved) {
  SubmitAs("ada", 100, 1s);
  SubmitAs("bob", 100, 1s);
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  auto result = ResultFor(worker_ids_[kFirst], lease);
  result.cpu_us = INT64_MAX;
  Deliver(result);
  int of_the_other = 0;
  for (; of_the_other < 100; ++of_the_other) {
    const auto next = LeaseOne(kFirst);
    if (next.experiment_id == lease.experiment_id) break;
    auto used = ResultFor(worker_ids_[kFirst], next);
    used.cpu_us = 1'000'000;
    Deliver(used);
  }
  EXPECT_EQ(of_the_other, 60) << "the limit of a job is a minute";
}

TEST_F(SharedPool, JobsForNothingHaveTheirTurns) {
  const auto first = SubmitAs("", 1000, 0s);
  const auto second = SubmitAs("", 1000, 0s);
  Hello(kFirst);
  std::map<std::int64_t, int> leases;
  for (int i = 0; i < 100; ++i) {
    const auto lease = LeaseOne(kFirst);
    ++leases[lease.experiment_id];
    Finish(kFirst, lease);
  }
  EXPECT_EQ(leases[first], 50);
  EXPECT_EQ(leases[second], 50);
}

}  // namespace
}  // namespace legopt::server
