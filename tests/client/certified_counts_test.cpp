// Policy: a table counts the problems that a certificate does not prove infeasible, and shows how many are open. The
// certificate of another dataset is refused if requested explicitly and ignored otherwise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/exit_codes.h"
#include "client/report/benchmark_table.h"
#include "client/report/certificate_report.h"
#include "client/report/reading.h"
#include "legopt/planning/certify/certificate.h"
#include "program_run.h"
#include "table_parsers.h"
#include "test_database.h"
#include "tests/dataset/test_data.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

const BenchmarkColumn kGoodPostures = {Task::kPosture, Initialization::kGood};

// Problems 0 to 4: certified, certified, infeasible, and two that are not in the certificate, of which 3 is solved.
constexpr const char* kProblems =
    R"([{"id": 0, "feasibility": "certified"}, {"id": 1, "feasibility": "certified"},
        {"id": 2, "feasibility": "infeasible"}])";

class CertifiedCounts : public testing::Test {
 protected:
  CertifiedCounts() {
    TestExperiment experiment;
    experiment.methods = {{"SQP", 0}, {"SQP", 10}};
    for (int problem = 0; problem < 5; ++problem) {
      experiment.results.push_back(
          {.method = 0, .problem = problem, .verdict = problem == 2 || problem == 4 ? "foot_pose" : "success"});
      experiment.results.push_back({.method = 1, .problem = problem, .verdict = problem == 0 ? "success" : "com"});
    }
    WriteTestDatabase(database_, experiment);
    source_ = OpenResults({database_.string(), {}});
    WriteCertificate(experiment.dataset_hash);
  }
  void WriteCertificate(const std::string& hash) const {
    test::WriteText(folder_.path() / certify::kCertificateFileName,
                    R"({"format": "legopt-certificate/1", "dataset": {"name": "tiny", "hash": ")" + hash +
                        R"("}, "complete": true, "problems": {"posture": )" + kProblems +
                        R"(, "motion": []}, "stances": []})");
  }
  BenchmarkTable CertifiedTable() const {
    BenchmarkTable table = ReadBenchmarkTable(*source_, {});
    AddCertifiedCounts(*source_, ReadCertificateOf(folder_.path(), FindExperiment(*source_, 1)), &table);
    return table;
  }
  ProgramResult Table(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"table", "1", "--db", database_.string()});
    return RunLegopt(arguments, folder_.path());
  }

  TemporaryFolder folder_;
  std::filesystem::path database_ = folder_.path() / "test.sqlite";
  std::unique_ptr<ResultSource> source_;
};

TEST_F(CertifiedCounts, SplitTheJobsOfACell) {
  const auto counts = CertifiedTable().rows[0].cells.at(kGoodPostures).by_feasibility;
  EXPECT_EQ(counts[Feasibility::kCertified], (JobCounts{3, 3})) << "a solved problem is feasible";
  EXPECT_EQ(counts[Feasibility::kInfeasible], (JobCounts{1, 0}));
  EXPECT_EQ(counts[Feasibility::kOpen], (JobCounts{1, 0}));
}

TEST_F(CertifiedCounts, StandInEveryFormat) {
  const BenchmarkTable table = CertifiedTable();
  const auto text = RenderBenchmarkTable(table, TableFormat::kText);
  EXPECT_THAT(text, AllOf(HasSubstr("3/4 (1 open, 0 of 1 infeasible)"), HasSubstr("1/4 (1 open, 0 of 1"),
                          HasSubstr("LegOpt-best's SQP; not judged again here")));
  const auto narrow = RenderBenchmarkTable(table, TableFormat::kText, {kMilliseconds, {.width = 60, .color = false}});
  EXPECT_THAT(narrow, HasSubstr("3/4 (1 open, 0 of 1 infeasible)"));
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(table, TableFormat::kJson));
  const auto& cell = json["rows"][0]["posture"]["good"];
  EXPECT_EQ(cell["n"], 5) << "the figures of all jobs do not change";
  EXPECT_EQ(cell["by_feasibility"]["certified"], (nlohmann::json{{"n", 3}, {"solved", 3}}));
  EXPECT_EQ(json["certificate"]["verified"], false);
  EXPECT_EQ(json["certificate"]["hash"].get<std::string>().size(), 64U);
  const auto csv = ParseCsv(RenderBenchmarkTable(table, TableFormat::kCsv));
  const auto column = std::find(csv[0].begin(), csv[0].end(), "posture_good_open_solved") - csv[0].begin();
  ASSERT_LT(column, std::ssize(csv[0]));
  EXPECT_EQ(csv[1][static_cast<std::size_t>(column)], "0");
}

TEST_F(CertifiedCounts, BoldGoesToTheBest) {
  const auto text =
      RenderBenchmarkTable(CertifiedTable(), TableFormat::kText, {kMilliseconds, {.width = 100, .color = true}});
  EXPECT_THAT(text, ContainsRegex("\x1b\\[1m3/4"));
  EXPECT_THAT(text, Not(ContainsRegex("\x1b\\[1m1/4")));
}

// A continuous motion has the stances of the motion, so it is counted by the motion's certificate.
TEST(CertifiedContinuousMotions, CountAsTheirMotions) {
  const TemporaryFolder folder;
  TestExperiment experiment;
  experiment.task = "continuous";
  experiment.num_waypoints = 4;
  experiment.results = {{.problem = 0}, {.problem = 1, .verdict = "foot_pose"}, {.problem = 2}};
  const std::filesystem::path database = folder.path() / "test.sqlite";
  WriteTestDatabase(database, experiment);
  const auto source = OpenResults({database.string(), {}});
  certify::ProblemFeasibility known;
  known.problems[Task::kMotion] = {{0, Feasibility::kCertified}, {1, Feasibility::kCertified}};
  BenchmarkTable table = ReadBenchmarkTable(*source, {});
  AddCertifiedCounts(*source, known, &table);
  const auto counts = table.rows[0].cells.at({Task::kContinuous, Initialization::kGood}).by_feasibility;
  EXPECT_EQ(counts[Feasibility::kCertified], (JobCounts{3, 2})) << "problem 2 was solved";
  EXPECT_EQ(counts[Feasibility::kOpen], (JobCounts{0, 0}));
  EXPECT_THAT(RenderBenchmarkTable(table, TableFormat::kText), HasSubstr("2/3"));
}

// Columns of tasks that are not in the paper follow those of the paper if the table contains such tasks.
TEST(CsvColumns, ArePapersAndThenTheTables) {
  for (const char* task : {"posture", "continuous"}) {
    const TemporaryFolder folder;
    TestExperiment experiment;
    experiment.task = task;
    experiment.results = {{.problem = 0}};
    const std::filesystem::path database = folder.path() / "test.sqlite";
    WriteTestDatabase(database, experiment);
    const BenchmarkTable table = ReadBenchmarkTable(*OpenResults({database.string(), {}}), {});
    const std::vector<std::string> titles = ParseCsv(RenderBenchmarkTable(table, TableFormat::kCsv))[0];
    EXPECT_THAT(titles, testing::Contains("motion_in_collision_time_s"));
    const auto at = std::find(titles.begin(), titles.end(), "continuous_good_solved") - titles.begin();
    EXPECT_EQ(at < std::ssize(titles), std::string(task) == "continuous");
    const auto values = ParseCsv(RenderBenchmarkTable(table, TableFormat::kCsv))[1];
    if (at < std::ssize(titles)) {
      EXPECT_EQ(values.at(static_cast<std::size_t>(at)), "1");
    }
  }
}

TEST_F(CertifiedCounts, TheTableCommandTakesAFileOrAFolder) {
  for (const char* name : {".", "certificate.json"}) {
    const ProgramResult made = Table({"--certificate", name});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    EXPECT_THAT(made.out, HasSubstr("3/4 (1 open"));
  }
  EXPECT_THAT(Table({}).out, AllOf(HasSubstr("3/5"), Not(HasSubstr("certificate"))));
}

TEST_F(CertifiedCounts, WhatDoesNotFitIsRefusedWhereItWasAskedFor) {
  WriteCertificate(std::string(64, 'b'));
  const ProgramResult refused = Table({"--certificate", "."});
  EXPECT_EQ(refused.exit_code, static_cast<int>(app::ExitCode::kCertificateMismatch));
  EXPECT_THAT(refused.err, AllOf(HasSubstr("certificate.json"), HasSubstr("tiny")));
  EXPECT_FALSE(FindCertificate(folder_.path(), FindExperiment(*source_, 1)));
  EXPECT_EQ(Table({"--certificate", "nowhere"}).exit_code, kUsage);
  test::WriteText(folder_.path() / certify::kCertificateFileName, "{");
  EXPECT_EQ(Table({"--certificate", "."}).exit_code, kUsage);
}

}  // namespace
}  // namespace legopt::client
