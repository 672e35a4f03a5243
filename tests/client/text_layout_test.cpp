// Policy: widths are display widths of a terminal. Wrapped lines never exceed them, lose nothing but spaces, and do
// not break numbers. Escape sequences surround texts and have no width.
#include "client/report/text_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace legopt::client {
namespace {

using testing::ElementsAre;

TEST(DisplayWidth, IsThatOfTheTerminal) {
  EXPECT_EQ(DisplayWidth(""), 0U);
  EXPECT_EQ(DisplayWidth("plain"), 5U);
  EXPECT_EQ(DisplayWidth("Brand\xc3\xa3o"), 7U);
  EXPECT_EQ(DisplayWidth("a\xcc\x83"), 1U);                 // a combining tilde
  EXPECT_EQ(DisplayWidth("\xe4\xba\xba\xe5\xbd\xa2"), 4U);  // two wide characters
  EXPECT_EQ(DisplayWidth("\xff\xfe"), 2U);                  // not UTF-8
}

TEST(WrapText, BreaksAtSpaces) {
  EXPECT_THAT(WrapText("", 10), ElementsAre(""));
  EXPECT_THAT(WrapText("one two", 10), ElementsAre("one two"));
  EXPECT_THAT(WrapText("one two three", 7), ElementsAre("one two", "three"));
  EXPECT_THAT(WrapText("one two   three", 8), ElementsAre("one two", "three"));
  EXPECT_THAT(WrapText("one two three", 0), ElementsAre("one two three"));
}

TEST(WrapText, BreaksLongWordsAfterMarksElseAnywhere) {
  EXPECT_THAT(WrapText(R"({"a":1,"b":22,"c":3})", 10), ElementsAre(R"({"a":1,)", R"("b":22,)", R"("c":3})"));
  EXPECT_THAT(WrapText("abcdefghij", 4), ElementsAre("abcd", "efgh", "ij"));
  EXPECT_THAT(WrapText("\xe4\xba\xba\xe5\xbd\xa2\xe4\xba\xba", 3),
              ElementsAre("\xe4\xba\xba", "\xe5\xbd\xa2", "\xe4\xba\xba"));
}

TEST(WrapText, NeverExceedsTheWidthAndKeepsEveryCharacter) {
  std::mt19937 random(1);
  const std::vector<std::string> pieces = {"a",        "bc",           " ",    "  ",  ",", "12.5",
                                           "\xc3\xa3", "\xe4\xba\xba", "\xff", "word"};
  const auto squeezed = [](std::string text) {
    std::erase(text, ' ');
    return text;
  };
  for (int trial = 0; trial < 2000; ++trial) {
    std::string text;
    for (std::uint32_t i = random() % 60; i > 0; --i) text += pieces[random() % pieces.size()];
    const std::size_t width = 2 + random() % 40;
    std::string joined;
    for (const auto& line : WrapText(text, width)) {
      ASSERT_LE(DisplayWidth(line), width) << text;
      joined += line;
    }
    ASSERT_EQ(squeezed(joined), squeezed(text));
  }
}

TEST(Emphasized, OnlyWithColour) {
  EXPECT_EQ(Emphasized("x", Emphasis::kBad, false), "x");
  EXPECT_EQ(Emphasized("x", Emphasis::kNone, true), "x");
  EXPECT_EQ(Emphasized("", Emphasis::kBad, true), "");
  EXPECT_EQ(Emphasized("x", Emphasis::kBad, true), "\033[31mx\033[0m");
  EXPECT_EQ(Emphasized("x", Emphasis::kBest, true), "\033[1mx\033[0m");
  EXPECT_EQ(Emphasized("x", Emphasis::kDim, true), "\033[2mx\033[0m");
}

}  // namespace
}  // namespace legopt::client
