// Solves motions of 100, 1,000 and 10,000 stances by LegOpt-best. Time per waypoint, and memory apart from the
// solution, must not grow with the length. The motion walks back and forth over the stances of a motion of the
// embedded dataset.

#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "tests/bench/repeated_motion.h"
#include "tests/folders.h"

namespace legopt {
namespace {

constexpr int kMotion = 0;  // problem of the embedded dataset

double HeapBytes() {
  const struct mallinfo2 heap = mallinfo2();
  return static_cast<double>(heap.uordblks + heap.hblkhd);
}

void LongMotion(benchmark::State& state) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-easier");
  ProblemSolver solver(dataset);
  Judge judge(dataset);
  const ProblemDefinition problem =
      RepeatedMotion(dataset->problem(Task::kMotion, kMotion), static_cast<std::size_t>(state.range(0)));
  const Method method = Method::Of("best");
  solver.Solve(Task::kMotion, RepeatedMotion(problem, 20), Initialization::kGood, method, {});  // warm-up
  SolveOutcome outcome;
  double during = 0;
  for (auto _ : state) {
    SolveSettings settings;
    const double before = HeapBytes();
    // HeapBytes walks through all free blocks, so few calls are made lest they dominate the measured time.
    settings.progress = [&](int done, int windows) {
      constexpr int kLooks = 20;
      if (done % std::max(1, windows / kLooks) == 0) during = std::max(during, HeapBytes() - before);
    };
    outcome = solver.Solve(Task::kMotion, problem, Initialization::kGood, method, settings);
  }
  double solution = 0;
  for (const Eigen::VectorXd& x : outcome.waypoints) solution += static_cast<double>(x.size()) * sizeof(double);
  const auto waypoints = static_cast<double>(outcome.waypoints.size());
  constexpr double kMebibyte = 1024.0 * 1024.0;
  state.counters["cpu_us_per_waypoint"] = static_cast<double>(outcome.cpu_us) / waypoints;
  state.counters["waypoints"] = waypoints;
  state.counters["solution_MiB"] = solution / kMebibyte;
  state.counters["heap_MiB"] = during / kMebibyte;
  state.counters["trace_steps"] = static_cast<double>(outcome.history.size());
  state.counters["solved"] = judge.Evaluate(Task::kMotion, problem, outcome.waypoints).literal == Verdict::kSuccess;
}
BENCHMARK(LongMotion)->Arg(100)->Arg(1000)->Arg(10000)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt
