#include "legopt/methods/registry.h"

#include <array>

namespace legopt {
namespace {

void VisitDescent(Method& method, OptionFields& fields) { method.gradient.Visit(fields); }

void VisitMomentDescent(Method& method, OptionFields& fields) {
  method.gradient.Visit(fields);
  method.moments.Visit(fields);
}

void VisitCovariantDescent(Method& method, OptionFields& fields) {
  method.gradient.Visit(fields);
  method.metric.Visit(fields);
}

// Models see obstacles ahead; plain penalties are zero until the margin (5e-4) is violated.
constexpr double kAhead_m = 0.03;
constexpr double kTouching_m = 1e-3;

constexpr std::array kSolvers = {
    SolverEntry{"sqp", "SQP", true, false, kAhead_m, [](Method& m, OptionFields& f) { m.sqp.Visit(f); }},
    SolverEntry{"best", "LegOpt-best", false, true, kAhead_m, [](Method& m, OptionFields& f) { m.best.Visit(f); }},
    SolverEntry{"ipopt", "Ipopt", false, false, kAhead_m, [](Method& m, OptionFields& f) { m.ipopt.Visit(f); }},
    SolverEntry{"sgd", "SGD", true, false, kTouching_m, VisitDescent},
    SolverEntry{"adam", "Adam", true, false, kTouching_m, VisitMomentDescent},
    SolverEntry{"nadam", "Nadam", true, false, kTouching_m, VisitMomentDescent},
    SolverEntry{"chomp", "CHOMP", false, false, kTouching_m, VisitCovariantDescent},
    SolverEntry{"stomp", "STOMP", false, true, kTouching_m, [](Method& m, OptionFields& f) { m.stomp.Visit(f); }},
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
