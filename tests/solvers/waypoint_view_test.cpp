// One waypoint of a program as a program of its own: its terms, its variables, and the unchanged rest.

#include <gtest/gtest.h>

#include "legopt/problem/program.h"
#include "legopt/solvers/internal/sqp_solver.h"
#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

/// Three waypoints on a line, the last one fixed at 2: a cost and a constraint of each, and a constraint of
/// neighbours.
class WaypointViewTest : public ::testing::Test {
 protected:
  WaypointViewTest() : program_(Vector3d(-1, -1, 2), Vector3d(3, 3, 2), 3) {
    for (int t = 0; t < 3; ++t) {
      program_.AddShaped({"cost", TermKind::kCost, t, 1, -1}, [](const VectorXd& x) { return x; });
      program_.AddShaped({"floor", TermKind::kInequality, t, 1, -1},
                         [t](const VectorXd& x) { return One(t + 0.5 - x[0]); });
    }
    program_.AddShaped({"chain", TermKind::kEquality, 0, 2, -1}, [](const VectorXd& x) { return One(x[1] - x[0]); });
  }

  AnalyticProgram program_;
  VectorXd x_ = Vector3d(0, 0, 2);
};

TEST_F(WaypointViewTest, HoldsTheConstraintsOfItsWaypointAlone) {
  const WaypointView view(program_, 1, x_);
  EXPECT_EQ(view.num_waypoints(), 1);
  ASSERT_EQ(view.terms().size(), 1u);
  const TermShape& shape = view.terms()[0]->shape();
  EXPECT_EQ(shape.name, "floor");
  EXPECT_EQ(shape.waypoint, 0) << "seen from inside, it is the first";
}

TEST_F(WaypointViewTest, MovesItsPartOfTheWhole) {
  WaypointView view(program_, 1, x_);
  view.SetPoint(One(0.25));
  std::vector<double> floor;
  view.terms()[0]->Evaluate(floor);
  EXPECT_EQ(floor, std::vector<double>{1.25});
  std::vector<double> all;
  for (const auto& term : program_.terms()) {
    if (term->shape().name == "cost") term->Evaluate(all);
  }
  EXPECT_EQ(all, (std::vector<double>{0, 0.25, 2}));
}

TEST_F(WaypointViewTest, BoundsAreThoseOfItsWaypoint) {
  const WaypointView view(program_, 1, x_);
  VectorXd lower(1), upper(1), x = One(0.5), next(1);
  view.StepBounds(x, lower, upper);
  EXPECT_EQ(lower[0], -1.5);
  EXPECT_EQ(upper[0], 2.5);
  view.Retract(x, One(9), next);
  EXPECT_EQ(next[0], 3);
  x[0] = -7;
  view.ProjectOnBounds(x);
  EXPECT_EQ(x[0], -1);
  EXPECT_TRUE(view.IsFree());
  EXPECT_FALSE(WaypointView(program_, 2, x_).IsFree());
}

TEST_F(WaypointViewTest, IsSolvedAtTheCostOfTheWholeProgram) {
  WaypointView view(program_, 1, x_);
  VectorXd x = One(0);
  SolverContext context;
  const SolverResult result = SqpSolver(SqpOptions()).Solve(view, x, context);
  EXPECT_TRUE(result.feasible);
  EXPECT_NEAR(x[0], 1.5, 1e-3);
  EXPECT_EQ(result.value.cost, 0) << "costs are left out";
  EXPECT_EQ(program_.TermEvaluations(), view.TermEvaluations());
  EXPECT_GT(view.TermEvaluations(), 0);
}

}  // namespace
}  // namespace legopt
