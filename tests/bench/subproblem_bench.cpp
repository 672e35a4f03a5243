// Convex subproblem budgets: posture 0.15 ms (aim 0.05), window of 12 waypoints 2.5 ms (aim 0.8).

#include <benchmark/benchmark.h>

#include "legopt/subproblem/interior_point.h"
#include "tests/subproblem/random_subproblem.h"

namespace legopt {
namespace {

constexpr double kAccuracy = 1e-6;

void Run(benchmark::State& state, const RandomSubproblemShape& shape) {
  const ConvexSubproblem problem = MakeRandomSubproblem(shape, 1);
  Eigen::VectorXd dx(static_cast<Eigen::Index>(shape.num_blocks) * shape.block_size);
  InteriorPointSolver solver;
  double iterations = 0;
  for (auto _ : state) {
    iterations = solver.Solve(problem, {.gap = kAccuracy}, dx).iterations;
    benchmark::DoNotOptimize(dx.data());
  }
  state.counters["iterations"] = iterations;
}

void Posture(benchmark::State& state) { Run(state, {}); }
void PostureHeavyPenalty(benchmark::State& state) { Run(state, {.weight = 1e5}); }
void WindowOfTwelve(benchmark::State& state) {
  Run(state, {.num_blocks = 12, .cost_rows = 0, .coupled = true, .fixed_variables = 35});
}
// As a window of a motion has them on average: 25 rows a waypoint, one between two.
void WindowOfAMotion(benchmark::State& state) {
  Run(state, {.num_blocks = 12,
              .cost_rows = 0,
              .inequality_rows = 13,
              .coupled = true,
              .steps = true,
              .pair_rows = 1,
              .fixed_variables = 35});
}

BENCHMARK(Posture)->Unit(benchmark::kMicrosecond);
BENCHMARK(PostureHeavyPenalty)->Unit(benchmark::kMicrosecond);
BENCHMARK(WindowOfTwelve)->Unit(benchmark::kMicrosecond);
BENCHMARK(WindowOfAMotion)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace legopt
