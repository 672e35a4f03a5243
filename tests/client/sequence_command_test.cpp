// `legopt dataset import-sequence` and `export-sequence`: bad input is one error with exit code 2, and leaves no file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "app/exit_codes.h"
#include "command_line_fixture.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using app::ExitCode;
using testing::AllOf;
using testing::HasSubstr;

class SequenceCommands : public CommandLine {
 protected:
  ProgramResult Export(int problem, const std::string& task, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {
        "dataset", "export-sequence", std::to_string(problem), "--task", task, "--dataset",
        dataset_,  "--out",           File("sequence.xml")};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }
  ProgramResult Import(std::vector<std::string> more) {
    std::vector<std::string> words = {"dataset", "import-sequence", "--dataset", dataset_, "--out", File("made.json")};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }
  std::string File(const std::string& name) { return (folder_.path() / name).string(); }
  nlohmann::json Problems(const std::string& file) { return nlohmann::json::parse(test::ReadText(file))["problems"]; }

  /// Expects that the exported sequence, with an expression replaced, is refused and makes no file.
  void ExpectRefused(const std::string& from, const std::string& to, const std::string& words) {
    const std::string text = std::regex_replace(test::ReadText(File("sequence.xml")), std::regex(from), to);
    ExpectError(Import({Write("bad.xml", text)}), static_cast<int>(ExitCode::kUsage), words);
    EXPECT_FALSE(std::filesystem::exists(File("made.json")));
  }

  const std::string dataset_ = SourceFolder() + "/data/contacts-humanoid";
};

TEST_F(SequenceCommands, ExportAndImportGiveTheSameProblem) {
  ASSERT_EQ(Export(3, "motion").exit_code, 0);
  const ProgramResult imported = Import({File("sequence.xml")});
  ASSERT_EQ(imported.exit_code, 0) << imported.err;
  EXPECT_THAT(imported.err, HasSubstr("motion problem 0: "));
  EXPECT_EQ(Problems(File("made.json"))[0]["definition"],
            Problems(dataset_ + "/problems-motion.json")[3]["definition"]);
}

TEST_F(SequenceCommands, ExportsTheConfigurationsOfASolution) {
  const ProgramResult exported = Export(0, "motion", {"--solutions", dataset_ + "/solutions-motion.json"});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_THAT(test::ReadText(File("sequence.xml")), testing::Not(HasSubstr("<rows>0</rows>")));
  ExpectError(Export(0, "motion", {"--solutions", dataset_ + "/solutions-posture.json"}), 2,
              "the solutions are postures");
  ExpectError(Export(0, "motion", {"--solutions", dataset_ + "/solutions-motion.json", "--method", "none"}), 2,
              "has no solution of this method");
  ExpectError(Export(999, "motion"), 2, "no problem with this id");
}

TEST_F(SequenceCommands, SeveralFilesAreSeveralProblemsOfOneTask) {
  ASSERT_EQ(Export(0, "posture").exit_code, 0);
  const std::string first = Write("first.xml", test::ReadText(File("sequence.xml")));
  ASSERT_EQ(Export(1, "posture").exit_code, 0);
  const ProgramResult imported = Import({first, File("sequence.xml")});
  ASSERT_EQ(imported.exit_code, 0) << imported.err;
  const nlohmann::json posed = Problems(dataset_ + "/problems-posture.json"), made = Problems(File("made.json"));
  ASSERT_EQ(made.size(), 2U);
  for (const int i : {0, 1}) EXPECT_EQ(made[i]["definition"], posed[i]["definition"]);
  std::filesystem::remove(File("made.json"));
  ASSERT_EQ(Export(0, "motion").exit_code, 0);
  ExpectError(Import({first, File("sequence.xml")}), 2, "a posture has one phase");
  EXPECT_FALSE(std::filesystem::exists(File("made.json")));
}

TEST_F(SequenceCommands, BadInputIsOneErrorAndMakesNoFile) {
  ASSERT_EQ(Export(0, "motion").exit_code, 0);
  ExpectError(Import({Write("walk.txt", "22 serialization::archive 18 0 2")}), 2, "is a text archive");
  ExpectRefused("</boost_serialization>", "", "not well-formed");
  ExpectRefused(">l_palm<", ">left_hand<", "name the contact with --effectors left_hand=CONTACT; valid: l_foot");
  ExpectRefused("<placement[^]*?</placement>", "", "<placement> is missing");
  ExpectRefused("<mu>5[^<]*", "<mu>-0.3", "friction is negative (got '-0.3')");
  ExpectRefused("<size>[0-9]*", "<size>0", "no phases");
  ExpectRefused("<ContactSequence([^>]*)version=\"2\"", "<ContactSequence$1version=\"9\"", "version");
  ExpectError(Import({File("sequence.xml"), "--effectors", "l_foot"}), 2, "EFFECTOR=CONTACT");
  ExpectError(Import({File("absent.xml")}), 2, "absent.xml");
}

}  // namespace
}  // namespace legopt::client
