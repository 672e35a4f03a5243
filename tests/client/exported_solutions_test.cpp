// Policy: exported solutions get the same verdicts when judged again, and the method strings distinguish all results
// of a problem.
#include "client/report/exported_solutions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "client/client_error.h"
#include "client/report/evaluation_report.h"
#include "legopt/dataset/dataset.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/robot/robot_model.h"
#include "test_database.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::ElementsAre;

TEST(MethodStrings, AreTheNamesWhenTheseSuffice) {
  EXPECT_THAT(
      MethodStrings({{1, "SQP", 0, 100, Initialization::kGood, 0}, {2, "I-SQP", 10, 80, Initialization::kGood, 0}}),
      ElementsAre("SQP", "I-SQP"));
}

TEST(MethodStrings, AddOnlyWhatTellsApart) {
  EXPECT_THAT(MethodStrings({{1, "SQP", 0, 100, Initialization::kGood, 0},
                             {1, "SQP", 0, 100, Initialization::kInCollision, 0},
                             {2, "SQP", 10, 100, Initialization::kGood, 0},
                             {3, "SGD", 10, 100, Initialization::kGood, 0},
                             {3, "SGD", 10, 100, Initialization::kGood, 1}}),
              ElementsAre("SQP, 0 multi-starts, good", "SQP, 0 multi-starts, in_collision", "SQP, 10 multi-starts",
                          "SGD, repetition 0", "SGD, repetition 1"));
}

TEST(MethodStrings, AreUniquePerKey) {
  std::vector<ResultKey> keys;
  for (int method = 1; method <= 3; ++method) {
    for (const auto initialization : {Initialization::kGood, Initialization::kInCollision}) {
      for (int repetition = 0; repetition < 2; ++repetition)
        keys.push_back({method, "M", 0, 100, initialization, repetition});
    }
  }
  const auto texts = MethodStrings(keys);
  EXPECT_EQ(std::set<std::string>(texts.begin(), texts.end()).size(), keys.size());
}

TEST(MethodStrings, TellCollisionModelsApart) {
  EXPECT_THAT(MethodStrings({{1, "SQP", 0, 100, Initialization::kGood, 0, SceneRepresentation::kSolid},
                             {2, "SQP", 0, 100, Initialization::kGood, 0, SceneRepresentation::kSurface}}),
              ElementsAre("SQP, solid", "SQP, surface"));
}

TEST(MethodStrings, OfNothingAreNothing) { EXPECT_TRUE(MethodStrings({}).empty()); }

// Uses the folder of the shared benchmark data with one solution that is known to be correct.
class ExportRoundTrip : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path data = TestDataFolder();
    if (!std::filesystem::exists(data / "sample_solution.json")) GTEST_SKIP() << "no shared test data in " << data;
    dataset_ = Dataset::Load(data);
    const auto sample = ReadSolutions(data / "sample_solution.json");
    const Eigen::VectorXd x = sample.problems.at(0).solutions.at(0).waypoints.at(0);
    Eigen::VectorXd shifted = x;
    shifted[dataset_->robot().num_dofs()] += 0.5;
    TestExperiment experiment;
    experiment.dataset_name = dataset_->name();
    experiment.dataset_hash = dataset_->content_hash();
    experiment.methods = {{"SQP", 0}, {"SQP", 10}};
    experiment.results = {
        {.method = 0, .problem = 0, .cost = 955.88, .waypoints = {x}},
        {.method = 0, .problem = 1, .verdict = "foot_pose", .waypoints = {shifted}},
        {.method = 0, .initialization = "in_collision", .problem = 0, .cost = 955.88, .waypoints = {x}},
        {.method = 1, .problem = 0, .verdict = "foot_pose", .waypoints = {shifted}},
        {.method = 1, .problem = 1, .finished = false}};
    WriteTestDatabase(folder_.path() / "test.sqlite", experiment);
    source_ = OpenResults({(folder_.path() / "test.sqlite").string(), {}});
    x_ = x;
  }

  TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
  std::unique_ptr<ResultSource> source_;
  Eigen::VectorXd x_;
};

TEST_F(ExportRoundTrip, GivesTheSameVerdicts) {
  const auto exported = ReadSolutionsOf(*source_, 1, *dataset_, {});
  EXPECT_EQ(exported.num_solutions, 4);
  EXPECT_EQ(exported.num_missing, 1);
  ASSERT_EQ(exported.files.size(), 1U);
  WriteSolutions(folder_.path() / "out.json", exported.files[0]);

  const auto file = ReadSolutions(folder_.path() / "out.json");
  EXPECT_EQ(file.problems.at(0).solutions.at(0).waypoints.at(0), x_);  // bitwise
  Judge judge(dataset_);
  const auto report = EvaluateSolutions(file, judge, Rule::kLiteral);
  EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
  ASSERT_EQ(report.rows.size(), 4U);
  for (const auto& row : report.rows) {
    const bool solved = row.problem_id == 0 && row.method != "SQP, 10 multi-starts";
    EXPECT_EQ(row.evaluation.literal, solved ? Verdict::kSuccess : Verdict::kFootPose) << row.method;
    EXPECT_DOUBLE_EQ(row.time_s, 0.0015);
  }
}

// Completely and partly solved motions on the embedded dataset.
TEST(ExportedMotions, KeepEveryBitAndArePartlyExportedWhenPartlySolved) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  const ProblemDefinition& problem = dataset->problems(Task::kMotion).at(0);
  std::vector<Eigen::VectorXd> whole;
  for (const Stance& stance : problem.stances) {
    whole.push_back(InitialGuess(*dataset, stance, Initialization::kGood));
    whole.push_back(whole.back());
  }
  const std::vector<Eigen::VectorXd> part(whole.begin(), whole.begin() + 12);
  TestExperiment experiment;
  experiment.dataset_name = dataset->name();
  experiment.dataset_hash = dataset->content_hash();
  experiment.task = "motion";
  experiment.num_waypoints = static_cast<int>(whole.size());
  experiment.methods = {{"SQP", 0, "solid"}, {"SQP", 0, "surface"}};
  experiment.results = {{.method = 0, .problem = problem.id, .verdict = "foot_pose", .waypoints = whole},
                        {.method = 1,
                         .problem = problem.id,
                         .verdict = "window_unsolved",
                         .waypoints = part,
                         .unsolved = {whole.begin() + 10, whole.begin() + 22},
                         .first_unsolved = 10}};
  TemporaryFolder folder;
  WriteTestDatabase(folder.path() / "test.sqlite", experiment);
  const auto source = OpenResults({(folder.path() / "test.sqlite").string(), {}});
  const auto exported = ReadSolutionsOf(*source, 1, *dataset, {});
  ASSERT_EQ(exported.files.size(), 1U);
  WriteSolutions(folder.path() / "out.json", exported.files[0]);

  const auto file = ReadSolutions(folder.path() / "out.json");
  EXPECT_EQ(file.task, Task::kMotion);
  EXPECT_EQ(file.joints, DofNames(dataset->robot())) << "whoever reads it knows the order";
  EXPECT_EQ(file.joints.at(0), "back_lbz");
  EXPECT_EQ(file.problems.at(0).solutions.at(0).method, "SQP, solid");
  EXPECT_EQ(file.problems.at(0).solutions.at(0).waypoints, whole);
  EXPECT_EQ(file.problems.at(0).solutions.at(1).waypoints, part);
  Judge judge(dataset);
  const auto report = EvaluateSolutions(file, judge, Rule::kLiteral);
  ASSERT_EQ(report.rows.size(), 2U);
  EXPECT_EQ(report.rows[0].evaluation.literal, Verdict::kFootPose);
  EXPECT_EQ(report.rows[1].evaluation.literal, Verdict::kWrongWaypointCount) << "the unsolved window is no part of it";
  const auto written = nlohmann::json::parse(std::ifstream(folder.path() / "out.json"));
  const auto& window = written.at("problems").at(0).at("solution").at(1).at("unsolvedWindow");
  EXPECT_EQ(window.at("firstWaypoint"), 10);
  EXPECT_EQ(window.at("x").size(), 12U);
  EXPECT_FALSE(written.at("problems").at(0).at("solution").at(0).contains("unsolvedWindow"));
  EXPECT_THAT(RenderEvaluation(report, TableFormat::kText), testing::HasSubstr("Between waypoints"));
  ResultFilter surface;
  surface.collision = SceneRepresentation::kSurface;
  EXPECT_EQ(ReadSolutionsOf(*source, 1, *dataset, surface).num_solutions, 1);
}

TEST_F(ExportRoundTrip, FilterSelects) {
  const auto exported = ReadSolutionsOf(
      *source_, 1, *dataset_, {.methods = {"sqp"}, .tasks = {"posture"}, .initializations = {"in_collision"}});
  EXPECT_EQ(exported.num_solutions, 1);
  EXPECT_EQ(exported.files.at(0).problems.at(0).solutions.at(0).method, "SQP");
  EXPECT_EQ(exported.files.at(0).problems.at(0).solutions.at(0).init_type, "in_collision");
  EXPECT_THROW(ReadSolutionsOf(*source_, 1, *dataset_, {.tasks = {"motion"}}), ClientError);
}

}  // namespace
}  // namespace legopt::client
