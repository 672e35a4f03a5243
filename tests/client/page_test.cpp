// Policy: a page contains the figures that commands print and poses that agree with the kinematics. It contains
// nothing that a browser would fetch or that would end a block early. A page that cannot be made leaves nothing
// behind.
#include "client/page/page.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>

#include "client/client_error.h"
#include "client/compare/statistics_table.h"
#include "client/page/page_file.h"
#include "client/report/output.h"
#include "client/report/reading.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/robot/kinematics.h"
#include "page_fixture.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

std::string Read(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST_F(PageTest, TablesAreThoseOfTheCommands) {
  const Json page = Json::parse(Block(Report().text, "page"));
  const auto source = OpenResults({file_.string(), {}});
  EXPECT_EQ(page["experiments"][0]["table"], BenchmarkTableJson(ReadBenchmarkTable(*source, {})));
  EXPECT_EQ(page["experiments"][0]["statistics"], StatisticsTableJson(ReadStatisticsTable(*source, {})));
}

TEST_F(PageTest, CausesCountWhatIsNotSolved) {
  const Json page = Json::parse(Block(Report().text, "page"));
  const Json& columns = page["experiments"][0]["columns"];
  EXPECT_EQ(columns[0]["causes"][0], Json::object());
  EXPECT_EQ(columns[0]["causes"][1], (Json{{"foot_pose", 1}}));
  EXPECT_EQ(columns[1]["causes"][0], (Json{{"dead", 1}}));
  EXPECT_EQ(columns[1]["causes"][1], Json::object()) << "a queued job has not failed";
}

TEST_F(PageTest, WaypointsGiveTheKinematicsOfTheJudge) {
  const std::string text = Report().text;
  const Json solutions = Json::parse(Block(text, "solutions-0"));
  const std::string bytes = Block(text, "motion-0");
  ASSERT_EQ(solutions.size(), 2U);
  for (const Json& solution : solutions) {
    const auto x = UnpackWaypoints(bytes.substr(solution["offset"], solution["bytes"]));
    ASSERT_EQ(x.size(), 1U);
    const Eigen::VectorXd& stored = experiment_.results[solution["job"].get<int>() == 1 ? 0 : 1].waypoints[0];
    Kinematics shown(dataset_->robot()), judged(dataset_->robot());
    shown.Update(x[0]);
    judged.Update(stored);
    for (std::size_t i = 0; i < dataset_->robot().links().size(); ++i) {
      const int link = static_cast<int>(i);
      EXPECT_LT((shown.link_pose(link).matrix() - judged.link_pose(link).matrix()).cwiseAbs().maxCoeff(), 1e-6);
    }
  }
}

TEST_F(PageTest, FindingsNameTheFootThatIsOff) {
  const Json solutions = Json::parse(Block(Report().text, "solutions-0"));
  const Json& failed = solutions[0];  // failed postures come first
  EXPECT_EQ(failed["job"], 2);
  const Json& foot = failed["findings"][0]["feet"][0];
  EXPECT_TRUE(foot["violated"].get<bool>());
  EXPECT_NEAR(foot["error"].get<double>(), 0.01, 1e-6);
  EXPECT_EQ(foot["component"], "translation y");
}

TEST_F(PageTest, NothingIsFetchedAndNoBlockEndsEarly) {
  std::string text = Report().text;
  EXPECT_NE(text.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(text.find("<script>alert"), std::string::npos) << "the title is escaped, the rest is no text";
  const auto program = text.find(PageProgram());
  ASSERT_NE(program, std::string::npos);
  EXPECT_EQ(PageProgram().find("</script"), std::string_view::npos);
  text.erase(program, PageProgram().size());
  EXPECT_EQ(text.find("http:"), std::string::npos);
  EXPECT_EQ(text.find("https:"), std::string::npos);
  EXPECT_EQ(text.find(" src="), std::string::npos);
  const std::regex opened("<script"), closed("</script");
  EXPECT_EQ(std::distance(std::sregex_iterator(text.begin(), text.end(), opened), {}),
            std::distance(std::sregex_iterator(text.begin(), text.end(), closed), {}));
}

TEST_F(PageTest, TellsWhatIsUnfinished) {
  const Page page = Report();
  EXPECT_TRUE(std::ranges::any_of(page.notes, [](const auto& n) { return n.find("is unfinished: 1 jobs") != n.npos; }));
  EXPECT_EQ(Json::parse(Block(page.text, "page"))["experiments"][0]["unfinished"], 1);
}

TEST_F(PageTest, TellsWhatDoesNotFit) {
  const std::size_t whole = Report().text.size();
  const Page page = Report(whole - 200);
  EXPECT_LE(page.text.size(), whole - 200);
  EXPECT_TRUE(
      std::ranges::any_of(page.notes, [](const auto& n) { return n.find("solutions are left out") != n.npos; }));
  EXPECT_THROW(Report(1000), ClientError);
}

TEST_F(PageTest, ReportWithoutItsDatasetHasNo3dAndSaysSo) {
  ReportRequest request;
  request.sources = {{{file_.string(), {}}, std::nullopt}};
  const Page page = MakeReport(request);
  EXPECT_TRUE(std::ranges::any_of(page.notes, [](const auto& n) { return n.find("no 3D") != n.npos; }));
  EXPECT_TRUE(Json::parse(Block(page.text, "page"))["experiments"][0]["dataset_index"].is_null());
}

ExitCode CodeOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const ClientError& error) {
    return error.code();
  }
  return ExitCode::kOk;
}

TEST_F(PageTest, ViewsRefuseWhatTheyCannotDraw) {
  EXPECT_EQ(CodeOf([&] { View(1); }), ExitCode::kOk);
  EXPECT_EQ(CodeOf([&] { View(3); }), ExitCode::kUsage) << "died without a solution";
  EXPECT_EQ(CodeOf([&] { View(99); }), ExitCode::kUsage);
  experiment_.dataset_hash = std::string(64, 'b');
  std::filesystem::remove(file_);
  WriteTestDatabase(file_, experiment_);
  EXPECT_EQ(CodeOf([&] { View(1); }), ExitCode::kDatasetMismatch);
}

TEST_F(PageTest, WhatCannotBeWrittenLeavesTheOldFile) {
  const auto page = folder_.path() / "page.html";
  ReplaceFile(page, "old");
  // No file system accepts a name of this length, or that of the temporary file that replaces it.
  EXPECT_EQ(CodeOf([&] { ReplaceFile(folder_.path() / std::string(300, 'p'), "new"); }), ExitCode::kUsage);
  EXPECT_EQ(Read(page), "old");
  EXPECT_EQ(CodeOf([&] { ReplaceFile(folder_.path() / "none" / "page.html", "new"); }), ExitCode::kUsage);
}

TEST(PageRules, AreTheWeakestOfTheExperiments) {
  const TemporaryFolder folder;
  std::vector<PageSource> sources;
  for (const Rule rule : {Rule::kPhysical, Rule::kStrict, Rule::kPhysical}) {
    TestExperiment experiment;
    experiment.results.emplace_back();
    experiment.rule = rule;
    const auto file = folder / (std::to_string(sources.size()) + ".sqlite");
    WriteTestDatabase(file, experiment);
    sources.push_back({{file.string(), {}}, {}});
  }
  EXPECT_EQ(PageRule({sources[0]}, {}), Rule::kPhysical);
  EXPECT_EQ(PageRule({sources[0], sources[2]}, {}), Rule::kPhysical);
  EXPECT_EQ(PageRule(sources, {}), Rule::kStrict);
  EXPECT_EQ(PageRule(sources, Rule::kLiteral), Rule::kLiteral);
  EXPECT_EQ(PageRule({}, {}), Rule::kSolid);
}

// Two windows of a motion on the embedded dataset, the first of which is solved, and a motion whose first window
// failed.
TEST(PageMotions, ShowTheWindowThatWasNotSolvedBehindTheSolvedOnes) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  const ProblemDefinition& problem = dataset->problems(Task::kMotion).at(0);
  for (const char* task : {"motion", "continuous"}) {
    std::vector<Eigen::VectorXd> solved, unsolved;
    for (int w = 0; w < 22; ++w) {
      const Stance& stance = problem.stances.at(static_cast<std::size_t>(w / 2));
      Eigen::VectorXd x = InitialGuess(*dataset, stance, Initialization::kInCollision);
      if (w >= 10) unsolved.push_back(x);
      if (HasTimeStamps(ParseEnum<Task>(task).value())) {
        x.conservativeResize(x.size() + 1);
        x[x.size() - 1] = w;
      }
      if (w < 12) solved.push_back(x);
    }
    TestExperiment experiment;
    experiment.dataset_name = dataset->name();
    experiment.dataset_hash = dataset->content_hash();
    experiment.task = task;
    experiment.num_waypoints = 30;
    experiment.methods = {{"A"}, {"B"}};
    experiment.results = {{.method = 0,
                           .problem = problem.id,
                           .verdict = "window_unsolved",
                           .waypoints = solved,
                           .unsolved = unsolved,
                           .first_unsolved = 10},
                          {.method = 1, .problem = problem.id, .verdict = "window_unsolved", .unsolved = unsolved}};
    TemporaryFolder folder;
    WriteTestDatabase(folder.path() / "results.sqlite", experiment);
    for (const std::int64_t job : {1, 2}) {
      ViewRequest request;
      request.source = {(folder.path() / "results.sqlite").string(), {}};
      request.job = job;
      request.dataset = dataset;
      const std::string text = MakeView(request).text;
      const Json solution = Json::parse(Block(text, "solutions-0"))[0];
      EXPECT_EQ(solution["unsolved"]["from"], job == 1 ? 10 : 0) << task;
      EXPECT_EQ(solution["unsolved"]["waypoints_per_stance"], 2);
      EXPECT_EQ(solution["waypoints"], job == 1 ? 22 : 12) << "none of them twice";
      EXPECT_EQ(solution["findings"].size(), job == 1 ? 22U : 12U);
      const auto x = UnpackWaypoints(Block(text, "motion-0").substr(solution["offset"], solution["bytes"]));
      for (std::size_t w = 0; w < x.size(); ++w) {
        const Eigen::VectorXd& stored = job == 1 && w < 10 ? solved[w] : unsolved[job == 1 ? w - 10 : w];
        EXPECT_LT((x[w] - stored.head(x[w].size())).cwiseAbs().maxCoeff(), 1e-6) << w;
      }
    }
  }
}

TEST(PageBlock, WaypointsComeBackToHalfATenMillionth) {
  std::vector<Eigen::VectorXd> waypoints;
  for (int w = 0; w < 20; ++w) waypoints.push_back(Eigen::VectorXd::Random(37) * 99.0);
  const auto back = UnpackWaypoints(PackWaypoints(waypoints));
  ASSERT_EQ(back.size(), waypoints.size());
  for (std::size_t w = 0; w < back.size(); ++w) {
    EXPECT_LT((back[w] - waypoints[w]).cwiseAbs().maxCoeff(), 0.51e-7);
  }
  EXPECT_TRUE(PackWaypoints(std::vector<Eigen::VectorXd>{Eigen::VectorXd::Constant(3, 101.0)}).empty());
  EXPECT_TRUE(PackWaypoints(std::vector<Eigen::VectorXd>{Eigen::VectorXd::Constant(3, std::nan(""))}).empty());
}

TEST(PageBlock, Base64HasTheVectorsOfItsStandard) {  // RFC 4648, section 10
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Unzip(Gzip("any bytes")), "any bytes");
}

}  // namespace
}  // namespace legopt::client
