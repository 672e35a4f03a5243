// Problems that LegOpt-best solves with nearly the full tolerance of the judge, where a solver's own tolerance does
// not suffice.

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "legopt/geometry/collision_query.h"
#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/robot/kinematics.h"
#include "tests/folders.h"

namespace legopt {
namespace {

/// Returns the nearest contact of two links at x.
ProximityPair ContactOf(const Dataset& dataset, int link_a, int link_b, const Eigen::VectorXd& x) {
  constexpr double kFar_m = 1.0;
  Kinematics kinematics(dataset.robot());
  kinematics.Update(x);
  CollisionQuery query(dataset.collision_model());
  std::optional<ProximityPair> nearest;
  for (const ProximityPair& contact : query.Contacts(kinematics, kFar_m)) {
    if (contact.link_a != link_a || contact.link_b != link_b) continue;
    if (!nearest || contact.distance_m < nearest->distance_m) nearest = contact;
  }
  return nearest.value();
}

/// Returns the stance of a posture problem with its second foot moved into the first one by `overlap_m`.
Stance OverlappingFeetStance(const Dataset& dataset, ProblemSolver& solver, const ProblemDefinition& problem,
                             double overlap_m) {
  const SolveOutcome apart = solver.Solve(Task::kPosture, problem.id, Initialization::kGood, Method::Of("best"), {});
  Stance stance = problem.stances.front();
  const int first = dataset.contact(stance.contacts[0].contact).link_index;
  const int second = dataset.contact(stance.contacts[1].contact).link_index;
  const ProximityPair contact =
      ContactOf(dataset, std::min(first, second), std::max(first, second), apart.waypoints.front());
  const double sign = first < second ? 1.0 : -1.0;  // the normal is from the later link to the earlier one
  stance.contacts[1].position += sign * (contact.distance_m + overlap_m) * contact.normal_W;
  return stance;
}

// The overlap exceeds the sum of a margin of 0.5 mm and three tolerances of 0.4 mm, and is less than twice the judge's
// 1 mm.
TEST(EmbeddedPostures, LegOptBestSolvesOverlappingFeet) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  ProblemSolver solver(dataset);
  Judge judge(dataset);
  const ProblemDefinition& problem = dataset->problems(Task::kPosture).front();
  const ProblemDefinition narrow{.id = 0, .stances = {OverlappingFeetStance(*dataset, solver, problem, 9e-4)}};
  const auto solve = [&](const Method& method) {
    return solver.Solve(Task::kPosture, narrow, Initialization::kGood, method, {});
  };
  EXPECT_NE(solve({}).status, SolveStatus::kConvergedFeasible) << "nothing is in the way";
  const SolveOutcome best = solve(Method::Of("best"));
  EXPECT_EQ(best.status, SolveStatus::kConvergedFeasible);
  const Evaluation evaluation = judge.Evaluate(Task::kPosture, narrow, best.waypoints);
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
}

}  // namespace
}  // namespace legopt
