#include "legopt/optimize/registry.h"

#include <array>
#include <utility>

#include "legopt/optimize/best_solver.h"
#include "legopt/optimize/gradient_solver.h"
#include "legopt/optimize/ipopt_solver.h"
#include "legopt/optimize/sqp_solver.h"
#include "legopt/optimize/stomp_solver.h"

namespace legopt {
namespace {

Sampling SamplingOf(const Method& method) { return {method.sample_size_percent, method.incremental}; }

std::unique_ptr<Solver> Descent(const Method& method, std::unique_ptr<GradientDirection> direction) {
  return std::make_unique<GradientSolver>(method.gradient, std::move(direction), SamplingOf(method));
}

std::unique_ptr<Solver> MomentDescent(const Method& method, bool nesterov) {
  return Descent(method, std::make_unique<MomentDirection>(method.moments, nesterov));
}

void VisitMomentDescent(Method& method, OptionFields& fields) {
  method.gradient.Visit(fields);
  method.moments.Visit(fields);
}

// Models see obstacles ahead; plain penalties are zero until the margin (5e-4) is violated.
constexpr double kAhead_m = 0.03;
constexpr double kTouching_m = 1e-3;

constexpr std::array kSolvers = {
    SolverEntry{
        "sqp", "SQP", true, false, kAhead_m, [](Method& m, OptionFields& f) { m.sqp.Visit(f); },
        [](const Method& m) -> std::unique_ptr<Solver> { return std::make_unique<SqpSolver>(m.sqp, SamplingOf(m)); }},
    SolverEntry{"best", "LegOpt-best", false, true, kAhead_m, [](Method& m, OptionFields& f) { m.best.Visit(f); },
                [](const Method& m) -> std::unique_ptr<Solver> { return std::make_unique<BestSolver>(m.best); }},
    SolverEntry{"ipopt", "Ipopt", false, false, kAhead_m, [](Method& m, OptionFields& f) { m.ipopt.Visit(f); },
                [](const Method& m) -> std::unique_ptr<Solver> { return std::make_unique<IpoptSolver>(m.ipopt); }},
    SolverEntry{"sgd", "SGD", true, false, kTouching_m, [](Method& m, OptionFields& f) { m.gradient.Visit(f); },
                [](const Method& m) { return Descent(m, std::make_unique<SteepestDirection>()); }},
    SolverEntry{"adam", "Adam", true, false, kTouching_m, VisitMomentDescent,
                [](const Method& m) { return MomentDescent(m, false); }},
    SolverEntry{"nadam", "Nadam", true, false, kTouching_m, VisitMomentDescent,
                [](const Method& m) { return MomentDescent(m, true); }},
    SolverEntry{"chomp", "CHOMP", false, false, kTouching_m,
                [](Method& m, OptionFields& f) {
                  m.gradient.Visit(f);
                  m.metric.Visit(f);
                },
                [](const Method& m) { return Descent(m, std::make_unique<CovariantDirection>(m.metric)); }},
    SolverEntry{"stomp", "STOMP", false, true, kTouching_m, [](Method& m, OptionFields& f) { m.stomp.Visit(f); },
                [](const Method& m) -> std::unique_ptr<Solver> { return std::make_unique<StompSolver>(m.stomp); }},
};

}  // namespace

std::span<const SolverEntry> SolverRegistry() { return kSolvers; }

const SolverEntry* FindSolver(const std::string& word) {
  for (const SolverEntry& entry : kSolvers) {
    if (word == entry.word) return &entry;
  }
  return nullptr;
}

std::unique_ptr<Solver> MakeSolver(const Method& method) { return FindSolver(method.solver)->make(method); }

}  // namespace legopt
