#include <gtest/gtest.h>

#include "legopt/evaluate/judge.h"
#include "legopt/evaluate/solution_file.h"
#include "legopt/generate/dataset_builder.h"
#include "legopt/generate/stance_features.h"
#include "tests/generate/plain_dataset.h"
#include "tests/problem/test_data.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

TEST(Clusters, FindTheGroupsOfThePoints) {
  std::vector<Vector3d> points;
  for (int k = 0; k < 30; ++k) points.emplace_back(10.0 * (k % 3) + 0.01 * k, 0.0, k % 3 == 1 ? 5.0 : 0.0);
  const auto clusters = ClusterPoints(points, 3, 4);
  ASSERT_EQ(clusters.size(), 3u);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(clusters[c].size(), 10u);
    for (const int i : clusters[c]) EXPECT_EQ(static_cast<size_t>(i % 3), c);
  }
  EXPECT_EQ(clusters, ClusterPoints(points, 3, 4));
  EXPECT_NE(test::MessageOf([&] { ClusterPoints(points, 31, 1); }).find("30 different stances"), std::string::npos);
}

TEST(Histograms, CoverAllValuesWithRoundLimits) {
  const std::vector<double> values = {0.21, 0.24, 0.35, 0.5, 0.69};
  const Histogram histogram = MakeHistogram("length", "m", values, 5);
  EXPECT_DOUBLE_EQ(histogram.width, 0.1);
  EXPECT_DOUBLE_EQ(histogram.low, 0.2);
  EXPECT_EQ(histogram.counts, (std::vector<int>{2, 1, 0, 1, 1}));
  EXPECT_NE(FormatHistogram(histogram).find("length [m], n = 5"), std::string::npos);
  EXPECT_NE(FormatHistogram(histogram).find("2 ##\n"), std::string::npos);
  const std::vector<HistogramRow> rows = {{"Row", {histogram, MakeHistogram("none", "", {})}}};
  const std::string svg = FormatHistogramsAsSvg(rows);
  EXPECT_EQ(svg.rfind("<svg", 0), 0u);
  EXPECT_NE(svg.find("Row"), std::string::npos);
}

/// The whole way on a scene of four boxes.
class DatasetBuilding : public testing::Test {
 protected:
  void SetUp() override {
    test::WritePlainDataset(folder_.path() / "plain", test::kTwoLevels);
    options_.name = "made";
    options_.robot_folder = folder_.path() / "plain";
    options_.stances = 12;
    options_.same_floor = 2;
    options_.different_floors = 0;  // the deck is lower than a floor
    options_.postures = 3;
  }
  DatasetReport Make(const std::string& name) {
    std::filesystem::create_directories(folder_.path() / name);
    return BuildDataset(options_, folder_.path() / name, {});
  }

  test::TemporaryFolder folder_;
  DatasetOptions options_;
};

TEST_F(DatasetBuilding, GivesAProvenDatasetWhateverTheThreads) {
  const std::string hash = Make("one").content_hash;
  options_.threads = 2;
  EXPECT_EQ(Make("two").content_hash, hash);
  const auto dataset = Dataset::Load(folder_.path() / "one");
  EXPECT_EQ(dataset->problems(Task::kPosture).size(), 3u);
  EXPECT_EQ(dataset->problems(Task::kMotion).size(), 2u);
  Judge judge(dataset);
  const SolutionFile solutions = ReadSolutions(folder_.path() / "one" / "solutions-posture.json");
  ASSERT_EQ(solutions.problems.size(), 3u);
  for (const SolvedProblem& solved : solutions.problems) {
    const Evaluation evaluation = judge.Evaluate(Task::kPosture, dataset->problem(Task::kPosture, solved.definition.id),
                                                 solved.solutions.front().waypoints);
    EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
  }
  for (const char* file : {"plans.csv", "features.csv", "histograms.svg", "solutions-posture.json"}) {
    EXPECT_EQ(test::ReadText(folder_.path() / "one" / file), test::ReadText(folder_.path() / "two" / file)) << file;
  }
}

TEST_F(DatasetBuilding, GoesOnWithStagesThatAreDone) {
  const std::string hash = Make("one").content_hash;
  std::filesystem::create_directories(folder_.path() / "two");
  std::filesystem::copy_file(folder_.path() / "one" / "stances.json", folder_.path() / "two" / "stances.json");
  const DatasetReport report = Make("two");
  EXPECT_EQ(report.content_hash, hash);
  EXPECT_TRUE(report.tally.empty());  // nothing was sampled
}

TEST_F(DatasetBuilding, BadInputIsNamed) {
  options_.name = "two words";
  EXPECT_NE(test::MessageOf([&] { Make("a"); }).find("--name"), std::string::npos);
  options_.name = "made";
  options_.different_floors = 1;
  EXPECT_NE(test::MessageOf([&] { Make("b"); }).find("no two of them"), std::string::npos);
  options_.different_floors = 0;
  options_.postures = 5000;  // more than the plans have stances
  EXPECT_NE(test::MessageOf([&] { Make("c"); }).find("ask for fewer posture problems"), std::string::npos);
}

TEST_F(DatasetBuilding, MeshWithHolesOrInsideOutIsRefused) {
  const auto slab = [](bool hole, bool inverted) {
    std::string obj = "v -3 -3 -1\nv 3 -3 -1\nv 3 3 -1\nv -3 3 -1\nv -3 -3 0\nv 3 -3 0\nv 3 3 0\nv -3 3 0\n";
    for (const char* face : {"5 6 7", "5 7 8", "1 3 2", "1 4 3", "1 2 6", "1 6 5", "2 3 7", "2 7 6", "3 4 8", "3 8 7",
                             "4 1 5", hole ? "" : "4 5 8"}) {
      const std::string text = face;
      if (text.empty()) continue;
      obj += "f " + (inverted ? std::string(text.rbegin(), text.rend()) : text) + "\n";
    }
    return obj;
  };
  const auto refuse = [&](const std::string& name, const std::string& obj) {
    const auto plain = folder_.path() / name;
    std::filesystem::create_directories(plain);
    test::WriteText(plain / "slab.obj", obj);
    test::WritePlainDataset(plain, "objects:\n  - {name: slab, shape: mesh, file: slab.obj}\n");
    options_.robot_folder = plain;
    return test::MessageOf([&] { Make(name + "-out"); });
  };
  EXPECT_NE(refuse("hole", slab(true, false)).find("holes"), std::string::npos);
  EXPECT_NE(refuse("inverted", slab(false, true)).find("inside out"), std::string::npos);
}

}  // namespace
}  // namespace legopt
