#include "legopt/worldgen/internal/scenario.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "legopt/dataset/internal/text_file.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "tests/dataset/test_data.h"

namespace legopt::worldgen {
namespace {

TEST(Scenario, WordsOfKindAndLevel) {
  EXPECT_EQ(ParseScenarioLevel("hard"), ScenarioLevel::kHard);
  EXPECT_EQ(ParseBuildingKind("house"), BuildingKind::kHouse);
  EXPECT_NE(test::MessageOf([] { ParseScenarioLevel("easyer"); }).find("easier"), std::string::npos);
  EXPECT_NE(test::MessageOf([] { ParseBuildingKind("garag"); }).find("garage"), std::string::npos);
}

TEST(Scenario, SameSeedSameBytesOtherSeedOtherBuilding) {
  ScenarioOptions options;
  options.kind = BuildingKind::kHouse;
  options.collapse.snapshots_s = {0.15};
  const test::TemporaryFolder folder;
  const auto write = [&](const char* name) {
    std::filesystem::create_directories(folder.path() / name);
    const Scenario scenario = MakeScenario(options, {});
    WriteScenario(scenario, folder.path() / name, false);
    return test::ReadText(folder.path() / name / kSceneMeshName) +
           test::ReadText(folder.path() / name / kScenarioFileName);
  };
  const std::string first = write("a");
  EXPECT_EQ(first, write("b"));
  options.seed = 2;
  EXPECT_NE(first, write("c"));
}

TEST(Scenario, SolverSeesOneSolidPerPieceOfTheMesh) {
  ScenarioOptions options;
  options.kind = BuildingKind::kGarage;
  options.collapse.snapshots_s = {0.3};
  const Scenario scenario = MakeScenario(options, {});
  const TriangleMesh mesh = MeshOf(scenario.pieces);
  EXPECT_TRUE(FindMeshFaults(mesh).none());
  const auto solids = SolidsOfMesh(mesh, {});
  // Undamaged coplanar plates may be joined; nothing may be decomposed approximately into more solids.
  EXPECT_LE(solids.size(), scenario.pieces.size());
  EXPECT_GT(solids.size(), scenario.pieces.size() / 2);
  EXPECT_LT(scenario.pieces.size(), 1500u);
}

TEST(Scenario, ManifestNamesEveryFileWithItsHash) {
  ScenarioOptions options;
  options.kind = BuildingKind::kHouse;
  options.collapse.snapshots_s = {0.05};
  const test::TemporaryFolder folder;
  WriteScenario(MakeScenario(options, {}), folder.path(), true);
  const auto manifest = nlohmann::json::parse(test::ReadText(folder.path() / kScenarioFileName));
  EXPECT_EQ(manifest["kind"], "house");
  EXPECT_EQ(manifest["files"].size(), 6u);  // mesh, members, four pictures
  for (const auto& [file, hash] : manifest["files"].items()) {
    EXPECT_TRUE(std::filesystem::exists(folder.path() / file));
    EXPECT_EQ(hash.get<std::string>().size(), 64u);
  }
  const double share = manifest["difficulty"]["walkable_share"];
  EXPECT_GT(share, 0.5);
  EXPECT_LT(share, 1.05);  // removed walls add a little ground
}

TEST(StagedFolder, HasOneMaker) {
  const test::TemporaryFolder folder;
  const auto out = folder.path() / "out";
  {
    const StagedFolder first(out, "a", Unfinished::kKept);
    EXPECT_NE(test::MessageOf([&] { StagedFolder other(out, "a", Unfinished::kKept); }).find(" is making it"),
              std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "out.partial.lock"));
}

TEST(StagedFolder, FilesOfAnEarlierProcessAreRemovedIfNothingContinuesThem) {
  const test::TemporaryFolder folder;
  const auto out = folder.path() / "out";
  {
    const StagedFolder killed(out, "a", Unfinished::kRemoved);
    test::WriteText(killed.path() / "stale", "1");
  }
  StagedFolder again(out, "a", Unfinished::kRemoved);
  again.Finish();
  EXPECT_TRUE(std::filesystem::is_empty(out));
}

// A folder of that name made meanwhile is not replaced, even if it is empty.
TEST(StagedFolder, ANameTakenMeanwhileIsLeftAlone) {
  const test::TemporaryFolder folder;
  const auto out = folder.path() / "out";
  StagedFolder made(out, "a", Unfinished::kKept);
  std::filesystem::create_directory(out);
  EXPECT_NE(test::MessageOf([&] { made.Finish(); }).find("exists by now"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(out));
}

TEST(StagedFolder, NothingIsOverwrittenAndUnfinishedWorkIsKept) {
  const test::TemporaryFolder folder;
  const auto out = folder.path() / "out";
  {
    StagedFolder first(out, "a", Unfinished::kKept);
    test::WriteText(first.path() / "stage", "1");
  }
  EXPECT_NE(test::MessageOf([&] { StagedFolder other(out, "b", Unfinished::kKept); }).find("other parameters"),
            std::string::npos);
  StagedFolder again(out, "a", Unfinished::kKept);
  EXPECT_EQ(test::ReadText(again.path() / "stage"), "1");
  again.Finish();
  EXPECT_TRUE(std::filesystem::exists(out / "stage"));
  EXPECT_NE(test::MessageOf([&] { StagedFolder third(out, "a", Unfinished::kKept); }).find("exists"),
            std::string::npos);
}

}  // namespace
}  // namespace legopt::worldgen
