// How costs grow when the work doubles, five times each. scripts/make-performance computes the exponents: 1 = linear,
// at most 1.1. Motions walk back and forth over the stances of a motion of the embedded dataset.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/kinematics.h"
#include "legopt/solvers/subproblem/interior_point.h"
#include "tests/bench/repeated_motion.h"
#include "tests/folders.h"
#include "tests/solvers/subproblem/random_subproblem.h"

namespace legopt {
namespace {

/// Runs a benchmark at a size and at five doublings of it.
void Doublings(benchmark::internal::Benchmark* benchmark, std::int64_t smallest) {
  constexpr int kDoublings = 5;
  for (int k = 0; k <= kDoublings; ++k) benchmark->Arg(smallest << k);
}

std::shared_ptr<const Dataset> Garage() {
  static const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-easier");
  return dataset;
}

/// Evaluates and linearizes all terms of a program at a new point. Argument: waypoints.
void Terms(benchmark::State& state) {
  const auto dataset = Garage();
  const ProblemDefinition problem =
      RepeatedMotion(dataset->problem(Task::kMotion, 0), static_cast<std::size_t>(state.range(0)) / 2);
  CollisionQuery query(dataset->collision_model());
  const auto program = MakeTaskProgram(Task::kMotion, *dataset, query, problem.stances, {.margin_m = 5e-4});
  const int size = program->point_size();
  Eigen::VectorXd x(program->num_waypoints() * size),
      dx = Eigen::VectorXd::Constant(program->num_waypoints() * program->tangent_size(), 1e-6);
  for (int t = 0; t < program->num_waypoints(); ++t) {
    x.segment(t * size, size) =
        InitialGuess(*dataset, problem.stances[static_cast<std::size_t>(t) / 2], Initialization::kGood);
  }
  std::vector<double> residuals;
  LinearModel model;
  Eigen::VectorXd next = x;
  for (auto _ : state) {
    program->Retract(x, dx, next);
    x.swap(next);
    program->SetPoint(x);
    for (const auto& term : program->terms()) {
      residuals.clear();
      term->Evaluate(residuals);
      term->Linearize(model);
    }
  }
  state.counters["terms"] = static_cast<double>(program->terms().size());
}
BENCHMARK(Terms)->Apply([](auto* benchmark) { Doublings(benchmark, 12); }) -> Unit(benchmark::kMicrosecond);

/// Solves a convex subproblem with the rows of LegOpt-best's windows. Argument: waypoints.
void Subproblem(benchmark::State& state) {
  const ConvexSubproblem problem = MakeRandomSubproblem(WindowOfMotion(static_cast<int>(state.range(0))), 1);
  Eigen::VectorXd dx(static_cast<Eigen::Index>(state.range(0)) * problem.block_size());
  InteriorPointSolver solver;
  int iterations = 0;
  for (auto _ : state) iterations = solver.Solve(problem, {.gap = 1e-6}, dx).iterations;
  state.counters["iterations"] = iterations;
}
BENCHMARK(Subproblem)->Apply([](auto* benchmark) { Doublings(benchmark, 12); }) -> Unit(benchmark::kMicrosecond);

/// Queries a robot among small boxes around its base. Argument: boxes.
void Pairs(benchmark::State& state) {
  const auto dataset = Garage();
  const RobotModel& robot = dataset->robot();
  const Eigen::VectorXd x =
      InitialGuess(*dataset, dataset->problem(Task::kPosture, 0).stances.front(), Initialization::kGood);
  Kinematics kinematics(robot);
  kinematics.Update(x);
  constexpr double kMargin_m = 0.05, kSide_m = 0.02, kReach_m = 0.2;
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> offset_m(-kReach_m, kReach_m);
  Scene scene;
  for (int i = 0; i < state.range(0); ++i) {
    ShapeSpec box;
    box.kind = ShapeSpec::Kind::kBox;
    box.size = Eigen::Vector3d::Constant(kSide_m);
    for (double& coordinate : box.pose.translation()) coordinate = offset_m(generator);
    box.pose.pretranslate(kinematics.link_pose(0).translation());
    scene.objects.push_back({"box " + std::to_string(i), box});
  }
  const auto model = CollisionModel::Build(robot, scene, dataset->self_collision_reference());
  CollisionQuery query(model);
  std::size_t contacts = 0;
  for (auto _ : state) contacts = query.Contacts(kinematics, kMargin_m).size();
  state.counters["contacts"] = static_cast<double>(contacts);
}
BENCHMARK(Pairs)->Apply([](auto* benchmark) { Doublings(benchmark, 64); }) -> Unit(benchmark::kMicrosecond);

/// Solves a motion by LegOpt-best. Argument: stances.
void Windows(benchmark::State& state) {
  const auto dataset = Garage();
  ProblemSolver solver(dataset);
  const ProblemDefinition once = dataset->problem(Task::kMotion, 0);
  const ProblemDefinition problem = RepeatedMotion(once, static_cast<std::size_t>(state.range(0)));
  const Method method = Method::Of("best");
  solver.Solve(Task::kMotion, RepeatedMotion(once, 20), Initialization::kGood, method, {});  // warm-up
  for (auto _ : state) {
    const SolveOutcome outcome = solver.Solve(Task::kMotion, problem, Initialization::kGood, method, {});
    if (outcome.status != SolveStatus::kConvergedFeasible) state.SkipWithError("the motion was not solved");
  }
}
BENCHMARK(Windows)->Apply([](auto* benchmark) { Doublings(benchmark, 50); }) -> Iterations(3)
    -> Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt
