// CPU time of the terms, for the weights of term_weights.h. A counter per kind of term: mean ns of Evaluate and
// Linearize at a new point, over random points near the initial guesses. Argument: 0 postures, 1 motions, 2 postures
// with hands.

#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <map>
#include <random>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "tests/folders.h"

namespace legopt {
namespace {

/// Name of the kind: the name of the term without that of its contact.
std::string KindOf(const Term& term) {
  const std::string& name = term.shape().name;
  for (const char* kind : {"foot", "contact", "slide of"}) {
    if (name.starts_with(kind)) return kind;
  }
  return name;
}

struct Sum {
  double ns = 0.0;
  double calls = 0.0;
};

class TermTimes {
 public:
  /// Adds the times of all terms at `x`.
  void Measure(Program& program, const Eigen::VectorXd& x) {
    for (const auto& term : program.terms()) {
      program.SetPoint(x);
      residuals_.clear();
      program.terms().front()->Evaluate(residuals_);  // the kinematics of the point
      const auto begin = Clock::now();
      residuals_.clear();
      term->Evaluate(residuals_);
      term->Linearize(model_);
      Sum& sum = sums_[KindOf(*term)];
      sum.ns += std::chrono::duration<double, std::nano>(Clock::now() - begin).count();
      sum.calls += 2.0;
    }
  }

  void Report(benchmark::State& state) const {
    for (const auto& [kind, sum] : sums_) state.counters[kind] = sum.ns / sum.calls;
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::map<std::string, Sum> sums_;
  std::vector<double> residuals_;
  LinearModel model_;
};

void Terms(benchmark::State& state) {
  constexpr std::array kData = {"garage-small", "garage-small", "contacts-humanoid", "quadruped-rubble"};
  const auto kind = static_cast<std::size_t>(state.range(0));
  const Task task = kind == 1 ? Task::kMotion : Task::kPosture;
  const auto dataset = Dataset::Load(SourceFolder() + "/data/" + kData.at(kind));
  CollisionQuery query(dataset->collision_model());
  ProgramOptions options{.margin_m = 5e-4};
  if (kind == 2) options.physics = Physics::kEffort;
  std::mt19937_64 generator(1);
  TermTimes times;
  constexpr std::size_t kProblems = 40, kStances = 6;
  constexpr double kNoise_rad = 0.15;
  for (auto _ : state) {
    for (std::size_t p = 0; p < std::min(kProblems, dataset->problems(task).size()); ++p) {
      const std::vector<Stance>& all = dataset->problems(task)[p].stances;
      const std::span<const Stance> stances(all.data(), std::min(kStances, all.size()));
      const auto program = MakeTaskProgram(task, *dataset, query, stances, options);
      const int size = program->point_size();
      Eigen::VectorXd x(program->num_waypoints() * size);
      const int per_stance = program->num_waypoints() / static_cast<int>(stances.size());
      for (int t = 0; t < program->num_waypoints(); ++t) {
        const Stance& stance = stances[static_cast<std::size_t>(t / per_stance)];
        Eigen::VectorXd point = InitialGuess(*dataset, stance, Initialization::kGood);
        PerturbJoints(dataset->robot(), generator, kNoise_rad, point);
        x.segment(t * size, size) = point;
      }
      times.Measure(*program, x);
    }
  }
  times.Report(state);
}
BENCHMARK(Terms)->Arg(0)->Arg(1)->Arg(2)->Arg(3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt
