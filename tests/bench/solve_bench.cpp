// Time budgets. A posture by SQP, mean over the solved problems: at most 4 ms, target 1 ms. The judge per waypoint: at
// most 8 ms, target 1 ms. Argument 0: the embedded dataset; 1: the LegOpt test data, where present.

#include <benchmark/benchmark.h>

#include <filesystem>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "tests/folders.h"

namespace legopt {
namespace {

std::shared_ptr<const Dataset> Load(benchmark::State& state) {
  const std::string folder = state.range(0) == 0 ? SourceFolder() + "/data/garage-small" : TestDataFolder();
  if (!std::filesystem::exists(folder)) {
    state.SkipWithError("dataset not found");
    return nullptr;
  }
  auto dataset = Dataset::Load(folder);
  dataset->collision_model();
  return dataset;
}

Initialization Start(const benchmark::State& state) {
  return state.range(1) == 0 ? Initialization::kGood : Initialization::kInCollision;
}

void PostureSqp(benchmark::State& state) {
  const auto dataset = Load(state);
  if (dataset == nullptr) return;
  ProblemSolver solver(dataset);
  const auto& problems = dataset->problems(Task::kPosture);
  double solves = 0, iterations = 0, wall_us = 0, cpu_us = 0, feasible = 0;
  for (auto _ : state) {
    for (const ProblemDefinition& problem : problems) {
      const SolveOutcome outcome = solver.Solve(Task::kPosture, problem.id, Start(state), {}, {});
      solves += 1;
      iterations += outcome.iterations;
      wall_us += static_cast<double>(outcome.wall_us);
      cpu_us += static_cast<double>(outcome.cpu_us);
      feasible += outcome.status == SolveStatus::kConvergedFeasible ? 1 : 0;
    }
  }
  state.counters["wall_us_per_posture"] = wall_us / solves;
  state.counters["cpu_us_per_posture"] = cpu_us / solves;
  state.counters["iterations"] = iterations / solves;
  state.counters["feasible"] = feasible / solves;
}
BENCHMARK(PostureSqp)->ArgsProduct({{0, 1}, {0, 1}})->Unit(benchmark::kMillisecond);

void JudgeOneWaypoint(benchmark::State& state) {
  const auto dataset = Load(state);
  if (dataset == nullptr) return;
  ProblemSolver solver(dataset);
  Judge judge(dataset);
  const ProblemDefinition& problem = dataset->problems(Task::kPosture).front();
  const SolveOutcome outcome = solver.Solve(Task::kPosture, problem.id, Initialization::kGood, {}, {});
  for (auto _ : state) {
    benchmark::DoNotOptimize(judge.Evaluate(Task::kPosture, problem, outcome.waypoints).cost);
  }
}
BENCHMARK(JudgeOneWaypoint)->Args({0, 0})->Args({1, 0})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace legopt
