// Policy: `legopt report` and `legopt view` as a user runs them. A page that cannot be made is refused with an exit
// code and a remedy, and leaves nothing behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "command_line_fixture.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

class PageCommand : public CommandLine {
 protected:
  void SetUp() override {
    TestExperiment experiment;
    experiment.results = {{.problem = 0, .waypoints = {Eigen::VectorXd::Zero(3)}},
                          {.problem = 1, .verdict = "com"},
                          {.problem = 2, .finished = false}};
    WriteTestDatabase(file_, experiment);
  }
  bool Exists(const std::string& name) const { return std::filesystem::exists(folder_.path() / name); }
  std::string Text(const std::string& name) const {
    std::ifstream stream(folder_.path() / name);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::string file_ = (folder_.path() / "results.sqlite").string();
};

TEST_F(PageCommand, AnUnfinishedExperimentOnADatasetThatIsNotAtHandIsReportedAndNoted) {
  const auto result = Run({"report", "--db", file_, "--out", "page.html"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("is unfinished: 1 jobs have no end yet"));
  EXPECT_THAT(result.err, HasSubstr("which was not found: no 3D; name its folder with --dataset"));
  EXPECT_THAT(result.err, HasSubstr("page.html written"));
  EXPECT_THAT(Text("page.html"), testing::StartsWith("<!doctype html>"));
}

TEST_F(PageCommand, AJobWithoutASolutionSaysWhereItsProblemIs) {
  ExpectError(Run({"view", "2", "--db", file_}), 2, "legopt view --problem 1 --tasks posture");
  ExpectError(Run({"view", "3", "--db", file_}), 2, "job 3 has no solution to draw (queued)");
  ExpectError(Run({"view", "77", "--db", file_}), 2, "there is no job 77");
  EXPECT_FALSE(Exists("job-2.html") || Exists("job-3.html"));
}

TEST_F(PageCommand, AFileThatNobodyNamedIsNotReplaced) {
  Write("problem-1.html", "mine");
  const std::string dataset = SourceFolder() + "/data/garage-small";
  for (int again = 0; again < 2; ++again) {
    const auto result = Run({"view", "--problem", "1", "--dataset", dataset});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("problem-1-2.html written"));
  }
  EXPECT_EQ(Text("problem-1.html"), "mine");
  EXPECT_THAT(Text("problem-1-2.html"), testing::StartsWith("<!doctype html>"));
  EXPECT_FALSE(Exists("problem-1-3.html"));
}

TEST_F(PageCommand, ADatasetThatIsGoneOrAnotherIsRefused) {
  ExpectError(Run({"view", "1", "--db", file_}), 5, "name the right folder with --dataset");
  ExpectError(Run({"view", "1", "--db", file_, "--dataset", "gone"}), 2, "gone");
  ExpectError(Run({"report", "--db", file_, "--out", "page.html", "--dataset", "gone"}), 2, "gone");
  EXPECT_FALSE(Exists("job-1.html") || Exists("page.html"));
}

TEST_F(PageCommand, ADatabaseOfANewerSchemaIsLeftAlone) {
  AlterDatabase(file_, "none", "PRAGMA user_version = 99");
  ExpectError(Run({"report", "--db", file_, "--out", "page.html"}), 9, "results.sqlite");
  ExpectError(Run({"view", "1", "--db", file_}), 9, "results.sqlite");
  ExpectError(Run({"serve", "--db", file_, "--http-port", "0"}), 9, "results.sqlite");
  EXPECT_FALSE(Exists("page.html"));
}

TEST_F(PageCommand, WhatCannotBeWrittenLeavesWhatWasThere) {
  for (const std::string& out : {std::string("none/page.html"), file_ + "/page.html"}) {
    const auto result = Run({"report", "--db", file_, "--out", out});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(out + ": cannot be written"));
  }
  Write("page.html", "before");
  EXPECT_EQ(Run({"report", "9", "--db", file_, "--out", "page.html"}).exit_code, 2);
  EXPECT_EQ(Text("page.html"), "before");
  EXPECT_EQ(Run({"report", "--db", file_, "--out", "page.html"}).exit_code, 0);
  EXPECT_NE(Text("page.html"), "before");
  EXPECT_FALSE(Exists("page.html.new"));
}

TEST_F(PageCommand, AProblemNeedsNoDatabase) {
  const auto result = Run({"view", "--problem", "0"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(Exists("problem-0.html"));
  ExpectError(Run({"view", "--problem", "100000"}), 2, "100000");
  ExpectError(Run({"view"}), 2, "name a job or a problem");
}

}  // namespace
}  // namespace legopt::client
