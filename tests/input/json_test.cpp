// Policy: JSON is read completely or refused with line, byte and cause. Nothing in it is ignored, and a few bytes of
// text never take much memory. Output is valid UTF-8.
#include "legopt/input/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/input/faults.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Json = nlohmann::json;

std::string JsonFault(const std::string& text, const JsonLimits& limits = {}) {
  const std::string ordered = FaultOf([&] { ParseOrderedJson(text, "a.json", limits); });
  const std::string fault = FaultOf([&] { ParseJson(text, "a.json", limits); });
  EXPECT_EQ(fault, ordered);
  EXPECT_EQ(TryParseJson(text, limits).has_value(), fault.empty());
  return fault;
}

TEST(Json, ValuesOfEveryKindAreRead) {
  const Json json =
      ParseJson(R"( {"a": [1, -2, 18446744073709551615, 0.5, -1e-3, true, false, null], "b": {"c": "ü\u00fc\n"},
                                  "": {}, "d": []} )",
                "a.json");
  EXPECT_EQ(json["a"], (Json{1, -2, 18446744073709551615U, 0.5, -1e-3, true, false, nullptr}));
  EXPECT_TRUE(json["a"][2].is_number_unsigned());
  EXPECT_TRUE(json["a"][1].is_number_integer());
  EXPECT_EQ(json["b"]["c"], "üü\n");
  EXPECT_EQ(json[""], Json::object());
  EXPECT_EQ(json["d"], Json::array());
}

TEST(Json, AScalarIsAValueToo) {
  EXPECT_EQ(ParseJson("3", "a.json"), 3);
  EXPECT_EQ(ParseJson("\xEF\xBB\xBF\"x\"", "a.json"), "x");
}

TEST(Json, OrderedObjectsKeepTheirOrder) {
  EXPECT_EQ(Dump(ParseOrderedJson(R"({"z":1,"a":{"y":2,"b":3}})", "")), R"({"z":1,"a":{"y":2,"b":3}})");
}

TEST(Json, AKeyThatIsGivenTwiceIsRefusedAtAnyDepth) {
  EXPECT_THAT(JsonFault("{\"a\": 1,\n \"a\": 1}"), AllOf(HasSubstr("a.json:2: byte 13: 'a'"), HasSubstr("twice")));
  EXPECT_THAT(JsonFault(R"({"a": [{"b": {"c": 1, "d": 2, "c": 1}}]})"), HasSubstr("'c'"));
  EXPECT_THAT(JsonFault(R"({"a": 1, "\u0061": 2})"), HasSubstr("'a'")) << "the same key by another spelling";
  EXPECT_THAT(JsonFault(R"({"": 1, "": 2})"), HasSubstr("twice"));
  EXPECT_EQ(JsonFault(R"([{"a": 1}, {"a": 2}, {"a": {"a": 3}}])"), "");
}

TEST(Json, TextThatIsNotUtf8IsRefusedWithItsByte) {
  EXPECT_THAT(JsonFault("{\n\"gr\xfcnd\": 1}"),
              AllOf(HasSubstr("a.json:2: byte 5"), HasSubstr("0xfc"), HasSubstr("UTF-8")));
  EXPECT_THAT(JsonFault("[\"\xed\xa0\x80\"]"), HasSubstr("UTF-8")) << "a surrogate";
  EXPECT_THAT(JsonFault("[\"\xc0\xaf\"]"), HasSubstr("UTF-8")) << "overlong";
}

TEST(Json, BrokenSyntaxIsRefusedWithItsPlace) {
  for (const char* text :
       {"", "{", "[1,]", "{\"a\" 1}", "[1] 2", "{} {}", "nul", "[NaN]", "'a'", "[\"\\ud800\"]", "[1}"}) {
    EXPECT_THAT(JsonFault(text), AllOf(HasSubstr("a.json:1: byte "), HasSubstr("not valid JSON"))) << text;
  }
  EXPECT_THAT(JsonFault("[1e400]"), HasSubstr("write numbers below 1.8e308"));
}

// The library regards NUL as the end of the text.
TEST(Json, NothingIsReadPastBecauseOfNul) {
  using std::string_literals::operator""s;  // keeps the NUL
  EXPECT_THAT(JsonFault("{\"a\": 1}\0\n{\"a\": 2}"s), AllOf(HasSubstr("a.json:1: byte 8"), HasSubstr("NUL")));
  EXPECT_THAT(JsonFault("[1]\n\0"s), HasSubstr("a.json:2: byte 4"));
  EXPECT_EQ(JsonFault("[\"a\\u0000\"]"), "");
}

TEST(Json, NestingEndsAtTheLimit) {
  EXPECT_EQ(JsonFault(std::string(64, '[') + std::string(64, ']')), "");
  EXPECT_THAT(JsonFault(std::string(65, '[') + std::string(65, ']')), HasSubstr("nested more than 64 deep"));
  EXPECT_THAT(JsonFault(std::string(5'000'000, '[')), HasSubstr("nested more than 64 deep"));
  std::string objects;
  for (int i = 0; i < 100; ++i) objects += "{\"a\":";
  EXPECT_THAT(JsonFault(objects), HasSubstr("nested more than 64 deep"));
}

TEST(Json, LengthAndNumberOfValuesEndAtTheLimits) {
  EXPECT_EQ(JsonFault("[1,2]", {.bytes = 5}), "");
  EXPECT_THAT(JsonFault("[1,22]", {.bytes = 5}), HasSubstr("larger than"));
  EXPECT_EQ(JsonFault("[1,2]", {.values = 3}), "");
  EXPECT_THAT(JsonFault("[1,2,3]", {.values = 3}), HasSubstr("more than 3 values"));
}

TEST(Json, FilesAreReadWithinTheLimit) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.json") << R"({"a": 1})";
  EXPECT_EQ(ReadJsonFile(folder / "a.json")["a"], 1);
  EXPECT_THAT(FaultOf([&] { ReadJsonFile(folder / "a.json", {.bytes = 4}); }), HasSubstr("larger than"));
  EXPECT_THAT(FaultOf([&] { ReadJsonFile(folder / "b.json"); }),
              AllOf(HasSubstr("b.json"), HasSubstr("cannot be read")));
}

TEST(Json, WrittenTextIsUtf8WhateverTheValueHolds) {
  EXPECT_EQ(Dump(Json{{"gr\xfcnd", "\xff"}}), "{\"gr\uFFFDnd\":\"\uFFFD\"}");
  EXPECT_EQ(Dump(Json{1.0, 0.1, 3}, 1), "[\n 1.0,\n 0.1,\n 3\n]");
}

}  // namespace
}  // namespace legopt::test
