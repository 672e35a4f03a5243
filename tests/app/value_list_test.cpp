// Policy: commas separate values, and a value that is known or exists may contain commas itself.
#include "app/value_list.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace legopt::app {
namespace {

using Values = std::vector<std::string>;

TEST(ValueList, CommasSeparate) {
  EXPECT_EQ(SplitValues("a,b,c"), (Values{"a", "b", "c"}));
  EXPECT_EQ(SplitValues("a"), (Values{"a"}));
  EXPECT_EQ(SplitValues("a, b"), (Values{"a", "b"}));
  EXPECT_EQ(SplitValues("a,,b,"), (Values{"a", "", "b", ""}));
}

TEST(ValueList, ABackslashKeepsAComma) {
  EXPECT_EQ(SplitValues("a\\,b,c"), (Values{"a,b", "c"}));
  EXPECT_EQ(SplitValues("\\,"), (Values{","}));
  EXPECT_EQ(SplitValues("a\\b\\"), (Values{"a\\b\\"}));
}

TEST(ValueList, TheLongestKnownValueIsTaken) {
  const auto known = [](const std::string& text) { return text == "SQP, tuned" || text == "SQP" || text == "a,b,c"; };
  EXPECT_EQ(SplitValues("SQP, tuned", known), (Values{"SQP, tuned"}));
  EXPECT_EQ(SplitValues("Adam,SQP, tuned,SQP", known), (Values{"Adam", "SQP, tuned", "SQP"}));
  EXPECT_EQ(SplitValues("a,b,c", known), (Values{"a,b,c"}));
  EXPECT_EQ(SplitValues("a,b", known), (Values{"a", "b"}));
}

TEST(ValueList, PathsThatExistAreWhole) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "a,b.sqlite") << "x";
  std::ofstream(folder / "c") << "x";
  const std::string comma = (folder / "a,b.sqlite").string(), plain = (folder / "c").string();
  EXPECT_EQ(SplitValues(comma + "," + plain, IsExistingPath), (Values{comma, plain}));
  EXPECT_EQ(SplitValues(plain + "," + comma, IsExistingPath), (Values{plain, comma}));
}

}  // namespace
}  // namespace legopt::app
