#include "legopt/optimize/registry.h"

#include <array>

#include "legopt/optimize/best_solver.h"
#include "legopt/optimize/ipopt_solver.h"
#include "legopt/optimize/sqp_solver.h"

namespace legopt {
namespace {

Sampling SamplingOf(const Method& method) { return {method.sample_size_percent, method.incremental}; }

constexpr std::array kSolvers = {
    SolverEntry{
        "sqp", "SQP", true, false, [](Method& m, OptionFields& f) { m.sqp.Visit(f); },
        [](const Method& m) -> std::unique_ptr<Solver> { return std::make_unique<SqpSolver>(m.sqp, SamplingOf(m)); }},
    SolverEntry{"best", "LegOpt-best", false, true, [](Method& m, OptionFields& f) { m.best.Visit(f); },
                [](const Method& m) -> std::unique_ptr<Solver> { return std::make_unique<BestSolver>(m.best); }},
    SolverEntry{"ipopt", "Ipopt", false, false, [](Method& m, OptionFields& f) { m.ipopt.Visit(f); },
                [](const Method& m) -> std::unique_ptr<Solver> { return std::make_unique<IpoptSolver>(m.ipopt); }},
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
