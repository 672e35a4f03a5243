// Policy: `table` and `compare` plot the figures they print. A plot that cannot be written is refused before anything
// is printed, and an existing file is kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "command_line_fixture.h"
#include "toy_experiment.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class PlotCommand : public CommandLine {
 protected:
  void SetUp() override { WriteTestDatabase(file_, ToyPool()); }
  std::string Text(const std::string& name) const {
    std::ifstream stream(folder_.path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::string file_ = (folder_.path() / "toy.sqlite").string();
};

TEST_F(PlotCommand, TheTableStandsAboveItsProfiles) {
  const auto plain = Run({"table", "--db", file_}), drawn = Run({"table", "--db", file_, "--plot"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(drawn.out, StartsWith(plain.out));
  EXPECT_THAT(drawn.out, HasSubstr("  c  C: best on 20 %, solves 60 %"));
}

TEST_F(PlotCommand, AComparisonStandsAboveItsScatterAndAFileIsWrittenBeside) {
  const auto result = Run({"compare", "A", "B", "--db", file_, "--plot", "--svg", "x.svg"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("x: time of A (ms)"));
  EXPECT_THAT(Text("x.svg"), StartsWith("<?xml"));
}

TEST_F(PlotCommand, FilesAreWrittenWithEveryFormatOfTheTable) {
  const auto result = Run({"table", "--db", file_, "--format", "csv", "--svg", "x.svg"});
  EXPECT_EQ(result.out, Run({"table", "--db", file_, "--format", "csv"}).out);
  EXPECT_THAT(Text("x.svg"), StartsWith("<?xml"));
}

TEST_F(PlotCommand, WhatCannotBeDrawnIsRefused) {
  ExpectError(Run({"table", "--db", file_, "--plot", "--format", "json"}), 2, "give --svg FILE");
  ExpectError(Run({"compare", "A", "B", "--db", file_, "--plot", "--format", "md"}), 2, "give --svg FILE");
  ExpectError(Run({"table", "--db", file_, "--plot", "--interpolation"}), 2, "without --interpolation");
  ExpectError(Run({"table", "--db", file_, "--png", "x.png"}), 2, "give --svg FILE.svg instead");
  ExpectError(Run({"compare", "A", "B", "--db", file_, "--svg", "x.png"}), 2, "give a name that ends in .svg");
}

TEST_F(PlotCommand, AFileThatCannotBeWrittenIsNamedAndNothingIsPrinted) {
  ExpectError(Run({"table", "--db", file_, "--svg", "none/x.svg"}), 2, "none/x.svg: cannot be written");
  std::filesystem::create_directory(folder_.path() / "folder");
  ExpectError(Run({"table", "--db", file_, "--svg", "folder"}), 2, "folder: cannot be written");
  EXPECT_TRUE(Run({"table", "--db", file_, "--svg", "folder"}).out.empty());
}

}  // namespace
}  // namespace legopt::client
