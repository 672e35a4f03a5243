// Policy: a YAML file is read completely or refused with its line and a remedy. Nothing in it is ignored, and a few
// lines cannot expand to billions of values.
#include "legopt/input/yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/input/faults.h"

namespace legopt::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string YamlFault(const std::string& text, const YamlLimits& limits = {}) {
  return FaultOf([&] { ParseYaml(text, "a.yaml", limits); });
}

TEST(Yaml, OneDocumentIsRead) {
  const YAML::Node root = ParseYaml("%YAML 1.2\n---\na: [1, {b: 'x: y'}]\nc: &m {d: 1}\ne: *m\n...\n", "a.yaml");
  EXPECT_EQ(root["a"][1]["b"].Scalar(), "x: y");
  EXPECT_EQ(root["e"]["d"].Scalar(), "1");
  for (const char* text : {"", "# only a comment\n", "---\n", "a: 1\n---\n", "a: 1\n---\n# nothing\n", "~"}) {
    EXPECT_EQ(YamlFault(text), "") << text;
  }
}

TEST(Yaml, ASecondDocumentIsRefused) {
  for (const char* more : {"b: 2\n", "- b\n", "b\n", "''\n"}) {
    EXPECT_THAT(YamlFault(std::string("a: 1\n---\n") + more),
                AllOf(HasSubstr("a.yaml:3"), HasSubstr("a second YAML document begins here")))
        << more;
  }
  EXPECT_THAT(YamlFault("---\n---\na: 1\n"), HasSubstr("a second YAML document")) << "the first one would be read";
  EXPECT_THAT(YamlFault("a: 1\n...\n---\nb: 1\n"), HasSubstr("a second YAML document"));
}

TEST(Yaml, AKeyThatIsGivenTwiceIsRefusedAtAnyDepth) {
  EXPECT_THAT(YamlFault("a: 1\nb: 2\na: 1\n"), AllOf(HasSubstr("a.yaml:3"), HasSubstr("'a' is given twice")));
  EXPECT_THAT(YamlFault("a:\n  - {b: {c: 1, \"c\": 1}}\n"), AllOf(HasSubstr("a.yaml:2"), HasSubstr("'c'")));
  EXPECT_THAT(YamlFault("&k a: 1\n*k : 2\n"), HasSubstr("'a' is given twice")) << "by an alias";
  EXPECT_THAT(YamlFault("'': 1\n'': 1\n"), HasSubstr("twice"));
  EXPECT_EQ(YamlFault("a: {a: {a: 1}}\nb: [{a: 1}, {a: 1}]\n"), "");
}

TEST(Yaml, KeysAreScalars) {
  EXPECT_THAT(YamlFault("? [a, b]\n: 1\n"), HasSubstr("stands as a key"));
  EXPECT_THAT(YamlFault("a: &l [1]\n*l : 1\n"), HasSubstr("stands as a key"));
}

TEST(Yaml, MergeKeysAreRefusedPlainly) {
  EXPECT_THAT(
      YamlFault("m: &m {a: 1}\nb:\n  <<: *m\n"),
      AllOf(HasSubstr("a.yaml:3"), HasSubstr("merge keys (<<) are not supported"), HasSubstr("write the keys out")));
  EXPECT_EQ(YamlFault("a: <<\n'<<': 1\n"), "") << "as a value, or in quotes, it is a text";
}

TEST(Yaml, AliasesCannotMultiply) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before;
    for (int k = 1; k < 10; ++k) bomb += ", " + before;
    bomb += "]\n";
  }
  EXPECT_THAT(YamlFault(bomb), AllOf(HasSubstr("a.yaml:"), HasSubstr("values, aliases expanded")));
  std::string deep = "a0: &a0 [x]\n";
  for (int i = 1; i < 70; ++i) {
    deep += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [*a" + std::to_string(i - 1) + "]\n";
  }
  EXPECT_THAT(YamlFault(deep), HasSubstr("nested more than 64 deep"));
}

TEST(Yaml, CyclesAreRefused) {
  for (const char* text : {"a: &a [*a]\n", "&a\nb: {c: *a}\n", "a: &a {b: [1, *a]}\n"}) {
    EXPECT_THAT(YamlFault(text), HasSubstr("inside of the value that it refers to")) << text;
  }
}

TEST(Yaml, NestingEndsAtTheLimit) {
  EXPECT_EQ(YamlFault(std::string(64, '[') + std::string(64, ']')), "");
  EXPECT_THAT(YamlFault(std::string(65, '[') + std::string(65, ']')), HasSubstr("nested more than 64 deep"));
  EXPECT_THAT(YamlFault(std::string(100'000, '[')), HasSubstr("a.yaml:1"));
  EXPECT_THAT(YamlFault(std::string(100'000, '{')), HasSubstr("a.yaml:1"));
  std::string block;
  for (int i = 0; i < 70; ++i) block += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_THAT(YamlFault(block), HasSubstr("nested more than 64 deep"));
}

TEST(Yaml, LengthAndNumberOfValuesEndAtTheLimits) {
  EXPECT_THAT(YamlFault("a: 1234567\n", {.bytes = 8}), HasSubstr("larger than"));
  EXPECT_EQ(YamlFault("[1, 2]", {.values = 3}), "");
  EXPECT_THAT(YamlFault("[1, 2, 3]", {.values = 3}), HasSubstr("more than 3 values"));
}

TEST(Yaml, TextThatIsNotUtf8IsRefusedWithItsByte) {
  EXPECT_THAT(YamlFault("a: 1\nb: gr\xfcnd\n"),
              AllOf(HasSubstr("a.yaml:2: byte 10"), HasSubstr("0xfc"), HasSubstr("iconv")));
  EXPECT_EQ(ParseYaml("\xEF\xBB\xBF"
                      "a: gründ\n",
                      "a.yaml")["a"]
                .Scalar(),
            "gründ");
}

TEST(Yaml, WideEncodingsWithAMarkAreRead) {
  const std::string wide(
      "\xFF\xFE"
      "a\0:\0 \0\xfc\0\n\0",
      12);
  EXPECT_EQ(ParseYaml(wide, "a.yaml")["a"].Scalar(), "ü");
}

// Without the check, yaml-cpp reads the first of these as the key "\b".
TEST(Yaml, ControlCharactersAreRefusedWithTheirByte) {
  const std::string nul("a: 1\n\0b: 2\n", 11);
  EXPECT_THAT(YamlFault(nul), AllOf(HasSubstr("a.yaml:2: byte 5"), HasSubstr("control character"), HasSubstr("0x00")));
  EXPECT_THAT(YamlFault("a: 1\nb: x\x04y\nc: 1\n"), AllOf(HasSubstr("a.yaml:2: byte 9"), HasSubstr("0x04")));
  EXPECT_THAT(YamlFault("a: \x7f\n"), HasSubstr("0x7f"));
  EXPECT_THAT(YamlFault("a: 1\nb: \"x\\0y\"\n"), AllOf(HasSubstr("a.yaml:2"), HasSubstr("NUL"))) << "as an escape";
  EXPECT_EQ(YamlFault("a:\t1\r\nb: \"\\x04\\n\"\r\n"), "");
}

TEST(Yaml, WideEncodingsAreCheckedAsWell) {
  const std::string mark("\xFF\xFE", 2), key("a\0:\0 \0", 6), key_big("\0a\0:\0 ", 6);
  EXPECT_THAT(YamlFault(mark + key + "x"), AllOf(HasSubstr("byte 8"), HasSubstr("UTF-16"))) << "half a character";
  EXPECT_THAT(YamlFault(mark + key + std::string("\x00\xd8\n\0", 4)), HasSubstr("byte 8")) << "half a pair";
  EXPECT_THAT(YamlFault("\xFE\xFF" + key_big + std::string("\xdc\x00", 2)), HasSubstr("byte 8"));
  EXPECT_EQ(ParseYaml("\xFE\xFF" + key_big + std::string("\xd8\x3e\xdd\x16", 4), "a.yaml")["a"].Scalar(), "\U0001F916");
  const std::string wider("\xFF\xFE\0\0a\0\0\0:\0\0\0 \0\0\0\x16\xf9\x01\0", 20);
  EXPECT_EQ(ParseYaml(wider, "a.yaml")["a"].Scalar(), "\U0001F916");
  EXPECT_THAT(YamlFault(wider.substr(0, 16) + std::string("\0\xd8\0\0", 4)), HasSubstr("UTF-32")) << "a surrogate";
  EXPECT_THAT(YamlFault(std::string("a\0:\0 \0x\0", 8)), HasSubstr("byte order mark")) << "without a mark";
}

TEST(Yaml, BrokenSyntaxIsRefusedWithItsLine) {
  for (const char* text : {"a: [1\n", "a: {b: 1\n", "a: 1\n b: 2\n", ",\n", "a: *b\n", "\ta: 1\n"}) {
    EXPECT_THAT(YamlFault(text), AllOf(HasSubstr("a.yaml:"), HasSubstr("is not valid YAML"))) << text;
  }
}

}  // namespace
}  // namespace legopt::test
