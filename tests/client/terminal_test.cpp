// Policy: flags take precedence over the environment, and the environment over the terminal. Output to other files is
// plain text.
#include <gtest/gtest.h>

#include <map>

#include "client/report/output.h"

namespace legopt::client {
namespace {

constexpr Terminal kFile{};
constexpr Terminal kWindow{true, 120, 40};

Environment With(std::map<std::string, std::string> variables) {
  return [variables = std::move(variables)](const char* name) -> const char* {
    const auto found = variables.find(name);
    return found == variables.end() ? nullptr : found->second.c_str();
  };
}

std::size_t Width(const OutputOptions& options, const Terminal& terminal, const Environment& environment) {
  return ChooseLayout(options, terminal, environment).width;
}

bool Color(ColorChoice choice, const Terminal& terminal, const Environment& environment) {
  OutputOptions options;
  options.color = choice;
  return ChooseLayout(options, terminal, environment).color;
}

TEST(ChooseLayout, WidthOfFlagThenEnvironmentThenTerminal) {
  OutputOptions given;
  given.width = 60;
  EXPECT_EQ(Width(given, kWindow, With({{"COLUMNS", "100"}})), 60U);
  EXPECT_EQ(Width(given, kFile, With({})), 60U);
  EXPECT_EQ(Width({}, kWindow, With({{"COLUMNS", "100"}})), 100U);
  EXPECT_EQ(Width({}, kWindow, With({})), 120U);
  EXPECT_EQ(Width({}, kFile, With({{"COLUMNS", "100"}})), 0U);
}

TEST(ChooseLayout, NonsenseIsNotAWidth) {
  for (const char* text : {"", "0", "-5", "wide", "80x"}) {
    EXPECT_EQ(Width({}, kWindow, With({{"COLUMNS", text}})), 120U) << text;
  }
  EXPECT_EQ(Width({}, {true, 0, 0}, With({})), 80U);
  EXPECT_EQ(Width({}, {true, 3, 5}, With({})), kSmallestWidth);
}

TEST(ChooseLayout, ColourOnTerminalsUnlessToldOtherwise) {
  EXPECT_TRUE(Color(ColorChoice::kAuto, kWindow, With({{"TERM", "xterm"}})));
  EXPECT_TRUE(Color(ColorChoice::kAuto, kWindow, With({{"NO_COLOR", ""}})));
  EXPECT_FALSE(Color(ColorChoice::kAuto, kWindow, With({{"NO_COLOR", "1"}})));
  EXPECT_FALSE(Color(ColorChoice::kAuto, kWindow, With({{"TERM", "dumb"}})));
  EXPECT_FALSE(Color(ColorChoice::kAuto, kFile, With({})));
  EXPECT_TRUE(Color(ColorChoice::kAlways, kFile, With({{"NO_COLOR", "1"}})));
  EXPECT_FALSE(Color(ColorChoice::kNever, kWindow, With({})));
}

TEST(ChoosePager, OursThenTheUsersThenLess) {
  EXPECT_EQ(ChoosePager(With({{"LEGOPT_PAGER", "most"}, {"PAGER", "more"}})), "most");
  EXPECT_EQ(ChoosePager(With({{"PAGER", "more -d"}})), "more -d");
  EXPECT_EQ(ChoosePager(With({})), "less -FRX");
  EXPECT_EQ(ChoosePager(With({{"PAGER", "cat"}})), "");
  EXPECT_EQ(ChoosePager(With({{"LEGOPT_PAGER", ""}, {"PAGER", "more"}})), "");
}

}  // namespace
}  // namespace legopt::client
