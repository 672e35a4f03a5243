// Internal restarts of LegOpt-best.

#include "legopt/solvers/internal/best_solver.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

using Eigen::VectorXd;

/// Adds two wells, the left one with lower cost; SQP from the right ends in the right one.
void AddTwoWells(AnalyticProgram& program) {
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(x[0] * x[0] - 1.0); });
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(0.3 * (x[0] + 1.0)); });
}

SolverResult Solve(const BestOptions& options, AnalyticProgram& program, VectorXd& x) {
  std::mt19937_64 generator(3);
  SolverContext context;
  context.generator = &generator;
  return BestSolver(options).Solve(program, x, context);
}

TEST(Best, RefinementsFindTheCheaperWell) {
  AnalyticProgram program(One(-2), One(2));
  AddTwoWells(program);
  BestOptions options;
  options.refinement_noise = 2.0;
  options.refinements = 0;
  VectorXd x = One(1.5);
  const SolverResult once = Solve(options, program, x);
  EXPECT_NEAR(x[0], 0.95, 0.1);
  options.refinements = 20;
  x = One(1.5);
  const SolverResult best = Solve(options, program, x);
  EXPECT_NEAR(x[0], -1.0, 0.1);
  EXPECT_LT(best.value.cost, once.value.cost);
  EXPECT_GT(best.iterations, once.iterations);
  EXPECT_EQ(once.starts, 1);
  EXPECT_EQ(best.starts, 1 + options.refinements);
}

/// Adds x (x^2 - 1) > 0.5, which holds only for x > 1.19; further left the gradient leads into a valley.
void AddPit(AnalyticProgram& program) {
  program.Add(TermKind::kInequality, [](const VectorXd& x) { return One(0.5 - x[0] * (x[0] * x[0] - 1.0)); });
}

TEST(Best, RestartsBeginWhereTheFirstAttemptFailed) {
  AnalyticProgram program(One(-1), One(3));
  AddPit(program);
  BestOptions options;
  options.rescue_noise = 3.0;
  options.rescues = 0;
  VectorXd x = One(-0.9);
  EXPECT_FALSE(Solve(options, program, x).feasible);
  options.rescues = 20;
  x = One(-0.9);
  EXPECT_TRUE(Solve(options, program, x).feasible);
  EXPECT_GT(x[0], 1.19);
}

TEST(Best, FreeVariablesAreNotScattered) {
  const double infinity = std::numeric_limits<double>::infinity();
  AnalyticProgram program(Eigen::Vector2d(-2, -infinity), Eigen::Vector2d(2, infinity));
  AddTwoWells(program);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(std::cos(x[1])); });
  BestOptions options;
  options.refinements = 50;
  options.refinement_noise = 9.0;
  VectorXd x = Eigen::Vector2d(1.5, M_PI / 2);
  Solve(options, program, x);
  EXPECT_NEAR(x[1], M_PI / 2, 1e-3) << "the next optimum of the free variable is far away";
}

/// Three waypoints, each attracted by its neighbours; the middle one has the pit of AddPit.
class ChainWithAPit : public AnalyticProgram {
 public:
  ChainWithAPit() : AnalyticProgram(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(3, 3, 3), 3) {
    for (int t : {0, 1}) {
      AddShaped({"chain", TermKind::kCost, t, 2, -1}, [](const VectorXd& x) { return One(x[1] - x[0]); });
    }
    AddShaped({"pit", TermKind::kInequality, 1, 1, -1},
              [](const VectorXd& x) { return One(0.5 - x[0] * (x[0] * x[0] - 1.0)); });
  }
};

/// Returns options with too little noise to leave the pit and steps too short to cross its wall.
BestOptions QuietRestarts() {
  BestOptions options;
  options.sqp.trust_box_size = 0.05;
  options.sqp.trust_expand_ratio = 1.0;
  options.rescue_noise = 1e-3;
  return options;
}

TEST(Best, SingleWaypointSearchSolvesChain) {
  ChainWithAPit program;
  BestOptions options = QuietRestarts();
  const Eigen::Vector3d start(1.5, -0.9, 1.5);
  // Fixed neighbours can neither pull the middle waypoint out of its pit nor be pulled into it.
  program.AddShaped({"first", TermKind::kEquality, 0, 1, -1}, [](const VectorXd& x) { return One(x[0] - 1.5); });
  program.AddShaped({"last", TermKind::kEquality, 2, 1, -1}, [](const VectorXd& x) { return One(x[0] - 1.5); });
  options.waypoint_starts = 0;
  VectorXd x = start;
  const SolverResult without = Solve(options, program, x);
  EXPECT_FALSE(without.feasible);
  EXPECT_EQ(without.starts, 1 + options.rescues);
  options.waypoint_starts = 20;
  x = start;
  const SolverResult with = Solve(options, program, x);
  EXPECT_TRUE(with.feasible);
  EXPECT_GT(x[1], 1.19);
  EXPECT_EQ(with.starts, 1 + 2 + 1) << "the chain, the violated waypoint alone in its pit and from its neighbour's "
                                       "place, the chain";
}

// The pit is between the initial guess and the optimum of the costs, and its gradient points away from it.
TEST(Best, FreeDescentPassesObstacle) {
  AnalyticProgram program(Eigen::Vector2d(-1, -1), Eigen::Vector2d(3, 3), 2);
  program.AddShaped({"there", TermKind::kCost, 0, 2, -1},
                    [](const VectorXd& x) { return VectorXd(Eigen::Vector2d(x[0] - 1.5, x[1] - 1.6)); });
  program.AddRemovable({"pit", TermKind::kInequality, 1, 1, -1},
                       [](const VectorXd& x) { return One(0.5 - x[0] * (x[0] * x[0] - 1.0)); });
  BestOptions options = QuietRestarts();
  options.rescues = 0;
  options.free_iterations = 0;
  VectorXd x = Eigen::Vector2d(1.5, -0.9);
  EXPECT_FALSE(Solve(options, program, x).feasible);
  options.free_iterations = 60;
  x = Eigen::Vector2d(1.5, -0.9);
  const SolverResult result = Solve(options, program, x);
  EXPECT_TRUE(result.feasible);
  EXPECT_NEAR(x[1], 1.6, 0.1);
  EXPECT_EQ(result.starts, 1) << "it is a way to begin, not another start";
  EXPECT_GT(result.iterations, 40) << "but its steps count";
  std::vector<double> rows;
  program.SetPoint(Eigen::Vector2d(1.5, 0.0));
  program.terms()[1]->Evaluate(rows);
  EXPECT_EQ(rows, std::vector<double>{0.5}) << "what was set aside is back";
}

// The free descent ends in a dead end, so the original initial guess is tried next.
TEST(Best, AStartThatAFreeDescentSpoilsIsTriedAsItWas) {
  AnalyticProgram program(Eigen::Vector2d(-1, -1), Eigen::Vector2d(3, 3), 2);
  program.AddShaped({"there", TermKind::kCost, 0, 2, -1},
                    [](const VectorXd& x) { return VectorXd(Eigen::Vector2d(x[0] + 0.9, x[1] + 0.9)); });
  program.AddRemovable({"pit", TermKind::kInequality, 1, 1, -1},
                       [](const VectorXd& x) { return One(0.5 - x[0] * (x[0] * x[0] - 1.0)); });
  BestOptions options = QuietRestarts();
  options.rescues = 1;
  options.free_iterations = 60;
  VectorXd x = Eigen::Vector2d(1.5, 1.5);
  const SolverResult result = Solve(options, program, x);
  EXPECT_TRUE(result.feasible);
  EXPECT_GT(x[1], 1.19 - options.sqp.constraint_tolerance);
  EXPECT_EQ(result.starts, 2);
}

// The costs attract the middle waypoint into the pit more strongly than the first penalties repel it.
TEST(Best, WaypointsThatWereSolvedAloneAreNotLost) {
  ChainWithAPit program;
  program.AddShaped({"into the pit", TermKind::kCost, 1, 1, -1},
                    [](const VectorXd& x) { return One(100.0 * (x[0] + 0.9)); });
  program.AddShaped({"first", TermKind::kEquality, 0, 1, -1}, [](const VectorXd& x) { return One(x[0] - 1.5); });
  program.AddShaped({"last", TermKind::kEquality, 2, 1, -1}, [](const VectorXd& x) { return One(x[0] - 1.5); });
  BestOptions options = QuietRestarts();
  options.window_improve_frac = 1e-4;  // its steps are small
  options.rescues = 1;
  VectorXd x = Eigen::Vector3d(1.5, -0.9, 1.5);
  const SolverResult result = Solve(options, program, x);
  EXPECT_TRUE(result.feasible);
  EXPECT_GT(x[1], 1.19 - options.sqp.constraint_tolerance);
  EXPECT_EQ(result.starts, 1 + 2 + 2) << "the chain, the waypoint twice, the chain from there, and once more steadily";
}

// The first start, at the current point, ends in the pit; the neighbour's position is only tried second.
TEST(Best, ViolatedWaypointGetsManyStartsLast) {
  ChainWithAPit program;
  program.AddShaped({"first", TermKind::kEquality, 0, 1, -1}, [](const VectorXd& x) { return One(x[0] - 1.5); });
  program.AddShaped({"last", TermKind::kEquality, 2, 1, -1}, [](const VectorXd& x) { return One(x[0] - 1.5); });
  BestOptions options = QuietRestarts();
  options.rescues = 1;
  options.waypoint_starts = 1;
  VectorXd x = Eigen::Vector3d(1.5, -0.9, 1.5);
  const SolverResult result = Solve(options, program, x);
  EXPECT_TRUE(result.feasible);
  EXPECT_GT(x[1], 1.19 - options.sqp.constraint_tolerance);
  EXPECT_EQ(result.starts, 1 + (1 + 1) + (2 + 1)) << "the chain, a rescue with one start, a rescue with two";
}

TEST(Best, UnsolvableWaypointDoesNotChangeRestarts) {
  ChainWithAPit program;
  program.AddShaped({"never", TermKind::kEquality, 1, 1, -1}, [](const VectorXd& x) { return One(x[0] * x[0] + 1); });
  BestOptions options = QuietRestarts();
  options.rescues = 3;
  options.waypoint_starts = 5;
  VectorXd x = Eigen::Vector3d(1.5, -0.9, 1.5);
  const SolverResult result = Solve(options, program, x);
  EXPECT_FALSE(result.feasible);
  EXPECT_EQ(result.starts, 1 + 5 + 1 + 5 + 1 + 1 + 5 * 5)
      << "the other waypoints have nothing to be solved for alone; the last 25 are those of patience";
}

// Two walls 0.02 apart, each with a margin of 0.015.
TEST(Best, UnsolvedProblemRelaxesMargins) {
  AnalyticProgram program(One(-1), One(1));
  program.AddWithMargin([](const VectorXd& x) { return One(x[0] - 0.51); }, 0.015);
  program.AddWithMargin([](const VectorXd& x) { return One(0.49 - x[0]); }, 0.015);
  BestOptions options = QuietRestarts();
  options.rescues = 0;
  VectorXd x = One(0.0);
  EXPECT_FALSE(Solve(options, program, x).feasible);
  options.rescues = 3;
  x = One(0.0);
  const SolverResult result = Solve(options, program, x);
  EXPECT_TRUE(result.feasible);
  EXPECT_EQ(result.margin_relaxed, 0.5);
  EXPECT_NEAR(x[0], 0.5, 0.01 + options.sqp.constraint_tolerance);
  // The margin is restored afterwards, and is unchanged if another restart succeeds.
  std::vector<double> rows;
  program.SetPoint(One(0.51));
  program.terms()[0]->Evaluate(rows);
  EXPECT_NEAR(rows[0], 0.015, 1e-12);
  AnalyticProgram wide(One(-1), One(1));
  wide.AddWithMargin([](const VectorXd& y) { return One(0.49 - y[0]); }, 0.015);
  x = One(0.0);
  const SolverResult kept = Solve(options, wide, x);
  EXPECT_TRUE(kept.feasible);
  EXPECT_EQ(kept.margin_relaxed, 0.0);
  EXPECT_GT(x[0], 0.505 - options.sqp.constraint_tolerance);
}

// The cost attracts towards one of two walls, 0.015 apart. Both margins are halved, which suffices.
TEST(Best, MarginsAreHalvedFirst) {
  AnalyticProgram program(One(-1), One(1));
  program.AddWithMargin([](const VectorXd& x) { return One(0.49 - x[0]); }, 0.01);
  program.AddWithMargin([](const VectorXd& x) { return One(x[0] - 0.505); }, 0.01);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(100.0 * (x[0] - 0.49)); });
  BestOptions options = QuietRestarts();
  VectorXd x = One(0.0);
  const SolverResult result = Solve(options, program, x);
  EXPECT_TRUE(result.feasible);
  EXPECT_EQ(result.margin_relaxed, 0.5);
  EXPECT_NEAR(x[0], 0.495, 1.1 * options.sqp.constraint_tolerance);
}

// There is no solution near the initial guess. The costs attract away from the solution, which is found without them.
TEST(Best, ASingleWaypointIsSearchedWithoutItsCosts) {
  AnalyticProgram program(One(-1), One(3));
  AddPit(program);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(x[0] + 0.9); });
  BestOptions options = QuietRestarts();
  options.rescue_noise = 1.0;
  options.rescues = 4;
  options.waypoint_starts = 0;
  VectorXd x = One(-0.9);
  EXPECT_FALSE(Solve(options, program, x).feasible);
  options.rescues = 5;
  options.waypoint_starts = 40;
  x = One(-0.9);
  EXPECT_TRUE(Solve(options, program, x).feasible);
  EXPECT_GT(x[0], 1.19 - options.sqp.constraint_tolerance);
}

TEST(Best, AStopEndsTheWaypointsAlone) {
  ChainWithAPit program;
  program.AddRemovable({"aside", TermKind::kInequality, 0, 1, -1}, [](const VectorXd& x) { return One(x[0] - 1.4); });
  program.AddShaped({"never", TermKind::kEquality, 1, 1, -1}, [](const VectorXd& x) { return One(x[0] * x[0] + 1); });
  BestOptions options = QuietRestarts();
  options.waypoint_starts = 4;  // the time is quadratic in the starts
  VectorXd x = Eigen::Vector3d(1.5, -0.9, 1.5);
  std::mt19937_64 generator(3);
  SolverContext context;
  context.generator = &generator;
  int asked = 0;
  context.stop = [&asked]() -> std::optional<SolveStatus> {
    ++asked;
    return std::nullopt;
  };
  BestSolver(options).Solve(program, x, context);
  const int whole = asked;
  for (int last = 1; last < whole; last += 3) {
    asked = 0;
    context.stop = [&asked, last] {
      return ++asked < last ? std::nullopt : std::optional<SolveStatus>(SolveStatus::kCancelled);
    };
    generator.seed(3);
    x = Eigen::Vector3d(1.5, -0.9, 1.5);
    EXPECT_EQ(BestSolver(options).Solve(program, x, context).status, SolveStatus::kCancelled) << last;
    ASSERT_EQ(asked, last) << "asked again after it had said stop";
  }
}

/// Four waypoints at -1 or 1, the first one fixed at 1, and steps of at most 0.1: all must be at 1. Alone, each ends at
/// the nearer of both places.
class TwoPlaces : public AnalyticProgram {
 public:
  TwoPlaces() : AnalyticProgram(Eigen::Vector4d(1, -2, -2, -2), Eigen::Vector4d(1, 2, 2, 2), 4) {
    for (int t = 1; t < 4; ++t) {
      AddShaped({"place", TermKind::kEquality, t, 1, -1}, [](const VectorXd& x) { return One(x[0] * x[0] - 1.0); });
    }
    for (int t = 0; t < 3; ++t) {
      AddShaped({"step", TermKind::kInequality, t, 2, -1},
                [](const VectorXd& x) { return One(std::abs(x[1] - x[0]) - 0.1); });
    }
  }
};

TEST(Best, AChainOfWaypointsFollowsTheConstraintsBetweenThem) {
  TwoPlaces program;
  const Eigen::Vector4d start(1, -0.9, -0.9, -0.9);
  BestOptions options = QuietRestarts();
  options.waypoint_chains = WaypointChains::kNever;
  VectorXd x = start;
  EXPECT_FALSE(Solve(options, program, x).feasible);
  for (const WaypointChains chains : {WaypointChains::kLast, WaypointChains::kFirst}) {
    options.waypoint_chains = chains;
    x = start;
    const SolverResult result = Solve(options, program, x);
    EXPECT_TRUE(result.feasible);
    EXPECT_LT((x - Eigen::Vector4d::Ones()).cwiseAbs().maxCoeff(), 1e-3) << x.transpose();
  }
}

TEST(Best, AWaypointWithoutASolutionAloneIsReported) {
  TwoPlaces possible;
  BestOptions options = QuietRestarts();
  options.waypoint_chains = WaypointChains::kNever;
  VectorXd x = Eigen::Vector4d(1, -0.9, -0.9, -0.9);
  EXPECT_FALSE(Solve(options, possible, x).waypoint_unsolved) << "each has one; together they have none from there";
  TwoPlaces impossible;
  impossible.AddShaped({"nowhere", TermKind::kEquality, 2, 1, -1}, [](const VectorXd& y) { return One(y[0] - 0.5); });
  x = Eigen::Vector4d(1, -0.9, -0.9, -0.9);
  const SolverResult result = Solve(options, impossible, x);
  EXPECT_FALSE(result.feasible);
  EXPECT_TRUE(result.waypoint_unsolved);
}

}  // namespace
}  // namespace legopt
