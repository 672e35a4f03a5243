#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "program_run.h"
#include "test_database.h"

namespace legopt::client {

/// Runs the built `legopt` in a temporary folder.
class CommandLine : public testing::Test {
 protected:
  ProgramResult Run(const std::vector<std::string>& arguments,
                    const std::map<std::string, std::string>& environment = {}) {
    return RunLegopt(arguments, folder_.path(), environment);
  }

  std::string Write(const std::string& name, const std::string& text) {
    const auto file = folder_.path() / name;
    std::ofstream(file) << text;
    return file.string();
  }

  // Expects one line of error that begins with the program's name.
  void ExpectError(const ProgramResult& result, int code, const std::string& words) {
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, testing::AllOf(testing::StartsWith("legopt: error: "), testing::HasSubstr(words)));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }

  std::string Database() {
    const auto file = folder_.path() / "test.sqlite";
    TestExperiment experiment;
    experiment.results = {{.problem = 0}, {.problem = 1, .verdict = "com"}};
    WriteTestDatabase(file, experiment);
    return file.string();
  }

  TemporaryFolder folder_;
};

}  // namespace legopt::client
