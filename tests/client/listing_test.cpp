// Policy: a listing has the same cells in each of its four formats.
#include "client/report/listing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <sstream>

#include "client/client_error.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

Listing ExampleListing() {
  Listing listing;
  listing.columns = {"name", "count", "cost"};
  listing.rows = {{"plain", 3, 396.123456789}, {"a,\"b\"\nc", 12, nullptr}};
  return listing;
}

TEST(Listing, TextAlignsAndRounds) {
  EXPECT_EQ(RenderListing(ExampleListing(), TableFormat::kText),
            "name      count     cost\n"
            "plain         3  396.123\n"
            "a,\"b\"\\nc     12        -\n");
}

TEST(Listing, MarkdownIsAPipeTable) {
  Listing listing;
  listing.columns = {"a|b", "n"};
  listing.rows = {{"x|y", 1}};
  EXPECT_EQ(RenderListing(listing, TableFormat::kMarkdown), "| a\\|b | n |\n| --- | ---: |\n| x\\|y | 1 |\n");
}

TEST(Listing, CsvQuotesAndKeepsPrecision) {
  EXPECT_EQ(RenderListing(ExampleListing(), TableFormat::kCsv),
            "name,count,cost\nplain,3,396.123456789\n\"a,\"\"b\"\"\nc\",12,\n");
}

TEST(Listing, JsonIsAnArrayOfObjects) {
  const auto json = nlohmann::json::parse(RenderListing(ExampleListing(), TableFormat::kJson));
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0].at("cost").get<double>(), 396.123456789);
  EXPECT_TRUE(json[1].at("cost").is_null());
}

TEST(Listing, JsonKeepsColumnsOfEqualName) {
  Listing listing;
  listing.columns = {"n", "n"};
  listing.rows = {{1, 2}};
  const auto json = nlohmann::json::parse(RenderListing(listing, TableFormat::kJson));
  EXPECT_EQ(json[0].at("n"), 1);
  EXPECT_EQ(json[0].at("n_2"), 2);
}

TEST(Listing, EmptyResultHasItsHeading) {
  Listing listing;
  listing.columns = {"job"};
  EXPECT_EQ(RenderListing(listing, TableFormat::kText), "job\n");
  EXPECT_EQ(RenderListing(listing, TableFormat::kJson), "[]\n");
}

TEST(Listing, ControlCharactersDoNotReachTheTerminal) {
  Listing listing;
  listing.columns = {"m"};
  listing.rows = {{"\x1b[31mred"}};
  EXPECT_EQ(RenderListing(listing, TableFormat::kText), "m\n\\x1b[31mred\n");
}

TEST(Listing, WidthCountsCharactersNotBytes) {
  Listing listing;
  listing.columns = {"m", "n"};
  listing.rows = {{"\xc3\xa3", "x"}, {"ab", "y"}};
  EXPECT_EQ(RenderListing(listing, TableFormat::kText), "m   n\n\xc3\xa3   x\nab  y\n");
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

// Returns a listing as `legopt list` shows it.
Listing Jobs() {
  Listing listing;
  listing.columns = {"job",      "method",  "task",          "initialization", "problem", "repetition", "state",
                     "attempts", "verdict", "solver_status", "cost",           "time_s",  "worker"};
  listing.rows = {
      {1, "SQP", "posture", "good", 0, 0, "done", 1, "success", "converged_feasible", 380.1234, 0.00123, "worker-1"},
      {2, "LegOpt-best", "motion", "in_collision", 0, 0, "dead", 2, nullptr, nullptr, nullptr, nullptr,
       "worker-host-12"}};
  return listing;
}

std::string Narrow(const Listing& listing, std::size_t width) {
  return RenderListing(listing, TableFormat::kText, {width, false});
}

TEST(ListingLayout, WideEnoughItIsAsWithoutALimit) {
  EXPECT_EQ(Narrow(Jobs(), 200), RenderListing(Jobs(), TableFormat::kText));
  EXPECT_EQ(Narrow(ExampleListing(), 24), RenderListing(ExampleListing(), TableFormat::kText));
}

TEST(ListingLayout, StackedIfItDoesNotFit) {
  EXPECT_EQ(Narrow(Jobs(), 100), Narrow(Jobs(), 40));
  EXPECT_EQ(Narrow(Jobs(), 40), R"(job             1
method          SQP
task            posture
initialization  good
problem         0
repetition      0
state           done
attempts        1
verdict         success
solver_status   converged_feasible
cost            380.123
time_s          0.00123
worker          worker-1

job             2
method          LegOpt-best
task            motion
initialization  in_collision
problem         0
repetition      0
state           dead
attempts        2
verdict         -
solver_status   -
cost            -
time_s          -
worker          worker-host-12
)");
}

TEST(ListingLayout, LongTextsTakeSeveralLinesOfTheirColumn) {
  Listing listing;
  listing.columns = {"problem", "detail"};
  listing.rows = {{1, "l_uleg and r_uleg overlap by 1.04 mm (tolerance 1 mm)"}, {2, "short"}};
  EXPECT_EQ(Narrow(listing, 40),
            "problem  detail\n"
            "      1  l_uleg and r_uleg overlap by\n"
            "         1.04 mm (tolerance 1 mm)\n"
            "      2  short\n");
}

TEST(ListingLayout, FailuresAreRed) {
  const std::string text = RenderListing(Jobs(), TableFormat::kText, {0, true});
  EXPECT_NE(text.find("\033[31mdead\033[0m"), std::string::npos);
  EXPECT_EQ(text.find("\033[31mdone"), std::string::npos);
  for (const auto format : {TableFormat::kMarkdown, TableFormat::kCsv, TableFormat::kJson}) {
    EXPECT_EQ(RenderListing(Jobs(), format, {40, true}), RenderListing(Jobs(), format));
  }
}

// Values of any kind at many widths: no line is too long, no number is broken, and no word is lost.
TEST(ListingLayout, FitsAndLosesNothing) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 300; ++trial) {
    Listing listing;
    std::vector<std::string> values;
    const std::size_t columns = 1 + random() % 15;
    for (std::size_t i = 0; i < columns; ++i) listing.columns.push_back("c" + std::string(random() % 30, 'x'));
    for (std::size_t row = random() % 5; row > 0; --row) {
      auto& line = listing.rows.emplace_back();
      for (std::size_t i = 0; i < columns; ++i) {
        line.push_back(i % 3 == 2 ? nlohmann::json("t" + std::string(random() % 90, 'y'))
                                  : nlohmann::json(static_cast<std::int64_t>(random()) * (i % 2 == 0 ? 1 : 1000003)));
        if (line.back().is_number()) values.push_back(line.back().dump());
      }
    }
    for (const std::size_t width : {24U, 40U, 60U, 80U, 120U}) {
      const std::string text = Narrow(listing, width);
      std::set<std::string> words;
      std::istringstream lines(text);
      for (std::string line; std::getline(lines, line);) {
        ASSERT_LE(DisplayWidth(line), width) << text;
        std::istringstream stream(line);
        for (std::string word; stream >> word;) words.insert(word.substr(0, word.find_last_not_of(',') + 1));
      }
      for (const auto& value : values) ASSERT_EQ(words.count(value), 1U) << value << "\n" << text;
      const auto letters = [](const std::string& shown) { return std::count(shown.begin(), shown.end(), 'y'); };
      std::string all;
      for (const auto& row : listing.rows) all += nlohmann::json(row).dump();
      ASSERT_EQ(letters(text), letters(all)) << text;
    }
  }
}

TEST(RenderFields, OneLinePerValueAndNoneForNothing) {
  Listing listing;
  listing.columns = {"job", "message", "worker", "log"};
  listing.rows = {{7, nullptr, "worker-1", ""}};
  EXPECT_EQ(RenderFields(listing, 0), "job     7\nworker  worker-1\n");
  listing.rows[0][3] = R"({"max_iterations":50,"penalty":100.0,"trust":0.1})";
  EXPECT_EQ(RenderFields(listing, 0, {36, false}),
            "job     7\n"
            "worker  worker-1\n"
            "log     {\"max_iterations\":50,\n"
            "        \"penalty\":100.0,\"trust\":0.1}\n");
}

TEST(KeepColumns, InTheOrderAskedFor) {
  const Table kept = KeepColumns(TableOf(Jobs()), {"worker", "job"});
  EXPECT_EQ(RenderTable(kept, TableFormat::kCsv), "worker,job\nworker-1,1\nworker-host-12,2\n");
  try {
    KeepColumns(TableOf(Jobs()), {"worke"});
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUsage);
    EXPECT_NE(std::string(error.what()).find("did you mean 'worker'?"), std::string::npos) << error.what();
  }
}

TEST(Listing, AnUnknownWordIsDamageOfTheDatabase) {
  const Listing listing{{"state"}, {{std::string("do\0e", 4)}, {nullptr}}};
  for (std::size_t row = 0; row < 2; ++row) {
    try {
      (void)listing.EnumAt<JobState>(row, "state");
      ADD_FAILURE() << "row " << row;
    } catch (const ClientError& error) {
      EXPECT_EQ(error.code(), ExitCode::kDatabaseUnusable);
      EXPECT_THAT(error.what(), HasSubstr(row == 0 ? "state 'do" : "state 'null'"));
      EXPECT_THAT(error.what(), HasSubstr("the database is damaged"));
    }
  }
}

TEST(Listing, UnknownColumnIsNamed) {
  EXPECT_THROW(static_cast<void>(ExampleListing().Column("nothing")), std::out_of_range);
}

}  // namespace
}  // namespace legopt::client
