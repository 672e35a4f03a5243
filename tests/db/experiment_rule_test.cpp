// The rule of an experiment determines which results count as solved: in the totals of both stores, in the scheduler's
// list of open jobs, and in the views of the database.
#include "db/read_only_database.h"
#include "tests/db/store_conformance.h"

namespace legopt::db {
namespace {

using Row = std::vector<Value>;

ResultRecord ResultWith(Verdict literal, Verdict strict, Verdict solid, Verdict physical) {
  ResultRecord result = SampleResult();
  result.verdict_literal = literal;
  result.verdict_strict = strict;
  result.verdict_solid = solid;
  result.verdict_physical = physical;
  return result;
}

// Returns an experiment with five finished jobs and five queued ones. Four finished jobs count as solved by the
// original evaluator's rule, three by every listed pair, two by the solid rule, and one by the physical rule.
std::vector<StoreOp> ExperimentOf(Rule rule, std::int64_t id = 1) {
  constexpr std::int64_t kJobs = 10, kCells = 2;
  const std::int64_t first = 1 + kJobs * (id - 1);
  NewExperiment experiment = SampleExperiment(id, first, 1 + kCells * (id - 1), 5);
  experiment.rule = rule;
  const ResultRecord results[] = {
      ResultWith(Verdict::kSuccess, Verdict::kSuccess, Verdict::kSuccess, Verdict::kSuccess),
      ResultWith(Verdict::kSuccess, Verdict::kSuccess, Verdict::kSuccess, Verdict::kTorque),
      ResultWith(Verdict::kSuccess, Verdict::kSuccess, Verdict::kContainment, Verdict::kContainment),
      ResultWith(Verdict::kSuccess, Verdict::kSelfCollision, Verdict::kSelfCollision, Verdict::kSelfCollision),
      ResultWith(Verdict::kCom, Verdict::kCom, Verdict::kCom, Verdict::kCom),
  };
  std::vector<StoreOp> ops{CreateExperiment{experiment}, PutWorker{SampleWorker(1)}};
  for (std::int64_t i = 0; i < 5; ++i) {
    ops.emplace_back(LeaseJob{first + i, 1, 700 + first + i, 1, 10});
    ops.emplace_back(AcceptResult{first + i, 1, results[i], "", "", 20});
  }
  return ops;
}

constexpr std::pair<Rule, std::int64_t> kSolvedByRule[] = {
    {Rule::kLiteral, 4}, {Rule::kStrict, 3}, {Rule::kSolid, 2}, {Rule::kPhysical, 1}};

class ExperimentRule : public StoreConformance {};

TEST_P(ExperimentRule, DecidesWhichResultsAreSolved) {
  for (std::int64_t id = 1; const auto& [rule, solved] : kSolvedByRule) Apply(ExperimentOf(rule, id++));
  Reopen();
  const OpenState state = store().LoadOpenState();
  for (std::size_t i = 0; const auto& [rule, solved] : kSolvedByRule) {
    EXPECT_EQ(state.experiments.at(i).rule, rule);
    EXPECT_EQ(state.experiments.at(i).solved, solved) << ToString(rule);
    const auto& jobs = state.open.at(i++).jobs;
    EXPECT_EQ(std::ranges::count_if(jobs, &OpenJob::solved), solved) << ToString(rule);
  }
}

TEST_P(ExperimentRule, OfTheReusingExperimentCountsForAReusedResult) {
  Apply(ExperimentOf(Rule::kLiteral));
  ResultSearch search;
  search.experiment_id = 2;
  search.dataset_hash = HashOf('d');
  search.method_hash = HashOf('a');
  search.task = Task::kPosture;
  search.initialization = Initialization::kGood;
  search.seed = 1;
  search.wall_limit_us = 60'000'000;
  search.memory_limit_bytes = 1 << 30;
  for (int problem = 0; problem < 5; ++problem) search.problems.push_back({problem, 0});
  for (const auto& [rule, solved] : kSolvedByRule) {
    search.rule = rule;
    EXPECT_EQ(std::ranges::count_if(store().FindKnownResults(search), &KnownResult::solved), solved) << ToString(rule);
  }
}

INSTANTIATE_TEST_SUITE_P(Stores, ExperimentRule, testing::Values(StoreKind::kSqlite, StoreKind::kMemory),
                         [](const auto& kind) { return kind.param == StoreKind::kSqlite ? "Sqlite" : "Memory"; });

TEST(ExperimentRuleViews, CountByTheExperimentsRule) {
  for (const auto& [rule, solved] : kSolvedByRule) {
    const TemporaryFolder folder;
    const auto path = folder / "results.sqlite";
    OpenSqliteStore(path)->Apply(ExperimentOf(rule));
    ReadOnlyDatabase database(path);
    const std::string word(ToString(rule));
    EXPECT_EQ(database.Query("SELECT rule, posture_good_n, posture_good_solved FROM benchmark_table").rows,
              (std::vector<Row>{{word, std::int64_t{5}, solved}}));
    EXPECT_EQ(database.Query("SELECT rule, solved FROM experiment_list").rows, (std::vector<Row>{{word, solved}}));
    EXPECT_EQ(database.Query("SELECT rule, count(*) FROM failures GROUP BY 1").rows,
              (std::vector<Row>{{word, 5 - solved}}));
    EXPECT_EQ(database
                  .Query("SELECT b.rule FROM benchmark_table AS t JOIN benchmark_cells AS b ON b.rule = t.rule AND "
                         "b.initialization = 'good' AND b.solved = t.posture_good_solved AND b.cost IS "
                         "t.posture_good_cost AND b.time_s IS t.posture_good_time_s")
                  .rows,
              (std::vector<Row>{{word}}));
  }
}

}  // namespace
}  // namespace legopt::db
