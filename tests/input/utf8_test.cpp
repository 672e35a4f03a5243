// Policy: exactly the UTF-8 defined by RFC 3629 is accepted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/input/text.h"
#include "tests/input/faults.h"

namespace legopt::test {
namespace {

using ::testing::HasSubstr;

TEST(Utf8, EveryLengthIsDecoded) {
  EXPECT_EQ(FirstCharacter("a").code, U'a');
  EXPECT_EQ(FirstCharacter("ü!").code, U'ü');
  EXPECT_EQ(FirstCharacter("ü!").bytes, 2U);
  EXPECT_EQ(FirstCharacter("実").code, U'実');
  EXPECT_EQ(FirstCharacter("🤖").code, U'🤖');
  EXPECT_EQ(FirstCharacter("🤖").bytes, 4U);
  EXPECT_EQ(FirstInvalidByte("aü実🤖"), std::string_view::npos);
}

TEST(Utf8, WhatIsNoneIsFound) {
  for (const char* text :
       {"\xfc", "\xc3", "\xc3 ", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\x80", "\xff"}) {
    EXPECT_EQ(FirstInvalidByte(std::string("ab") + text), 2U) << text;
  }
}

TEST(Utf8, TheFaultNamesLineAndByte) {
  EXPECT_THAT(FaultOf([] { RequireUtf8("a\nb\n \xfc", "x.yaml"); }), HasSubstr("x.yaml:3: byte 5"));
  EXPECT_EQ(FaultOf([] { RequireUtf8("", "x.yaml"); }), "");
}

}  // namespace
}  // namespace legopt::test
