// Time of the terms on an idle machine, for the weights of term_weights.h. A counter per kind of term: mean ns of
// Evaluate and Linearize at a new point after nearby ones, over random points near the initial guesses; the first term
// includes the kinematics. Argument: 0 postures, 1 motions, 2 postures with hands, 3 postures of the quadruped.

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
  /// Moves to `x` and adds the times of all terms, unless it is the first point of a program, which fills caches.
  void Measure(Program& program, const Eigen::VectorXd& x, bool first) {
    program.SetPoint(x);
    for (const auto& term : program.terms()) {
      const double begin_ns = Now_ns();
      residuals_.clear();
      term->Evaluate(residuals_);
      term->Linearize(model_);
      Sum& sum = sums_[KindOf(*term)];
      if (first) continue;
      sum.ns += Now_ns() - begin_ns;
      sum.calls += 2.0;
    }
  }

  void Report(benchmark::State& state) const {
    for (const auto& [kind, sum] : sums_) state.counters[kind] = sum.ns / sum.calls;
  }

 private:
  /// Wall time: reading the CPU time takes as long as a small term.
  static double Now_ns() {
    return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

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
  constexpr double kNoise_rad = 0.15;  // decreases, as the steps of a solve do
  constexpr int kPoints = 10;
  for (auto _ : state) {
    for (std::size_t p = 0; p < std::min(kProblems, dataset->problems(task).size()); ++p) {
      const std::vector<Stance>& all = dataset->problems(task)[p].stances;
      const std::span<const Stance> stances(all.data(), std::min(kStances, all.size()));
      const auto program = MakeTaskProgram(task, *dataset, query, stances, options);
      const int size = program->point_size();
      Eigen::VectorXd x(program->num_waypoints() * size);
      const int num_waypoints = program->num_waypoints();
      for (int k = 0; k < kPoints; ++k) {
        for (int t = 0; t < num_waypoints; ++t) {
          const std::size_t stance =
              static_cast<std::size_t>(t) * stances.size() / static_cast<std::size_t>(num_waypoints);
          Eigen::VectorXd point = InitialGuess(*dataset, stances[stance], Initialization::kGood);
          PerturbJoints(dataset->robot(), generator, kNoise_rad / (1 + k), point);
          x.segment(t * size, size) = point;
        }
        times.Measure(*program, x, k == 0);
      }
    }
  }
  times.Report(state);
}
BENCHMARK(Terms)->Arg(0)->Arg(1)->Arg(2)->Arg(3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt
