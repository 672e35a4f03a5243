// Policy: what is unambiguous is found without a word; what is missing or ambiguous is named with the flag that
// decides.
#include "legopt/import/source_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/import/clone_folder.h"
#include "tests/problem/synthetic_dataset.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using test::MessageOf;
using testing::AllOf;
using testing::HasSubstr;

TEST(SourceLayout, OfACloneOfTheOriginalBenchmark) {
  const test::CloneFolder clone;
  test::WriteText(clone.path() / ".git" / "old.urdf", "hidden folders are not searched");
  const SourceLayout layout = FindSources(clone.path(), {});
  EXPECT_EQ(layout.robot.filename(), "tiny.zae");
  EXPECT_TRUE(layout.collada);
  EXPECT_EQ(layout.scene.filename(), "yard.stl");
  EXPECT_EQ(layout.posture.filename(), "problemsposture.json");
  EXPECT_EQ(layout.motion.filename(), "problemsmotion.json");
}

TEST(SourceLayout, OfLooseFilesAndOfADataset) {
  const test::TemporaryFolder folder;
  const test::SyntheticFolder dataset(folder.path() / "dataset");
  EXPECT_EQ(FindSources(dataset.path(), {}).scene.filename(), "scene.yaml");
  fs::remove(dataset.path() / "dataset.yaml");
  const SourceLayout layout = FindSources(dataset.path(), {});
  EXPECT_EQ(layout.robot.filename(), "robot.urdf");
  EXPECT_FALSE(layout.collada);
  EXPECT_EQ(layout.scene.filename(), "scene.yaml");
  EXPECT_EQ(layout.motion.filename(), "problems-motion.json");
}

TEST(SourceLayout, MissingAndAmbiguousFilesAreNamedWithTheFlag) {
  const test::CloneFolder clone;
  const auto error = [&](const SourceChoices& choices = {}) {
    return MessageOf([&] { FindSources(clone.path(), choices); });
  };
  EXPECT_THAT(MessageOf([&] { FindSources(clone.path() / "nowhere", {}); }), HasSubstr("does not exist"));
  EXPECT_THAT(error({"none.urdf", {}, {}, {}}), HasSubstr("none.urdf"));

  fs::copy(clone.path() / "data" / "problemsmotion.json", clone.path() / "data" / "problems-again.json");
  EXPECT_THAT(error(), AllOf(HasSubstr("problems-again.json"), HasSubstr("--motion")));
  EXPECT_EQ(FindSources(clone.path(), {{}, {}, {}, "data/problems-again.json"}).motion.filename(),
            "problems-again.json");
  fs::remove(clone.path() / "data" / "problems-again.json");

  fs::remove_all(clone.path() / "destruction_scenarios");  // a clone without --recursive
  EXPECT_THAT(error(), AllOf(HasSubstr("LegOptEnv.xml"), HasSubstr("yard.stl"), HasSubstr("submodule")));
  fs::remove(clone.path() / "LegOptEnv.xml");
  EXPECT_THAT(error(), AllOf(HasSubstr("scene"), HasSubstr("there is none"), HasSubstr("--scene")));

  fs::copy(clone.path() / "robots" / "tiny.zae", clone.path() / "robots" / "other.zae");
  EXPECT_THAT(error(), AllOf(HasSubstr("other.zae"), HasSubstr("tiny.zae"), HasSubstr("--robot")));
  fs::remove_all(clone.path() / "robots");
  EXPECT_THAT(error(), AllOf(HasSubstr("robot"), HasSubstr("there is none")));
}

}  // namespace
}  // namespace legopt
