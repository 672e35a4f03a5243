// Policy: one listing, four forms, the same cells in each.
#include "client/listing.h"

#include <gtest/gtest.h>

namespace legopt::client {
namespace {

Listing Example() {
  Listing listing;
  listing.columns = {"name", "count", "cost"};
  listing.rows = {{"plain", 3, 396.123456789}, {"a,\"b\"\nc", 12, nullptr}};
  return listing;
}

TEST(Listing, TextAlignsAndRounds) {
  EXPECT_EQ(RenderListing(Example(), ListingFormat::kText),
            "name     count     cost\n"
            "plain        3  396.123\n"
            "a,\"b\" c     12        -\n");
}

TEST(Listing, MarkdownIsAPipeTable) {
  Listing listing;
  listing.columns = {"a|b", "n"};
  listing.rows = {{"x|y", 1}};
  EXPECT_EQ(RenderListing(listing, ListingFormat::kMarkdown), "| a\\|b | n |\n| --- | ---: |\n| x\\|y | 1 |\n");
}

TEST(Listing, CsvQuotesAndKeepsPrecision) {
  EXPECT_EQ(RenderListing(Example(), ListingFormat::kCsv),
            "name,count,cost\nplain,3,396.123456789\n\"a,\"\"b\"\"\nc\",12,\n");
}

TEST(Listing, JsonIsAnArrayOfObjects) {
  const auto json = nlohmann::json::parse(RenderListing(Example(), ListingFormat::kJson));
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0].at("cost").get<double>(), 396.123456789);
  EXPECT_TRUE(json[1].at("cost").is_null());
}

TEST(Listing, JsonKeepsColumnsOfEqualName) {
  Listing listing;
  listing.columns = {"n", "n"};
  listing.rows = {{1, 2}};
  const auto json = nlohmann::json::parse(RenderListing(listing, ListingFormat::kJson));
  EXPECT_EQ(json[0].at("n"), 1);
  EXPECT_EQ(json[0].at("n_2"), 2);
}

TEST(Listing, EmptyResultHasItsHeading) {
  Listing listing;
  listing.columns = {"job"};
  EXPECT_EQ(RenderListing(listing, ListingFormat::kText), "job\n");
  EXPECT_EQ(RenderListing(listing, ListingFormat::kJson), "[]\n");
}

TEST(Listing, ControlCharactersDoNotReachTheTerminal) {
  Listing listing;
  listing.columns = {"m"};
  listing.rows = {{"\x1b[31mred"}};
  EXPECT_EQ(RenderListing(listing, ListingFormat::kText), "m\n [31mred\n");
}

TEST(Listing, WidthCountsCharactersNotBytes) {
  EXPECT_EQ(DisplayWidth("Brand\xc3\xa3o"), 7U);
  Listing listing;
  listing.columns = {"m", "n"};
  listing.rows = {{"\xc3\xa3", "x"}, {"ab", "y"}};
  EXPECT_EQ(RenderListing(listing, ListingFormat::kText), "m   n\n\xc3\xa3   x\nab  y\n");
}

TEST(Listing, FromJsonJoinsKeys) {
  const auto listing = ListingFromJson(nlohmann::json::parse(R"([{"a":1},{"b":[2],"a":3}])"));
  EXPECT_EQ(listing.columns, (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(listing.At(0, "b").is_null());
  EXPECT_EQ(listing.At(1, "b"), "[2]");
}

TEST(Listing, FromJsonPutsLeadingKeysFirst) {
  const auto listing = ListingFromJson(nlohmann::json::parse(R"([{"a":1,"id":2,"name":3}])"), {"id", "absent", "name"});
  EXPECT_EQ(listing.columns, (std::vector<std::string>{"id", "name", "a"}));
}

TEST(Listing, UnknownColumnIsNamed) { EXPECT_THROW(static_cast<void>(Example().Column("nothing")), std::out_of_range); }

}  // namespace
}  // namespace legopt::client
