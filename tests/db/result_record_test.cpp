// The columns of a result: the column descriptions agree with the schema.

#include "db/result_record.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

// Returns a record whose columns have distinct values, each allowed for every column.
ResultRecord DistinctValues() {
  ResultRecord record;
  int next = 2;
  ForEachResultColumn([&](const auto& column) {
    auto& member = record.*column.member;
    using Value = std::remove_cvref_t<decltype(member)>;
    if constexpr (std::is_same_v<Value, std::string>) {
      member = "[" + std::to_string(next++) + "]";
    } else if constexpr (std::is_same_v<Value, std::vector<std::uint8_t>>) {
      member.assign(3, static_cast<std::uint8_t>(next++));
    } else if constexpr (std::is_same_v<Value, double>) {
      member = 1.0 / next++;
    } else if constexpr (!std::is_enum_v<Value> && !std::is_same_v<Value, std::optional<Verdict>>) {
      member = next++;
    }
  });
  record.solver_status = SolveStatus::kNumericalFailure;
  record.verdict_literal = record.verdict_strict = record.verdict_solid = record.verdict_physical =
      Verdict::kWindowUnsolved;
  record.window_verdict = Verdict::kStep;
  std::swap(record.windows, record.windows_solved);  // the larger one is the total
  return record;
}

template <class Member>
Value Stored(const Member& member) {
  if constexpr (std::is_same_v<Member, std::optional<Verdict>>) {
    return std::string(ToString(*member));
  } else if constexpr (std::is_enum_v<Member>) {
    return std::string(ToString(member));
  } else if constexpr (std::is_integral_v<Member>) {
    return std::int64_t{member};
  } else if constexpr (std::is_same_v<Member, std::vector<std::uint8_t>>) {
    return Blob{{member.begin(), member.end()}};
  } else {
    return member;
  }
}

class ResultColumns : public testing::Test {
 protected:
  void SetUp() override {
    store_->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)}});
  }

  std::vector<Value> RowOf(const std::string& table, const std::string& columns) {
    return ReadOnlyDatabase(path_).Query("SELECT " + columns + " FROM " + table).rows.at(0);
  }
  void Accept(const ResultRecord& record) {
    store_->Apply(std::vector<StoreOp>{LeaseJob{1, 1, 71, 1, 1}, AcceptResult{1, 1, record, "", "", 2}});
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::unique_ptr<Store> store_ = OpenSqliteStore(path_);
};

TEST_F(ResultColumns, AreThoseOfTheTable) {
  std::set<std::string> described{"job_id",         "cell_id",       "received_at_us",
                                  "solved_literal", "solved_strict", "history_json"};  // the last: before version 7
  std::apply([&](const auto&... columns) { (described.insert(std::string(columns.name)), ...); }, kResultColumns);
  std::set<std::string> in_table;
  for (const auto& row : ReadOnlyDatabase(path_).Query("SELECT name FROM pragma_table_xinfo('results')").rows) {
    in_table.insert(std::get<std::string>(row.at(0)));
  }
  EXPECT_EQ(described, in_table);
}

TEST_F(ResultColumns, HoldWhatTheRecordHas) {
  const ResultRecord record = DistinctValues();
  ASSERT_EQ(FaultOf(record), "");
  Accept(record);
  ForEachResultColumn([&](const auto& column) {
    EXPECT_EQ(RowOf("results", std::string(column.name)).at(0), Stored(record.*column.member)) << column.name;
  });
  EXPECT_EQ(RowOf("results", "job_id, cell_id, attempt, received_at_us"),
            (std::vector<Value>{std::int64_t{1}, std::int64_t{1}, std::int64_t{1}, std::int64_t{2}}));
}

TEST_F(ResultColumns, AreNullWhereThereIsNothing) {
  ResultRecord record = SampleResult();
  record.solver_cost = std::numeric_limits<double>::infinity();
  Accept(record);
  std::set<std::string> null;
  ForEachResultColumn([&](const auto& column) {
    const Value value = RowOf("results", std::string(column.name)).at(0);
    if (std::holds_alternative<std::monostate>(value)) null.insert(std::string(column.name));
  });
  EXPECT_EQ(null, (std::set<std::string>{"solver_cost",
                                         "failed_waypoint",
                                         "windows",
                                         "windows_solved",
                                         "interpolation_environment_depth_m",
                                         "interpolation_self_depth_m",
                                         "interpolation_free_share",
                                         "trace",
                                         "starts",
                                         "term_evaluations",
                                         "collision_queries",
                                         "work_ns",
                                         "window_verdict",
                                         "holding_postures",
                                         "holding_without_equilibrium",
                                         "holding_over_torque",
                                         "halfway_postures",
                                         "halfway_without_equilibrium",
                                         "halfway_over_torque",
                                         "duration_s",
                                         "reduced_duration_s",
                                         "velocity_limited_share",
                                         "torque_limited_share",
                                         "contact_limited_share"}));
}

TEST_F(ResultColumns, AreKeptOfALateResult) {
  ResultRecord record = DistinctValues();
  record.waypoint_size = 2;
  record.waypoints = {1, 2};
  store_->Apply(std::vector<StoreOp>{LeaseJob{1, 1, 71, 1, 1},
                                     EndAttempt{1, 1, AttemptOutcome::kExpired, JobState::kQueued, 0, "", "", 2},
                                     RecordStaleResult{1, 1, AttemptOutcome::kFinished, "late", record, "said", 3}});
  std::set<std::string> kept;
  ForEachResultColumn([&](const auto& column) {
    if (!column.also_stale) return;
    kept.insert(std::string(column.name));
    EXPECT_EQ(RowOf("stale_results", std::string(column.name)).at(0), Stored(record.*column.member)) << column.name;
  });
  EXPECT_EQ(kept, (std::set<std::string>{"solver_status", "iterations", "wall_us", "cpu_us", "verdict_literal",
                                         "verdict_strict", "verdict_detail", "cost", "num_waypoints"}));
  EXPECT_EQ(RowOf("stale_results", "outcome, reason, message, received_at_us, waypoint_size, hex(x)"),
            (std::vector<Value>{std::string("finished"), std::string("late"), std::string("said"), std::int64_t{3},
                                std::int64_t{2}, std::string("000000000000F03F0000000000000040")}));
}

// Programs read the output of `legopt show JOB --format json`, in this order.
TEST_F(ResultColumns, AreShownInTheirOrder) {
  EXPECT_EQ(
      ShownResultColumns(),
      "solver_status, iterations, restarts, starts, term_evaluations, collision_queries, work_ns, margin_relaxed, "
      "solver_cost, solver_violation, verdict_literal, verdict_strict, verdict_solid, verdict_physical, "
      "verdict_detail, "
      "failed_waypoint, num_waypoints, "
      "cost, time_s, wall_us, cpu_us, "
      "involuntary_context_switches, peak_memory_bytes, windows, windows_solved, window_verdict, "
      "interpolation_environment_depth_m, interpolation_self_depth_m, interpolation_free_share, "
      "holding_postures, holding_without_equilibrium, holding_over_torque, halfway_postures, "
      "halfway_without_equilibrium, halfway_over_torque, duration_s, reduced_duration_s, "
      "velocity_limited_share, torque_limited_share, contact_limited_share, attempt, "
      "length(trace) AS trace_bytes");
}

TEST(ResultFault, NamesTheColumnAndItsRange) {
  const auto fault = [](auto member, auto value) {
    ResultRecord record = SampleResult();
    record.*member = value;
    return FaultOf(record);
  };
  EXPECT_EQ(FaultOf(SampleResult()), "");
  EXPECT_EQ(fault(&ResultRecord::peak_memory_bytes, -1), "peak_memory_bytes is negative");
  EXPECT_EQ(fault(&ResultRecord::num_waypoints, 0), "num_waypoints is below 1");
  EXPECT_EQ(fault(&ResultRecord::verdict_solid, Verdict::kContainment),
            "a success by the physical rule that is none by the solid one");
  EXPECT_EQ(fault(&ResultRecord::verdict_strict, Verdict::kContainment),
            "verdict 'containment' by a more lenient rule than the solid one");
  EXPECT_EQ(fault(&ResultRecord::verdict_literal, Verdict::kStep),
            "verdict 'step' by a more lenient rule than the solid one");
  EXPECT_EQ(fault(&ResultRecord::verdict_physical, Verdict::kTorque), "");
  EXPECT_EQ(fault(&ResultRecord::verdict_solid, Verdict::kTorque),
            "verdict 'torque' by a more lenient rule than the physical one");
  EXPECT_EQ(fault(&ResultRecord::verdict_strict, Verdict::kSelfCollision),
            "a success by the solid rule that is none by the strict one");
  EXPECT_EQ(fault(&ResultRecord::interpolation_free_share, 1.01), "interpolation_free_share is not within 0 .. 1");
  EXPECT_EQ(fault(&ResultRecord::interpolation_free_share, std::numeric_limits<double>::quiet_NaN()), "");
  EXPECT_EQ(fault(&ResultRecord::interpolation_self_depth_m, -0.5), "interpolation_self_depth_m is negative");
  EXPECT_EQ(fault(&ResultRecord::cost, std::numeric_limits<double>::infinity()), "a success without a finite cost");
  EXPECT_EQ(fault(&ResultRecord::windows_solved, 3), "windows_solved (3) is not within 0 .. windows (0)");
  EXPECT_EQ(fault(&ResultRecord::waypoint_size, 2),
            "the number of waypoint values (3) is not a multiple of waypoint_size (2)");
}

TEST(ResultFault, NamesTheCheckOfAViolation) {
  const auto fault = [](Verdict check, Rule rule, double value, int waypoint = -1, std::size_t count = 1) {
    ResultRecord record = SampleResult();
    Violation violation;
    violation.check = check;
    violation.rule = rule;
    violation.value = value;
    violation.waypoint = waypoint;
    record.violations.assign(count, violation);
    return FaultOf(record);
  };
  EXPECT_EQ(fault(Verdict::kStep, Rule::kSolid, 0.0), "");
  EXPECT_EQ(fault(Verdict::kStep, Rule::kSolid, -0.1), "the value of check 'step' is negative or not a number");
  EXPECT_EQ(fault(Verdict::kStep, Rule::kSolid, std::nan("")), "the value of check 'step' is negative or not a number");
  EXPECT_EQ(fault(Verdict::kCom, Rule::kLiteral, 0.0, -2), "the value of check 'com' has waypoint -2");
  EXPECT_EQ(fault(Verdict::kCom, Rule::kLiteral, 0.0, 3, 2),
            "the value of check 'com' by the literal rule occurs twice");
  EXPECT_EQ(fault(Verdict::kNotFinite, Rule::kLiteral, 1.0), "check 'not_finite' has no value");
}

TEST_F(ResultColumns, ViolationsAreStoredInTheirTable) {
  ResultRecord record = SampleResult();
  Violation violation;
  violation.check = Verdict::kContainment;
  violation.rule = Rule::kSolid;
  violation.subject = "l_hand and pelvis";
  violation.value = 0.25;
  record.violations = {violation};
  Accept(record);
  const auto row = ReadOnlyDatabase(path_).Query("SELECT * FROM violations").rows;
  ASSERT_EQ(row.size(), 1U);
  EXPECT_EQ(row.at(0), (std::vector<Value>{std::int64_t{1}, std::string("containment"), std::string("solid"),
                                           std::monostate{}, std::string("l_hand and pelvis"), 0.25}));
}

ResultRecord UnsolvedResult() {
  ResultRecord record = SampleResult();
  record.verdict_literal = record.verdict_strict = record.verdict_solid = record.verdict_physical =
      Verdict::kWindowUnsolved;
  record.window_verdict = Verdict::kFootPose;
  record.windows = 3;
  record.windows_solved = 1;
  record.first_unsolved = 10;
  record.num_unsolved = 2;
  record.unsolved = {1, 2, 3, 4};
  return record;
}

TEST(ResultFault, AnUnsolvedWindowIsOneByAllRulesAndLacksAWindow) {
  const auto fault = [](auto member, auto value) {
    ResultRecord record = UnsolvedResult();
    record.*member = value;
    return FaultOf(record);
  };
  EXPECT_EQ(FaultOf(UnsolvedResult()), "");
  EXPECT_EQ(fault(&ResultRecord::window_verdict, std::optional<Verdict>()), "") << "the window was not begun";
  EXPECT_EQ(fault(&ResultRecord::verdict_strict, Verdict::kCom), "verdict 'window_unsolved' by some rules only");
  EXPECT_EQ(fault(&ResultRecord::windows_solved, 3), "verdict 'window_unsolved' with all windows solved");
  EXPECT_EQ(fault(&ResultRecord::num_unsolved, 3),
            "the number of unsolved values (4) is not a multiple of num_unsolved (3)");
  ResultRecord record = SampleResult();
  record.window_verdict = Verdict::kSuccess;
  EXPECT_EQ(FaultOf(record), "a window without a solution, but no verdict 'window_unsolved'");
}

TEST_F(ResultColumns, KeepTheUnsolvedWindowApartFromTheSolution) {
  Accept(UnsolvedResult());
  EXPECT_EQ(RowOf("waypoints", "count(*)").at(0), Value(std::int64_t{1}));
  EXPECT_EQ(RowOf("unsolved_waypoints", "group_concat(waypoint || ':' || hex(x))").at(0),
            Value(std::string("10:000000000000F03F0000000000000040,11:00000000000008400000000000001040")));
  EXPECT_EQ(RowOf("experiment_list", "solved").at(0), Value(std::int64_t{0}));
  EXPECT_EQ(RowOf("benchmark_cells", "solved || '/' || n || coalesce(cost, '-') || coalesce(time_s, '-')").at(0),
            Value(std::string("0/2--")))
      << "in no average";
  EXPECT_EQ(RowOf("failures", "verdict_literal").at(0), Value(std::string("window_unsolved")));
}

}  // namespace
}  // namespace legopt::db
