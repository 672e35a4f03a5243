// The benchmarks of collision_bench on the datasets in the repository: the generated garage of convex pieces and the
// small hand-made one. No external data are needed.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/robot/kinematics.h"
#include "tests/folders.h"

namespace legopt {
namespace {

constexpr std::array<const char*, 2> kNames = {"garage-easier", "garage-small"};

/// Returns a dataset that is loaded once per program run.
const std::shared_ptr<const Dataset>& Embedded(std::int64_t which) {
  static std::array<std::shared_ptr<const Dataset>, kNames.size()> datasets;
  auto& dataset = datasets.at(static_cast<size_t>(which));
  if (!dataset) dataset = Dataset::Load(SourceFolder() + "/data/" + kNames.at(static_cast<size_t>(which)));
  return dataset;
}

/// Runs full queries at the initial guesses of all posture problems. Arguments: dataset, margin in mm, 1 for the
/// surface model.
void BM_EmbeddedQuery(benchmark::State& state, Initialization initialization) {
  const Dataset& dataset = *Embedded(state.range(0));
  const double margin_m = 1e-3 * static_cast<double>(state.range(1));
  const auto representation = state.range(2) == 0 ? SceneRepresentation::kSolid : SceneRepresentation::kSurface;
  const auto& model = dataset.collision_model(representation);
  std::vector<Kinematics> postures;
  for (const ProblemDefinition& problem : dataset.problems(Task::kPosture)) {
    postures.emplace_back(dataset.robot()).Update(InitialGuess(dataset, problem.stances.front(), initialization));
  }
  CollisionQuery query(model);
  size_t i = 0;
  size_t contacts = 0;
  for (auto _ : state) {
    contacts += query.Contacts(postures[i], margin_m).size();
    i = (i + 1) % postures.size();
  }
  state.SetLabel(kNames.at(static_cast<size_t>(state.range(0))));
  state.counters["contacts"] = benchmark::Counter(static_cast<double>(contacts), benchmark::Counter::kAvgIterations);
  state.counters["obstacles"] = model->num_scene_solids();
}

void Cases(benchmark::internal::Benchmark* query) {
  query->ArgNames({"dataset", "margin_mm", "surface"})->Unit(benchmark::kMicrosecond);
  query->ArgsProduct({{0, 1}, {30, 50}, {0, 1}});
}
BENCHMARK_CAPTURE(BM_EmbeddedQuery, good, Initialization::kGood)->Apply(Cases);
BENCHMARK_CAPTURE(BM_EmbeddedQuery, in_collision, Initialization::kInCollision)->Apply(Cases);

/// Reads, hashes and builds everything, as a job process does before its first job.
void BM_LoadEmbedded(benchmark::State& state) {
  const auto folder = SourceFolder() + "/data/" + kNames.at(static_cast<size_t>(state.range(0)));
  for (auto _ : state) {
    const auto dataset = Dataset::Load(folder);
    benchmark::DoNotOptimize(dataset->collision_model(SceneRepresentation::kSolid));
  }
  state.SetLabel(kNames.at(static_cast<size_t>(state.range(0))));
}
BENCHMARK(BM_LoadEmbedded)->Arg(0)->Arg(1)->ArgName("dataset")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt
