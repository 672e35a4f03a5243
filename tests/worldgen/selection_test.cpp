#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/input_error.h"
#include "legopt/worldgen/dataset_builder.h"
#include "legopt/worldgen/internal/posture_selection.h"
#include "legopt/worldgen/internal/stance_probe.h"
#include "legopt/worldgen/internal/stance_sampler.h"
#include "tests/dataset/test_data.h"
#include "tests/worldgen/plain_dataset.h"

namespace legopt::worldgen {
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

TEST(Clusters, AreAsManyAsThereAreDifferentPoints) {
  std::vector<Vector3d> points;
  for (int k = 0; k < 40; ++k) points.emplace_back(k % 4, k % 2, 1.0);
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    EXPECT_EQ(ClusterPoints(points, 4, seed).size(), 4u) << seed;
    EXPECT_EQ(ClusterPoints(points, 6, seed).size(), 4u) << seed;
  }
}

/// Returns three groups of ten points: 0, 3, 6, ...; 1, 4, 7, ...; 2, 5, 8, ...
std::vector<Vector3d> ThreeGroups() {
  std::vector<Vector3d> points;
  for (int k = 0; k < 30; ++k) points.emplace_back(10.0 * (k % 3) + 0.01 * k, 0.0, 0.0);
  return points;
}

TEST(PostureSelection, TakesTheProvenMemberNearestToTheCentre) {
  const auto clusters = ClusterPoints(ThreeGroups(), 3, 4);
  const auto nearest_fails = [&](int, size_t cluster, int point) { return point != clusters[cluster].front(); };
  const std::vector<int> chosen = SelectProven(ThreeGroups(), 3, 4, 1, nearest_fails, {});
  ASSERT_EQ(chosen.size(), 3u);
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(chosen[c], clusters[c][1]);
}

TEST(PostureSelection, ClustersAgainWithoutAGroupThatHasNone) {
  const auto no_second_group = [](int, size_t, int point) { return point % 3 != 1; };
  std::vector<int> rounds;
  const auto count_rounds = [&rounds](int proven, int) { rounds.push_back(proven); };
  const std::vector<int> one = SelectProven(ThreeGroups(), 3, 4, 1, no_second_group, count_rounds);
  EXPECT_EQ(rounds, (std::vector<int>{2, 3}));
  ASSERT_EQ(one.size(), 3u);
  for (const int point : one) EXPECT_NE(point % 3, 1);
  EXPECT_EQ(std::set<int>(one.begin(), one.end()).size(), 3u);
  EXPECT_EQ(one, SelectProven(ThreeGroups(), 3, 4, 2, no_second_group, {}));
}

TEST(PostureSelection, EndsWhenThePointsRunOut) {
  const auto nothing = [](int, size_t, int) { return false; };
  const auto everything = [](int, size_t, int) { return true; };
  const auto error = [](const std::vector<Vector3d>& points, int count, const ProveMember& prove) {
    return test::MessageOf([&] { SelectProven(points, count, 1, 1, prove, {}); });
  };
  EXPECT_NE(error(ThreeGroups(), 3, nothing).find("ask for fewer"), std::string::npos);
  EXPECT_NE(error(ThreeGroups(), 31, everything).find("ask for fewer"), std::string::npos);
  const std::vector<Vector3d> same(8, Vector3d(0.3, 0.0, 1.0));
  EXPECT_NE(error(same, 2, everything).find("ask for fewer"), std::string::npos);
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

TEST(DatasetFile, NamesThatYamlWouldMisreadAreQuoted) {
  const test::TemporaryFolder folder;
  DatasetDescription written;
  written.name = "no";
  written.robot_file = "robots/my robot.urdf";
  written.scene_file = "scene.ply";
  written.problem_files[Task::kPosture] = "problems #1.json";
  written.contacts = DescribeSoles({"left: foot", "[right]", "7", "sole, \"back\""}, 0.01);
  written.nominal_posture = {{"knee: left", 0.5}, {"true", 0.25}};
  written.files = {{"robots/my robot.urdf", std::string(64, '0')}};
  test::WriteText(
      folder.path() / kDatasetFileName,
      FormatDatasetFile(written, "a test") + "files:\n  \"robots/my robot.urdf\": " + std::string(64, '0') + "\n");
  const DatasetDescription read = ReadDatasetFile(folder.path());
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.robot_file, written.robot_file);
  EXPECT_EQ(read.problem_files, written.problem_files);
  EXPECT_EQ(read.contacts, written.contacts);
  EXPECT_EQ(read.nominal_posture, written.nominal_posture);
}

/// Complete generation on a scene of four boxes.
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
  EXPECT_TRUE(report.tally.empty());  // no sampling was done
}

// Fewer plans are requested than an interrupted run had tried.
TEST_F(DatasetBuilding, GoesOnWithAnotherNumberOfPlansAsIfFromNothing) {
  Make("one");
  struct Interruption {};
  options_.same_floor = 9;
  std::filesystem::create_directories(folder_.path() / "two");
  const auto stop_after_plans = [](const std::string& stage, double, double, const std::string&) {
    if (stage == "postures") throw Interruption();
  };
  EXPECT_THROW(BuildDataset(options_, folder_.path() / "two", stop_after_plans), Interruption);
  ASSERT_TRUE(std::filesystem::exists(folder_.path() / "two" / "plans-same.json"));
  options_.same_floor = 2;
  BuildDataset(options_, folder_.path() / "two", {});
  for (const char* file : {"plans.csv", "problems-motion.json", "problems-posture.json", "features.csv"}) {
    EXPECT_EQ(test::ReadText(folder_.path() / "one" / file), test::ReadText(folder_.path() / "two" / file)) << file;
  }
}

// A user's scene with one floor needs no option.
TEST_F(DatasetBuilding, PlansAreOnOneFloorIfThereIsNoOther) {
  options_.different_floors.reset();
  options_.postures = 0;
  const DatasetReport report = Make("made");
  EXPECT_TRUE(report.one_floor);
  const std::filesystem::path made = folder_.path() / "made";
  EXPECT_EQ(Dataset::Load(made)->problems(Task::kMotion).size(), 2U + DatasetOptions::kDifferentFloors);
  EXPECT_NE(test::ReadText(made / "generation.json").find("\"different_floors\": 0"), std::string::npos);
}

TEST_F(DatasetBuilding, ItsNameChangesNoResult) {
  const std::string hash = Make("one").content_hash;
  options_.name = "another";
  EXPECT_EQ(Make("two").content_hash, hash);
}

TEST_F(DatasetBuilding, ASceneOfKilometresIsRefused) {
  const auto source = options_.robot_folder;
  test::WriteText(source / "scene.yaml",
                  "objects:\n  - {name: plain, shape: box, size: [6000, 6000, 1], position: [0, 0, -0.5]}\n");
  WriteManifestHashes(source);
  const auto dataset = Dataset::Load(source);
  const std::string refusal = test::MessageOf([&] { CheckSource(dataset, options_.ProbeFor(*dataset), true); });
  EXPECT_NE(refusal.find("6000 m x 6000 m"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("millimetres"), std::string::npos) << refusal;
}

// Errors are reported before a folder is created, in terms of the user's input.
TEST_F(DatasetBuilding, TheSourceIsCheckedFirst) {
  const auto source = options_.robot_folder;
  const auto refusal = [&](const auto& change) {
    DatasetOptions options = options_;
    change(options);
    return test::MessageOf([&] {
      const auto dataset = Dataset::Load(source);
      CheckSource(dataset, options.ProbeFor(*dataset), true);
    });
  };
  const auto sound = Dataset::Load(source);
  EXPECT_NO_THROW(CheckSource(sound, options_.ProbeFor(*sound), true));
  EXPECT_NE(refusal([](DatasetOptions& o) { o.radius_m = std::nan(""); }).find("--radius: must be a finite"),
            std::string::npos);
  EXPECT_NE(refusal([](DatasetOptions& o) { o.radius_m = 5.0; }).find("--radius: exceeds the robot's reach"),
            std::string::npos);
  EXPECT_NE(refusal([](DatasetOptions& o) { o.slope_rad = 2.0; }).find("--slope"), std::string::npos);

  DatasetDescription description = ReadDatasetFile(source);
  std::swap(description.contacts.at(0), description.contacts.at(1));
  test::WriteText(source / kDatasetFileName, FormatDatasetFile(description, "for tests"));
  WriteManifestHashes(source);
  const std::string crossed = refusal([](DatasetOptions&) {});
  EXPECT_NE(crossed.find("name the left foot first: feet: [l_foot, r_foot]"), std::string::npos) << crossed;
  EXPECT_NE(crossed.find((source / kDatasetFileName).string()), std::string::npos) << crossed;
  EXPECT_THROW(Make("crossed"), InputError);

  std::swap(description.contacts.at(0), description.contacts.at(1));
  test::WriteText(source / kDatasetFileName, FormatDatasetFile(description, "for tests"));
  test::WriteText(source / "scene.yaml",
                  "objects:\n  - {name: wall, shape: box, size: [1, 1, 1], rpy: [0.7, 0.6, 0]}\n");
  WriteManifestHashes(source);
  const std::string steep = refusal([](DatasetOptions&) {});
  EXPECT_NE(steep.find("no walkable ground"), std::string::npos) << steep;
}

TEST_F(DatasetBuilding, CandidatesAreCheckedElsewhereAndProvenOnesUsed) {
  const auto candidates_folder = folder_.path() / "candidates";
  std::filesystem::create_directories(candidates_folder);
  const DatasetReport report = BuildCandidates(options_, candidates_folder, {});
  const auto candidates = Dataset::Load(candidates_folder);
  EXPECT_EQ(report.content_hash, candidates->content_hash());
  ASSERT_EQ(candidates->problems(Task::kPosture).size(), 12u);
  EXPECT_TRUE(candidates->problems(Task::kMotion).empty());
  const auto record = nlohmann::json::parse(test::ReadText(candidates_folder / "generation.json"));
  EXPECT_EQ(record.at("stances"), 12);
  EXPECT_EQ(record.at("postures"), 0) << "none was asked for";

  // The check, computed by hand. One solution is corrupted but called a success; one problem has no solution.
  PostureProver prover(candidates);
  SolutionFile solutions{"", "", Task::kPosture, {}};
  std::vector<Stance> proven;
  for (const ProblemDefinition& problem : candidates->problems(Task::kPosture)) {
    const PostureProof proof = prover.Prove(problem.stances.front(), problem.id);
    Solution solution{"SQP", 0.1, {proof.x}, true, "good"};
    if (problem.id == 3) solution.waypoints.front()[9] += 0.5;
    solutions.problems.push_back({problem, {}});
    if (problem.id == 5) continue;
    solutions.problems.back().solutions.push_back(solution);
    if (proof.accepted && problem.id != 3) proven.push_back(problem.stances.front());
  }
  ASSERT_GE(proven.size(), 5u);
  const auto file = folder_.path() / "proven.json";
  WriteSolutions(file, solutions);
  EXPECT_EQ(ReadFeasibleStances(candidates, file), proven);

  options_.proven = file;
  Make("one");
  EXPECT_EQ(ReadProblemFile(folder_.path() / "one" / "stances.json").problems.size(), proven.size());
  EXPECT_FALSE(nlohmann::json::parse(test::ReadText(folder_.path() / "one" / "generation.json")).contains("stances"));

  for (SolvedProblem& problem : solutions.problems) problem.solutions.clear();
  WriteSolutions(file, solutions);
  EXPECT_NE(test::MessageOf([&] { Make("two"); }).find("no stance has a solution that the judge accepts"),
            std::string::npos);
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
}  // namespace legopt::worldgen
