#include "legopt/methods/solver_factory.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "legopt/optimize/best_solver.h"
#include "legopt/optimize/gradient_solver.h"
#include "legopt/optimize/ipopt_solver.h"
#include "legopt/optimize/sqp_solver.h"
#include "legopt/optimize/stomp_solver.h"

namespace legopt {
namespace {

using Made = std::unique_ptr<Solver>;

Sampling SamplingOf(const Method& method) { return {method.sample_size_percent, method.incremental}; }

Made Descent(const Method& method, std::unique_ptr<GradientDirection> direction) {
  return std::make_unique<GradientSolver>(method.gradient, std::move(direction), SamplingOf(method));
}

Made MomentDescent(const Method& method, bool nesterov) {
  return Descent(method, std::make_unique<MomentDirection>(method.moments, nesterov));
}

struct Maker {
  std::string_view word;  // of the registry
  Made (*make)(const Method& method);
};

constexpr std::array kMakers = {
    Maker{"sqp", [](const Method& m) -> Made { return std::make_unique<SqpSolver>(m.sqp, SamplingOf(m)); }},
    Maker{"best", [](const Method& m) -> Made { return std::make_unique<BestSolver>(m.best); }},
    Maker{"ipopt", [](const Method& m) -> Made { return std::make_unique<IpoptSolver>(m.ipopt); }},
    Maker{"sgd", [](const Method& m) { return Descent(m, std::make_unique<SteepestDirection>()); }},
    Maker{"adam", [](const Method& m) { return MomentDescent(m, false); }},
    Maker{"nadam", [](const Method& m) { return MomentDescent(m, true); }},
    Maker{"chomp", [](const Method& m) { return Descent(m, std::make_unique<CovariantDirection>(m.metric)); }},
    Maker{"stomp", [](const Method& m) -> Made { return std::make_unique<StompSolver>(m.stomp); }},
};

}  // namespace

std::unique_ptr<Solver> MakeSolver(const Method& method) {
  for (const Maker& maker : kMakers) {
    if (maker.word == method.solver) return maker.make(method);
  }
  std::fprintf(stderr, "legopt: broken invariant: nothing makes solver \"%s\"\n", method.solver.c_str());
  std::abort();
}

}  // namespace legopt
