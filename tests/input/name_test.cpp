// Policy: names that look the same are equal, and letters of every script are allowed in a name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/input/text.h"
#include "tests/input/faults.h"

namespace legopt::test {
namespace {

using ::testing::HasSubstr;

std::string NameFaultOf(const std::string& name) {
  return FaultOf([&] { RequireName(name, "a.yaml:3", "methods[0].name"); });
}

TEST(Name, LettersOfEveryScriptMayStand) {
  for (const char* name :
       {"SQP", "SQP, 80 %", "x -- y", "a<b>c|d\"e", "Größe", "実験 №1", "\u05d0\u05d1", "🤖", "=1+1", "ﬁ"}) {
    EXPECT_EQ(NameFaultOf(name), "") << name;
  }
}

TEST(Name, BlanksAtTheEndsAreRefused) {
  for (const char* name : {" SQP", "SQP ", " ", "   "}) EXPECT_THAT(NameFaultOf(name), HasSubstr("blank")) << name;
  EXPECT_THAT(NameFaultOf(""), HasSubstr("is empty"));
  EXPECT_EQ(NameFaultOf("a b"), "");
}

TEST(Name, BlanksThatLookLikeAnotherAreRefused) {
  for (const char* name : {"a\u00a0b", "a\u2003b", "a\u3000b", "\u2009a"}) {
    EXPECT_THAT(NameFaultOf(name), HasSubstr("holds the blank U+")) << name;
  }
}

TEST(Name, WhatShowsNothingOrReordersIsRefused) {
  for (const char* name : {"\u202ePQS", "\u2066x\u2069", "\u200eSQP", "a\u061cb"}) {
    EXPECT_THAT(NameFaultOf(name), HasSubstr("invisible character U+")) << name;
  }
  for (const char* name : {"\ufeffSQP", "S\u200bQP", "S\u200dQP", "S\u00adQP", "S\u2060QP", "S\u3164QP", "S\ufe0fQP",
                           "S\u034fQP", "S\U000E0041QP"}) {
    EXPECT_THAT(NameFaultOf(name), HasSubstr("invisible character U+")) << name;
  }
  for (const char* name : {"a\nb", "a\tb", "\x1b[31m", "a\u0085b", "a\u2028b", "\x7f"}) {
    EXPECT_THAT(NameFaultOf(name), HasSubstr("control character U+")) << name;
  }
}

TEST(Name, DecomposedLettersAreRefused) {
  EXPECT_EQ(NameFaultOf("\u00e9"), "");
  EXPECT_THAT(NameFaultOf("e\u0301"), HasSubstr("composed form"));
  EXPECT_THAT(NameFaultOf("\u212b"), HasSubstr("composed form")) << "the sign of the unit, which looks like a letter";
  EXPECT_EQ(ToNfc("e\u0301"), "\u00e9");
  EXPECT_EQ(ToNfc("gr\xfcnd"), "gr\xfcnd");
}

TEST(Name, TextThatIsNotUtf8IsRefused) { EXPECT_THAT(NameFaultOf("gr\xfcnd"), HasSubstr("is not UTF-8")); }

TEST(Name, TheFaultNamesThePlace) {
  EXPECT_THAT(NameFaultOf("SQP "), HasSubstr("a.yaml:3: methods[0].name: begins or ends with a blank (got 'SQP ')"));
}

}  // namespace
}  // namespace legopt::test
