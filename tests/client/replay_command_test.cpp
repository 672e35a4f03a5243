// Policy: a stored job yields the same bits again. Causes of a difference are detected and named: another build,
// another dataset, a run stopped by the wall-time limit, altered bits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "client/replay/stored_job.h"
#include "command_line_fixture.h"
#include "legopt/math/blake2b.h"
#include "legopt/planning/internal/trace.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int kOtherBits = static_cast<int>(app::ExitCode::kOtherBits);
constexpr int kOtherResult = static_cast<int>(app::ExitCode::kOtherResult);

// Eight jobs, solved once by a pool; each test uses a copy.
class ReplayCommand : public CommandLine {
 protected:
  static void SetUpTestSuite() {
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) return;
    for (const char* program : {"legopt-server", "legopt-worker"}) {
      if (!std::filesystem::exists(BuiltProgram(program))) return;
    }
    solved_ = new TemporaryFolder;
    std::ofstream(solved_->path() / "tiny.yaml")
        << "tasks: [posture]\nproblems: [0, 1]\nmethods:\n  - {name: SQP, solver: sqp, multi_starts: 1}\n"
           "  - {name: I-Adam, solver: adam, incremental: true, sample_size: 80, multi_starts: 1}\n";
    run_ = RunLegopt({"run", "tiny.yaml", "--db", "solved.sqlite"}, solved_->path());
  }
  static void TearDownTestSuite() { delete solved_; }

  void SetUp() override {
    if (solved_ == nullptr) GTEST_SKIP() << "programs or a multicast route are missing";
    ASSERT_EQ(run_.exit_code, 0) << run_.err;
    file_ = (folder_.path() / "copy.sqlite").string();
    std::filesystem::copy_file(solved_->path() / "solved.sqlite", file_);
  }

  void Alter(const std::string& trigger, const std::string& change) { AlterDatabase(file_, trigger, change); }

  static TemporaryFolder* solved_;
  static ProgramResult run_;
  std::string file_;
};

TemporaryFolder* ReplayCommand::solved_ = nullptr;
ProgramResult ReplayCommand::run_;

TEST_F(ReplayCommand, AJobGivesTheSameBits) {
  const auto result = Run({"replay", "1", "--db", file_});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("job 1 (SQP, posture 0 from good, repetition 0, seed 1): bit-identical"));
}

TEST_F(ReplayCommand, ADrawTakesEveryMethodAndStart) {
  const auto result = Run({"replay", "--random", "4", "--db", file_, "--jobs", "2", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("bit_identical"), 4);
  std::set<std::string> cells;
  for (const auto& job : json.at("jobs")) {
    const auto text = job.at("described").get<std::string>();
    cells.insert(text.substr(0, text.find(',')) + (text.find("in_collision") == std::string::npos ? "" : " buried"));
  }
  EXPECT_EQ(cells.size(), 4U) << result.out;
  EXPECT_EQ(Run({"replay", "--random", "100", "--db", file_}).out, "8 of 8 bit-identical\n");
}

// Hides processor features from libm and others, which choose their code by the processor at run time, as on an older
// machine.
TEST_F(ReplayCommand, BitsAreThoseOfEveryProcessor) {
  for (const char* hidden : {"-AVX512F", "-AVX512F,-AVX2,-FMA", "-AVX512F,-AVX2,-FMA,-SSE4_1,-FMA4"}) {
    const auto result = RunLegopt({"replay", "--random", "100", "--db", file_}, folder_.path(),
                                  {{"GLIBC_TUNABLES", std::string("glibc.cpu.hwcaps=") + hidden}});
    EXPECT_EQ(result.out, "8 of 8 bit-identical\n") << hidden << result.err;
  }
}

TEST_F(ReplayCommand, ASolutionThatWasAlteredIsSeen) {
  Alter("waypoints_are_final", "UPDATE waypoints SET x = zeroblob(length(x)) WHERE job_id = 1");
  const auto result = Run({"replay", "1", "--db", file_});
  EXPECT_EQ(result.exit_code, kOtherBits) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("same status"), HasSubstr("waypoints: 1 of 1 have other bits, first 0")));
}

TEST_F(ReplayCommand, AHistoryThatPartsIsPlaced) {
  std::vector<IterationRecord> records = ReadTrace(*OpenResults({file_, {}}), 1).records;
  ASSERT_FALSE(records.empty());
  records[0].evaluations += 1;
  Alter("results_are_final", "UPDATE results SET trace = x'" + HexText(EncodeTrace(records)) + "' WHERE job_id = 1");
  const auto result = Run({"replay", "1", "--db", file_});
  EXPECT_EQ(result.exit_code, kOtherBits) << result.err;
  EXPECT_THAT(result.out, HasSubstr("part at window 0, restart 0, start 0, step 0"));
}

TEST_F(ReplayCommand, AnotherVerdictIsAnotherResult) {
  Alter("results_are_final",
        "UPDATE results SET verdict_literal = 'com', verdict_strict = 'com', verdict_solid = 'com', verdict_physical = "
        "'com' WHERE job_id = 1");
  const auto result = Run({"replay", "1", "--db", file_});
  EXPECT_EQ(result.exit_code, kOtherResult) << result.err;
  EXPECT_THAT(result.out, HasSubstr("literal verdict: com stored, success now"));
  const auto all = Run({"replay", "--random", "8", "--db", file_});
  EXPECT_EQ(all.exit_code, kOtherResult);
  EXPECT_THAT(all.out, HasSubstr("7 of 8 bit-identical, 0 with the same status, 1 differ"));
}

TEST_F(ReplayCommand, AnotherBuildIsRefusedUntilItIsAsked) {
  Alter("", "UPDATE workers SET build_id = '0123456789ab'");
  ExpectError(Run({"replay", "1", "--db", file_}), 2, "was solved by build 0123456789ab, and this is build ");
  const auto result = Run({"replay", "1", "--db", file_, "--any-build"});
  EXPECT_EQ(result.exit_code, 0) << "it is the same build after all";
  EXPECT_THAT(result.err, HasSubstr("warning: job 1 was solved by build 0123456789ab"));
}

TEST_F(ReplayCommand, RunsStoppedByTheTimeLimitCannotBeReplayed) {
  Alter("results_are_final", "UPDATE results SET solver_status = 'time_limit' WHERE job_id = 1");
  ExpectError(Run({"replay", "1", "--db", file_}), 2, "job 1 ended by time_limit");
  EXPECT_EQ(Run({"replay", "--random", "8", "--db", file_}).out, "7 of 7 bit-identical\n");
}

TEST_F(ReplayCommand, WhatIsNotThereIsSaid) {
  ExpectError(Run({"replay", "99", "--db", file_}), 2, "there is no job 99");
  ExpectError(Run({"replay", "--db", file_}), 2, "name a job, or let --random N draw some");
  Alter("", "DELETE FROM dataset_archives; UPDATE datasets SET hash = '" + std::string(64, 'a') + "'");
  ExpectError(Run({"replay", "1", "--db", file_}), 5, "name the right folder with --dataset");
}

TEST_F(ReplayCommand, DryRunsKnowWhatWasSolved) {
  const auto suite = (solved_->path() / "tiny.yaml").string();
  const auto known = Run({"run", "--dry-run", suite, "--db", file_, "--format", "json"});
  const auto estimate = nlohmann::json::parse(known.out).at("estimate");
  ASSERT_EQ(estimate.size(), 2U);
  for (const auto& cost : estimate) {
    EXPECT_EQ(cost.at("jobs"), 4);
    EXPECT_GT(cost.at("job_cpu_s").get<double>(), 0.0);
    EXPECT_EQ(cost.at("same_dataset"), true);
  }
  const auto text = Run({"run", "--dry-run", suite, "--db", file_, "--methods", "SQP"});
  EXPECT_THAT(text.out, AllOf(HasSubstr("posture 4 jobs, about "), HasSubstr("known of 4 of 4 jobs")));
  const auto unknown = Run({"run", "--dry-run", suite, "--db", "none.sqlite"});
  EXPECT_THAT(unknown.out, AllOf(HasSubstr("CPU time unknown"), HasSubstr("expected CPU time: unknown")));
}

using LogsCommand = CommandLine;

TEST_F(LogsCommand, TellsCauseSignalAndLog) {
  TestExperiment experiment;
  experiment.results = {{.problem = 0}, {.problem = 1, .dead = true}};
  const auto file = (folder_.path() / "test.sqlite").string();
  WriteTestDatabase(file, experiment);
  const auto dead = Run({"show", "2", "--logs", "--db", file});
  EXPECT_EQ(dead.exit_code, 0) << dead.err;
  EXPECT_THAT(dead.out, AllOf(HasSubstr("Attempt 1: crashed by signal 11 (Segmentation fault) after 2 s"),
                              HasSubstr("it crashed"), HasSubstr("  | the last line\n"), HasSubstr("worker-1")));
  EXPECT_THAT(Run({"show", "1", "--logs", "--db", file}).out,
              AllOf(HasSubstr("Attempt 1: finished"), HasSubstr("wrote nothing to its log"), Not(HasSubstr("signal"))));
  const auto json = nlohmann::json::parse(Run({"show", "2", "--logs", "--db", file, "--format", "json"}).out);
  EXPECT_EQ(json.at("attempt_list")[0].at("exit_signal"), 11);
  ExpectError(Run({"show", "9", "--logs", "--db", file}), 2, "there is no job 9");
}

}  // namespace
}  // namespace legopt::client
