// Policy: `evaluate` reports the judge's verdicts per method and per failure, the number of the dataset's problems,
// and the definitions used, in every format. It warns if the file claims otherwise.
#include "client/report/evaluation_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "table_parsers.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Returns a report of judged solutions without running the judge, to test rendering only.
EvaluationReport ExampleReport() {
  Evaluation good{};
  good.literal = good.strict = Verdict::kSuccess;
  good.cost = 396.4;
  good.num_waypoints = 1;
  Evaluation bad = good;
  bad.literal = bad.strict = Verdict::kFootPose;
  bad.failed_waypoint = 0;
  bad.detail = "l_foot is 0.002 m off";
  bad.cost = std::nan("");
  EvaluationReport report;
  report.file = "s.json";
  report.dataset = "yard";
  report.rule = Rule::kLiteral;
  report.num_posed = 2;
  report.in_file = {0, 1};
  report.defines = true;
  report.rows = {{"A", 0, 0.002, good}, {"A", 1, 0.004, bad, true}, {"B", 0, 0.001, bad}};
  report.summaries = {{"A", 2, 1, 396.4, 0.002}, {"B", 2, 0, std::nan(""), std::nan(""), 0, {1}}};
  report.warnings = {"problem 1, A: the file says success, the judge says foot_pose"};
  return report;
}

TEST(EvaluationReport, TextShowsSummaryAndFailures) {
  const std::string text = RenderEvaluation(ExampleReport(), TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("s.json: posture, dataset yard, literal rule."));
  EXPECT_THAT(text, HasSubstr("The file holds 2 of the dataset's 2 problems."));
  EXPECT_THAT(
      text, HasSubstr("Definitions: the file's own, as in the original evaluator; they are the same as the dataset's"));
  EXPECT_THAT(text, HasSubstr("A           1/2        2   396       2.00"));
  EXPECT_THAT(text, HasSubstr("B           0/2        1     -          -"));
  EXPECT_THAT(text, HasSubstr("time (ms)"));
  EXPECT_THAT(text, HasSubstr("l_foot is 0.002 m off"));
  EXPECT_THAT(text, HasSubstr("Left out"));
}

TEST(EvaluationReport, CountsPosturesOfAcceptedSolutionsThatCanBeHeld) {
  EvaluationReport report = ExampleReport();
  for (JudgedRow& row : report.rows) {
    row.evaluation.holding = {.postures = 10, .without_equilibrium = 1, .over_torque = 2};
    row.evaluation.holding_halfway = {.postures = 9, .without_equilibrium = 4, .over_torque = 0};
  }
  const std::string text = RenderEvaluation(report, TableFormat::kText);
  EXPECT_NE(text.find("Postures that contacts and joints can hold\n\n"
                      "method  solved  held  postures  without_equilibrium  over_torque  halfway_postures  "
                      "halfway_without_equilibrium  halfway_over_torque\n"
                      "A            1     0        10                    1            2                 9  "
                      "                          4                    0\n"),
            std::string::npos)
      << text;
}

TEST(EvaluationReport, Golden) {
  EXPECT_EQ(RenderEvaluation(ExampleReport(), TableFormat::kText), R"(s.json: posture, dataset yard, literal rule.
The file holds 2 of the dataset's 2 problems.
Definitions: the file's own, as in the original evaluator; they are the same as the dataset's.
Solved by the solid rule: A 2/2; B 1/2.
Solved by the physical rule: A 2/2; B 1/2.

method  success  in file  cost  time (ms)
A           1/2        2   396       2.00
B           0/2        1     -          -

Costs and times are averaged over successfully solved problems, per waypoint. Problems missing in the file count as not solved.

Not solved

method  problem  verdict    waypoint  detail
A             1  foot_pose         0  l_foot is 0.002 m off
B             0  foot_pose         0  l_foot is 0.002 m off

Left out

problems without a solution  methods
1                            B
)");
}

TEST(EvaluationReport, EveryFormatHasTheSameCounts) {
  const EvaluationReport report = ExampleReport();
  EXPECT_THAT(RenderEvaluation(report, TableFormat::kMarkdown), HasSubstr("| A | 1/2 | 2 | 396 | 2.00 |"));
  EXPECT_THAT(RenderEvaluation(report, TableFormat::kMarkdown), HasSubstr("2 of the dataset's 2 problems"));
  EXPECT_THAT(RenderEvaluation(report, TableFormat::kLatex), HasSubstr("A & 1/2 & 2 & 396 & 2.00"));
  EXPECT_THAT(RenderEvaluation(report, TableFormat::kLatex), HasSubstr("2 of the dataset's 2 problems"));
}

TEST(EvaluationReport, CsvHoldsTheSummaryUnrounded) {
  const auto rows = ParseCsv(RenderEvaluation(ExampleReport(), TableFormat::kCsv));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[1],
            (std::vector<std::string>{"A", "2", "1", "396.4", "0.002", "2", "0", "0", "0", "yard", "file", "literal"}));
  EXPECT_EQ(rows[2], (std::vector<std::string>{"B", "2", "0", "", "", "1", "0", "0", "0", "yard", "file", "literal"}));
}

TEST(EvaluationReport, JsonHoldsEverySolution) {
  const auto json = nlohmann::json::parse(RenderEvaluation(ExampleReport(), TableFormat::kJson));
  EXPECT_EQ(json.at("dataset_problems"), 2);
  EXPECT_EQ(json.at("methods")[0].at("solved"), 1);
  EXPECT_EQ(json.at("methods")[1].at("missing"), nlohmann::json({1}));
  ASSERT_EQ(json.at("solutions").size(), 3U);
  EXPECT_EQ(json.at("solutions")[1].at("verdict_literal"), "foot_pose");
  EXPECT_TRUE(json.at("solutions")[1].at("cost").is_null());
  EXPECT_EQ(json.at("solutions")[1].at("claim_differs"), true);
  EXPECT_EQ(json.at("warnings").size(), 1U);
}

TEST(RangesOf, JoinsNeighbours) {
  EXPECT_EQ(RangesOf({}), "");
  EXPECT_EQ(RangesOf({4}), "4");
  EXPECT_EQ(RangesOf({7, 0, 1, 2, 9, 8, 20, 5}), "0-2, 5, 7-9, 20");
  EXPECT_EQ(RangesOf({0, 1}), "0, 1");
}

// Solution files on a dataset with posture problems 0 and 7, both solved by standing upright.
class SolutionEvaluation : public testing::Test {
 protected:
  EvaluationReport Evaluate(const SolutionFile& file, Definitions definitions = Definitions::kFile) {
    return EvaluateSolutions(file, judge_, Rule::kLiteral, definitions);
  }

  SolvedProblem Solved(int id, const ProblemDefinition& definition, const Eigen::VectorXd& x) {
    return {{id, definition.stances}, {{.method = "A", .time_s = 1, .waypoints = {x}}}};
  }
  SolvedProblem Upright(int id) { return Solved(id, posed_, test::StandingUpright()); }

  // Returns a problem whose definition and solution are raised by 20 m.
  SolvedProblem InTheAir(int id) {
    ProblemDefinition definition = posed_;
    Eigen::VectorXd x = test::StandingUpright();
    for (ContactTarget& target : definition.stances[0].contacts) target.position.z() += 20;
    x[test::kSyntheticDofs + 2] += 20;
    return Solved(id, definition, x);
  }

  std::string Message(const SolutionFile& file) {
    return test::MessageOf([&] { Evaluate(file); });
  }

  TemporaryFolder folder_;
  Judge judge_{Dataset::Load(test::SyntheticFolder(folder_.path()).path())};
  ProblemDefinition posed_ = judge_.dataset().problem(Task::kPosture, 0);
  SolutionFile file_{.robot = "tiny", .scenario = "yard", .task = Task::kPosture, .problems = {}, .path = "s.json"};
};

TEST_F(SolutionEvaluation, AllProblemsByTheSameDefinitions) {
  file_.problems = {Upright(0), Upright(7)};
  const auto report = Evaluate(file_);
  ASSERT_EQ(report.summaries.size(), 1U);
  EXPECT_EQ(report.summaries[0].num_solved, 2);
  EXPECT_EQ(report.summaries[0].num_problems, 2);
  EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
  const std::string caption = EvaluationCaption(report);
  EXPECT_THAT(caption, HasSubstr("The file holds 2 of the dataset's 2 problems.\n"));
  EXPECT_THAT(caption, HasSubstr("they are the same as the dataset's"));
}

TEST_F(SolutionEvaluation, WhatTheFileLeavesOutIsNotSolved) {
  file_.problems = {Upright(7)};
  const auto report = Evaluate(file_);
  EXPECT_EQ(report.summaries.at(0).num_problems, 2);
  EXPECT_EQ(report.summaries.at(0).num_solved, 1);
  EXPECT_EQ(report.summaries.at(0).missing, std::vector<int>{0});
  for (const TableFormat format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    const std::string text = RenderEvaluation(report, format);
    EXPECT_THAT(text, HasSubstr("The file holds 1 of the dataset's 2 problems; the others count as not solved."));
    EXPECT_THAT(text, HasSubstr("1/2"));
  }
}

TEST_F(SolutionEvaluation, CopiesUnderOtherIdsAreCountedApart) {
  for (int id = 50; id < 110; ++id) file_.problems.push_back(Upright(id));
  const auto report = Evaluate(file_);
  ASSERT_EQ(report.summaries.size(), 1U);
  EXPECT_EQ(report.summaries[0].num_solved, 0);
  EXPECT_EQ(report.summaries[0].num_problems, 2);
  ASSERT_EQ(report.not_posed_summaries.size(), 1U);
  EXPECT_EQ(report.not_posed_summaries[0].num_solved, 60);
  for (const TableFormat format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    const std::string text = RenderEvaluation(report, format);
    EXPECT_THAT(text, HasSubstr("The file holds 0 of the dataset's 2 problems"));
    EXPECT_THAT(text, HasSubstr("60 problems (50-109) that the dataset does not have are counted apart"));
    EXPECT_LT(text.find("0/2"), text.find("60/60"));
  }
  const auto json = nlohmann::json::parse(RenderEvaluation(report, TableFormat::kJson));
  EXPECT_EQ(json.at("methods")[0].at("solved"), 0);
  EXPECT_EQ(json.at("methods")[0].at("other_solved"), 60);
  EXPECT_EQ(json.at("other_problems").size(), 60U);
  EXPECT_EQ(ParseCsv(RenderEvaluation(report, TableFormat::kCsv))[1][2], "0");
}

TEST_F(SolutionEvaluation, TheTableTellsWhatIsSolvedByAnotherDefinition) {
  file_.problems = {InTheAir(0), Upright(7)};
  const auto report = Evaluate(file_);
  EXPECT_EQ(report.summaries.at(0).num_solved, 2) << "the file's own definition counts, as in the original";
  EXPECT_EQ(report.summaries.at(0).num_other_definition, 1);
  EXPECT_EQ(report.differing, std::vector<int>{0});
  for (const TableFormat format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    const std::string text = RenderEvaluation(report, format);
    EXPECT_THAT(text, HasSubstr("Definitions: the file's own, as in the original evaluator; 1 of 2 in the file differ "
                                "from the dataset's (0)"));
    EXPECT_THAT(text, HasSubstr("by file's own definition"));
  }
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("problem 0: its definition differs from the dataset's"));

  const auto by_dataset = Evaluate(file_, Definitions::kDataset);
  EXPECT_EQ(by_dataset.summaries.at(0).num_solved, 1);
  EXPECT_EQ(by_dataset.rows.at(0).evaluation.literal, Verdict::kFootPose);
  EXPECT_THAT(EvaluationCaption(by_dataset), HasSubstr("Definitions: the dataset's"));
}

TEST_F(SolutionEvaluation, DigitsAndSignsOfQuaternionsMakeNoOtherDefinition) {
  file_.problems = {Upright(0)};
  ContactTarget& target = file_.problems[0].definition.stances[0].contacts[0];
  target.rotation.coeffs() *= -1;
  target.position.x() += 1e-12;
  EXPECT_TRUE(Evaluate(file_).differing.empty());
  target.position.x() += 1e-6;
  EXPECT_EQ(Evaluate(file_).differing, std::vector<int>{0});
}

TEST_F(SolutionEvaluation, AFileWithoutDefinitionsTakesTheDatasets) {
  file_.problems = {Upright(0), Upright(7)};
  for (SolvedProblem& problem : file_.problems) problem.definition.stances.clear();
  const auto report = Evaluate(file_);
  EXPECT_EQ(report.summaries.at(0).num_solved, 2);
  EXPECT_THAT(EvaluationCaption(report), HasSubstr("Definitions: the dataset's; the file has none."));
}

TEST_F(SolutionEvaluation, AnotherRobotOrScenarioIsSaid) {
  file_.problems = {Upright(0)};
  file_.robot = "valkyrie";
  file_.scenario = "moon";
  const auto report = Evaluate(file_);
  ASSERT_EQ(report.warnings.size(), 2U);
  EXPECT_THAT(report.warnings[0], AllOf(HasSubstr("s.json: robot"), HasSubstr("'valkyrie'"), HasSubstr("'tiny'")));
  EXPECT_THAT(report.warnings[1], AllOf(HasSubstr("s.json: scenario"), HasSubstr("'moon'")));
  file_.robot = file_.scenario = "";
  EXPECT_TRUE(Evaluate(file_).warnings.empty());
}

TEST_F(SolutionEvaluation, ADatasetWithoutTheTaskSaysSo) {
  std::filesystem::remove(folder_.path() / "problems-motion.json");
  test::ReplaceInFile(folder_.path() / "dataset.yaml", "  motion: problems-motion.json\n", "");
  WriteManifestHashes(folder_.path());
  Judge judge(Dataset::Load(folder_.path()));
  file_.task = Task::kMotion;
  ProblemDefinition twice{0, {posed_.stances[0], posed_.stances[0]}};
  file_.problems = {{twice, {{.method = "A", .time_s = 1, .waypoints = {4, test::StandingUpright()}}}}};
  const auto report = EvaluateSolutions(file_, judge, Rule::kLiteral);
  EXPECT_THAT(EvaluationCaption(report), HasSubstr("The dataset has no motion problems."));
  EXPECT_TRUE(report.summaries.empty());
  EXPECT_EQ(report.not_posed_summaries.at(0).num_solved, 1);
  EXPECT_EQ(ParseCsv(RenderEvaluation(report, TableFormat::kCsv)).size(), 2U);
}

TEST_F(SolutionEvaluation, AnUnreadableNumberFailsItsSolution) {
  file_.problems = {Upright(0), Upright(7)};
  file_.problems[0].solutions[0].unreadable = {0, 5, "1e400", "which no double holds"};
  const auto report = Evaluate(file_);
  EXPECT_EQ(report.summaries.at(0).num_solved, 1);
  EXPECT_TRUE(report.rows.at(0).unreadable);
  EXPECT_EQ(report.rows.at(0).evaluation.literal, Verdict::kNotFinite);
  EXPECT_EQ(report.rows.at(0).evaluation.detail, "waypoint 0: number 5 is '1e400', which no double holds");
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("s.json: problem 0, A, waypoint 0: number 5 is '1e400'"));
}

TEST_F(SolutionEvaluation, ATimeOfZeroIsNoMeasurement) {
  file_.problems = {Upright(0), Upright(7)};
  file_.problems[0].solutions[0].time_s = 0;
  const auto report = Evaluate(file_);
  EXPECT_EQ(report.summaries.at(0).mean_time_s, 1);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("1 solution has timeSec 0"));
}

TEST_F(SolutionEvaluation, FaultsNameTheFileAndTheProblem) {
  file_.problems = {Upright(0)};
  file_.problems[0].definition.stances[0].contacts[0].contact = "x_foot";
  EXPECT_THAT(Message(file_), AllOf(HasSubstr("s.json: problem 0, definition, stance 0"), HasSubstr("'x_foot'"),
                                    Not(HasSubstr("dataset.yaml"))));
  file_.problems = {Upright(0)};
  file_.task = Task::kMotion;
  EXPECT_THAT(Message(file_), HasSubstr("s.json: problem 0: does not fit the task 'motion'"));
  file_.task = Task::kPosture;
  file_.problems = {Upright(99)};
  file_.problems[0].definition.stances.clear();
  EXPECT_THAT(Message(file_), HasSubstr("s.json: problem 99: has no 'definition'"));
}

TEST_F(SolutionEvaluation, JointsMustBeTheRobotsInItsOrder) {
  file_.problems = {Upright(0)};
  file_.joints = {"l_hip", "l_ankle", "r_hip", "r_ankle", "l_shoulder", "r_shoulder", "neck", "lidar"};
  EXPECT_EQ(Evaluate(file_).summaries.at(0).num_solved, 1);
  std::swap(file_.joints[2], file_.joints[3]);
  EXPECT_THAT(Message(file_), AllOf(HasSubstr("s.json: joints[2]: joint 2 of the robot is 'r_hip' (got 'r_ankle')"),
                                    HasSubstr("legopt dataset info")));
  file_.joints = {"l_hip"};
  EXPECT_THAT(Message(file_), HasSubstr("s.json: joints: the robot 'tiny' has 8 joints (got '1 names')"));
}

TEST(EvaluationReport, SampleSolutionIsJudgedAsPublished) {
  const std::filesystem::path folder = TestDataFolder();
  if (!std::filesystem::exists(folder / "sample_solution.json")) GTEST_SKIP() << "no shared test data in " << folder;
  SolutionFile file = ReadSolutions(folder / "sample_solution.json");
  file.problems.at(0).solutions.at(0).success = false;
  Judge judge(Dataset::Load(folder));
  const auto report = EvaluateSolutions(file, judge, Rule::kLiteral);
  ASSERT_EQ(report.summaries.size(), 1U);
  EXPECT_EQ(report.summaries[0].num_solved, 1);
  EXPECT_NEAR(report.summaries[0].mean_cost, 955.88, 0.01);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("the file says no success, the judge says success"));
}

TEST(EvaluationReport, ForeignDefinitionIsUsedAndReported) {
  const std::filesystem::path folder = TestDataFolder();
  if (!std::filesystem::exists(folder / "sample_solution.json")) GTEST_SKIP() << "no shared test data in " << folder;
  SolutionFile file = ReadSolutions(folder / "sample_solution.json");
  file.problems.at(0).definition.stances.at(0).contacts.at(0).position.x() += 0.01;
  Judge judge(Dataset::Load(folder));
  const auto report = EvaluateSolutions(file, judge, Rule::kLiteral);
  EXPECT_EQ(report.rows.at(0).evaluation.literal, Verdict::kFootPose);
  ASSERT_GE(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("differs from the dataset's"));
}

}  // namespace
}  // namespace legopt::client
