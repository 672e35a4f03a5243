// The registry for the fuzz target of suites: every method's options, none of the optimisers behind them.
#include <array>

#include "legopt/optimize/registry.h"

namespace legopt {
namespace {

void VisitMoments(Method& method, OptionFields& fields) {
  method.gradient.Visit(fields);
  method.moments.Visit(fields);
}

constexpr std::array kSolvers = {
    SolverEntry{"sqp", "SQP", true, false, 0.03, [](Method& m, OptionFields& f) { m.sqp.Visit(f); }, nullptr},
    SolverEntry{"best", "LegOpt-best", false, true, 0.03, [](Method& m, OptionFields& f) { m.best.Visit(f); }, nullptr},
    SolverEntry{"ipopt", "Ipopt", false, false, 0.03, [](Method& m, OptionFields& f) { m.ipopt.Visit(f); }, nullptr},
    SolverEntry{"adam", "Adam", true, false, 1e-3, VisitMoments, nullptr},
    SolverEntry{"stomp", "STOMP", false, true, 1e-3, [](Method& m, OptionFields& f) { m.stomp.Visit(f); }, nullptr},
};

}  // namespace

std::span<const SolverEntry> SolverRegistry() { return kSolvers; }

const SolverEntry* FindSolver(const std::string& word) {
  for (const SolverEntry& entry : kSolvers) {
    if (word == entry.word) return &entry;
  }
  return nullptr;
}

}  // namespace legopt
