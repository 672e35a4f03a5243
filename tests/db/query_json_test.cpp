// Policy: a query has the same result from a server as from its file: every value survives conversion to JSON, with
// every bit of numbers and BLOBs.
#include "db/query_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace legopt::db {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::string AllBytes() {
  std::string bytes;
  for (int byte = 0; byte < 256; ++byte) bytes += static_cast<char>(byte);
  return bytes;
}

JsonRows Sent(const QueryResult& result) {
  const auto read = ReadJsonRows(WriteJsonRows(ToJsonRows(result)));
  EXPECT_TRUE(read.has_value());
  return read.value_or(JsonRows{});
}

TEST(BlobText, IsReadBack) {
  for (const std::string& bytes : {std::string(), std::string(1, '\0'), std::string("\xff\x0a"), AllBytes()}) {
    EXPECT_EQ(ParseBlobText(BlobText(bytes)), bytes);
  }
}

TEST(BlobText, IsThatOfSqlAndReadInEitherCase) {
  EXPECT_EQ(BlobText("\x0a\xff"), "0AFF");
  EXPECT_EQ(ParseBlobText("0aFf"), std::string("\x0a\xff"));
}

TEST(BlobText, OtherTextIsRefused) {
  for (const char* text : {"0", "0G", "0x", "0 ", "abc", "-1"}) EXPECT_FALSE(ParseBlobText(text)) << text;
}

TEST(QueryJson, AResultFromAServerEqualsThatOfItsFile) {
  const QueryResult result{
      .columns = {"a", "a", "caf\xC3\xA9", "bad \xff"},
      .rows = {{std::monostate(), std::int64_t{0}, 1.0 / 3, std::string("caf\xC3\xA9 \xff\x01\"\\")},
               {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(), kInfinite,
                -kInfinite},
               {-0.0, 5e-324, std::numeric_limits<double>::max(), Blob{AllBytes()}},
               {std::string(), Blob{}, 1e22, 2.0}},
      .truncated = true};
  const JsonRows file = ToJsonRows(result), server = Sent(result);
  EXPECT_EQ(server.columns, file.columns);
  EXPECT_EQ(server.rows, file.rows);
  EXPECT_EQ(server.truncated, file.truncated);
  for (std::size_t row = 0; row < file.rows.size(); ++row) {
    for (std::size_t i = 0; i < file.rows[row].size(); ++i) {
      EXPECT_EQ(server.rows[row][i].type(), file.rows[row][i].type()) << row << ", " << i;
    }
  }
  EXPECT_TRUE(std::signbit(server.rows[2][0].get<double>()));
  EXPECT_EQ(ParseBlobText(server.rows[2][3].get<std::string>()), AllBytes());
}

TEST(QueryJson, InvalidUtf8IsReplaced) {
  const JsonRows rows = ToJsonRows({.columns = {"x\xff"}, .rows = {{std::string("a\xff")}}});
  EXPECT_EQ(rows.columns[0], "x\xEF\xBF\xBD");
  EXPECT_EQ(rows.rows[0][0], "a\xEF\xBF\xBD");
}

TEST(QueryJson, RowsBeyondTheLimitOfBytesAreLeftOut) {
  const QueryResult result{.columns = {"a"}, .rows = {{std::string("one")}, {std::string("two")}}};
  const std::string whole = R"({"columns":["a"],"rows":[["one"],["two"]],"truncated":false})";
  EXPECT_EQ(WriteJsonRows(ToJsonRows(result)), whole);
  for (std::size_t limit = 0; limit < whole.size(); ++limit) {
    const std::string cut = WriteJsonRows(ToJsonRows(result), limit);
    const auto read = ReadJsonRows(cut);
    ASSERT_TRUE(read) << cut;
    EXPECT_TRUE(read->truncated) << cut;
    EXPECT_TRUE(read->rows.empty() || cut.size() <= limit) << cut;
  }
}

TEST(QueryJson, WhatIsNoResultIsRefused) {
  for (const char* text :
       {"", "1", "[]", "{}", R"({"columns":["a"]})", R"({"columns":[1],"rows":[]})",
        R"({"columns":["a"],"rows":[[1,2]]})", R"({"columns":["a"],"rows":[1]})", R"({"columns":["a"],"rows":[[[]]]})",
        R"({"columns":["a"],"rows":[[{"infinity":2}]]})", R"({"columns":["a"],"rows":[],"truncated":1})"}) {
    EXPECT_FALSE(ReadJsonRows(text)) << text;
  }
}

}  // namespace
}  // namespace legopt::db
