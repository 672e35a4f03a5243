// The result in a worker's report is converted to the record of the store: every column from the field of the same
// name.

#include "server/result_message.h"

#include <gtest/gtest.h>

#include "bus/message_fields.h"

namespace legopt::server {
namespace {

// Returns a message whose numbers and texts are all distinct.
legopt_msg::result_request DistinctReport() {
  legopt_msg::result_request request{};
  int next = 1;
  const auto fill = [&](auto& member) {
    using Value = std::remove_cvref_t<decltype(member)>;
    if constexpr (std::is_arithmetic_v<Value>) member = static_cast<Value>(next++);
    if constexpr (std::is_same_v<Value, std::string>) member = "text " + std::to_string(next++);
  };
  std::apply([&](const auto&... fields) { (fill(request.*fields.member), ...); },
             bus::kFields<legopt_msg::result_request>);
  request.solver_status = "time_limit";
  request.verdict_literal = "success";
  request.verdict_strict = "self_collision";
  request.verdict_solid = request.verdict_physical = "containment";
  request.window_verdict = "joint_limit";
  request.waypoints = {1, 2};
  request.unsolved = {3, 4};
  request.trace = {3, 4, 5};
  legopt_msg::violation& violation = request.violations.emplace_back();
  violation.check = "containment";
  violation.rule = "solid";
  violation.waypoint = 7;
  violation.subject = "hand and pelvis";
  violation.value = 0.25;
  return request;
}

TEST(ResultMessage, EveryColumnComesFromTheFieldOfItsName) {
  const legopt_msg::result_request request = DistinctReport();
  const auto [record, fault] = ResultOf(request);
  EXPECT_EQ(fault, "");
  EXPECT_EQ(record.solver_status, SolveStatus::kTimeLimit);
  EXPECT_EQ(record.verdict_literal, Verdict::kSuccess);
  EXPECT_EQ(record.verdict_strict, Verdict::kSelfCollision);
  EXPECT_EQ(record.verdict_solid, Verdict::kContainment);
  EXPECT_EQ(record.iterations, request.iterations);
  EXPECT_EQ(record.restarts, request.restarts);
  EXPECT_EQ(record.starts, request.starts);
  EXPECT_EQ(record.term_evaluations, request.term_evaluations);
  EXPECT_EQ(record.collision_queries, request.collision_queries);
  EXPECT_EQ(record.wall_us, request.wall_us);
  EXPECT_EQ(record.cpu_us, request.cpu_us);
  EXPECT_EQ(record.involuntary_context_switches, request.involuntary_context_switches);
  EXPECT_EQ(record.peak_memory_bytes, request.peak_memory_bytes);
  EXPECT_EQ(record.solver_cost, request.solver_cost);
  EXPECT_EQ(record.solver_violation, request.solver_violation);
  EXPECT_EQ(record.verdict_detail, request.verdict_detail);
  EXPECT_EQ(record.failed_waypoint, request.failed_waypoint);
  EXPECT_EQ(record.cost, request.cost);
  EXPECT_EQ(record.interpolation_environment_depth_m, request.interpolation_environment_depth_m);
  EXPECT_EQ(record.interpolation_self_depth_m, request.interpolation_self_depth_m);
  EXPECT_EQ(record.interpolation_free_share, request.interpolation_free_share);
  EXPECT_EQ(record.duration_s, request.duration_s);
  EXPECT_EQ(record.reduced_duration_s, request.reduced_duration_s);
  EXPECT_EQ(record.velocity_limited_share, request.velocity_limited_share);
  EXPECT_EQ(record.torque_limited_share, request.torque_limited_share);
  EXPECT_EQ(record.contact_limited_share, request.contact_limited_share);
  ASSERT_EQ(record.violations.size(), 1U);
  EXPECT_EQ(record.violations[0].check, Verdict::kContainment);
  EXPECT_EQ(record.violations[0].rule, Rule::kSolid);
  EXPECT_EQ(record.violations[0].waypoint, 7);
  EXPECT_EQ(record.violations[0].subject, "hand and pelvis");
  EXPECT_EQ(record.violations[0].value, 0.25);
  EXPECT_EQ(record.windows, request.windows);
  EXPECT_EQ(record.windows_solved, request.windows_solved);
  EXPECT_EQ(record.window_verdict, Verdict::kJointLimit);
  EXPECT_EQ(record.first_unsolved, request.first_unsolved);
  EXPECT_EQ(record.num_unsolved, request.num_unsolved);
  EXPECT_EQ(record.unsolved, request.unsolved);
  EXPECT_EQ(record.trace, request.trace);
  EXPECT_EQ(record.num_waypoints, request.num_waypoints);
  EXPECT_EQ(record.waypoint_size, request.waypoint_size);
  EXPECT_EQ(record.waypoints, request.waypoints);
}

TEST(ResultMessage, TheFirstUnknownWordIsNamed) {
  legopt_msg::result_request request = DistinctReport();
  request.num_waypoints = 0;
  request.verdict_strict = "perfect";
  EXPECT_EQ(ResultOf(request).fault, "verdict_strict 'perfect' is unknown");
  request.violations[0].check = "elegance";
  EXPECT_EQ(ResultOf(request).fault, "verdict_strict 'perfect' is unknown");
  request.verdict_strict = "success";
  EXPECT_EQ(ResultOf(request).fault, "violations: check 'elegance' is unknown");
  request.solver_status = "";
  EXPECT_EQ(ResultOf(request).fault, "solver_status '' is unknown");
  EXPECT_EQ(ResultOf(request).record.num_waypoints, 1);
}

TEST(ResultMessage, OutcomesKeepTheirMeaning) {
  for (const auto& [reported, word] : kEnumNames<ReportedOutcome>) {
    legopt_msg::result_request request{};
    request.outcome = EnumNumber(reported);
    // A worker reports a released attempt as refused.
    EXPECT_EQ(ToString(OutcomeOf(request)), reported == ReportedOutcome::kRefused ? "returned" : word);
  }
}

}  // namespace
}  // namespace legopt::server
