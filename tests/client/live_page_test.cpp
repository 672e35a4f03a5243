// Policy: a live server of pages sends the same content as a report. It follows a growing database, reports read
// errors, and computes nothing twice.
#include "client/serve/live_page.h"

#include <gtest/gtest.h>

#include "client/client_error.h"
#include "db/connection.h"
#include "page_fixture.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

class LivePageTest : public PageTest {
 protected:
  FigureRequest Request() const {
    FigureRequest request;
    request.sources = {{{file_.string(), {}}, std::nullopt}};
    request.datasets = {dataset_};
    return request;
  }
  static std::string BytesOf(const HttpReply& reply) { return Unzip(*reply.body); }
};

TEST_F(LivePageTest, FiguresAreThoseOfAReport) {
  LiveBlocks blocks(Request());
  const HttpReply reply = blocks.Make({"/blocks/page", ""});
  ASSERT_EQ(reply.status, 200U) << *reply.body;
  Json live = Json::parse(BytesOf(reply)), page = Json::parse(Block(Report().text, "page"));
  for (Json* json : {&live, &page}) json->erase("chunks");  // a server computes solutions one by one
  EXPECT_EQ(live, page);
  const std::string block = live["datasets"][0]["geometry"]["block"];
  const auto geometry = blocks.TryAnswer({"/blocks/" + block, ""});
  ASSERT_TRUE(geometry);
  EXPECT_EQ(BytesOf(*geometry), Block(Report().text, block));
  Json named = Json::parse(BytesOf(blocks.Make({"/blocks/page", "1"})));
  named.erase("chunks");
  EXPECT_EQ(named, page) << "the newest is experiment 1";
}

TEST_F(LivePageTest, FiguresAreOfTheKeptMethods) {
  FigureRequest request = Request();
  request.filter.methods = {"B"};
  LiveBlocks blocks(request);
  const Json page = Json::parse(BytesOf(blocks.Make({"/blocks/page", ""})));
  ASSERT_EQ(page["experiments"][0]["methods"].size(), 1U);
  EXPECT_EQ(page["experiments"][0]["methods"][0]["name"], "B");
  EXPECT_NE(page["notes"].dump().find("--methods B"), std::string::npos);
  request.filter.methods = {"C"};
  EXPECT_EQ(LiveBlocks(request).Make({"/blocks/page", ""}).status, 404U);
}

TEST_F(LivePageTest, FiguresAreByTheRuleOfTheirExperimentUnlessOneIsAskedFor) {
  TestExperiment physical = experiment_;
  physical.rule = Rule::kPhysical;
  const auto file = folder_.path() / "physical.sqlite";
  WriteTestDatabase(file, physical);
  FigureRequest request = Request();
  request.rule = Rule::kLiteral;  // not used
  request.sources = {{{file.string(), {}}, {}}};
  const auto rule_of = [](LiveBlocks&& blocks) {
    return Json::parse(BytesOf(blocks.Make({"/blocks/page", "1"}))).at("rule").get<std::string>();
  };
  EXPECT_EQ(rule_of(LiveBlocks(request)), "physical");
  EXPECT_EQ(rule_of(LiveBlocks(request, Rule::kStrict)), "strict");
}

TEST_F(LivePageTest, ASolutionIsThatOfAView) {
  LiveBlocks blocks(Request());
  EXPECT_FALSE(blocks.TryAnswer({"/blocks/motion-2", ""}));
  const Json live = Json::parse(BytesOf(blocks.Make({"/blocks/solutions-2", ""})));
  const std::string view = View(2).text;
  EXPECT_EQ(live, Json::parse(Block(view, "solutions-0")));
  const auto motion = blocks.TryAnswer({"/blocks/motion-2", ""});
  ASSERT_TRUE(motion) << "both blocks are made at once";
  EXPECT_EQ(BytesOf(*motion), Block(view, "motion-0"));
  EXPECT_FALSE(motion->etag.empty());
}

TEST_F(LivePageTest, WhatThereIsNotIsSaid) {
  LiveBlocks blocks(Request());
  EXPECT_EQ(blocks.TryAnswer({"/", ""})->status, 200U);
  EXPECT_EQ(blocks.TryAnswer({"/page.js", ""})->type, "text/javascript; charset=utf-8");
  EXPECT_EQ(blocks.TryAnswer({"/favicon.ico", ""})->status, 404U);
  for (const char* path : {"/blocks/", "/blocks/nothing", "/blocks/solutions-", "/blocks/solutions-1x",
                           "/blocks/solutions-0", "/blocks/solutions-77", "/blocks/motion-99999999999999999999"}) {
    EXPECT_EQ(blocks.Make({path, ""}).status, 404U) << path;
  }
  EXPECT_NE(blocks.Make({"/blocks/solutions-4", ""}).body->find("has no solution to draw (queued)"), std::string::npos);
  EXPECT_EQ(blocks.Make({"/blocks/page", "7"}).status, 404U);
  for (const char* experiments : {"x", "1,", "1;DROP TABLE jobs", "-1", "1,1,1,1,1,1,1,1,1"}) {
    EXPECT_EQ(blocks.Make({"/blocks/page", experiments}).status, 400U) << experiments;
  }
}

TEST_F(LivePageTest, FiguresAreMadeOnceWhileNothingEnds) {
  LiveBlocks blocks(Request());
  const auto first = blocks.Make({"/blocks/page", ""}), second = blocks.Make({"/blocks/page", ""});
  EXPECT_EQ(first.body, second.body);
  EXPECT_EQ(first.etag, second.etag);
}

TEST_F(LivePageTest, ADatasetThatIsNotAtHandIsNoted) {
  FigureRequest request = Request();
  request.datasets.clear();
  LiveBlocks blocks(request);
  const Json page = Json::parse(BytesOf(blocks.Make({"/blocks/page", ""})));
  EXPECT_EQ(page["experiments"][0]["dataset_index"], nullptr);
  EXPECT_NE(page["notes"].dump().find("no 3D"), std::string::npos);
  EXPECT_EQ(blocks.Make({"/blocks/solutions-1", ""}).status, 404U);
}

TEST_F(LivePageTest, TheStateFollowsTheDatabase) {
  LiveState state({file_.string(), {}}, Rule::kLiteral);
  ASSERT_TRUE(state.Read(0));
  Json json = Json::parse(*state.text());
  const Json& experiment = json["experiments"][0];
  EXPECT_EQ(experiment["jobs"], 4);
  EXPECT_EQ(experiment["done"], 2);
  EXPECT_EQ(experiment["dead"], 1);
  EXPECT_EQ(experiment["queued"], 1);
  EXPECT_EQ(experiment["solved"], 1);
  ASSERT_EQ(json["failures"].size(), 2U) << json["failures"];
  EXPECT_EQ(state.version(), 1U);
  EXPECT_FALSE(state.Read(10)) << "nothing is new";
  EXPECT_EQ(state.version(), 1U);
  AlterDatabase(file_, "none", "UPDATE jobs SET state = 'cancelled' WHERE state = 'queued'");
  ASSERT_TRUE(state.Read(20));
  json = Json::parse(*state.text());
  EXPECT_EQ(json["experiments"][0]["cancelled"], 1);
  EXPECT_EQ(json["experiments"][0]["per_minute"], 3) << "one in 20 s";
  EXPECT_EQ(json["version"], 2);
}

TEST_F(LivePageTest, ADatabaseThatGoesAwayIsSaidAndTheLastStateKept) {
  LiveState state({file_.string(), {}}, Rule::kLiteral);
  state.Read(0);
  AlterDatabase(file_, "none", "DROP VIEW experiment_list");
  ASSERT_TRUE(state.Read(1));
  const Json json = Json::parse(*state.text());
  EXPECT_NE(json["error"].get<std::string>().find("experiment_list"), std::string::npos) << json["error"];
  EXPECT_EQ(json["experiments"][0]["jobs"], 4);
  state.Read(2);  // SQLite's error text differs the second time
  EXPECT_FALSE(state.Read(3)) << "the same error is no news: " << *state.text();
}

}  // namespace
}  // namespace legopt::client
