// A job on the embedded dataset: solve, then judge; and validation by the executor.

#include "legopt/planning/job_runner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "legopt/planning/internal/trace.h"
#include "legopt/types/input_error.h"
#include "tests/folders.h"
#include "tests/worker/sample_messages.h"
#include "worker/solve_executor.h"

namespace legopt::worker {
namespace {

const std::filesystem::path kDataset = std::filesystem::path(SourceFolder()) / "data" / "garage-small";

class JobRunnerTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kDataset / "dataset.yaml")) GTEST_SKIP() << "no dataset at " << kDataset;
    dataset_ = Dataset::Load(kDataset);
    job_.problem_id = dataset_->problems(Task::kPosture).front().id;
    job_.experiment_seed = 1;
  }

  // Returns the lease of `job_`, as the server would write it.
  legopt_msg::lease Lease() const {
    legopt_msg::lease lease = SampleLease(1);
    lease.dataset_hash = dataset_->content_hash();
    lease.method_hash = job_.method.Hash();
    lease.problem_id = job_.problem_id;
    return lease;
  }

  static JobExecutor::Hooks Hooks() {
    return {[] { return false; }, [](int, int) {}, [] {}};
  }

  std::shared_ptr<const Dataset> dataset_;
  Job job_;
};

TEST_F(JobRunnerTest, SolvesAndJudges) {
  bool judging = false;
  JobHooks hooks;
  hooks.judging = [&judging] { judging = true; };
  const JobResult result = RunJob(dataset_, job_, hooks);
  EXPECT_NE(result.solve.status, SolveStatus::kNotRun);
  ASSERT_EQ(result.solve.waypoints.size(), 1U);
  EXPECT_EQ(result.solve.waypoints[0].size(), dataset_->robot().configuration_size());
  EXPECT_EQ(result.evaluation.num_waypoints, 1);
  EXPECT_TRUE(judging);
  EXPECT_GT(result.solve.wall_us, 0);
}

TEST_F(JobRunnerTest, TheSameJobGivesTheSameBitsFirstOrLater) {
  job_.method.multi_starts = 2;
  JobRunner warm(dataset_);
  Job other = job_;
  other.problem_id = dataset_->problems(Task::kPosture).back().id;
  warm.Run(other);
  const JobResult later = warm.Run(job_);
  const JobResult first = RunJob(Dataset::Load(kDataset), job_);
  ASSERT_EQ(first.solve.waypoints.size(), later.solve.waypoints.size());
  EXPECT_EQ(first.solve.iterations, later.solve.iterations);
  EXPECT_EQ(first.solve.status, later.solve.status);
  EXPECT_TRUE(first.solve.waypoints[0] == later.solve.waypoints[0]);
  EXPECT_EQ(first.evaluation.literal, later.evaluation.literal);
}

TEST_F(JobRunnerTest, CancellingEndsTheSolve) {
  JobHooks hooks;
  hooks.cancelled = [] { return true; };
  EXPECT_EQ(RunJob(dataset_, job_, hooks).solve.status, SolveStatus::kCancelled);
}

TEST_F(JobRunnerTest, TheFirstWindowWithoutASolutionIsKeptJudgedAndNamed) {
  for (const Task task : {Task::kMotion, Task::kContinuous, Task::kBalanced}) {
    job_.task = task;
    job_.problem_id = 0;
    job_.initialization = Initialization::kInCollision;
    job_.method.options.As<SqpOptions>().max_iterations = 1;
    job_.method.options.As<SqpOptions>().max_penalty_iterations = 1;
    const JobResult result = RunJob(dataset_, job_);
    const Evaluation& evaluation = result.evaluation;
    for (const Verdict verdict : {evaluation.literal, evaluation.strict, evaluation.solid}) {
      EXPECT_EQ(verdict, Verdict::kWindowUnsolved);
    }
    ASSERT_TRUE(evaluation.window.has_value());
    EXPECT_EQ(*evaluation.window, Verdict::kFootPose) << evaluation.detail;
    EXPECT_TRUE(evaluation.detail.starts_with("window 0 of 3 (stances 0 to 5) unsolved: waypoint "))
        << evaluation.detail;
    EXPECT_NE(evaluation.detail.find("off by "), std::string::npos) << "the amount: " << evaluation.detail;
    EXPECT_NE(evaluation.detail.find("; largest violation in the solver: "), std::string::npos) << evaluation.detail;
    EXPECT_TRUE(std::isnan(evaluation.cost));
    EXPECT_GT(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), kPoseTolerance)
        << "figures of the window's best point";
    EXPECT_TRUE(result.solve.waypoints.empty()) << "no part of a solution";
    EXPECT_FALSE(result.solve.history.empty());
    const auto message = ToMessage(result);
    EXPECT_EQ(message.verdict_literal, "window_unsolved");
    EXPECT_EQ(message.window_verdict, "foot_pose");
    EXPECT_EQ(message.first_unsolved, 0);
    EXPECT_EQ(message.num_unsolved, 12);
    EXPECT_EQ(std::ssize(message.unsolved), 12 * dataset_->robot().configuration_size());
    EXPECT_FALSE(message.trace.empty());
  }
}

TEST_F(JobRunnerTest, ALaterWindowIsNumberedAsInTheWholeMotion) {
  job_.task = Task::kMotion;
  job_.problem_id = 0;
  const JobResult whole = RunJob(dataset_, job_);
  ASSERT_EQ(whole.solve.windows_solved, 3);
  // Stopped by the effort limit within the second window, which begins with the last stance of the first one.
  JobResult part;
  for (job_.effort_limit = whole.solve.term_evaluations / 2; job_.effort_limit > 0; job_.effort_limit /= 2) {
    part = RunJob(dataset_, job_);
    if (part.solve.windows_solved == 1 && part.evaluation.window) break;
  }
  ASSERT_EQ(part.solve.windows_solved, 1) << "no such limit";
  ASSERT_TRUE(part.solve.unsolved.has_value());
  EXPECT_EQ(part.solve.unsolved->first_stance, 5);
  EXPECT_EQ(part.solve.unsolved->waypoints.front(), part.solve.waypoints[10]) << "where the first window ended";
  EXPECT_EQ(part.evaluation.literal, Verdict::kWindowUnsolved);
  EXPECT_TRUE(part.evaluation.detail.starts_with("window 1 of 3 (stances 5 to 10) unsolved, ended by effort_limit: "))
      << part.evaluation.detail;
  if (part.evaluation.failed_waypoint >= 0) {
    EXPECT_GE(part.evaluation.failed_waypoint, 10);
  }
  EXPECT_EQ(ToMessage(part).first_unsolved, 10);
  EXPECT_EQ(ToMessage(part).num_waypoints, 12);
}

TEST_F(JobRunnerTest, ABudgetThatIsSpentIsAResultAndATimeLimitIsNone) {
  JobResult result = RunJob(dataset_, job_);
  result.solve.status = SolveStatus::kTimeLimit;
  EXPECT_EQ(ToMessage(result).outcome, EnumNumber(ReportedOutcome::kTimeLimit));
  result.solve.budget_spent = true;
  EXPECT_EQ(ToMessage(result).outcome, EnumNumber(ReportedOutcome::kFinished));
  EXPECT_EQ(ToMessage(result).solver_status, "time_limit") << "its mark";
}

TEST_F(JobRunnerTest, AMotionTellsItsWindowsAndHasItsInterpolationScored) {
  job_.task = Task::kMotion;
  job_.problem_id = 0;
  std::vector<std::pair<int, int>> progress;
  JobHooks hooks;
  hooks.progress = [&progress](int done, int total) { progress.emplace_back(done, total); };
  const JobResult result = RunJob(dataset_, job_, hooks);
  EXPECT_EQ(result.solve.windows, 3) << "15 stances";
  EXPECT_EQ(static_cast<int>(progress.size()), result.solve.windows_solved);
  EXPECT_EQ(result.evaluation.num_waypoints, 30);
  const auto message = ToMessage(result);
  EXPECT_EQ(message.windows, 3);
  EXPECT_EQ(message.windows_solved, result.solve.windows_solved);
  EXPECT_EQ(std::isnan(message.interpolation_free_share), result.solve.waypoints.size() < 2);
  EXPECT_TRUE(std::isnan(message.duration_s)) << "no timed motion";
}

TEST_F(JobRunnerTest, AMotionOutOfTimeKeepsTheWindowsItSolved) {
  job_.task = Task::kMotion;
  job_.problem_id = 0;
  bool stop = false;
  JobHooks hooks;
  hooks.progress = [&stop](int, int) { stop = true; };
  hooks.cancelled = [&stop] { return stop; };
  const JobResult result = RunJob(dataset_, job_, hooks);
  ASSERT_EQ(result.solve.windows_solved, 1);
  EXPECT_EQ(result.solve.waypoints.size(), 12U);
  EXPECT_EQ(result.evaluation.literal, Verdict::kWindowUnsolved);
  const std::string begun = "window 1 of 3 (stances 5 to 10) unsolved, ended by cancelled: waypoint ";
  EXPECT_TRUE(result.evaluation.detail.starts_with(begun)) << result.evaluation.detail;
  EXPECT_EQ(result.evaluation.window, Verdict::kFootPose) << "its start: the solve of the window took no step";
}

TEST_F(JobRunnerTest, AProblemThatDoesNotExistIsAnInputError) {
  job_.problem_id = 987654;
  EXPECT_THROW(RunJob(dataset_, job_), InputError);
}

TEST_F(JobRunnerTest, TheExecutorAnnouncesWhatItLoaded) {
  SolveExecutor executor(WorkerInputs{.datasets = {kDataset, kDataset}, .solvers = {}});
  std::vector<Capability> loaded = executor.Load();
  std::erase_if(loaded, [](const Capability& capability) { return capability.kind != CapabilityKind::kDataset; });
  ASSERT_EQ(loaded.size(), 1U) << "the same content counts once";
  EXPECT_EQ(loaded[0].hash, dataset_->content_hash());
  EXPECT_EQ(loaded[0].name, dataset_->name());
}

TEST_F(JobRunnerTest, TheExecutorFillsTheResult) {
  SolveExecutor executor(WorkerInputs{.datasets = {kDataset}, .solvers = {}});
  executor.Load();
  const auto result = executor.Execute(Lease(), job_.method.ToJson().dump(), Hooks());
  EXPECT_EQ(result.outcome, static_cast<int>(ReportedOutcome::kFinished));
  EXPECT_EQ(result.num_waypoints, 1);
  EXPECT_EQ(result.waypoints.size(), static_cast<std::size_t>(dataset_->robot().configuration_size()));
  EXPECT_FALSE(result.verdict_literal.empty());
  EXPECT_FALSE(result.solver_status.empty());
  EXPECT_GT(result.peak_memory_bytes, 0);
  const std::vector<IterationRecord> trace = DecodeTrace(result.trace, "test");
  ASSERT_FALSE(trace.empty());
  const auto returned = std::find_if(trace.rbegin(), trace.rend(), [](const auto& step) { return step.accepted; });
  ASSERT_NE(returned, trace.rend());
  EXPECT_EQ(returned->violation, result.solver_violation);
  EXPECT_LE(trace.back().evaluations, result.term_evaluations);
  EXPECT_LE(trace.back().elapsed_us, result.wall_us);
}

TEST_F(JobRunnerTest, EffortThatRanOutIsAResult) {
  SolveExecutor executor(WorkerInputs{.datasets = {kDataset}, .solvers = {}});
  executor.Load();
  legopt_msg::lease lease = Lease();
  lease.effort_limit = 1;
  const auto result = executor.Execute(lease, job_.method.ToJson().dump(), Hooks());
  EXPECT_EQ(result.outcome, static_cast<int>(ReportedOutcome::kFinished));
  EXPECT_EQ(result.solver_status, "effort_limit");
  EXPECT_EQ(result.num_waypoints, 1) << "the best point found";
}

TEST_F(JobRunnerTest, WhatTheClockStoppedIsNoResult) {
  SolveExecutor executor(WorkerInputs{.datasets = {kDataset}, .solvers = {}});
  executor.Load();
  legopt_msg::lease lease = Lease();
  lease.wall_limit_us = 1;
  const auto result = executor.Execute(lease, job_.method.ToJson().dump(), Hooks());
  EXPECT_EQ(result.outcome, static_cast<int>(ReportedOutcome::kTimeLimit));
  EXPECT_NE(result.message.find("stopped by the clock"), std::string::npos) << result.message;
  EXPECT_GT(result.wall_us, 0) << "it is charged for";
  lease.effort_limit = 1;
  EXPECT_EQ(executor.Execute(lease, job_.method.ToJson().dump(), Hooks()).solver_status, "effort_limit")
      << "what ends by its effort does so whatever the clock says at the same moment";
}

TEST_F(JobRunnerTest, TheExecutorRefusesOtherDatasetsAndForgedMethods) {
  SolveExecutor executor(WorkerInputs{.datasets = {kDataset}, .solvers = {}});
  executor.Load();
  legopt_msg::lease other_dataset = Lease();
  other_dataset.dataset_hash = HexHash('0');
  EXPECT_THROW(executor.Execute(other_dataset, job_.method.ToJson().dump(), Hooks()), JobRefused);
  legopt_msg::lease forged = Lease();
  forged.method_hash = HexHash('0');
  EXPECT_THROW(executor.Execute(forged, job_.method.ToJson().dump(), Hooks()), JobRefused);
  EXPECT_THROW(executor.Execute(forged, "{not json", Hooks()), JobRefused);
  EXPECT_THROW(executor.Execute(forged, R"({"solver":"sqp","multi_stars":3})", Hooks()), JobRefused);
}

TEST_F(JobRunnerTest, TheExecutorRefusesFoldersThatAreNoDataset) {
  SolveExecutor executor(WorkerInputs{.datasets = {kDataset / "nothing-here"}, .solvers = {}});
  EXPECT_THROW(executor.Load(), InputError);
}

}  // namespace
}  // namespace legopt::worker
