// Policy: `import` only creates new folders and leaves nothing behind when it refuses. The example of
// docs/tutorials/my-robot.md works, command by command.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/exit_codes.h"
#include "bus/lcm_transport.h"
#include "client/report/result_source.h"
#include "program_run.h"
#include "terminal_run.h"
#include "tests/folders.h"
#include "tests/import/clone_folder.h"
#include "tests/import/walker.h"
#include "tests/temporary_folder.h"

namespace legopt::client {
namespace {

using app::ExitCode;

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

ProgramResult Import(const test::CloneFolder& clone, std::vector<std::string> more = {}) {
  std::vector<std::string> words = {"import", clone.path().string(), "--out", "made"};
  words.insert(words.end(), more.begin(), more.end());
  return RunLegopt(words, clone.path().parent_path());
}

/// Returns the entries of the clone's parent folder other than the clone.
std::vector<std::string> Made(const test::CloneFolder& clone) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(clone.path().parent_path())) {
    if (entry.path() != clone.path()) names.push_back(entry.path().filename());
  }
  return names;
}

TEST(ImportCommand, MakesADatasetOnceAndSaysWhatItFound) {
  const test::CloneFolder clone;
  const ProgramResult first = Import(clone);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, AllOf(HasSubstr("w first: 5 of 5"), HasSubstr("hovering"), HasSubstr("dataset ")))
      << "hovering feet are looked for, too";
  EXPECT_THAT(Made(clone), Contains("made"));
  const ProgramResult again = Import(clone);
  EXPECT_EQ(again.exit_code, kUsage);
  EXPECT_THAT(again.err, HasSubstr("exists already"));
  const ProgramResult checked = RunLegopt({"dataset", "check", "made"}, clone.path().parent_path());
  EXPECT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("trunk in collision"));
}

TEST(ImportCommand, AsksAtATerminalForContactsThatAreNotClear) {
  if (!HasTerminals()) GTEST_SKIP() << "no pseudo-terminal can be opened here; mount /dev/pts";
  const test::TemporaryFolder folder;
  test::Walker walker;
  for (const auto& [name, y] : {std::pair("handl", "0.4"), std::pair("handr", "-0.4")}) {
    walker.more +=
        test::Link(name, 0.5, 0.0, "<origin xyz='0 0 -0.45'/><geometry><box size='0.02 0.02 0.9'/></geometry>") +
        test::Joint(std::string(name) + "_joint", "trunk", name, std::string("0 ") + y + " 0.1", "0 1 0",
                    "lower='-1' upper='1'");
  }
  fs::create_directory(folder.path() / "in");
  std::ofstream(folder.path() / "in" / "robot.urdf") << walker.Urdf();
  const auto import = [&](const std::string& typed) {
    return RunInTerminal(BuiltProgram("legopt"), {"import", "in", "--out", "made"}, folder.path(), {}, {}, typed);
  };
  const ProgramResult none = import("\n");
  EXPECT_EQ(none.exit_code, kUsage);
  EXPECT_THAT(none.out, AllOf(HasSubstr("1  handl"), HasSubstr("3  l_foot"), HasSubstr("not clear")));
  const ProgramResult answered = import("3, r_foot\n");
  EXPECT_EQ(answered.exit_code, 0) << answered.out;
  EXPECT_TRUE(fs::exists(folder.path() / "made" / "dataset.yaml"));
}

TEST(ImportCommand, AsJson) {
  const test::CloneFolder clone;
  const ProgramResult result = Import(clone, {"--format", "json", "--name", "yard"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report.at("written"), true);
  EXPECT_EQ(report.at("hash").get<std::string>().size(), 64U);
  for (const auto& finding : report.at("findings")) {
    EXPECT_THAT((std::vector<std::string>{"info", "warning"}), Contains(finding.at("severity")));
    EXPECT_FALSE(finding.at("check").get<std::string>().empty());
  }
}

TEST(ImportCommand, DrawsTheRobotAndNamesTheDatasetByItsFolder) {
  const test::CloneFolder clone;
  const ProgramResult result = RunLegopt({"import", clone.path().string(), "--out", "robot v2.5", "--format", "json"},
                                         clone.path().parent_path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("standing").at("stands"), true);
  const fs::path dataset = clone.path().parent_path() / "robot v2.5";
  std::ifstream picture(dataset / "robot.png", std::ios::binary);
  std::string head(4, '\0');
  picture.read(head.data(), 4);
  EXPECT_EQ(head, "\x89PNG");
  const ProgramResult info = RunLegopt({"dataset", "info", dataset.string()}, clone.path().parent_path());
  EXPECT_THAT(info.out, HasSubstr("robot-v2-5"));
}

TEST(ImportCommand, BadInputIsNamedAndNothingIsLeft) {
  const test::CloneFolder clone;
  const auto error = [&](const std::vector<std::string>& more) {
    const ProgramResult result = Import(clone, more);
    EXPECT_EQ(result.exit_code, kUsage) << result.err;
    EXPECT_TRUE(Made(clone).empty());
    EXPECT_THAT(result.err, Not(HasSubstr(".partial")));
    return result.err;
  };
  EXPECT_THAT(error({"--feet", "l_fot,r_foot"}), HasSubstr("did you mean 'l_foot'"));
  EXPECT_THAT(error({"--contacts", "99"}), AllOf(HasSubstr("99"), HasSubstr("1 ")));
  EXPECT_THAT(error({"--mesh-path", "nowhere"}), AllOf(HasSubstr("--mesh-path"), HasSubstr("nowhere")));
  EXPECT_THAT(error({"--scene", "nowhere.stl"}), HasSubstr("nowhere.stl"));
  EXPECT_THAT(error({"--nominal", "l_hip"}), AllOf(HasSubstr("--nominal"), HasSubstr("JOINT=RADIANS")));
  EXPECT_THAT(error({"--nominal", "l_hop=0.1"}), HasSubstr("l_hip"));
  EXPECT_THAT(error({"--name", "a b"}), HasSubstr("--name"));
  EXPECT_THAT(error({"--sole-offset", "-1"}), HasSubstr("--sole-offset"));
  EXPECT_EQ(RunLegopt({"import", "nowhere", "--out", "made"}, clone.path().parent_path()).exit_code, kUsage);
  EXPECT_TRUE(Made(clone).empty());
}

// A copy of the embedded small dataset to be corrupted.
class CorruptedDataset : public testing::Test {
 protected:
  CorruptedDataset() { fs::copy(SourceFolder() + "/data/garage-small", dataset_); }
  ProgramResult Run(std::vector<std::string> words) const {
    words.push_back(dataset_.string());
    return RunLegopt(words, folder_.path());
  }

  test::TemporaryFolder folder_;
  fs::path dataset_ = folder_.path() / "dataset";
};

TEST_F(CorruptedDataset, ABrokenLinkEndsCommandsWithWords) {
  std::string mass = "<mass value=\"14.2529\"/>";
  for (const char* text : {"14,2", "${m}", "x %n%n%n", "%s%s%s%s%s%s"}) {
    const std::string broken = "<mass value=\"" + std::string(text) + "\"/>";
    test::ReplaceInFile(dataset_ / "robot.urdf", mass, broken);
    mass = broken;
    for (const ProgramResult& result :
         {Run({"dataset", "hash"}), Run({"import", "--nominal", "l_arm_elx=0.1", "--out", "made"})}) {
      EXPECT_EQ(result.exit_code, kUsage) << result.err;
      EXPECT_THAT(result.err,
                  AllOf(HasSubstr("robot.urdf"), HasSubstr("link 'pelvis'"), HasSubstr("mass"), HasSubstr(text)));
    }
  }
}

TEST_F(CorruptedDataset, UnitsThatAreMixedUpAreSaidBeforeARun) {
  test::ReplaceInFile(dataset_ / "scene.yaml", "objects:\n",
                      "objects:\n  - {name: wide, shape: box, size: [6000, 1, 1], position: [0, 0, -9]}\n");
  ASSERT_EQ(Run({"dataset", "hash"}).exit_code, 0);
  const ProgramResult result = Run({"submit", "--dry-run", "quick", "--dataset"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("legopt: warning: "), HasSubstr("6000 x"), HasSubstr("millimetres")));
  EXPECT_THAT(Run({"dataset", "check"}).out, AllOf(HasSubstr("6000 x"), HasSubstr("millimetres")));
}

TEST(ImportCommand, AMeshWithHolesIsAFindingAndNoDatasetIsMade) {
  const test::CloneFolder clone;
  const fs::path mesh = clone.path() / "destruction_scenarios" / "worlds" / "yard.stl";
  std::string text = test::ReadText(mesh);
  text.erase(text.find(" facet"), text.find("endfacet") + 9 - text.find(" facet"));
  test::WriteText(mesh, text);
  const ProgramResult result = Import(clone);
  EXPECT_EQ(result.exit_code, kUsage);
  EXPECT_THAT(result.out, AllOf(HasSubstr("FAIL"), HasSubstr("holes"), HasSubstr("scene.stl"), HasSubstr("3 of ")));
  EXPECT_THAT(result.err, HasSubstr("no dataset was made"));
  EXPECT_TRUE(Made(clone).empty());
}

/// Returns the commands of docs/tutorials/my-robot.md: lines indented by four columns that begin with "legopt", joined
/// at backslashes.
std::vector<std::vector<std::string>> DocumentedCommands() {
  std::ifstream document(fs::path(SourceFolder()) / "docs" / "tutorials" / "my-robot.md");
  std::vector<std::vector<std::string>> commands;
  bool joined = false;
  for (std::string line; std::getline(document, line);) {
    if (!joined && !line.starts_with("    legopt ")) continue;
    if (!joined) commands.emplace_back();
    std::istringstream words(line.substr(0, line.find('#')));
    joined = false;
    for (std::string word; words >> word;) {
      if (word == "\\") {
        joined = true;
      } else {
        commands.back().push_back(word);
      }
    }
  }
  return commands;
}

TEST(BringYourOwn, TheDocumentedExampleWorksFromFilesToTable) {
  for (const char* program : {"legopt-server", "legopt-worker"}) {
    if (!fs::exists(BuiltProgram(program))) GTEST_SKIP() << program << " is not built";
  }
  if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
  const test::TemporaryFolder folder;
  fs::create_directory_symlink(fs::path(SourceFolder()) / "data", folder.path() / "data");
  const auto commands = DocumentedCommands();
  ASSERT_GE(commands.size(), 5U);
  std::string table;
  for (std::vector<std::string> words : commands) {
    words.erase(words.begin());  // "legopt"
    const ProgramResult result = RunLegopt(words, folder.path());
    ASSERT_EQ(result.exit_code, 0) << testing::PrintToString(words) << result.err;
    if (words.front() == "table") table = result.out;
  }
  EXPECT_THAT(table, AllOf(HasSubstr("my-biped"), HasSubstr("SQP")));
  const auto solved = [&](const std::string& task) {
    return OpenResults({(folder.path() / "biped.sqlite").string(), {}})
        ->Query("SELECT count(DISTINCT problem_id) AS n FROM job_list WHERE verdict_strict = 'success' AND task = '" +
                task + "'")
        .At(0, "n")
        .get<int>();
  };
  EXPECT_GE(solved("posture"), 6);  // the problem under the shelf is hard
  EXPECT_EQ(solved("motion"), 2);
}

}  // namespace
}  // namespace legopt::client
