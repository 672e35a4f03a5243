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

TEST_F(WaypointViewTest, MayIncludeItsCostsAndTheTermsSharedWithItsPredecessor) {
  program_.AddShaped({"next", TermKind::kEquality, 1, 2, -1}, [](const VectorXd& x) { return One(x[1] - x[0]); });
  WaypointView view(program_, 1, Vector3d(0.75, 0, 2), ViewedTerms::kUpToWaypoint);
  std::vector<std::string> names;
  for (const auto& term : view.terms()) names.push_back(term->shape().name);
  EXPECT_EQ(names, (std::vector<std::string>{"cost", "floor", "chain"})) << "the next waypoint's term is not its own";
  Term& chain = *view.terms()[2];
  EXPECT_EQ(chain.shape().waypoint, 0);
  EXPECT_EQ(chain.shape().num_waypoints, 1);
  view.SetPoint(One(0.25));
  std::vector<double> residuals;
  chain.Evaluate(residuals);
  EXPECT_EQ(residuals, std::vector<double>{0.25 - 0.75}) << "the predecessor stays";
  LinearModel model;
  chain.Linearize(model);
  ASSERT_EQ(model.rows(), 1);
  ASSERT_EQ(model.num_waypoints(), 1);
  EXPECT_EQ(model.value(0), -0.5);
  EXPECT_NEAR(model.row(0, 0)[0], 1.0, 1e-8) << "the derivative by this waypoint";
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
