// Policy: unambiguous files are found without a message; missing or ambiguous ones are reported with the flag that
// selects them.
#include "legopt/import/internal/source_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/dataset/synthetic_dataset.h"
#include "tests/import/clone_folder.h"

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
  EXPECT_EQ(layout.problems[Task::kPosture].filename(), "problemsposture.json");
  EXPECT_EQ(layout.problems[Task::kMotion].filename(), "problemsmotion.json");
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
  EXPECT_EQ(layout.problems[Task::kMotion].filename(), "problems-motion.json");
}

TEST(SourceLayout, OfARobotsFileIsTheRobotAlone) {
  const test::TemporaryFolder folder;
  const test::SyntheticFolder dataset(folder.path() / "dataset");
  const fs::path robot = dataset.path() / "robot.urdf";
  const SourceLayout layout = FindSources(robot, {});
  EXPECT_EQ(layout.robot.filename(), "robot.urdf");
  EXPECT_EQ(layout.folder, fs::weakly_canonical(dataset.path()));
  EXPECT_TRUE(layout.scene.empty());
  for (const fs::path& problems : layout.problems) EXPECT_TRUE(problems.empty());
  const fs::path link = folder.path() / "link.urdf";
  fs::create_symlink(robot, link);  // its meshes are searched beside the link
  EXPECT_EQ(FindSources(link, {}).folder, fs::weakly_canonical(folder.path()));
  const SourceLayout chosen = FindSources(robot, {.robot = {}, .scene = "scene.yaml"});
  EXPECT_EQ(chosen.scene.filename(), "scene.yaml");
  EXPECT_THAT(MessageOf([&] { FindSources(robot, {.robot = "robot.urdf", .scene = {}}); }), HasSubstr("second robot"));
  EXPECT_THAT(MessageOf([&] { FindSources(dataset.path() / "scene.yaml", {}); }), HasSubstr("is not a robot"));
}

TEST(SourceLayout, MissingAndAmbiguousFilesAreNamedWithTheFlag) {
  const test::CloneFolder clone;
  const auto error = [&](const SourceChoices& choices = {}) {
    return MessageOf([&] { FindSources(clone.path(), choices); });
  };
  EXPECT_THAT(MessageOf([&] { FindSources(clone.path() / "nowhere", {}); }), HasSubstr("does not exist"));
  EXPECT_THAT(error({"none.urdf", {}, {}}), HasSubstr("none.urdf"));

  fs::copy(clone.path() / "data" / "problemsmotion.json", clone.path() / "data" / "problems-again.json");
  EXPECT_THAT(error(), AllOf(HasSubstr("problems-again.json"), HasSubstr("--motion")));
  SourceChoices again;
  again.problems[Task::kMotion] = "data/problems-again.json";
  EXPECT_EQ(FindSources(clone.path(), again).problems[Task::kMotion].filename(), "problems-again.json");
  fs::remove(clone.path() / "data" / "problems-again.json");

  fs::remove_all(clone.path() / "destruction_scenarios");  // a clone without --recursive
  EXPECT_THAT(error(), AllOf(HasSubstr("LegOptEnv.xml"), HasSubstr("yard.stl"), HasSubstr("submodule")));
  fs::remove(clone.path() / "LegOptEnv.xml");
  EXPECT_EQ(FindSources(clone.path(), {}).scene, fs::path()) << "level ground";
  // Of the meshes beside a URDF, those that it names are its own; a scene's name may end like one of theirs.
  fs::create_directories(clone.path() / "loose");
  test::WriteText(clone.path() / "loose" / "r.urdf",
                  "<robot name='r'><link name='a'><collision><geometry><mesh filename='./step_floor.obj'/></geometry>"
                  "</collision></link></robot>");
  test::WriteText(clone.path() / "loose" / "step_floor.obj", "v 0 0 0");
  EXPECT_EQ(FindSources(clone.path() / "loose", {}).scene, fs::path());
  test::WriteText(clone.path() / "loose" / "floor.obj", "v 0 0 0");
  EXPECT_EQ(FindSources(clone.path() / "loose", {}).scene.filename(), "floor.obj");
  fs::remove_all(clone.path() / "loose");

  fs::copy(clone.path() / "robots" / "tiny.zae", clone.path() / "robots" / "other.zae");
  EXPECT_THAT(error(), AllOf(HasSubstr("other.zae"), HasSubstr("tiny.zae"), HasSubstr("--robot")));
  fs::remove_all(clone.path() / "robots");
  EXPECT_THAT(error(), AllOf(HasSubstr("robot"), HasSubstr("there is none")));
}

// Drops root's rights, since root may read everything: acts as the user nobody.
class DroppedPrivileges {
 public:
  DroppedPrivileges() : changed_(::geteuid() == 0 && ::seteuid(kNobody) == 0) {}
  ~DroppedPrivileges() {
    if (changed_ && ::seteuid(0) != 0) std::abort();
  }
  DroppedPrivileges(const DroppedPrivileges&) = delete;
  DroppedPrivileges& operator=(const DroppedPrivileges&) = delete;

 private:
  static constexpr uid_t kNobody = 65534;
  bool changed_;
};

TEST(SourceLayout, WhatCannotBeReadIsNamed) {
  constexpr fs::perms kOthersRead = fs::perms::group_read | fs::perms::others_read;
  constexpr fs::perms kOthersEnter = fs::perms::group_exec | fs::perms::others_exec;
  const test::CloneFolder clone;
  const fs::path secret = clone.path() / "secret";
  test::WriteText(secret / "robot.urdf", "<robot/>");
  for (const fs::path& folder : {clone.path(), clone.path().parent_path()}) {
    fs::permissions(folder, fs::perms::owner_all | kOthersRead | kOthersEnter);
  }
  // A folder that cannot be listed, and one that can be listed but not entered.
  for (const fs::perms perms : {fs::perms::none, fs::perms::owner_read | kOthersRead}) {
    fs::permissions(secret, perms);
    std::string error;
    {
      const DroppedPrivileges nobody;
      std::error_code error_code;
      const bool outside = !fs::exists(clone.path() / "LegOptEnv.xml", error_code);
      if (outside || std::ifstream(secret / "robot.urdf").good()) {
        GTEST_SKIP() << "this user reads what is forbidden, or cannot look from without";
      }
      error = MessageOf([&] { FindSources(clone.path(), {}); });
    }
    EXPECT_THAT(error, AllOf(HasSubstr(secret.string()), HasSubstr("cannot be read"), HasSubstr("allow")));
  }
  fs::permissions(secret, fs::perms::owner_all);
}

}  // namespace
}  // namespace legopt
