// Time budgets of the convex subproblem: posture at most 35 us, target 25 us, window of 12 waypoints at most 0.7 ms,
// target 0.45 ms. Also prints GFLOP/s and its share of the core's measured peak in double precision. The peak in single
// precision, in which most steps are computed, is twice as high.

#include <benchmark/benchmark.h>

#include <algorithm>

#include "legopt/solvers/subproblem/interior_point.h"
#include "tests/bench/peak_flops.h"
#include "tests/solvers/subproblem/random_subproblem.h"

namespace legopt {
namespace {

constexpr double kAccuracy = 1e-6;

/// Returns the number of columns with coefficients in one part of a row; columns come in groups of four.
double NumColumns(const ConvexSubproblem& problem, const ConvexSubproblem::Row& row, int part) {
  const double* const coefficients = problem.coefficients(row, part);
  int columns = 0;
  for (int j = 0; j < problem.block_size(); j += 4) {
    const int end = std::min(j + 4, problem.block_size());
    if (std::any_of(coefficients + j, coefficients + end, [](double c) { return c != 0.0; })) columns += end - j;
  }
  return columns;
}

/// Returns the additions and multiplications of one iteration, without terms of lower order than n per row. With n
/// variables per block, c of which occur in a row:
///
/// forming A'DA   c (c + 2) per row and block
/// factoring      n^3 / 3 per block; n^3 / 3 each for U^-T C and its square if the coupling C is diagonal and few rows
///                connect blocks, else n^3 each
/// solving twice  4 n^2 per block and 4 n^2 (dense: 8 n^2) per coupling
/// residuals      2 n^2 per block and 2 n (dense: 4 n^2) per coupling
/// A x, A'y       three times each, 2 c per row and block
double FlopsOfIteration(const RandomSubproblemShape& shape, const ConvexSubproblem& problem) {
  const double n = shape.block_size, blocks = shape.num_blocks, links = shape.coupled ? blocks - 1.0 : 0.0;
  double rows = 0.0;
  for (const ConvexSubproblem::Row& row : problem.rows()) {
    for (int k = 0; k < row.num_blocks; ++k) {
      const double c = NumColumns(problem, row, k);
      rows += c * (c + 2.0) + 12.0 * c;
    }
  }
  const double link = shape.steps ? 2.0 / 3.0 * n * n * n + 4.0 * n * n + 2.0 * n : 2.0 * n * n * n + 12.0 * n * n;
  return rows + blocks * (n * n * n / 3.0 + 6.0 * n * n) + links * link;
}

void Run(benchmark::State& state, const RandomSubproblemShape& shape) {
  const ConvexSubproblem problem = MakeRandomSubproblem(shape, 1);
  Eigen::VectorXd dx(static_cast<Eigen::Index>(shape.num_blocks) * shape.block_size);
  InteriorPointSolver solver;
  double iterations = 0;
  for (auto _ : state) {
    iterations = solver.Solve(problem, {.gap = kAccuracy}, dx).iterations;
    benchmark::DoNotOptimize(dx.data());
  }
  static const double peak = MeasurePeak();
  const double flops = iterations * FlopsOfIteration(shape, problem);
  constexpr double kGiga = 1e9;
  state.counters["iterations"] = iterations;
  state.counters["GFLOP/s"] = {flops / kGiga, benchmark::Counter::kIsIterationInvariantRate};
  state.counters["of_peak"] = {flops / peak, benchmark::Counter::kIsIterationInvariantRate};
  state.counters["peak_GFLOP/s"] = peak / kGiga;
}

void Posture(benchmark::State& state) { Run(state, {}); }
void PostureHeavyPenalty(benchmark::State& state) { Run(state, {.weight = 1e5}); }
void WindowOfTwelve(benchmark::State& state) {
  Run(state, {.num_blocks = 12, .cost_rows = 0, .coupled = true, .fixed_variables = 35});
}
// The average numbers of rows and columns in LegOpt-best's postures.
void PostureOfChains(benchmark::State& state) { Run(state, {.inequality_rows = 16, .chains = true}); }
void WindowOfAMotion(benchmark::State& state) { Run(state, WindowOfMotion(12)); }

BENCHMARK(Posture)->Unit(benchmark::kMicrosecond);
BENCHMARK(PostureHeavyPenalty)->Unit(benchmark::kMicrosecond);
BENCHMARK(PostureOfChains)->Unit(benchmark::kMicrosecond);
BENCHMARK(WindowOfTwelve)->Unit(benchmark::kMicrosecond);
BENCHMARK(WindowOfAMotion)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace legopt
