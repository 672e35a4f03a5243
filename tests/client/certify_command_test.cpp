// Policy: `certify` as a user runs it. It writes one file per dataset, from which it resumes after an interruption.
// The file of another dataset is refused with its own exit code and left unchanged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/exit_codes.h"
#include "legopt/files/name_lock.h"
#include "program_run.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using app::ExitCode;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class CertifyCommand : public testing::Test {
 protected:
  CertifyCommand() {
    std::filesystem::copy(SourceFolder() + "/data/garage-small", folder_.path() / "small",
                          std::filesystem::copy_options::recursive);
  }
  ProgramResult Certify(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "certify");
    return RunLegopt(arguments, folder_.path());
  }

  test::TemporaryFolder folder_;
};

// The process that ends last would replace the other's results.
TEST_F(CertifyCommand, ACertificateHasOneWriter) {
  {
    const files::NameLock other(folder_.path() / "c.json");
    const ProgramResult refused = Certify({"small", "--starts", "5", "--out", "c.json"});
    EXPECT_EQ(refused.exit_code, static_cast<int>(ExitCode::kUsage));
    EXPECT_THAT(refused.err, HasSubstr("is writing this certificate"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "c.json"));
  EXPECT_EQ(Certify({"small", "--starts", "5", "--out", "c.json"}).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "c.json.lock"));
}

TEST_F(CertifyCommand, WritesOneFileInTheDatasetAndCounts) {
  const ProgramResult made = Certify({"small", "--starts", "60"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("certified"), HasSubstr("infeasible"), HasSubstr("open")));
  const auto file = folder_.path() / "small" / "certificate.json";
  const std::string text = test::ReadText(file);
  const auto json = nlohmann::json::parse(text);
  EXPECT_TRUE(json["complete"].get<bool>());
  EXPECT_EQ(json["problems"]["posture"].size(), 40U);
  EXPECT_EQ(Certify({"small", "--threads", "1", "--out", "other.json", "--starts", "60"}).exit_code, 0);
  EXPECT_EQ(test::ReadText(folder_.path() / "other.json"), text);
  const ProgramResult csv = Certify({"small", "--starts", "60", "--format", "csv"});
  EXPECT_THAT(csv.out, AllOf(HasSubstr("task,problems,certified,infeasible,open\n"), HasSubstr("posture,40,40,0,0\n"),
                             HasSubstr("motion,4,4,0,0\n")));
  EXPECT_THAT(csv.err, Not(HasSubstr("starts"))) << "nothing is left to look for";
  EXPECT_EQ(test::ReadText(file), text);
}

TEST_F(CertifyCommand, NamesTheStanceThatHasNone) {
  const auto problems = folder_.path() / "small" / "problems-posture.json";
  auto json = nlohmann::json::parse(test::ReadText(problems));
  json["problems"] = {{{"id", 3}, {"definition", {"l_foot,1 0 0 0 0 0 0 ,r_foot,1 0 0 0 0 -3 0 ,"}}}};
  test::WriteText(problems, json.dump());
  ASSERT_EQ(RunLegopt({"dataset", "hash", "small"}, folder_.path()).exit_code, 0);
  const ProgramResult made = Certify({"small", "--starts", "5", "--format", "json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto stance = nlohmann::json::parse(made.out)["uncertified"][0];
  EXPECT_EQ(stance["task"], "posture");
  EXPECT_EQ(stance["problem"], 3);
  EXPECT_THAT(stance["reason"].get<std::string>(), Not(HasSubstr("without")));
}

TEST_F(CertifyCommand, AnInterruptionLeavesAFileToGoOnWith) {
  const std::vector<std::string> words = {"certify", SourceFolder() + "/data/garage-easier", "--out", "easier.json"};
  RunningProgram program(BuiltProgram("legopt"), words, folder_.path());
  ASSERT_TRUE(program.WaitForError("first starts"));
  ::kill(program.pid(), SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kInterrupted)) << result.err;
  EXPECT_THAT(result.err, HasSubstr("the same command continues"));
  const auto json = nlohmann::json::parse(test::ReadText(folder_.path() / "easier.json"));
  EXPECT_FALSE(json["complete"].get<bool>());
  EXPECT_FALSE(json["stances"].empty());
}

TEST_F(CertifyCommand, TheFileOfAnotherDatasetIsRefusedAndStays) {
  ASSERT_EQ(Certify({"small", "--starts", "60"}).exit_code, 0);
  const auto file = folder_.path() / "small" / "certificate.json";
  const std::string text = test::ReadText(file);
  test::ReplaceInFile(folder_.path() / "small" / "dataset.yaml", "gravity_m_s2: 9.797930195020351",
                      "gravity_m_s2: 9.8");
  const ProgramResult refused = Certify({"small"});
  EXPECT_EQ(refused.exit_code, static_cast<int>(ExitCode::kCertificateMismatch));
  EXPECT_THAT(refused.err, AllOf(HasSubstr("certificate.json"), HasSubstr("--out")));
  EXPECT_EQ(test::ReadText(file), text);
}

TEST_F(CertifyCommand, BadArgumentsAreNamed) {
  const auto error_of = [&](const std::vector<std::string>& words) {
    const ProgramResult result = Certify(words);
    EXPECT_EQ(result.exit_code, kUsage) << result.err;
    return result.err;
  };
  EXPECT_THAT(error_of({"small", "--starts", "0"}), HasSubstr("--starts"));
  EXPECT_THAT(error_of({"small", "--threads", "0"}), HasSubstr("--threads"));
  EXPECT_THAT(error_of({"nowhere"}), HasSubstr("nowhere"));
  test::WriteText(folder_.path() / "no.json", "{}");
  EXPECT_THAT(error_of({"small", "--out", "no.json"}), HasSubstr("format"));
  EXPECT_EQ(test::ReadText(folder_.path() / "no.json"), "{}");
  EXPECT_THAT(error_of({"small", "--out", "no/folder.json", "--starts", "1"}), HasSubstr("no/folder.json"));
}

}  // namespace
}  // namespace legopt::client
