#include "db/named_queries.h"

#include <gtest/gtest.h>

#include <optional>
#include <stdexcept>

#include "db/connection.h"
#include "db/sqlite_store.h"
#include "legopt/types/check.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

class NamedQueries : public testing::Test {
 protected:
  void SetUp() override { OpenSqliteStore(folder_ / "db.sqlite"); }
  TemporaryFolder folder_;
};

// SQLite compiles every file as it is, so with all optional lines, and without them.
TEST_F(NamedQueries, FitTheSchema) {
  Connection connection(folder_ / "db.sqlite", Connection::Mode::kReadOnly);
  EXPECT_GT(AllQueries().size(), 40U);
  for (const Query query : AllQueries()) {
    const std::string file(FileOf(query));
    EXPECT_TRUE(file.starts_with("-- ")) << "a comment states rows, parameters and order:\n" << file;
    std::string without;
    for (std::size_t begin = 0; begin < file.size();) {
      const std::size_t end = file.find('\n', begin);
      const std::string line = file.substr(begin, end - begin);
      if (line.find("-- if :") == std::string::npos) without += line + "\n";
      begin = end + 1;
    }
    for (const std::string& sql : {file, without}) {
      try {
        Statement statement(connection, "EXPLAIN QUERY PLAN " + sql);
        statement.Step();
        EXPECT_TRUE(Statement(connection, sql).read_only()) << sql;
      } catch (const StoreError& error) {
        ADD_FAILURE() << error.what() << "\n" << sql;
      }
    }
  }
}

TEST(Sql, ParametersAreReplacedByLiterals) {
  EXPECT_EQ(Sql(Query::kNewestExperimentOfName, {{"name", std::string("a'b; DROP TABLE jobs")}}),
            "SELECT max(experiment_id) AS id FROM experiments WHERE name = 'a''b; DROP TABLE jobs'");
  EXPECT_EQ(Sql(Query::kNewestExperimentOfName, {{"name", std::string("of :name")}}),
            "SELECT max(experiment_id) AS id FROM experiments WHERE name = 'of :name'");
  EXPECT_EQ(Sql(Query::kSolvedByRule, {{"experiment_id", -7}, {"rule", Rule::kStrict}}),
            "SELECT method_id, task, initialization, solved\nFROM benchmark_cells\n"
            "WHERE experiment_id = -7 AND rule = 'strict'");
  EXPECT_EQ(Sql(Query::kWaypointsOfJobs, {{"job_ids", std::vector<std::int64_t>{1, 2}}}),
            "SELECT job_id, x FROM waypoints WHERE job_id IN (1, 2) ORDER BY job_id, waypoint");
}

TEST(Sql, LinesOfParametersWithoutAValueAreLeftOut) {
  const auto text = [](std::optional<int> experiment, const std::vector<std::string>& kinds) {
    return Sql(Query::kLatestEvents, {{"after", 0}, {"limit", 5}, {"experiment_id", experiment}, {"kinds", kinds}});
  };
  EXPECT_NE(text(3, {"job_dead", "disk_low"}).find("AND experiment_id = 3\n    AND kind IN ('job_dead', 'disk_low')"),
            std::string::npos);
  EXPECT_EQ(text(std::nullopt, {}).find("AND"), std::string::npos);
  EXPECT_EQ(text(std::nullopt, {}).find("--"), std::string::npos);
  EXPECT_NE(Sql(Query::kExperimentProgress, {{"experiment_ids", std::nullopt}, {"newest", true}}).find("LIMIT 1"),
            std::string::npos);
  EXPECT_EQ(Sql(Query::kExperimentProgress, {{"experiment_ids", 4}, {"newest", false}}).find("LIMIT 1"),
            std::string::npos);
}

TEST(Sql, ParametersMustBeThoseOfTheQuery) {
  EXPECT_THROW(Sql(Query::kDatasetArchive), std::logic_error);
  EXPECT_THROW(Sql(Query::kDatasetArchive, {{"hash", 1}, {"hush", 1}}), std::logic_error);
}

}  // namespace
}  // namespace legopt::db
