#include "legopt/dataset/dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/math/blake2b.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using test::ReadText;
using test::ReplaceInFile;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class DatasetTest : public testing::Test {
 protected:
  DatasetTest() { test::SyntheticFolder{folder_.path()}; }
  std::shared_ptr<const Dataset> Load() { return Dataset::Load(folder_.path()); }
  test::TemporaryFolder folder_;
};

TEST_F(DatasetTest, ReadsEverything) {
  const auto dataset = Load();
  EXPECT_EQ(dataset->name(), "tiny");
  EXPECT_EQ(dataset->folder(), fs::weakly_canonical(folder_.path()));
  EXPECT_EQ(dataset->robot().num_dofs(), test::kSyntheticDofs);
  EXPECT_EQ(dataset->scene().objects.size(), 3u);
  EXPECT_EQ(dataset->problems(Task::kPosture).size(), 2u);
  EXPECT_EQ(dataset->problem(Task::kPosture, 7).id, 7);
  EXPECT_EQ(dataset->problem(Task::kMotion, 0).stances.size(), 3u);
  EXPECT_EQ(dataset->gravity_m_s2(), 9.797930195020351);
  EXPECT_EQ(dataset->contacts()[0].link_height_m(), test::kSyntheticSoleOffset_m);
  ASSERT_EQ(dataset->contacts().size(), 2u);
  EXPECT_EQ(dataset->contacts()[1].link, "r_foot");
  EXPECT_EQ(dataset->contacts()[1].link_index, dataset->robot().FindLink("r_foot"));
  EXPECT_NEAR(dataset->contacts()[0].box_L.min().z(), -0.05, 1e-15);
  EXPECT_NEAR(dataset->contacts()[0].box_L.max().x(), 0.13, 1e-15);
  EXPECT_EQ(dataset->nominal_joints()[test::kLeftHip], -0.3);
  EXPECT_EQ(dataset->nominal_joints()[test::kNeck], 0.1) << "clamped to its limit";
  EXPECT_EQ(dataset->self_collision_reference()[test::kSyntheticDofs + 3], 1);
  EXPECT_NEAR(dataset->nominal_sole_height_m(), -0.5 * std::cos(0.3) - 0.05, 1e-12);
  EXPECT_THAT(dataset->content_hash(), MatchesRegex("[0-9a-f]{64}"));
}

TEST_F(DatasetTest, FootTargetIsRaisedAlongTheNormal) {
  const auto dataset = Load();
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  const Eigen::Isometry3d target = dataset->LinkTarget({.contact = "l_foot", .position = {1, 2, 3}, .rotation = tilt});
  const Eigen::Vector3d expected(1, 2 - 0.051 * std::sin(0.5), 3 + 0.051 * std::cos(0.5));
  EXPECT_NEAR((target.translation() - expected).norm(), 0, 1e-15);
  EXPECT_NEAR((target.linear() - tilt.toRotationMatrix()).norm(), 0, 1e-15);
}

TEST_F(DatasetTest, CollisionModelIsBuiltOnceAlsoByManyThreads) {
  const auto dataset = Load();
  std::vector<const CollisionModel*> models(4);
  std::vector<std::thread> threads;
  for (auto& model : models) threads.emplace_back([&] { model = dataset->collision_model().get(); });
  for (std::thread& thread : threads) thread.join();
  for (const CollisionModel* model : models) EXPECT_EQ(model, models[0]);
  ASSERT_NE(models[0], nullptr);
  EXPECT_EQ(models[0]->num_links(), static_cast<int>(dataset->robot().links().size()));
}

TEST_F(DatasetTest, MeshesAreReadUnderItsGuardNowAndLater) {
  int calls = 0;
  bool fail = false;
  const ReadGuard guard = [&](const std::function<std::string()>& read, const ReadLimits&) {
    ++calls;
    if (fail) throw GuardedReadError("it is tired");
    return read();
  };
  const auto dataset = Dataset::Load(folder_.path(), guard);
  EXPECT_EQ(calls, 1) << "the rock";
  EXPECT_EQ(dataset->content_hash(), Load()->content_hash());
  dataset->collision_model();
  EXPECT_EQ(calls, 2);
  fail = true;
  EXPECT_THAT(test::MessageOf([&] { dataset->collision_model(SceneRepresentation::kSurface); }),
              HasSubstr("meshes/rock.obj: "));
  EXPECT_THAT(test::MessageOf([&] { Dataset::Load(folder_.path(), guard); }), HasSubstr("meshes/rock.obj: "));
}

TEST_F(DatasetTest, EachRepresentationOfTheSceneHasItsOwnModel) {
  const auto dataset = Load();
  const CollisionModel* surface = dataset->collision_model(SceneRepresentation::kSurface).get();
  EXPECT_EQ(surface->scene_representation(), SceneRepresentation::kSurface);
  EXPECT_EQ(surface, dataset->collision_model(SceneRepresentation::kSurface).get());
  EXPECT_EQ(dataset->collision_model()->scene_representation(), SceneRepresentation::kSolid);
  EXPECT_EQ(surface->checked_pairs(), dataset->collision_model()->checked_pairs());
}

TEST_F(DatasetTest, ManifestListsEveryUsedFileOnce) {
  std::vector<std::string> paths;
  for (const FileHash& file : ComputeManifest(folder_.path())) {
    paths.push_back(file.path);
    EXPECT_EQ(file.hash, HashFile(folder_.path() / file.path));
  }
  EXPECT_THAT(paths, ElementsAre("meshes/rock.obj", "problems-motion.json", "problems-posture.json", "robot.urdf",
                                 "scene.yaml"));
}

TEST_F(DatasetTest, WritingHashesKeepsTheRestOfTheFile) {
  const fs::path file = folder_.path() / "dataset.yaml";
  const std::string once = ReadText(file);
  EXPECT_THAT(once, HasSubstr("# A dataset for tests.\n"));
  EXPECT_THAT(once, HasSubstr("# The end.\n"));
  WriteManifestHashes(folder_.path());
  EXPECT_EQ(ReadText(file), once);
  // If the block is missing, it is appended.
  const size_t begin = once.find("files:");
  test::WriteText(file, once.substr(0, begin));
  WriteManifestHashes(folder_.path());
  EXPECT_EQ(Load()->name(), "tiny");
}

TEST_F(DatasetTest, BlakeOfKnownBytes) {
  // BLAKE2b-256 of the empty string (RFC 7693 parameters, 32-byte digest).
  EXPECT_EQ(Blake2bHex(""), "0e5751c026e543b2e8ab2eb06099daa1d1e5df47778f7787faab45cdf12fe3a8");
}

TEST_F(DatasetTest, HashFollowsContentAndNothingElse) {
  const std::string hash = Load()->content_hash();
  EXPECT_EQ(Load()->content_hash(), hash);

  const test::TemporaryFolder elsewhere;
  fs::copy(folder_.path(), elsewhere.path() / "moved", fs::copy_options::recursive);
  ReplaceInFile(elsewhere.path() / "moved" / "dataset.yaml", "name: tiny", "name: other");
  EXPECT_EQ(Dataset::Load(elsewhere.path() / "moved")->content_hash(), hash);

  ReplaceInFile(folder_.path() / "dataset.yaml", "sole_offset_m: 0.051", "sole_offset_m: 0.0510");
  EXPECT_EQ(Load()->content_hash(), hash) << "the same number";
  ReplaceInFile(folder_.path() / "dataset.yaml", "sole_offset_m: 0.0510", "sole_offset_m: 0.052");
  EXPECT_NE(Load()->content_hash(), hash);
}

TEST_F(DatasetTest, HashChangesWithAnyByteOfAnyFile) {
  const std::string hash = Load()->content_hash();
  for (const FileHash& file : ComputeManifest(folder_.path())) {
    const fs::path path = folder_.path() / file.path;
    const std::string original = ReadText(path);
    test::WriteText(path, original + "\n");
    EXPECT_THROW(Load(), InputError) << file.path;
    WriteManifestHashes(folder_.path());
    EXPECT_NE(Load()->content_hash(), hash) << file.path;
    test::WriteText(path, original);
    WriteManifestHashes(folder_.path());
    EXPECT_EQ(Load()->content_hash(), hash) << file.path;
  }
}

}  // namespace
}  // namespace legopt
