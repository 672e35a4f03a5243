// The numbers of the views on data small enough to compute by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

// Returns two methods ("SQP" without and "SQP" with 10 restarts), posture (2 problems) and motion (1 problem of 4
// waypoints), both initializations, 1 repetition: 12 jobs. Submitted in the order restarts 10, restarts 0.
NewExperiment TwoMethods() {
  NewExperiment e = SampleExperiment(1, 1, 1);
  e.rule = Rule::kLiteral;
  e.methods = {{"SQP", HashOf('a'), R"({"multi_starts":10})", 10, 100, false, SceneRepresentation::kSurface},
               {"SQP", HashOf('b'), R"({"multi_starts":0})", 0, 80, true}};
  e.problems = {{Task::kPosture, 3, 1}, {Task::kPosture, 5, 1}, {Task::kMotion, 0, 4}};
  e.cells.clear();
  e.jobs.clear();
  std::int64_t job_id = 1;
  for (int method = 0; method < 2; ++method) {
    for (const Task task : {Task::kPosture, Task::kMotion}) {
      for (const Initialization initialization : {Initialization::kGood, Initialization::kInCollision}) {
        const int cell = static_cast<int>(e.cells.size());
        const bool posture = task == Task::kPosture;
        e.cells.push_back({cell + 1, method, task, initialization, posture ? 2 : 1});
        for (int problem = posture ? 0 : 2; problem < (posture ? 2 : 3); ++problem) {
          e.jobs.push_back({job_id++, cell, problem, 0});
        }
      }
    }
  }
  return e;
}

class BenchmarkTable : public testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenSqliteStore(path_);
    Apply({CreateExperiment{TwoMethods()}, PutWorker{SampleWorker(1)}});
  }

  void Apply(const std::vector<StoreOp>& ops) { store_->Apply(ops); }

  // Finishes a job whose verdict by the solid rule equals that by every listed pair.
  void Finish(std::int64_t job_id, Verdict literal, Verdict strict, double cost, std::int64_t wall_us,
              int num_waypoints) {
    Finish(job_id, literal, strict, strict, cost, wall_us, num_waypoints);
  }
  void Finish(std::int64_t job_id, Verdict literal, Verdict strict, Verdict solid, double cost, std::int64_t wall_us,
              int num_waypoints) {
    ResultRecord r = SampleResult(cost);
    r.verdict_literal = literal;
    r.verdict_strict = strict;
    r.verdict_solid = r.verdict_physical = solid;
    r.verdict_detail = literal == Verdict::kSuccess ? "" : "foot l_foot off by 2.0 mm";
    r.wall_us = r.cpu_us = wall_us;
    r.num_waypoints = num_waypoints;
    Apply({LeaseJob{job_id, 1, 100 + job_id, 1, 1}, AcceptResult{job_id, 1, r, "", "", 2}});
  }

  QueryResult Query(const std::string& sql) { return ReadOnlyDatabase(path_).Query(sql); }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::unique_ptr<Store> store_;
};

using Row = std::vector<Value>;
const Value kNull = std::monostate{};
Value Int(std::int64_t value) { return value; }
Value Text(const char* value) { return std::string(value); }

TEST_F(BenchmarkTable, MeansOverSolvedPerWaypointAndNullWithoutSuccess) {
  Finish(1, Verdict::kSuccess, Verdict::kSuccess, 400, 1'000, 1);  // method 1, posture, good
  Finish(2, Verdict::kSuccess, Verdict::kSelfCollision, 500, 3'000, 1);
  Finish(3, Verdict::kFootPose, Verdict::kFootPose, std::nan(""), 9'000,
         1);  // method 1, posture, in collision: nothing solved
  Finish(4, Verdict::kCom, Verdict::kCom, std::nan(""), 9'000, 1);
  Finish(5, Verdict::kSuccess, Verdict::kSuccess, 0.125, 8'000, 4);  // method 1, motion, good

  const QueryResult table = Query("SELECT * FROM benchmark_table WHERE experiment_id = 1");
  ASSERT_EQ(table.columns.size(), 23U);
  EXPECT_EQ(table.columns[4], "incremental");
  EXPECT_EQ(table.columns[5], "collision");
  EXPECT_EQ(table.columns[6], "rule");
  EXPECT_EQ(table.columns[7], "posture_good_n");
  EXPECT_EQ(table.columns[14], "posture_in_collision_time_s");
  EXPECT_EQ(table.columns[22], "motion_in_collision_time_s");
  ASSERT_EQ(table.rows.size(), 2U);
  const Row restarts{Int(1), Text("SQP"),     Int(10),         Int(100),
                     Int(0), Text("surface"), Text("literal"),                   //
                     Int(2), Int(2),          450.0,           0.002,            // means of 400, 500 and of 1, 3 ms
                     Int(2), Int(0),          kNull,           kNull,            // a dash, not 0
                     Int(1), Int(1),          0.125,           8'000 / 1e6 / 4,  // per waypoint
                     Int(1), Int(0),          kNull,           kNull};
  EXPECT_EQ(table.rows[0], restarts);
  const Row plain{Int(1), Text("SQP"), Int(0), Int(80), Int(1), Text("solid"), Text("literal"), Int(2), Int(0),
                  kNull,  kNull,       Int(2), Int(0),  kNull,  kNull,         Int(1),          Int(0), kNull,
                  kNull,  Int(1),      Int(0), kNull,   kNull};
  EXPECT_EQ(table.rows[1], plain);
}

TEST_F(BenchmarkTable, InterpolationCoversTheSolvedMotions) {
  const auto finish = [this](std::int64_t job_id, Verdict strict, double scene_m, double self_m, double share) {
    ResultRecord r = SampleResult(0.1);
    r.verdict_strict = strict;
    r.verdict_solid = r.verdict_physical = strict == Verdict::kSuccess ? Verdict::kStep : strict;
    r.num_waypoints = 4;
    r.windows = r.windows_solved = 1;
    r.interpolation_environment_depth_m = scene_m;
    r.interpolation_self_depth_m = self_m;
    r.interpolation_free_share = share;
    Apply({LeaseJob{job_id, 1, 100 + job_id, 1, 1}, AcceptResult{job_id, 1, r, "", "", 2}});
  };
  finish(5, Verdict::kSuccess, 0.004, 0, 0.75);  // method 1, motion, good
  finish(6, Verdict::kSelfCollision, 0.0005, 0.0001,
         1.0);  // method 1, motion, in collision: solved by the original evaluator's rule only
  Finish(1, Verdict::kSuccess, Verdict::kSuccess, 400, 1'000, 1);  // a posture is not counted
  const std::string columns =
      "SELECT rule, initialization, n, solved, scored, free, free_share, environment_depth_m, self_depth_m "
      "FROM interpolation_cells WHERE multi_starts = 10 ORDER BY rule, initialization";
  const std::vector<Row> expected{
      {Text("literal"), Text("good"), Int(1), Int(1), Int(1), Int(0), 0.75, 0.004, 0.0},
      {Text("literal"), Text("in_collision"), Int(1), Int(1), Int(1), Int(1), 1.0, 0.0005, 0.0001},
      {Text("physical"), Text("good"), Int(1), Int(0), Int(0), Int(0), kNull, kNull, kNull},
      {Text("physical"), Text("in_collision"), Int(1), Int(0), Int(0), Int(0), kNull, kNull, kNull},
      {Text("solid"), Text("good"), Int(1), Int(0), Int(0), Int(0), kNull, kNull, kNull},
      {Text("solid"), Text("in_collision"), Int(1), Int(0), Int(0), Int(0), kNull, kNull, kNull},
      {Text("strict"), Text("good"), Int(1), Int(1), Int(1), Int(0), 0.75, 0.004, 0.0},
      {Text("strict"), Text("in_collision"), Int(1), Int(0), Int(0), Int(0), kNull, kNull, kNull}};
  EXPECT_EQ(Query(columns).rows, expected);
}

TEST_F(BenchmarkTable, HeldPosturesAreSumsOverAcceptedSolutions) {
  const auto finish = [&](std::int64_t job, Verdict strict, int without_equilibrium, int over_torque) {
    ResultRecord r = SampleResult();
    r.verdict_strict = strict;
    r.verdict_solid = strict;
    r.verdict_physical =
        without_equilibrium + over_torque > 0 && strict == Verdict::kSuccess ? Verdict::kTorque : strict;
    r.holding_postures = 10;
    r.holding_without_equilibrium = without_equilibrium;
    r.holding_over_torque = over_torque;
    r.halfway_postures = 9;
    r.halfway_without_equilibrium = 4;
    Apply({LeaseJob{job, 1, 900 + job, 1, 10}, AcceptResult{job, 1, r, "", "", 20}});
  };
  finish(1, Verdict::kSuccess, 0, 0);
  finish(2, Verdict::kSuccess, 1, 2);
  const auto row = [&](const char* rule) {
    return Query(
               "SELECT solved, tested, held, postures, without_equilibrium, over_torque, halfway_postures, "
               "halfway_without_equilibrium, halfway_over_torque FROM holding_cells WHERE cell_id = 1 AND rule = '" +
               std::string(rule) + "'")
        .rows.at(0);
  };
  EXPECT_EQ(row("literal"), row("solid"));
  EXPECT_EQ(row("solid"), (Row{Int(2), Int(2), Int(1), Int(20), Int(1), Int(2), Int(18), Int(8), Int(0)}));
  EXPECT_EQ(row("physical"), (Row{Int(1), Int(1), Int(1), Int(10), Int(0), Int(0), Int(9), Int(4), Int(0)}));
}

TEST_F(BenchmarkTable, CellsOfAllRulesWithFinishedJobs) {
  Finish(1, Verdict::kSuccess, Verdict::kSuccess, 400, 1'000, 1);
  Finish(2, Verdict::kSuccess, Verdict::kSelfCollision, Verdict::kContainment, 500, 3'000, 1);
  const QueryResult cells = Query(
      "SELECT experiment, method_id, multi_starts, sample_size, incremental, rule, n, finished, solved, cost, time_s "
      "FROM benchmark_cells WHERE task = 'posture' AND initialization = 'good' AND multi_starts = 10 ORDER BY rule");
  ASSERT_EQ(cells.rows.size(), 4U);
  EXPECT_EQ(cells.rows[0], (Row{Text("sample"), Int(1), Int(10), Int(100), Int(0), Text("literal"), Int(2), Int(2),
                                Int(2), 450.0, 0.002}));
  for (int i = 1; const char* rule : {"physical", "solid", "strict"}) {
    EXPECT_EQ(cells.rows[static_cast<size_t>(i++)], (Row{Text("sample"), Int(1), Int(10), Int(100), Int(0), Text(rule),
                                                         Int(2), Int(2), Int(1), 400.0, 0.001}));
  }
  EXPECT_EQ(Query("SELECT sum(finished), sum(n) FROM benchmark_cells WHERE rule = 'literal'").rows[0],
            (Row{Int(2), Int(12)}));
}

TEST_F(BenchmarkTable, CellsThatAnExperimentLacksAreNull) {
  Apply({CreateExperiment{SampleExperiment(2, 13, 9)}});
  const QueryResult table = Query(
      "SELECT posture_good_n, motion_good_n, motion_good_solved, motion_good_cost "
      "FROM benchmark_table WHERE experiment_id = 2");
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_EQ(table.rows[0], (Row{Int(2), kNull, kNull, kNull}));
}

TEST_F(BenchmarkTable, JobListNamesEverything) {
  Finish(2, Verdict::kSuccess, Verdict::kSuccess, 500, 3'000, 1);
  const QueryResult jobs = Query("SELECT * FROM job_list WHERE job_id = 2");
  std::string columns;
  for (const std::string& column : jobs.columns) columns += column + " ";
  EXPECT_EQ(columns,
            "job_id experiment_id method multi_starts sample_size incremental collision task initialization problem_id "
            "repetition state attempts taken_from solver_status verdict_literal verdict_strict verdict_solid "
            "verdict_physical windows_solved windows "
            "cost time_s "
            "wall_us cpu_us iterations restarts starts term_evaluations collision_queries work_ns margin_relaxed "
            "solid_depth_m "
            "longest_step_m "
            "interpolation_environment_depth_m interpolation_self_depth_m interpolation_free_share "
            "holding_postures holding_without_equilibrium holding_over_torque halfway_postures "
            "halfway_without_equilibrium halfway_over_torque duration_s reduced_duration_s velocity_limited_share "
            "torque_limited_share contact_limited_share worker hostname "
            "processor build_id ");
  EXPECT_EQ(jobs.rows.at(0), (Row{Int(2),
                                  Int(1),
                                  Text("SQP"),
                                  Int(10),
                                  Int(100),
                                  Int(0),
                                  Text("surface"),
                                  Text("posture"),
                                  Text("good"),
                                  Int(5),
                                  Int(0),
                                  Text("done"),
                                  Int(1),
                                  kNull,
                                  Text("converged_feasible"),
                                  Text("success"),
                                  Text("success"),
                                  Text("success"),
                                  Text("success"),
                                  kNull,
                                  kNull,
                                  500.0,
                                  0.003,
                                  Int(3'000),
                                  Int(3'000),
                                  Int(12),
                                  Int(0),
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  0.0,
                                  0.0,
                                  0.0,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  kNull,
                                  Text("w1"),
                                  Text("host"),
                                  Text("some processor"),
                                  Text("0123456789ab")}));
  EXPECT_EQ(Query("SELECT * FROM job_list").rows.size(), 12U);
}

TEST_F(BenchmarkTable, FailuresTellWhy) {
  Finish(1, Verdict::kSuccess, Verdict::kSuccess, 400, 1'000, 1);
  Finish(2, Verdict::kFootPose, Verdict::kFootPose, std::nan(""), 3'000, 1);
  Apply({LeaseJob{3, 1, 900, 1, 1},
         EndAttempt{3, 1, AttemptOutcome::kCrashed, JobState::kDead, 11, "killed by SIGSEGV", "", 2}});
  EXPECT_EQ(Query("SELECT job_id, state, detail, message FROM failures ORDER BY job_id").rows,
            (std::vector<Row>{{Int(2), Text("done"), Text("foot l_foot off by 2.0 mm"), Text("")},
                              {Int(3), Text("dead"), kNull, Text("killed by SIGSEGV")}}));
}

// Every view that names a method distinguishes methods of the same name.
TEST_F(BenchmarkTable, ViewsDistinguishMethodsOfOneName) {
  int views = 0;
  for (const Row& view : Query("SELECT name FROM pragma_table_list WHERE type = 'view'").rows) {
    const std::string& name = std::get<std::string>(view.at(0));
    const auto columns = Query("SELECT * FROM " + name).columns;
    const auto has = [&](const char* column) { return std::count(columns.begin(), columns.end(), column) == 1; };
    if (!has("method")) continue;
    ++views;
    for (const char* column : {"multi_starts", "sample_size", "incremental", "collision"}) {
      EXPECT_TRUE(has(column)) << name << " has no column " << column;
    }
    EXPECT_EQ(has("problem_id"), has("repetition")) << name;
  }
  EXPECT_EQ(views, 7);
}

TEST_F(BenchmarkTable, DisagreementsOfSolverAndJudgeAndOfTheRules) {
  Finish(1, Verdict::kSuccess, Verdict::kSuccess, 400, 1'000, 1);
  Finish(2, Verdict::kSuccess, Verdict::kSelfCollision, 500, 3'000, 1);
  Finish(3, Verdict::kCom, Verdict::kCom, std::nan(""), 3'000, 1);  // the solver reports converged_feasible
  ResultRecord jumps = SampleResult();
  jumps.verdict_solid = jumps.verdict_physical = Verdict::kStep;
  Apply({LeaseJob{4, 1, 904, 1, 1}, AcceptResult{4, 1, jumps, "", "", 2}});
  EXPECT_EQ(Query("SELECT job_id FROM disagreements ORDER BY job_id").rows,
            (std::vector<Row>{{Int(2)}, {Int(3)}, {Int(4)}}));
}

TEST_F(BenchmarkTable, ExperimentListCountsEveryJobOnce) {
  Finish(1, Verdict::kSuccess, Verdict::kSuccess, 400, 1'000, 1);
  Apply({LeaseJob{2, 1, 900, 1, 1}});
  EXPECT_EQ(Query("SELECT jobs, queued, leased, done, failed, dead, cancelled, solved FROM experiment_list").rows.at(0),
            (Row{Int(12), Int(10), Int(1), Int(1), Int(0), Int(0), Int(0), Int(1)}));
}

TEST_F(BenchmarkTable, ExperimentListTellsWhoseAndWhat) {
  NewExperiment second = SampleExperiment(2, 13, 9);
  second.submitter = "ada";
  second.seed = 7;
  Apply({CreateExperiment{second}, TagExperiment{2, "paper", true}, TagExperiment{2, "baseline", true}});
  EXPECT_EQ(Query("SELECT name, submitter, tags, dataset, seed, repetitions FROM experiment_list").rows,
            (std::vector<Row>{{Text("sample"), Text(""), Text(""), Text("garage"), Int(1), Int(1)},
                              {Text("sample"), Text("ada"), Text("baseline,paper"), Text("garage"), Int(7), Int(1)}}));
}

}  // namespace
}  // namespace legopt::db
