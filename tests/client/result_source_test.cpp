// Policy: a database file answers read-only SQL, and the readers of tables and experiments work on it as on a server.
#include "client/report/result_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/client_error.h"
#include "client/report/reading.h"
#include "db/sqlite_store.h"
#include "db/store_error.h"
#include "test_database.h"

namespace legopt::client {
namespace {

class ResultSourceTest : public testing::Test {
 protected:
  void SetUp() override {
    TestExperiment experiment;
    experiment.methods = {{"SQP", 0}, {"SQP", 10}};
    experiment.results = {{.method = 0, .problem = 0, .cost = 300, .wall_us = 1000},
                          {.method = 0, .problem = 1, .cost = 500, .wall_us = 3000},
                          {.method = 0, .problem = 2, .verdict = "foot_pose"},
                          {.method = 1, .initialization = "in_collision", .problem = 0, .finished = false},
                          {.method = 1, .initialization = "in_collision", .problem = 1, .verdict = "com"}};
    WriteTestDatabase(file_, experiment);
    source_ = OpenResults({file_.string(), {}});
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "test.sqlite";
  std::unique_ptr<ResultSource> source_;
};

TEST_F(ResultSourceTest, ReadsTheBenchmarkTable) {
  const auto table = ReadBenchmarkTable(*source_, {});
  EXPECT_EQ(table.experiment_id, 1);
  EXPECT_EQ(table.experiment, "test");
  EXPECT_EQ(table.dataset, "tiny");
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[0].multi_starts, 0);
  EXPECT_EQ(table.rows[0].cells.at({Task::kPosture, Initialization::kGood}),
            (BenchmarkCell{3, 3, 2, 400.0, 0.002, 0, 0, 0, 3, 1, 0, 0, 2}));
  EXPECT_EQ(table.other_rule, Rule::kLiteral);
  EXPECT_EQ(table.rows[1].multi_starts, 10);
  EXPECT_EQ(table.rows[1].cells.at({Task::kPosture, Initialization::kInCollision}),
            (BenchmarkCell{2, 1, 0, std::nullopt, std::nullopt, 0, 0, 0, 2, 1}));
}

// A table of a part of the rows would be wrong without a word.
TEST_F(ResultSourceTest, NothingIsComputedFromAResultThatALimitHasCut) {
  const std::string rows = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n LIMIT ";
  EXPECT_EQ(source_->Query(rows + "1000000").rows.size(), 1'000'000U);
  try {
    source_->Query(rows + "1000001");
    ADD_FAILURE() << "cut without a word";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kCutShort);
    EXPECT_THAT(error.what(), testing::HasSubstr("exceed the 1000000 rows"));
  }
}

TEST_F(ResultSourceTest, TheExperimentsRuleIsTheDefault) {
  EXPECT_EQ(RuleFor(*source_, std::nullopt, std::nullopt), Rule::kSolid) << "a suite that names none";
  AlterDatabase(file_, "results_are_final", "UPDATE experiments SET rule = 'literal'");
  EXPECT_EQ(RuleFor(*source_, std::nullopt, std::nullopt), Rule::kLiteral);
  EXPECT_EQ(RuleFor(*source_, std::nullopt, Rule::kStrict), Rule::kStrict);
}

TEST_F(ResultSourceTest, ATableByTheSolidRuleNeedsItsVerdictOfEveryResult) {
  const TableSelection solid{.experiment = {}, .rule = Rule::kSolid};
  EXPECT_EQ(ReadBenchmarkTable(*source_, solid).rows[0].cells.at({Task::kPosture, Initialization::kGood}).solved, 2);
  // Results of an older release look like this.
  AlterDatabase(file_, "results_are_final",
                "UPDATE results SET verdict_solid = NULL WHERE job_id = 2; UPDATE cell_results SET unjudged_solid = 1");
  const auto table = ReadBenchmarkTable(*source_, {.experiment = {}, .rule = Rule::kLiteral});
  EXPECT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.other_rule, std::nullopt) << "not known of all results";
  try {
    ReadBenchmarkTable(*source_, solid);
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUsage);
    EXPECT_THAT(error.what(), testing::HasSubstr("without the solid rule"));
    EXPECT_THAT(error.what(), testing::HasSubstr("legopt export 1 --out FILE --db "));
  }
}

TEST(BrokenJobs, AreCountedInTheirCells) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "test.sqlite";
  TestExperiment experiment;
  experiment.results = {{.problem = 0},
                        {.problem = 1, .finished = false},
                        {.problem = 2, .finished = false},
                        {.problem = 3, .finished = false},
                        {.initialization = "in_collision", .problem = 0},
                        {.initialization = "in_collision", .problem = 1, .finished = false}};
  WriteTestDatabase(file, experiment);
  const std::int64_t worker = 1, at_us = 1'700'000'000'000'000;
  std::vector<db::StoreOp> operations;
  const auto end = [&](std::int64_t job, db::JobState next) {
    operations.emplace_back(db::LeaseJob{job, 1, 100 + job, worker, at_us});
    operations.emplace_back(db::EndAttempt{job, 1, db::AttemptOutcome::kCrashed, next, 11, "", "", at_us});
  };
  end(2, db::JobState::kDead);
  end(3, db::JobState::kFailed);
  db::OpenSqliteStore(file)->Apply(operations);
  const auto cells = [&](Initialization start) {
    return ReadBenchmarkTable(*OpenResults({file.string(), {}}), {}).rows[0].cells.at({Task::kPosture, start});
  };
  EXPECT_EQ(cells(Initialization::kGood), (BenchmarkCell{4, 3, 1, 400.0, 0.0015, 1, 1, 0, 4, 1, 0, 0, 1}));
  EXPECT_EQ(cells(Initialization::kInCollision), (BenchmarkCell{2, 1, 1, 400.0, 0.0015, 0, 0, 0, 2, 1, 0, 0, 1}));
  db::OpenSqliteStore(file)->Apply(std::vector<db::StoreOp>{db::CancelExperiment{1, at_us}});
  EXPECT_EQ(cells(Initialization::kGood), (BenchmarkCell{4, 4, 1, 400.0, 0.0015, 1, 1, 1, 4, 1, 0, 0, 1}));
  EXPECT_EQ(cells(Initialization::kInCollision), (BenchmarkCell{2, 2, 1, 400.0, 0.0015, 0, 0, 1, 2, 1, 0, 0, 1}));
}

TEST_F(ResultSourceTest, ReadingManyJobsIsAnnounced) {
  std::vector<std::string> announced;
  SourceOptions options{file_.string(), {}};
  options.announce = [&](const std::string& text) { announced.push_back(text); };
  const auto source = OpenResults(options);
  source->AnnounceJobs(49'999, 7);
  EXPECT_TRUE(announced.empty());
  source->AnnounceJobs(50'000, 7);
  ASSERT_EQ(announced.size(), 1U);
  EXPECT_TRUE(announced[0].starts_with("reads 50000 jobs of experiment 7;")) << announced[0];
  source->AnnounceJobs(70'000, 7);
  EXPECT_EQ(announced.size(), 1U) << "once for each experiment";
  source->AnnounceJobs(70'000, 8);
  EXPECT_EQ(announced.size(), 2U);
}

TEST_F(ResultSourceTest, FindsTheNewestExperiment) {
  const auto experiment = FindExperiment(*source_, std::nullopt);
  EXPECT_EQ(experiment.id, 1);
  EXPECT_EQ(experiment.state, ExperimentState::kActive);
  EXPECT_EQ(experiment.dataset_hash, std::string(64, 'a'));
}

TEST_F(ResultSourceTest, UnknownExperimentIsAUsageError) {
  try {
    FindExperiment(*source_, 7);
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUsage);
    EXPECT_THAT(error.what(), testing::HasSubstr("no experiment 7"));
  }
}

TEST_F(ResultSourceTest, RowLimitIsReported) {
  EXPECT_TRUE(source_->Query("SELECT job_id FROM jobs", 2).truncated);
  EXPECT_FALSE(source_->Query("SELECT job_id FROM jobs", 5).truncated);
}

TEST_F(ResultSourceTest, BlobsAreHexadecimal) {
  const Listing listing = source_->Query("SELECT x'0aFF' AS b, NULL AS none, 'text' AS text, 7 AS number");
  EXPECT_EQ(listing.At(0, "b"), "0AFF");
  EXPECT_EQ(BlobAt(listing, 0, "b"), std::string("\x0a\xff"));
  for (const char* other : {"none", "text", "number"}) EXPECT_EQ(BlobAt(listing, 0, other), std::nullopt) << other;
}

TEST_F(ResultSourceTest, AWaypointThatCannotBeReadIsToBeChecked) {
  try {
    WaypointAt(source_->Query("SELECT x'0102' AS x"), 0, "x", "job 7");
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kDatabaseUnusable);
    EXPECT_THAT(error.what(),
                testing::StartsWith("job 7: holds 2 bytes instead of an array of float64; 'legopt service doctor"));
  }
}

TEST_F(ResultSourceTest, NothingCanBeChanged) {
  for (const char* sql :
       {"DELETE FROM jobs", "UPDATE experiments SET name = 'x'", "DROP TABLE jobs", "PRAGMA user_version = 9"}) {
    EXPECT_THROW(source_->Query(sql), db::StoreError) << sql;
  }
  EXPECT_EQ(source_->Query("SELECT count(*) AS n FROM jobs").At(0, "n"), 5);
}

TEST(ResultSource, MissingFileIsADatabaseError) {
  EXPECT_THROW(OpenResults({"/nowhere/results.sqlite", {}}), db::StoreError);
}

}  // namespace
}  // namespace legopt::client
