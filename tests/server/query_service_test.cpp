#include "server/query_service.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <nlohmann/json.hpp>

#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"
#include "tests/server/reply_status.h"

namespace legopt::server {
namespace {

using Json = nlohmann::json;

class Queries : public testing::Test {
 protected:
  Queries() : store_(db::OpenSqliteStore(path_)), service_(path_) {
    store_->Apply(std::vector<db::StoreOp>{db::CreateExperiment{db::SampleExperiment(1, 1, 1)},
                                           db::PutWorker{db::SampleWorker(1)}, db::LeaseJob{1, 1, 7, 1, 1},
                                           db::AcceptResult{1, 1, db::SampleResult(), "", "", 2}});
  }

  static legopt_msg::query_request Request(const std::string& sql, int max_rows = 100) {
    legopt_msg::query_request request{};
    request.sql = sql;
    request.max_rows = max_rows;
    return request;
  }

  // Waits on the descriptor, as the server does.
  legopt_msg::query_reply Ask(const std::string& sql, int max_rows = 100) {
    EXPECT_EQ(service_.Start(++ticket_, kSender, Request(sql, max_rows)), "");
    while (true) {
      pollfd descriptor{service_.descriptor(), POLLIN, 0};
      poll(&descriptor, 1, -1);
      for (auto& finished : service_.TakeFinished()) {
        if (finished.ticket == ticket_) return finished.reply;
      }
    }
  }

  QueryService::Finished NextFinished() {
    while (finished_.empty()) {
      pollfd descriptor{service_.descriptor(), POLLIN, 0};
      poll(&descriptor, 1, -1);
      for (auto& one : service_.TakeFinished()) finished_.push_back(std::move(one));
    }
    auto first = std::move(finished_.front());
    finished_.erase(finished_.begin());
    return first;
  }

  static std::string EndlessQuery() {
    return "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";
  }

  static constexpr bus::EndpointId kSender = 7;
  std::vector<QueryService::Finished> finished_;
  db::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::unique_ptr<db::Store> store_;
  QueryService service_;
  std::int64_t ticket_ = 0;
};

TEST_F(Queries, AnswerIsJson) {
  const auto reply = Ask("SELECT 1 AS one, 0.5 AS half, 'text' AS word, NULL AS missing, x'00ff' AS bytes");
  EXPECT_EQ(StatusOf(reply), QueryStatus::kOk) << reply.message;
  EXPECT_EQ(Json::parse(reply.json), Json::parse(R"({"columns":["one","half","word","missing","bytes"],
      "rows":[[1,0.5,"text",null,"00FF"]],"truncated":false})"));
}

TEST_F(Queries, SeesWhatIsCommittedMeanwhile) {
  EXPECT_EQ(Json::parse(Ask("SELECT count(*) FROM experiments").json)["rows"][0][0], 1);
  store_->Apply(std::vector<db::StoreOp>{db::CreateExperiment{db::SampleExperiment(2, 5, 3)}});
  EXPECT_EQ(Json::parse(Ask("SELECT count(*) FROM experiments").json)["rows"][0][0], 2);
}

TEST_F(Queries, RowsAreLimited) {
  const Json answer = Json::parse(Ask("SELECT job_id FROM jobs", 3).json);
  EXPECT_EQ(answer["rows"].size(), 3U);
  EXPECT_EQ(answer["truncated"], true);
}

TEST_F(Queries, FaultsAreToldNotThrown) {
  EXPECT_EQ(StatusOf(Ask("SELECT nonsense")), QueryStatus::kRefused);
  EXPECT_NE(Ask("SELECT nonsense").message.find("nonsense"), std::string::npos);
  EXPECT_NE(Ask("DELETE FROM jobs").message.find("read-only"), std::string::npos);
}

// The client then ends with the exit code of a limit and names it.
TEST_F(Queries, AnAnswerThatIsTooLargeIsCutAsByALimitOfRows) {
  const std::string rows = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 400) ";
  for (const char* value : {"zeroblob(100000)", "hex(zeroblob(100000))"}) {
    const auto reply = Ask(rows + "SELECT " + value + " FROM n", 1000);
    ASSERT_EQ(StatusOf(reply), QueryStatus::kOk) << reply.message;
    const Json answer = Json::parse(reply.json);
    EXPECT_EQ(answer["truncated"], true);
    EXPECT_EQ(answer["rows"].size(), (std::size_t{48} << 20U) / 200'005)
        << "rows that fit, with quotes, brackets and commas";
  }
  const Json answer = Json::parse(Ask("SELECT zeroblob(30000000)").json);
  EXPECT_EQ(answer["rows"].size(), 0U);
  EXPECT_EQ(answer["truncated"], true);
}

TEST_F(Queries, TextThatIsNotUtf8IsReplaced) {
  EXPECT_EQ(Json::parse(Ask("SELECT CAST(x'61ff62' AS TEXT)").json)["rows"][0][0],
            "a\xEF\xBF\xBD"
            "b");
}

TEST_F(Queries, MissingDatabaseIsAnError) {
  QueryService service(folder_ / "missing.sqlite");
  EXPECT_EQ(service.Start(1, kSender, Request("SELECT 1")), "");
  pollfd descriptor{service.descriptor(), POLLIN, 0};
  poll(&descriptor, 1, -1);
  const auto finished = service.TakeFinished();
  ASSERT_EQ(finished.size(), 1U);
  EXPECT_EQ(StatusOf(finished[0].reply), QueryStatus::kRefused);
}

TEST_F(Queries, TheStatementMayAskForItsTime) {
  const std::string endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";
  const auto reply = Ask("/*+ MAX_EXECUTION_TIME(100) */ " + endless);
  EXPECT_EQ(StatusOf(reply), QueryStatus::kStopped) << "not the statement's fault, as a refusal would be";
  EXPECT_NE(reply.message.find("stopped after 0.1 s"), std::string::npos) << reply.message;
  // A query with a limit of an hour delays no other query.
  EXPECT_EQ(service_.Start(1000, kSender, Request("/*+ MAX_EXECUTION_TIME(3600000) */ " + endless)), "");
  EXPECT_EQ(StatusOf(Ask("SELECT 1")), QueryStatus::kOk);
  // An invalid number is ignored.
  for (const char* hint :
       {"/*+ MAX_EXECUTION_TIME(x) */ ", "/*+ MAX_EXECUTION_TIME(-1) */ ", "/*+ MAX_EXECUTION_TIME(5 "}) {
    EXPECT_EQ(Ask(std::string(hint) + "*/ SELECT 1").message.find("stopped"), std::string::npos) << hint;
  }
}

// Sixteen clients with endless queries do not delay others, neither a quick query nor one that exceeds the limit of
// the first lane.
TEST_F(Queries, AQueryWaitsOnlyForQueriesThatTakeAsLong) {
  constexpr std::int64_t kEndless = 16, kOther = 2000;
  for (std::int64_t i = 0; i < kEndless; ++i) EXPECT_EQ(service_.Start(3000 + i, 30 + i, Request(EndlessQuery())), "");
  EXPECT_EQ(service_.Start(kOther, kSender, Request("SELECT 1")), "");
  EXPECT_EQ(NextFinished().ticket, kOther) << "it came before the end of any other";
  const std::string longer =
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 30000) SELECT count(*) FROM n";
  EXPECT_EQ(service_.Start(kOther + 1, kSender, Request(longer)), "");
  const auto finished = NextFinished();
  EXPECT_EQ(finished.ticket, kOther + 1);
  EXPECT_EQ(StatusOf(finished.reply), QueryStatus::kOk);
}

TEST_F(Queries, OneSenderCannotFillTheQueue) {
  for (std::size_t i = 0; i < QueryService::kMaxOfSender; ++i) {
    EXPECT_EQ(service_.Start(++ticket_, kSender, Request(EndlessQuery())), "");
  }
  const std::string refusal = service_.Start(++ticket_, kSender, Request("SELECT 1"));
  EXPECT_NE(refusal.find("16 unanswered queries"), std::string::npos) << refusal;
  EXPECT_EQ(service_.Start(++ticket_, kSender + 1, Request("SELECT 1")), "");
  EXPECT_EQ(NextFinished().ticket, ticket_);
}

TEST_F(Queries, WaitingTextHasALimit) {
  const std::string large = EndlessQuery() + "/*" + std::string(90'000, 'x') + "*/";
  std::size_t started = 0;
  for (std::int64_t sender = 1; sender < 60 && service_.Start(++ticket_, sender, Request(large)).empty(); ++sender) {
    ++started;
  }
  EXPECT_LE(started * large.size(), QueryService::kMaxWaitingBytes);
  EXPECT_GE(started, 20U);
}

TEST_F(Queries, DestructorInterruptsAndTooManyAreRefused) {
  std::size_t started = 0;
  std::string refusal;
  while (refusal.empty() && started < 1000) {
    ++ticket_;
    refusal = service_.Start(ticket_, ticket_, Request(EndlessQuery()));
    ++started;
  }
  EXPECT_GE(started, QueryService::kMaxWaiting);
  EXPECT_LT(started, 1000U);
  EXPECT_NE(refusal.find("too many queries wait"), std::string::npos) << refusal;
}

}  // namespace
}  // namespace legopt::server
